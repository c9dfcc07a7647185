//! A small raster canvas with smooth lines, discs and lettering. Pixel coordinates, y down.

use homing_core::RgbImage;

use crate::glyphs;
use crate::palette::Rgb;

/// Where a text stands relative to its anchor.
#[derive(Copy, Clone)]
pub(crate) enum Align {
    Left,
    Centre,
}

/// How text looks.
#[derive(Copy, Clone)]
pub(crate) struct Style {
    /// Height of a capital letter, pixels.
    pub(crate) size_px: f64,
    /// Width of a stroke relative to that height.
    pub(crate) weight: f64,
    pub(crate) colour: Rgb,
}

impl Style {
    pub(crate) fn regular(size_px: f64, colour: Rgb) -> Self {
        Self { size_px, weight: 0.125, colour }
    }

    pub(crate) fn bold(size_px: f64, colour: Rgb) -> Self {
        Self { size_px, weight: 0.185, colour }
    }
}

/// A rectangle of pixels.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) struct Rect {
    pub(crate) x: f64,
    pub(crate) y: f64,
    pub(crate) width: f64,
    pub(crate) height: f64,
}

pub(crate) struct Canvas {
    width: usize,
    height: usize,
    pixels: Vec<u8>,
}

impl Canvas {
    pub(crate) fn new(width: usize, height: usize, ground: Rgb) -> Self {
        Self { width, height, pixels: ground.repeat(width * height) }
    }

    /// The image.
    #[expect(clippy::expect_used, reason = "a canvas holds exactly its pixels, and none is made empty")]
    pub(crate) fn into_image(self) -> RgbImage {
        RgbImage::new(self.width as u32, self.height as u32, self.pixels).expect("a canvas is an image")
    }

    /// Calls `colour` for every whole pixel of a rectangle, with the pixel's centre.
    pub(crate) fn paint(&mut self, rect: Rect, mut colour: impl FnMut(f64, f64) -> Rgb) {
        let columns = span(rect.x, rect.x + rect.width, self.width);
        for row in span(rect.y, rect.y + rect.height, self.height) {
            for column in columns.clone() {
                let at = 3 * (row * self.width + column);
                self.pixels[at..at + 3].copy_from_slice(&colour(column as f64 + 0.5, row as f64 + 0.5));
            }
        }
    }

    pub(crate) fn fill(&mut self, rect: Rect, colour: Rgb) {
        self.paint(rect, |_, _| colour);
    }

    /// Draws an image into a rectangle, each pixel the mean of what it covers.
    pub(crate) fn image(&mut self, rect: Rect, image: &RgbImage) {
        let (w, h) = (f64::from(image.width()), f64::from(image.height()));
        let (sx, sy) = (w / rect.width, h / rect.height);
        let samples = |scale: f64| scale.ceil().clamp(1.0, 8.0) as usize;
        let (nx, ny) = (samples(sx) + 1, samples(sy) + 1);
        self.paint(rect, |x, y| {
            let mut sum = [0.0; 3];
            for j in 0..ny {
                for i in 0..nx {
                    let u = (x - rect.x + (i as f64 + 0.5) / nx as f64 - 0.5) * sx;
                    let v = (y - rect.y + (j as f64 + 0.5) / ny as f64 - 0.5) * sy;
                    let pixel = bilinear(image, u, v);
                    sum = core::array::from_fn(|c| sum[c] + pixel[c]);
                }
            }
            sum.map(|s| (s / (nx * ny) as f64).round() as u8)
        });
    }

    /// A line through points with round ends, each pixel coloured once however often the line crosses it.
    pub(crate) fn line(&mut self, points: &[(f64, f64)], width: f64, colour: Rgb) {
        let half = 0.5 * width;
        let segments: Vec<_> = match points {
            [one] => vec![(*one, *one)],
            more => more.windows(2).map(|w| (w[0], w[1])).collect(),
        };
        let Some(bounds) = bounds_of(points, half + 1.0) else { return };
        let (columns, rows) = (
            span(bounds.x, bounds.x + bounds.width, self.width),
            span(bounds.y, bounds.y + bounds.height, self.height),
        );
        let mut coverage = vec![0.0_f32; columns.len() * rows.len()];
        for (a, b) in segments {
            let reach = bounds_of(&[a, b], half + 1.0).unwrap_or(bounds);
            for row in span(reach.y, reach.y + reach.height, self.height) {
                for column in span(reach.x, reach.x + reach.width, self.width) {
                    let distance = distance_to_segment((column as f64 + 0.5, row as f64 + 0.5), a, b);
                    let covered = (half + 0.5 - distance).clamp(0.0, 1.0) as f32;
                    let cell = &mut coverage[(row - rows.start) * columns.len() + column - columns.start];
                    *cell = cell.max(covered);
                }
            }
        }
        for row in rows.clone() {
            for column in columns.clone() {
                let covered = coverage[(row - rows.start) * columns.len() + column - columns.start];
                self.blend(column, row, colour, f64::from(covered));
            }
        }
    }

