//! Which triangle every pixel of a band shows.

use core::ops::Range;

use crate::render::geometry::Geometry;
use crate::render::mip::MipTexture;
use crate::render::setup::{Bins, ScreenTriangle, pixels_between};
use crate::render::shade::Texturing;

/// Entry of pixels that show nothing.
pub const NOTHING: u32 = u32::MAX;

/// Some rows of the image while they are drawn.
pub struct Band<'a> {
    /// Row of the image that is the band's first.
    pub first_row: usize,
    /// Columns.
    pub width: usize,
    /// 1/z of the nearest surface so far, 0 for none; metres once shaded.
    pub depth: &'a mut [f32],
    /// Entry of the bins whose triangle is nearest.
    pub ids: &'a mut [u32],
}

/// Draws the triangles without holes.
pub fn opaque(band: &mut Band<'_>, bins: &Bins<'_>, entries: Range<usize>) {
    for entry in entries {
        let triangle = bins.triangle(entry);
        if !triangle.cut_out {
            for_each_span(band, triangle, |span| span.draw(entry as u32));
        }
    }
}

/// Draws the triangles whose texture has holes, after all others.
pub fn cut_out(
    band: &mut Band<'_>,
    bins: &Bins<'_>,
    entries: Range<usize>,
    geometry: &Geometry,
    textures: &[MipTexture],
) {
    for entry in entries {
        let triangle = bins.triangle(entry);
        if triangle.cut_out {
            let look = &geometry.looks[triangle.look as usize];
            let texturing = Texturing::new(triangle, geometry, &textures[look.texture]);
            for_each_span(band, triangle, |span| span.draw_holed(entry as u32, &texturing, look.alpha_cutoff));
        }
    }
}

/// The pixels of one row inside one triangle.
struct Span<'a> {
    column: i32,
    row: i32,
    inverse_depth: f32,
    per_column: f32,
    range: (f32, f32),
    depth: &'a mut [f32],
    ids: &'a mut [u32],
}

impl Span<'_> {
    // Written without branches, so that it compiles to vector instructions.
    #[inline]
    fn draw(self, entry: u32) {
        for (i, (depth, id)) in self.depth.iter_mut().zip(self.ids.iter_mut()).enumerate() {
            let q = (self.inverse_depth + self.per_column * (i as i32 as f32)).max(self.range.0).min(self.range.1);
            let nearer = q > *depth;
            *depth = if nearer { q } else { *depth };
            *id = if nearer { entry } else { *id };
        }
    }

    fn draw_holed(self, entry: u32, texturing: &Texturing<'_>, cutoff: f32) {
        for (i, (depth, id)) in self.depth.iter_mut().zip(self.ids.iter_mut()).enumerate() {
            let q = (self.inverse_depth + self.per_column * (i as i32 as f32)).max(self.range.0).min(self.range.1);
            if q > *depth && texturing.alpha(self.column + i as i32, self.row, q) >= cutoff {
                *depth = q;
                *id = entry;
            }
        }
    }
}

fn for_each_span(band: &mut Band<'_>, triangle: &ScreenTriangle, mut draw: impl FnMut(Span<'_>)) {
    let first_row = band.first_row as i32;
    let n_rows = (band.depth.len() / band.width) as i32;
    let (lefts, rights) =
        triangle.crossings[..usize::from(triangle.n_crossings)].split_at(usize::from(triangle.n_left));
    for row in triangle.row_first.max(first_row)..=triangle.row_last.min(first_row + n_rows - 1) {
        let y = f64::from(row);
        let low = lefts.iter().fold(-1.0, |low: f64, (slope, offset)| low.max(slope * y + offset));
        let high = rights.iter().fold(band.width as f64, |high: f64, (slope, offset)| high.min(slope * y + offset));
        let Some((first, last)) = pixels_between(low, high, band.width) else { continue };
        let start = (row - first_row) as usize * band.width;
        let pixels = start + first as usize..start + last as usize + 1;
        draw(Span {
            column: first,
            row,
            inverse_depth: triangle.inverse_depth.at(f64::from(first), y) as f32,
            per_column: triangle.inverse_depth.x as f32,
            range: triangle.inverse_depth_range,
            depth: &mut band.depth[pixels.clone()],
            ids: &mut band.ids[pixels],
        });
    }
}
