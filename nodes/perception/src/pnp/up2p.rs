//! The minimal kernel of a camera that knows which way is up: four degrees of freedom are left, yaw and position, and
//! two points fix them (Kukelova, Bujnak, Pajdla, "Closed-form solutions to minimal absolute pose problems with known
//! vertical direction", ACCV 2010). At 90 % outliers and 0.9999 confidence two points need 917 samples, three 9,206.

use nalgebra::{Matrix3, Point3, Unit, UnitQuaternion, Vector3};

use super::CameraPose;

/// The direction of up in both cameras.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Upright {
    /// Robot's camera axes to axes with z up.
    level_camera: Matrix3<f64>,
    /// Goal camera axes to axes with z up.
    level_goal: Matrix3<f64>,
}

impl Upright {
    /// From the direction of up in the robot's camera and in the goal camera, any length. `None` if one has no direction.
    #[must_use]
    pub fn new(up_camera: &Vector3<f64>, up_goal: &Vector3<f64>) -> Option<Self> {
        Some(Self { level_camera: levelling(up_camera)?, level_goal: levelling(up_goal)? })
    }

    /// From how far the optical axes look down, radians: 0 for a level camera, negative for one that looks up. The
    /// cameras must not be rolled. `None` for an angle that is not finite.
    #[must_use]
    pub fn from_tilts(camera_down_rad: f64, goal_down_rad: f64) -> Option<Self> {
        // Optical axes: x right, y down, z forward.
        let up = |down_rad: f64| {
            let (sine, cosine) = nalgebra::ComplexField::sin_cos(down_rad);
            Vector3::new(0.0, -cosine, -sine)
        };
        Self::new(&up(camera_down_rad), &up(goal_down_rad))
    }

    /// The angle by which a pose's up misses the known one, radians.
    #[must_use]
    pub fn off_rad(&self, pose: &CameraPose) -> f64 {
        let up_camera = self.level_camera.row(2).transpose();
        let up_goal = self.level_goal.row(2).transpose();
        nalgebra::RealField::atan2((pose.r * up_camera).cross(&up_goal).norm(), (pose.r * up_camera).dot(&up_goal))
    }
}

fn levelling(up: &Vector3<f64>) -> Option<Matrix3<f64>> {
    let up = Unit::try_new(*up, 1e-9).filter(|up| up.iter().all(|x| x.is_finite()))?;
    let turn = UnitQuaternion::rotation_between_axis(&up, &Vector3::z_axis())
        .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), core::f64::consts::PI));
    Some(turn.to_rotation_matrix().into_inner())
}

/// Appends the poses (at most two) from which `points` (metres, robot's camera) lie along `rays` (unit, goal camera) and
/// up is up.
///
/// Points one above the other, rays that are both level and numbers that are not finite give none.
pub fn up2p(rays: &[Vector3<f64>; 2], points: &[Point3<f64>; 2], upright: &Upright, poses: &mut Vec<CameraPose>) {
    let [f0, f1] = [upright.level_goal * rays[0], upright.level_goal * rays[1]];
    let side = upright.level_camera * (points[0] - points[1]);
    let reach = side.x * side.x + side.y * side.y;
    // d_0 f_0 - d_1 f_1 is the side turned about the vertical: its height stays, so the distances lie on a line ...
    let slope = f0.z * f0.z + f1.z * f1.z;
    // Below a thousandth of a radian from level the heights say nothing; the comparison refuses a NaN, too.
    if !(slope > 1e-6 && reach > 1e-8 * side.norm_squared() && reach.is_finite()) {
        return;
    }
    let (start_0, start_1) = (side.z * f0.z / slope, -side.z * f1.z / slope);
    let foot = (f0 * start_0 - f1 * start_1).xy();
    let along = (f0 * f1.z - f1 * f0.z).xy();
    // ... and its horizontal length stays: |foot + x along|^2 = reach.
    let (a, b, c) = (along.norm_squared(), foot.dot(&along), foot.norm_squared() - reach);
    let discriminant = b * b - a * c;
    if !(a > 1e-12 && discriminant >= 0.0) {
        return;
    }
    let q = -(b + discriminant.sqrt().copysign(b));
    for x in [q / a, c / q] {
        let (d0, d1) = (start_0 + x * f1.z, start_1 + x * f0.z);
        if !(d0 > 0.0 && d1 > 0.0 && d0.is_finite() && d1.is_finite()) {
            continue;
        }
        let seen = foot + along * x;
        let (cosine, sine) = (seen.dot(&side.xy()) / reach, side.xy().perp(&seen) / reach);
        let turn = Matrix3::new(cosine, -sine, 0.0, sine, cosine, 0.0, 0.0, 0.0, 1.0);
        let r = upright.level_goal.tr_mul(&(turn * upright.level_camera));
        poses.push(CameraPose { r, p: points[0].coords - r.tr_mul(&(rays[0] * d0)) });
    }
}
