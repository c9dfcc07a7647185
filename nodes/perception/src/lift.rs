//! From keypoints of the robot's image to points in its camera (SLING eq. 1), where the depth can be trusted.

use homing_core::{DepthImage, Intrinsics, Keypoint};
use nalgebra::Point3;

/// When to trust a depth, and how far.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct DepthModel {
    /// Largest relative step between the pixels around a keypoint. Across a larger one the keypoint lies on an outline,
    /// and which of the two surfaces it belongs to is anybody's guess.
    pub step_max: f32,
    /// Standard deviation of a depth z (metres) is `sd_m + sd_per_m2 z^2`.
    pub sd_m: f64,
    /// See `sd_m`; 1/metres.
    pub sd_per_m2: f64,
}

impl Default for DepthModel {
    /// Close to what Nguyen, Izadi and Lovell (3DIMPVT 2012) measured on a Kinect from 1 to 4 m.
    fn default() -> Self {
        Self { step_max: 0.05, sd_m: 0.001, sd_per_m2: 0.0016 }
    }
}

impl DepthModel {
    /// One standard deviation at a depth, metres.
    #[must_use]
    pub fn sd(&self, depth_m: f64) -> f64 {
        self.sd_m + self.sd_per_m2 * depth_m * depth_m
    }
}

/// The keypoint's point in the camera frame, metres. `None` outside the image, where the nearest depth is invalid, or
/// on a depth discontinuity.
#[must_use]
pub fn lift(keypoint: &Keypoint, depth: &DepthImage, camera: &Intrinsics, model: &DepthModel) -> Option<Point3<f64>> {
    let depth_m = depth_at(keypoint.x_px, keypoint.y_px, depth, model.step_max)?;
    Some(camera.unproject(f64::from(keypoint.x_px), f64::from(keypoint.y_px), depth_m))
}

/// Bilinear in inverse depth, which is linear on a plane, over the valid ones of the four pixels around.
fn depth_at(x_px: f32, y_px: f32, depth: &DepthImage, step_max: f32) -> Option<f64> {
    let (width, height) = (depth.width() as f32, depth.height() as f32);
    // Also false for a NaN.
    if !(x_px >= -0.5 && y_px >= -0.5 && x_px < width - 0.5 && y_px < height - 0.5) {
        return None;
    }
    let (x, y) = (x_px.clamp(0.0, width - 1.0), y_px.clamp(0.0, height - 1.0));
    depth.at(x.round() as u32, y.round() as u32)?;
    let (column, row) = (x.floor(), y.floor());
    let (fx, fy) = (x - column, y - row);
    let corners = [(0, 0, (1.0 - fx) * (1.0 - fy)), (1, 0, fx * (1.0 - fy)), (0, 1, (1.0 - fx) * fy), (1, 1, fx * fy)];
    let (mut nearest, mut farthest) = (f32::INFINITY, 0.0_f32);
    let (mut inverse, mut weight) = (0.0, 0.0);
    for (dx, dy, w) in corners {
        let Some(d) = depth.at(column as u32 + dx, row as u32 + dy) else { continue };
        (nearest, farthest) = (nearest.min(d), farthest.max(d));
        inverse += f64::from(w) / f64::from(d);
        weight += f64::from(w);
    }
    (weight > 0.0 && farthest - nearest <= step_max * nearest).then(|| weight / inverse)
}
