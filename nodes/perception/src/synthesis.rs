//! Proof of a pose by view synthesis (Taira et al., "InLoc", CVPR 2018, section 3.3): what the robot sees is drawn as the
//! goal camera would see it, and compared with the photo. Two rooms with one wallpaper agree on hundreds of keypoints; they
//! do not agree on what stands in front of it.

use homing_core::{Intrinsics, RgbImage, RgbdFrame};

use crate::pnp::CameraPose;

/// Cells along the photo's longer side: 1.5 degrees each with a field of view of 120 degrees.
const CELLS: usize = 80;
/// Points of the frame along its longer side: enough for no holes where the goal is nearer to what it shows.
const SAMPLES: u32 = 320;
/// Side of a patch, cells, and from one patch to the next.
const PATCH: usize = 5;
const STRIDE: usize = 2;
/// Cells of a patch that must be covered.
const COVERED_MIN: usize = 20;
/// A patch with less contrast than this says nothing, grey levels of 256 (one standard deviation).
const CONTRAST_MIN: f64 = 8.0;
/// Correlation from which two patches show the same.
const SAME: f64 = 0.6;

/// An image as means of square cells.
#[derive(Clone, Debug)]
pub(crate) struct Thumbnail {
    columns: usize,
    rows: usize,
    /// Pixels per cell.
    cell_px: f64,
    grey: Vec<f64>,
}

impl Thumbnail {
    pub fn of(image: &RgbImage) -> Self {
        let (width, height) = (image.width() as usize, image.height() as usize);
        let cell_px = (width.max(height) as f64 / CELLS as f64).max(1.0);
        let cells = |side: usize| ((side as f64 / cell_px) as usize).max(1);
        let (columns, rows) = (cells(width), cells(height));
        let mut sums = vec![(0.0, 0.0); columns * rows];
        let of = |pixel: usize| ((pixel as f64 + 0.5) / cell_px) as usize;
        for (i, grey) in image.to_luma().into_iter().enumerate() {
            let (column, row) = (of(i % width), of(i / width));
            if column < columns && row < rows {
                let sum: &mut (f64, f64) = &mut sums[row * columns + column];
                *sum = (sum.0 + f64::from(grey), sum.1 + 1.0);
            }
        }
        let grey = sums.into_iter().map(|(sum, n)| if n > 0.0 { sum / n } else { 0.0 }).collect();
        Self { columns, rows, cell_px, grey }
    }

    /// Index of the cell at a pixel.
    fn at(&self, x_px: f64, y_px: f64) -> Option<usize> {
        let (x, y) = ((x_px + 0.5) / self.cell_px, (y_px + 0.5) / self.cell_px);
        (x >= 0.0 && y >= 0.0 && x < self.columns as f64 && y < self.rows as f64)
            .then(|| y as usize * self.columns + x as usize)
    }
}

/// What the robot sees, as far as drawing it from elsewhere needs it: every few pixels in both directions.
#[derive(Clone, Debug)]
pub(crate) struct Seen {
    camera: Intrinsics,
    samples: Vec<Sample>,
}

/// One pixel with depth.
#[derive(Copy, Clone, Debug)]
struct Sample {
    u: u16,
    v: u16,
    depth_m: f32,
    grey: u8,
}

impl Seen {
    pub fn of(frame: &RgbdFrame) -> Self {
        let (width, height) = (frame.depth.width(), frame.depth.height());
        let grey = frame.rgb.to_luma();
        let step = (width.max(height) / SAMPLES).max(1) as usize;
        let mut samples = Vec::new();
        for v in (0..height).step_by(step) {
            for u in (0..width).step_by(step) {
                if let (Some(depth_m), Some(&grey)) = (frame.depth.at(u, v), grey.get((v * width + u) as usize)) {
                    samples.push(Sample { u: u as u16, v: v as u16, depth_m, grey });
                }
            }
        }
        Self { camera: frame.intrinsics, samples }
    }
}

/// How well frame and photo agree.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) struct Agreement {
    /// Patches with contrast that both show.
    pub n_patches: usize,
    /// Share of them that correlate, 0 to 1.
    pub share: f64,
}

/// Compares the photo with the frame seen from `pose`.
pub(crate) fn agreement(seen: &Seen, photo: &Thumbnail, goal_camera: &Intrinsics, pose: &CameraPose) -> Agreement {
    let drawn = draw(seen, photo, goal_camera, pose);
    let (mut n_patches, mut n_same) = (0, 0);
    for row in (0..photo.rows.saturating_sub(PATCH - 1)).step_by(STRIDE) {
        for column in (0..photo.columns.saturating_sub(PATCH - 1)).step_by(STRIDE) {
            let corner = row * photo.columns + column;
            let cells = (0..PATCH * PATCH).map(|i| corner + i / PATCH * photo.columns + i % PATCH);
            if let Some(same) = compare(cells.filter_map(|i| Some((drawn[i]?, photo.grey[i])))) {
                n_patches += 1;
                n_same += usize::from(same);
            }
        }
    }
    Agreement { n_patches, share: n_same as f64 / n_patches.max(1) as f64 }
}

