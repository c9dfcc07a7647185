//! Trigonometry that gives the same bits on every CPU, and the small geometry built on it.

use homing_core::PlanarPose;

/// Sine and cosine.
pub fn sin_cos(angle_rad: f64) -> (f64, f64) {
    (libm::sin(angle_rad), libm::cos(angle_rad))
}

/// The pose after driving straight ahead.
pub fn ahead(pose: &PlanarPose, heading_rad: f64, distance_m: f64) -> (f64, f64) {
    let (sin, cos) = sin_cos(heading_rad);
    (pose.x_m + distance_m * cos, pose.y_m + distance_m * sin)
}

/// Distance between two points, metres.
pub fn distance(a: (f64, f64), b: (f64, f64)) -> f64 {
    ((a.0 - b.0) * (a.0 - b.0) + (a.1 - b.1) * (a.1 - b.1)).sqrt()
}
