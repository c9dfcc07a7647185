//! What became of the episodes, a bar for each row.

use plotters::style::RGBColor;

use super::picture::{Axis, Mark, Picture};
use crate::perception::plots::style::colour;
use crate::tables::Causes;
use crate::tables::causes::CAUSES;

const SUCCESS: RGBColor = RGBColor(0, 130, 95);
/// Narrower parts have no figure in them, percent.
const WORDS_FROM: f64 = 4.0;

/// One bar for each of these; `None` if there are none. `name` is what a bar is called.
pub(in crate::tables) fn causes(title: &str, all: &[(String, &Causes)]) -> Option<Picture> {
    if all.is_empty() {
        return None;
    }
    let mut marks = Vec::new();
    for (i, (_, causes)) in all.iter().rev().enumerate() {
        let parts = CAUSES.iter().enumerate().map(|(k, cause)| (causes.causes.get(cause).copied(), tint(k)));
        let mut x = 0.0;
        for (n, tint) in core::iter::once((Some(causes.n_success), SUCCESS)).chain(parts) {
            let width = 100.0 * n.unwrap_or(0) as f64 / causes.n.max(1) as f64;
            if width > 0.0 {
                let (from, to) = ((x, i as f64 + 0.14), (x + width, i as f64 + 0.86));
                marks.push(Mark::Box { from, to, colour: tint, opacity: 1.0 });
            }
            if width >= WORDS_FROM {
                marks.push(Mark::Inside {
                    at: (x + 0.5 * width, i as f64 + 0.5),
                    text: format!("{width:.0}"),
                    on: tint,
                });
            }
            x += width;
        }
    }
    let names = all.iter().rev().map(|(name, c)| format!("{name} ({})", c.n)).collect();
    let parts = CAUSES.iter().enumerate().map(|(k, cause)| (cause.words().to_owned(), tint(k)));
    Some(Picture {
        title: title.to_owned(),
        subtitle: "strict rule; in brackets: episodes".to_owned(),
        x: Axis::percent("percent of episodes"),
        y: Axis::names("", names),
        legend: core::iter::once(("success".to_owned(), SUCCESS)).chain(parts).collect(),
        marks,
    })
}

/// Told apart from each other and from success.
fn tint(k: usize) -> RGBColor {
    [colour(0), colour(4), colour(3), colour(5), colour(1), colour(6)][k % 6]
}
