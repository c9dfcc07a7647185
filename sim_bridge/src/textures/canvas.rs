//! A picture under construction: pixels in sRGB 0 to 1, shapes with smooth edges.

use super::palette::{Colour, blend};
use crate::scene::Texture;

/// Pixels, row-major. Shapes are given in pixels, the centre of the top-left one at (0.5, 0.5).
pub struct Canvas {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    pixels: Vec<Colour>,
}

impl Canvas {
    /// Paints every pixel by a function of (u, v) in 0..1.
    pub fn painted(width: usize, height: usize, paint: impl Fn(f32, f32) -> Colour) -> Self {
        let (du, dv) = (1.0 / width as f32, 1.0 / height as f32);
        let pixel = |i: usize| paint(((i % width) as f32 + 0.5) * du, ((i / width) as f32 + 0.5) * dv);
        Self { width, height, pixels: (0..width * height).map(pixel).collect() }
    }

    /// One colour all over.
    pub fn plain(width: usize, height: usize, colour: Colour) -> Self {
        Self { width, height, pixels: vec![colour; width * height] }
    }

    /// 8-bit, opaque.
    pub fn into_texture(self) -> Texture {
        let byte = |c: f32| (c.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
        let rgba = self.pixels.iter().flat_map(|p| [byte(p[0]), byte(p[1]), byte(p[2]), 255]).collect();
        Texture { width: self.width as u32, height: self.height as u32, rgba }
    }

    /// Changes the pixels of a rectangle (cut to the picture) by a function of (x, y) and the colour there.
    pub fn alter(&mut self, from: (f32, f32), to: (f32, f32), change: impl Fn(f32, f32, Colour) -> Colour) {
        let cut = |c: f32, side: usize| c.clamp(0.0, side as f32) as usize;
        let (x0, x1) = (cut(from.0, self.width), cut(to.0 + 1.0, self.width));
        for y in cut(from.1, self.height)..cut(to.1 + 1.0, self.height) {
            for (x, pixel) in self.pixels[y * self.width..(y + 1) * self.width].iter_mut().enumerate().take(x1).skip(x0)
            {
                *pixel = change(x as f32 + 0.5, y as f32 + 0.5, *pixel);
            }
        }
    }

    /// Fills where a signed distance (pixels, negative inside) is below zero, within a rectangle.
    pub fn fill(&mut self, from: (f32, f32), to: (f32, f32), colour: Colour, distance: impl Fn(f32, f32) -> f32) {
        self.alter((from.0 - 1.0, from.1 - 1.0), (to.0 + 1.0, to.1 + 1.0), |x, y, old| {
            blend(old, colour, (0.5 - distance(x, y)).clamp(0.0, 1.0))
        });
    }

    /// An upright rectangle.
    pub fn rectangle(&mut self, (x0, y0): (f32, f32), (x1, y1): (f32, f32), colour: Colour) {
        let (cx, cy, hx, hy) = (0.5 * (x0 + x1), 0.5 * (y0 + y1), 0.5 * (x1 - x0), 0.5 * (y1 - y0));
        self.fill((x0, y0), (x1, y1), colour, |x, y| ((x - cx).abs() - hx).max((y - cy).abs() - hy));
    }

    /// The outline of an upright rectangle, `line` thick inwards.
    pub fn frame(&mut self, (x0, y0): (f32, f32), (x1, y1): (f32, f32), line: f32, colour: Colour) {
        self.rectangle((x0, y0), (x1, y0 + line), colour);
        self.rectangle((x0, y1 - line), (x1, y1), colour);
        self.rectangle((x0, y0), (x0 + line, y1), colour);
        self.rectangle((x1 - line, y0), (x1, y1), colour);
    }

    /// A disc.
    pub fn disc(&mut self, (cx, cy): (f32, f32), radius: f32, colour: Colour) {
        self.fill((cx - radius, cy - radius), (cx + radius, cy + radius), colour, |x, y| {
            ((x - cx) * (x - cx) + (y - cy) * (y - cy)).sqrt() - radius
        });
    }

    /// A ring of the given thickness about `radius`.
    pub fn ring(&mut self, (cx, cy): (f32, f32), radius: f32, line: f32, colour: Colour) {
        let reach = radius + line;
        self.fill((cx - reach, cy - reach), (cx + reach, cy + reach), colour, |x, y| {
            (((x - cx) * (x - cx) + (y - cy) * (y - cy)).sqrt() - radius).abs() - 0.5 * line
        });
    }

    /// A straight stroke with round ends.
    pub fn stroke(&mut self, a: (f32, f32), b: (f32, f32), line: f32, colour: Colour) {
        let (dx, dy) = (b.0 - a.0, b.1 - a.1);
        let length2 = (dx * dx + dy * dy).max(1e-6);
        let (from, to) = ((a.0.min(b.0) - line, a.1.min(b.1) - line), (a.0.max(b.0) + line, a.1.max(b.1) + line));
        self.fill(from, to, colour, |x, y| {
            let t = (((x - a.0) * dx + (y - a.1) * dy) / length2).clamp(0.0, 1.0);
            let (ex, ey) = (x - a.0 - t * dx, y - a.1 - t * dy);
            (ex * ex + ey * ey).sqrt() - 0.5 * line
        });
    }

    /// A convex polygon, corners in either order.
    pub fn polygon(&mut self, corners: &[(f32, f32)], colour: Colour) {
        let low = corners.iter().fold((f32::MAX, f32::MAX), |l, c| (l.0.min(c.0), l.1.min(c.1)));
        let high = corners.iter().fold((f32::MIN, f32::MIN), |h, c| (h.0.max(c.0), h.1.max(c.1)));
        let next = |i: usize| corners[(i + 1) % corners.len()];
        let twice_area: f32 = (0..corners.len()).map(|i| corners[i].0 * next(i).1 - next(i).0 * corners[i].1).sum();
        let edges: Vec<(f32, f32, f32)> = (0..corners.len())
            .map(|i| {
                let ((ax, ay), (bx, by)) = (corners[i], next(i));
                let length = ((bx - ax) * (bx - ax) + (by - ay) * (by - ay)).sqrt().max(1e-6) * twice_area.signum();
                let (nx, ny) = ((by - ay) / length, (ax - bx) / length);
                (nx, ny, -(nx * ax + ny * ay))
            })
            .collect();
        self.fill(low, high, colour, |x, y| edges.iter().fold(f32::MIN, |d, (a, b, c)| d.max(a * x + b * y + c)));
    }
}