    /// A line in dashes, `on` and `off` pixels long.
    pub(crate) fn dashes(&mut self, points: &[(f64, f64)], width: f64, on: f64, off: f64, colour: Rgb) {
        let mut travelled = 0.0;
        for ends in points.windows(2) {
            let (a, b) = (ends[0], ends[1]);
            let length = (b.0 - a.0).hypot(b.1 - a.1);
            let mut done = 0.0;
            while done < length {
                let phase = (travelled + done) % (on + off);
                let piece = if phase < on { on - phase } else { on + off - phase };
                let next = (done + piece.max(1e-6)).min(length);
                if phase < on {
                    let at = |d: f64| (a.0 + (b.0 - a.0) * d / length, a.1 + (b.1 - a.1) * d / length);
                    self.line(&[at(done), at(next)], width, colour);
                }
                done = next;
            }
            travelled += length;
        }
    }

    pub(crate) fn disc(&mut self, centre: (f64, f64), radius: f64, colour: Rgb) {
        self.line(&[centre], 2.0 * radius, colour);
    }

    /// A filled polygon without inward corners.
    pub(crate) fn convex(&mut self, corners: &[(f64, f64)], colour: Rgb) {
        let Some(bounds) = bounds_of(corners, 1.0) else { return };
        let area: f64 = edges(corners).map(|(a, b)| a.0 * b.1 - b.0 * a.1).sum();
        for row in span(bounds.y, bounds.y + bounds.height, self.height) {
            for column in span(bounds.x, bounds.x + bounds.width, self.width) {
                let p = (column as f64 + 0.5, row as f64 + 0.5);
                let inside = edges(corners).map(|(a, b)| {
                    let cross = (b.0 - a.0) * (p.1 - a.1) - (b.1 - a.1) * (p.0 - a.0);
                    cross * area.signum() / (b.0 - a.0).hypot(b.1 - a.1).max(1e-9)
                });
                let depth = inside.fold(f64::INFINITY, f64::min);
                self.blend(column, row, colour, (depth + 0.5).clamp(0.0, 1.0));
            }
        }
    }

    /// Draws a line of text with its baseline at `y` and returns its width, pixels.
    pub(crate) fn text(&mut self, (x, y): (f64, f64), align: Align, style: Style, text: &str) -> f64 {
        let (strokes, width) = glyphs::strokes(text);
        let unit = style.size_px / glyphs::CAP_HEIGHT;
        let shift = match align {
            Align::Left => 0.0,
            Align::Centre => 0.5,
        };
        let left = x - shift * width * unit;
        for stroke in strokes {
            let placed: Vec<_> = stroke.iter().map(|(u, v)| (left + u * unit, y - v * unit)).collect();
            self.line(&placed, (style.weight * style.size_px).max(1.0), style.colour);
        }
        width * unit
    }

    /// Text that stays readable on anything: a halo in `halo` first.
    pub(crate) fn text_on(&mut self, at: (f64, f64), align: Align, style: Style, halo: Rgb, text: &str) {
        let thick = Style { weight: style.weight + 0.42, colour: halo, ..style };
        self.text(at, align, thick, text);
        self.text(at, align, style, text);
    }

    fn blend(&mut self, column: usize, row: usize, colour: Rgb, share: f64) {
        if share <= 0.0 {
            return;
        }
        let at = 3 * (row * self.width + column);
        for (old, new) in self.pixels[at..at + 3].iter_mut().zip(colour) {
            *old = (f64::from(*old) * (1.0 - share) + f64::from(new) * share).round() as u8;
        }
    }
}

/// Width of a line of text, pixels.
pub(crate) fn text_width(text: &str, size_px: f64) -> f64 {
    glyphs::strokes(text).1 * size_px / glyphs::CAP_HEIGHT
}

fn edges(corners: &[(f64, f64)]) -> impl Iterator<Item = ((f64, f64), (f64, f64))> + '_ {
    corners.iter().copied().zip(corners.iter().copied().cycle().skip(1))
}

// Casting saturates, so that coordinates far outside or not finite give an empty or clipped span.
fn span(from: f64, to: f64, limit: usize) -> core::ops::Range<usize> {
    let end = (to.ceil() as usize).min(limit);
    (from.floor() as usize).min(end)..end
}

