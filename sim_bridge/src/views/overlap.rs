//! What two views share.

use nalgebra::Point3;

use super::View;

/// Every so many rows and columns one pixel is asked: 4800 of 320 x 240, which leaves a standard error below 0.01.
const STRIDE: usize = 4;
/// Depths agree within this share of the depth ...
const AGREE_SHARE: f64 = 0.05;
/// ... or within this, metres.
const AGREE_M: f64 = 0.03;

/// The smaller of the two directions of the share of one view's pixels with depth whose point the other view sees: it
/// projects into the image and agrees with the depth there. What is hidden in the other view, or has moved, does not
/// count. 0 to 1, the same for (a, b) and (b, a).
#[must_use]
pub fn overlap(a: &View, b: &View) -> f64 {
    seen_share(a, b).min(seen_share(b, a))
}

/// True if a point at `expected_m` and a surface at `measured_m` along the same optical axis are the same: within 5 % or
/// 3 cm, metres.
#[must_use]
pub fn agrees(expected_m: f64, measured_m: f64) -> bool {
    (expected_m - measured_m).abs() <= AGREE_M.max(AGREE_SHARE * expected_m)
}

/// Share of the pixels of `from` that have depth and whose point `to` sees, 0 to 1; 0 without any depth.
#[must_use]
pub fn seen_share(from: &View, to: &View) -> f64 {
    let t_to_from = (to.t_world_camera.inverse() * from.t_world_camera).isometry().to_homogeneous();
    let (mut asked, mut seen) = (0_u32, 0_u32);
    for row in (0..from.depth.height()).step_by(STRIDE) {
        for column in (0..from.depth.width()).step_by(STRIDE) {
            let Some(depth_m) = from.depth.at(column, row) else { continue };
            asked += 1;
            let p_from = from.camera.unproject(f64::from(column), f64::from(row), f64::from(depth_m));
            let p_to = Point3::from((t_to_from * p_from.to_homogeneous()).xyz());
            seen += u32::from(sees(to, &p_to));
        }
    }
    if asked == 0 { 0.0 } else { f64::from(seen) / f64::from(asked) }
}

/// True if a point in the view's camera frame, metres, is what the view shows at its pixel.
fn sees(view: &View, p_camera: &Point3<f64>) -> bool {
    let Some(pixel) = view.camera.project(p_camera) else { return false };
    let (x, y) = (pixel.x.round(), pixel.y.round());
    let inside = x >= 0.0 && y >= 0.0 && x < f64::from(view.camera.width()) && y < f64::from(view.camera.height());
    inside && view.depth.at(x as u32, y as u32).is_some_and(|measured_m| agrees(p_camera.z, f64::from(measured_m)))
}