/// Mean grey of what the frame shows in each cell of the photo; what is nearer to the goal camera hides what is behind.
fn draw(seen: &Seen, photo: &Thumbnail, goal_camera: &Intrinsics, pose: &CameraPose) -> Vec<Option<f64>> {
    let mut nearest_m = vec![f64::INFINITY; photo.grey.len()];
    let mut points = Vec::new();
    for sample in &seen.samples {
        let point = seen.camera.unproject(f64::from(sample.u), f64::from(sample.v), f64::from(sample.depth_m));
        let at_goal = pose.to_goal(&point);
        let Some(pixel) = goal_camera.project(&at_goal.into()) else { continue };
        let Some(cell) = photo.at(pixel.x, pixel.y) else { continue };
        nearest_m[cell] = nearest_m[cell].min(at_goal.z);
        points.push((cell, at_goal.z, f64::from(sample.grey)));
    }
    let mut sums = vec![(0.0, 0.0); photo.grey.len()];
    for (cell, z_m, grey) in points {
        if z_m <= 1.1 * nearest_m[cell] + 0.05 {
            sums[cell] = (sums[cell].0 + grey, sums[cell].1 + 1.0);
        }
    }
    sums.into_iter().map(|(sum, n): (f64, f64)| (n > 0.0).then(|| sum / n)).collect()
}

/// Whether a patch correlates; `None` if too little of it is covered or neither side has contrast.
fn compare(cells: impl Iterator<Item = (f64, f64)>) -> Option<bool> {
    let (mut n, mut a, mut b, mut aa, mut bb, mut ab) = (0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for (x, y) in cells {
        n += 1;
        (a, b, aa, bb, ab) = (a + x, b + y, aa + x * x, bb + y * y, ab + x * y);
    }
    if n < COVERED_MIN {
        return None;
    }
    let n = n as f64;
    let (var_a, var_b) = ((aa / n - (a / n).powi(2)).max(0.0), (bb / n - (b / n).powi(2)).max(0.0));
    let covariance = ab / n - a * b / (n * n);
    (var_a.max(var_b) > CONTRAST_MIN * CONTRAST_MIN).then(|| covariance > SAME * (var_a * var_b).sqrt())
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "tests")]
mod tests {
    use std::sync::Arc;

    use homing_core::{DepthImage, Stamp};
    use nalgebra::{Matrix3, Vector3};

    use super::*;

    /// A wall 2 m ahead, painted in blocks whose grey is a function of where they are on the wall.
    fn wall(camera: &Intrinsics, at: Vector3<f64>, seed: u64) -> (RgbImage, DepthImage) {
        let (mut rgb, mut depth) = (Vec::new(), Vec::new());
        for v in 0..camera.height() {
            for u in 0..camera.width() {
                let ray = camera.unproject(f64::from(u), f64::from(v), 1.0);
                let z = 2.0 - at.z;
                let block = |x: f64| (x / 0.25).floor() as i64 as u64;
                let (x, y) = (block(at.x + z * ray.x), block(at.y + z * ray.y));
                let mixed =
                    (x.wrapping_mul(0x9e37_79b9) ^ y.wrapping_mul(0x85eb_ca6b) ^ seed).wrapping_mul(0xc2b2_ae35);
                rgb.extend([(mixed >> 13) as u8; 3]);
                depth.push(z as f32);
            }
        }
        let (w, h) = (camera.width(), camera.height());
        (RgbImage::new(w, h, rgb).unwrap(), DepthImage::from_metres(w, h, depth).unwrap())
    }

    fn compare_views(at_goal: Vector3<f64>, said: Vector3<f64>, seeds: (u64, u64)) -> Agreement {
        let camera = Intrinsics::from_hfov(320, 240, 2.0).unwrap();
        let (rgb, depth) = wall(&camera, Vector3::zeros(), seeds.0);
        let (photo, _) = wall(&camera, at_goal, seeds.1);
        let seen = Seen::of(&RgbdFrame::new(Stamp(0), Arc::new(rgb), Arc::new(depth), camera).unwrap());
        agreement(&seen, &Thumbnail::of(&photo), &camera, &CameraPose { r: Matrix3::identity(), p: said })
    }

    #[test]
    fn the_true_pose_explains_the_photo_and_no_other_does() {
        let goal = Vector3::new(0.4, 0.1, 0.5);
        let right = compare_views(goal, goal, (1, 1));
        assert!(right.n_patches > 100 && right.share > 0.85, "{right:?}");
        let beside = compare_views(goal, goal + Vector3::new(0.5, 0.0, 0.0), (1, 1));
        assert!(beside.share < 0.3, "{beside:?}");
        let elsewhere = compare_views(goal, goal, (1, 2));
        assert!(elsewhere.share < 0.3, "{elsewhere:?}");
    }

    #[test]
    fn a_view_that_shares_nothing_has_no_patches() {
        let behind = compare_views(Vector3::zeros(), Vector3::new(0.0, 0.0, 9.0), (1, 1));
        assert_eq!(behind, Agreement { n_patches: 0, share: 0.0 });
    }
}
