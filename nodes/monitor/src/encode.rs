//! Images as the bytes a recording holds.

use homing_core::{Cell, DepthImage, OccupancyGrid, RgbImage};
use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder as _, ImageResult};

/// JPEG of a colour image.
pub(crate) fn jpeg(image: &RgbImage, quality: u8) -> ImageResult<Vec<u8>> {
    let mut bytes = Vec::with_capacity(1 << 17);
    let encoder = JpegEncoder::new_with_quality(&mut bytes, quality.clamp(1, 100));
    encoder.write_image(image.data(), image.width(), image.height(), ExtendedColorType::Rgb8)?;
    Ok(bytes)
}

/// PNG of a colour image.
pub(crate) fn png(image: &RgbImage) -> ImageResult<Vec<u8>> {
    let mut bytes = Vec::with_capacity(1 << 17);
    let encoder = PngEncoder::new_with_quality(&mut bytes, CompressionType::Default, FilterType::Adaptive);
    encoder.write_image(image.data(), image.width(), image.height(), ExtendedColorType::Rgb8)?;
    Ok(bytes)
}

/// 16-bit PNG of a depth image in millimetres at half its size (every second pixel), 0 where invalid, at most 65.534 m.
/// A quarter of the pixels is what a view of a few hundred points shows, and what a recording can afford.
pub(crate) fn depth_png(depth: &DepthImage) -> ImageResult<Vec<u8>> {
    let (width, height) = (depth.width().div_ceil(2), depth.height().div_ceil(2));
    let rows = depth.data().chunks_exact(depth.width() as usize).step_by(2);
    let millimetres: Vec<u8> = rows
        .flat_map(|row| row.iter().step_by(2))
        .flat_map(|&metres| ((metres * 1e3).clamp(0.0, 65_534.0) as u16).to_ne_bytes())
        .collect();
    let mut bytes = Vec::with_capacity(1 << 16);
    let encoder = PngEncoder::new_with_quality(&mut bytes, CompressionType::Fast, FilterType::Up);
    encoder.write_image(&millimetres, width, height, ExtendedColorType::L16)?;
    Ok(bytes)
}

/// The known part of a map as an image of classes.
pub(crate) struct MapImage {
    /// Columns and rows.
    pub(crate) size: [u32; 2],
    /// A [`Cell`] as a byte for each pixel, row-major, the row of largest y on top.
    pub(crate) classes: Vec<u8>,
    /// Left edge, metres.
    pub(crate) left_m: f64,
    /// Upper edge: the largest y, metres.
    pub(crate) top_m: f64,
    /// Side of a pixel, metres.
    pub(crate) resolution_m: f64,
}

impl MapImage {
    /// Lower edge, metres.
    pub(crate) fn bottom_m(&self) -> f64 {
        self.top_m - f64::from(self.size[1]) * self.resolution_m
    }

    /// From left to right edge, metres.
    pub(crate) fn width_m(&self) -> f64 {
        f64::from(self.size[0]) * self.resolution_m
    }
}

/// Smallest box of cells (first column, first row, last column, last row) that holds every known cell and `margin` cells
/// around; `None` if nothing is known.
pub(crate) fn known_box(map: &OccupancyGrid, margin: usize) -> Option<[usize; 4]> {
    let geometry = map.geometry;
    let mut found: Option<[usize; 4]> = None;
    for (row, cells) in map.cells.chunks_exact(geometry.width.max(1)).enumerate() {
        let known = |cell: &Cell| *cell != Cell::Unknown;
        let Some(first) = cells.iter().position(known) else { continue };
        let last = cells.iter().rposition(known).unwrap_or(first);
        let b = found.get_or_insert([first, row, last, row]);
        *b = [b[0].min(first), b[1], b[2].max(last), row];
    }
    found.map(|[c0, r0, c1, r1]| {
        let (c1, r1) = ((c1 + margin).min(geometry.width - 1), (r1 + margin).min(geometry.height - 1));
        [c0.saturating_sub(margin), r0.saturating_sub(margin), c1, r1]
    })
}

/// The known part of a map and half a metre around it, y up; `None` if nothing is known.
pub(crate) fn map_image(map: &OccupancyGrid) -> Option<MapImage> {
    let resolution_m = map.geometry.resolution_m;
    let margin = (0.5 / resolution_m).ceil() as usize;
    let [c0, r0, c1, r1] = known_box(map, margin)?;
    Some(MapImage {
        size: [(c1 - c0 + 1) as u32, (r1 - r0 + 1) as u32],
        classes: (r0..=r1).rev().flat_map(|r| (c0..=c1).map(move |c| map.at(c, r) as u8)).collect(),
        left_m: map.geometry.origin_x_m + c0 as f64 * resolution_m,
        top_m: map.geometry.origin_y_m + (r1 + 1) as f64 * resolution_m,
        resolution_m,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use homing_core::GridGeometry;

    #[test]
    fn a_depth_image_keeps_millimetres_and_its_holes() {
        let depth = DepthImage::from_metres(3, 3, vec![1.5, 9.0, f32::NAN, 9.0, 9.0, 9.0, 0.25, 9.0, 60.0]).unwrap();
        let decoded = image::load_from_memory(&depth_png(&depth).unwrap()).unwrap().into_luma16();
        assert_eq!(decoded.dimensions(), (2, 2));
        assert_eq!(decoded.into_raw(), [1500, 0, 250, 60_000]);
    }

    #[test]
    fn the_map_image_is_cropped_and_has_y_up() {
        let mut map = OccupancyGrid::unknown(GridGeometry::centred(10.0, 0.1));
        for (x, y, cell) in [(1.05, 2.05, Cell::Occupied), (-1.05, -2.05, Cell::Free)] {
            let (c, r) = map.geometry.cell_at(x, y).unwrap();
            let i = map.geometry.index(c, r);
            map.cells[i] = cell;
        }
        let image = map_image(&map).unwrap();
        let at = |x: f64, y: f64| {
            let (c, r) = ((x - image.left_m) / image.resolution_m, (image.top_m - y) / image.resolution_m);
            image.classes[r as usize * image.size[0] as usize + c as usize]
        };
        assert_eq!(at(1.05, 2.05), Cell::Occupied as u8);
        assert_eq!(at(-1.05, -2.05), Cell::Free as u8);
        assert_eq!(at(0.0, 0.0), Cell::Unknown as u8);
        assert!(image.size[0] < 40 && image.size[1] < 60);
        assert!((image.bottom_m() - -2.6).abs() < 0.06, "{}", image.bottom_m());
    }

    #[test]
    fn an_unknown_map_has_no_image() {
        assert!(map_image(&OccupancyGrid::unknown(GridGeometry::centred(2.0, 0.1))).is_none());
    }
}
