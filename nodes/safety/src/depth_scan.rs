//! A planar scan from a depth image, for bodies without a scanner, and for what stands higher or lower than its plane.

use homing_core::{Base, Camera, DepthImage, Intrinsics, LaserScan, Stamp, Transform};
use nalgebra::Point3;

/// Which part of a depth image counts as an obstacle.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct DepthScanConfig {
    /// Lower points are floor, metres above it.
    pub height_m_min: f64,
    /// Higher points are passed under, metres above the floor.
    pub height_m_max: f64,
    /// Nearer points are invalid, metres.
    pub range_min_m: f64,
    /// Farther points are nothing, metres.
    pub range_max_m: f64,
    /// Width of a ray, radians.
    pub increment_rad: f64,
    /// Every how many pixels the image is read, across and down.
    pub stride_px: u32,
}

impl DepthScanConfig {
    /// From 8 cm above the floor to the body's height, 0.1 to 5 m away, one ray a degree, every fourth pixel.
    #[must_use]
    pub fn new(height_m: f64) -> Self {
        Self {
            height_m_min: 0.08,
            height_m_max: height_m.max(0.08),
            range_min_m: 0.1,
            range_max_m: 5.0,
            increment_rad: 1.0_f64.to_radians(),
            stride_px: 4,
        }
    }
}

/// The nearest obstacle in each direction, around the base. Directions without one valid depth are NaN (blind), those
/// where only floor or far things were seen are infinite. `None` if depth and intrinsics differ in size.
#[must_use]
pub fn scan_from_depth(
    config: &DepthScanConfig,
    stamp: Stamp,
    depth: &DepthImage,
    intrinsics: &Intrinsics,
    t_base_camera: &Transform<Base, Camera>,
) -> Option<LaserScan> {
    if (depth.width(), depth.height()) != (intrinsics.width(), intrinsics.height()) {
        return None;
    }
    let rays = (core::f64::consts::TAU / config.increment_rad).round().clamp(4.0, 3600.0) as usize;
    let increment_rad = core::f64::consts::TAU / rays as f64;
    let mut ranges_m = vec![f32::NAN; rays];
    for (row, column) in pixels(depth, config.stride_px) {
        let Some(d) = depth.at(column, row) else { continue };
        let p_camera = intrinsics.unproject(f64::from(column), f64::from(row), f64::from(d));
        let p: Point3<f64> = t_base_camera.apply(&p_camera);
        let angle_rad = nalgebra::RealField::atan2(p.y, p.x) + core::f64::consts::PI;
        let range = &mut ranges_m[(angle_rad / increment_rad) as usize % rays];
        *range = range.min(obstacle_range(config, &p));
    }
    Some(LaserScan {
        stamp,
        angle_min_rad: -core::f64::consts::PI + 0.5 * increment_rad,
        angle_increment_rad: increment_rad,
        range_min_m: config.range_min_m,
        range_max_m: config.range_max_m,
        ranges_m,
    })
}

fn pixels(depth: &DepthImage, stride_px: u32) -> impl Iterator<Item = (u32, u32)> {
    let step = stride_px.max(1) as usize;
    let width = depth.width();
    (0..depth.height()).step_by(step).flat_map(move |row| (0..width).step_by(step).map(move |column| (row, column)))
}

// Distance on the floor if the point is in the way, infinity if it is not.
fn obstacle_range(config: &DepthScanConfig, p_base: &Point3<f64>) -> f32 {
    let range_m = (p_base.x * p_base.x + p_base.y * p_base.y).sqrt();
    let in_the_way = p_base.z >= config.height_m_min && p_base.z <= config.height_m_max;
    if in_the_way && range_m <= config.range_max_m { range_m as f32 } else { f32::INFINITY }
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "tests")]
mod tests {
    use super::*;
    use nalgebra::{Matrix3, Vector3};

    fn level_camera(height_m: f64) -> Transform<Base, Camera> {
        let r_base_camera = Matrix3::new(0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0);
        Transform::from_rotation(&r_base_camera, Vector3::new(0.0, 0.0, height_m))
    }

    fn scan(depth_m: impl Fn(u32, u32) -> f32) -> LaserScan {
        let k = Intrinsics::from_hfov(160, 120, 90.0_f64.to_radians()).unwrap();
        let data = (0..120).flat_map(|r| (0..160).map(move |c| (c, r))).map(|(c, r)| depth_m(c, r)).collect();
        let depth = DepthImage::from_metres(160, 120, data).unwrap();
        let config = DepthScanConfig { stride_px: 1, ..DepthScanConfig::new(1.0) };
        scan_from_depth(&config, Stamp(5), &depth, &k, &level_camera(0.5)).unwrap()
    }

    fn at(scan: &LaserScan, bearing_deg: f64) -> f32 {
        let ray = (bearing_deg.to_radians() - scan.angle_min_rad) / scan.angle_increment_rad;
        scan.ranges_m[ray.round() as usize]
    }

    #[test]
    fn a_wall_ahead_is_seen_and_the_rest_is_blind() {
        let scan = scan(|_, _| 2.0);
        assert!((at(&scan, 0.0) - 2.0).abs() < 0.01);
        assert!((at(&scan, 30.0) - 2.0 / 30.0_f32.to_radians().cos()).abs() < 0.05);
        assert!(at(&scan, 90.0).is_nan() && at(&scan, -120.0).is_nan());
    }

    #[test]
    fn floor_is_free_and_no_depth_is_blind() {
        // The floor 0.5 m below a level camera of focal length 80: depth 40 / (row - 59.5) below the horizon.
        let floor = scan(|_, r| if r > 70 { 40.0 / (r as f32 - 59.5) } else { 0.0 });
        assert_eq!(at(&floor, 0.0), f32::INFINITY);
        assert!(scan(|_, _| 0.0).ranges_m.iter().all(|r| r.is_nan()));
    }

    #[test]
    fn sizes_must_agree() {
        let k = Intrinsics::from_hfov(320, 240, 1.5).unwrap();
        let depth = DepthImage::from_metres(160, 120, vec![1.0; 160 * 120]).unwrap();
        assert!(scan_from_depth(&DepthScanConfig::new(1.0), Stamp(0), &depth, &k, &level_camera(0.5)).is_none());
    }
}
