//! SPL against the quality of the link.

use super::picture::{Axis, Mark, Picture};
use crate::perception::plots::style::colour;

/// `points` are quality and SPL, 0 to 1 both; `None` of none.
pub(in crate::tables) fn link(points: &[(f64, f64)]) -> Option<Picture> {
    let mut points: Vec<(f64, f64)> = points.iter().map(|(q, spl)| (100.0 * q, 100.0 * spl)).collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    if points.is_empty() {
        return None;
    }
    let dots = points.iter().map(|p| Mark::Dot { at: *p, colour: colour(0) });
    let marks = core::iter::once(Mark::Line { points: points.clone(), colour: colour(0) }).chain(dots).collect();
    Some(Picture {
        title: "SPL by quality of the link".to_owned(),
        subtitle: "100 is a link that loses and delays nothing".to_owned(),
        x: Axis::percent("quality of the link, percent"),
        y: Axis::percent("SPL, times 100"),
        legend: Vec::new(),
        marks,
    })
}
