//! What the colours on the map mean, as a small image below it: a 2-D view has no legend of its own.

use rerun::EncodedImage;
use rerun::components::{MagnificationFilter, MediaType};

use crate::canvas::{Align, Canvas, Style};
use crate::palette::{Rgb, dark};
use crate::scene::Logger;
use crate::{encode, entities};

/// Width of the legend, pixels.
pub(super) const WIDTH_PX: f64 = 1120.0;
const HEIGHT_PX: f64 = 96.0;

/// How a meaning is drawn.
enum Mark {
    Line(f64),
    Disc,
    Ring,
}

const ENTRIES: [(&str, Mark, Rgb); 8] = [
    ("estimated path", Mark::Line(5.0), dark::ESTIMATED),
    ("true path", Mark::Line(10.0), dark::TRUE),
    ("planned path", Mark::Line(4.0), dark::PLANNED),
    ("shortest path", Mark::Line(4.0), dark::SHORTEST),
    ("goal estimate", Mark::Ring, dark::GOAL),
    ("true goal", Mark::Disc, dark::TRUE),
    ("frontier", Mark::Disc, dark::FRONTIER),
    ("target", Mark::Disc, dark::TARGET),
];

/// Logs the legend once; where it lies is for the map to say.
pub(super) fn show(log: &Logger) {
    match encode::png(&draw().into_image()) {
        Ok(bytes) => {
            let image = EncodedImage::new(bytes).with_media_type(MediaType::PNG).with_draw_order(-9.0);
            log.show_always(entities::LEGEND, &image.with_magnification_filter(MagnificationFilter::Linear));
        }
        Err(error) => tracing::warn!(%error, "legend not shown"),
    }
}

fn draw() -> Canvas {
    let mut canvas = Canvas::new(WIDTH_PX as usize, HEIGHT_PX as usize, dark::GROUND);
    let style = Style::regular(17.0, dark::TEXT);
    let columns = [0.0, 290.0, 520.0, 790.0];
    for (i, (name, mark, colour)) in ENTRIES.iter().enumerate() {
        let (x, y) = (columns[i % 4] + 8.0, if i < 4 { 26.0 } else { 70.0 });
        match mark {
            Mark::Line(width) => canvas.line(&[(x + 4.0, y), (x + 40.0, y)], *width, *colour),
            Mark::Disc => canvas.disc((x + 22.0, y), 8.0, *colour),
            Mark::Ring => {
                canvas.disc((x + 22.0, y), 12.0, *colour);
                canvas.disc((x + 22.0, y), 9.0, dark::GROUND);
                canvas.disc((x + 22.0, y), 4.0, *colour);
            }
        }
        canvas.text((x + 54.0, y + 8.0), Align::Left, style, name);
    }
    canvas
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::canvas::text_width;

    #[test]
    fn no_text_runs_into_the_next_column() {
        let lefts = [0.0, 290.0, 520.0, 790.0, WIDTH_PX];
        for (i, (name, ..)) in ENTRIES.iter().enumerate() {
            let right = lefts[i % 4] + 62.0 + text_width(name, 17.0);
            assert!(right < lefts[i % 4 + 1], "{name}: {right}");
        }
    }
}