fn bounds_of(points: &[(f64, f64)], margin: f64) -> Option<Rect> {
    let mut finite = points.iter().filter(|p| p.0.is_finite() && p.1.is_finite());
    let first = finite.next()?;
    let start = (first.0, first.1, first.0, first.1);
    let (x0, y0, x1, y1) =
        finite.fold(start, |(x0, y0, x1, y1), p| (x0.min(p.0), y0.min(p.1), x1.max(p.0), y1.max(p.1)));
    Some(Rect { x: x0 - margin, y: y0 - margin, width: x1 - x0 + 2.0 * margin, height: y1 - y0 + 2.0 * margin })
}

fn distance_to_segment(p: (f64, f64), a: (f64, f64), b: (f64, f64)) -> f64 {
    let (dx, dy) = (b.0 - a.0, b.1 - a.1);
    let length2 = dx * dx + dy * dy;
    let t = if length2 > 0.0 { (((p.0 - a.0) * dx + (p.1 - a.1) * dy) / length2).clamp(0.0, 1.0) } else { 0.0 };
    (p.0 - a.0 - t * dx).hypot(p.1 - a.1 - t * dy)
}

/// Colour at (u, v), where whole numbers are pixel corners.
fn bilinear(image: &RgbImage, u: f64, v: f64) -> [f64; 3] {
    let (w, h) = (image.width() as usize, image.height() as usize);
    let (u, v) = ((u - 0.5).clamp(0.0, (w - 1) as f64), (v - 0.5).clamp(0.0, (h - 1) as f64));
    let (c, r) = (u as usize, v as usize);
    let (fu, fv) = (u - c as f64, v - r as f64);
    let at =
        |c: usize, r: usize, channel: usize| f64::from(image.data()[3 * (r.min(h - 1) * w + c.min(w - 1)) + channel]);
    core::array::from_fn(|k| {
        let top = at(c, r, k) * (1.0 - fu) + at(c + 1, r, k) * fu;
        let bottom = at(c, r + 1, k) * (1.0 - fu) + at(c + 1, r + 1, k) * fu;
        top * (1.0 - fv) + bottom * fv
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pixel(canvas: &Canvas, x: usize, y: usize) -> [u8; 3] {
        let at = 3 * (y * canvas.width + x);
        [canvas.pixels[at], canvas.pixels[at + 1], canvas.pixels[at + 2]]
    }

    #[test]
    fn a_line_is_full_in_its_middle_and_soft_at_its_edge() {
        let mut canvas = Canvas::new(20, 20, [255; 3]);
        canvas.line(&[(2.0, 10.25), (18.0, 10.25)], 4.0, [0; 3]);
        assert_eq!(pixel(&canvas, 10, 10), [0; 3]);
        let edge = pixel(&canvas, 10, 12)[0];
        assert!(edge > 0 && edge < 255, "{edge}");
        assert_eq!(pixel(&canvas, 10, 16), [255; 3]);
    }

    #[test]
    fn nothing_outside_the_canvas_or_not_finite_is_drawn() {
        let mut canvas = Canvas::new(8, 8, [9; 3]);
        canvas.line(&[(-1e12, -1e12), (-1e11, -1e12)], 3.0, [0; 3]);
        canvas.line(&[(f64::NAN, 1.0)], 3.0, [0; 3]);
        canvas.disc((f64::INFINITY, 0.0), 4.0, [0; 3]);
        assert!(canvas.pixels.iter().all(|p| *p == 9));
    }

    #[test]
    fn an_image_fills_its_rectangle_and_keeps_its_mean() {
        let checker: Vec<u8> = (0..64 * 64).flat_map(|i| [if (i + i / 64) % 2 == 0 { 0 } else { 200 }; 3]).collect();
        let image = RgbImage::new(64, 64, checker).unwrap();
        let mut canvas = Canvas::new(10, 10, [255; 3]);
        canvas.image(Rect { x: 1.0, y: 1.0, width: 8.0, height: 8.0 }, &image);
        assert!(pixel(&canvas, 4, 4)[0].abs_diff(100) < 12, "{:?}", pixel(&canvas, 4, 4));
        assert_eq!(pixel(&canvas, 0, 0), [255; 3]);
    }

    #[test]
    fn a_triangle_is_filled_whatever_its_direction() {
        for corners in [[(1.0, 1.0), (9.0, 1.0), (5.0, 9.0)], [(5.0, 9.0), (9.0, 1.0), (1.0, 1.0)]] {
            let mut canvas = Canvas::new(10, 10, [255; 3]);
            canvas.convex(&corners, [0; 3]);
            assert_eq!(pixel(&canvas, 5, 3), [0; 3]);
            assert_eq!(pixel(&canvas, 0, 8), [255; 3]);
        }
    }
}
