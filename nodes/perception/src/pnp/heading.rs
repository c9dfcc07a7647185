//! SLING's own distance and heading (section 3.3, "Estimating Distance and Heading to Goal"), as an ablation: it shows
//! what the paper's last step costs. Nothing else should use it.

use nalgebra::Vector3;

use super::CameraPose;

/// Where SLING's formula puts the goal.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct SlingHeading {
    /// rho = |t|, metres. Right.
    pub distance_m: f64,
    /// Direction to the goal, left positive, radians about the camera's down axis. Wrong by the angle between the cameras.
    pub bearing_rad: f64,
}

impl SlingHeading {
    /// The place the formula means, on the robot's floor: position in the robot's camera, metres.
    #[must_use]
    pub fn position_m(&self) -> Vector3<f64> {
        let (sine, cosine) = nalgebra::ComplexField::sin_cos(self.bearing_rad);
        Vector3::new(-sine, 0.0, cosine) * self.distance_m
    }
}

/// rho = |t| and phi = sgn(t\[1\]) arccos(t . o_a / (|t| |o_a|)), o_a the optical axis, from the pose PnP found.
///
/// What is wrong with it: the t of eq. 2 is the robot's origin in the GOAL camera's axes, but o_a is an axis of the
/// robot's camera. The two may be compared only where both cameras look the same way; elsewhere phi is off by the angle
/// between them (the right direction is that of p = -R^T t). Height differences count as heading, too: arccos measures
/// the angle in space.
///
/// Where the print is ambiguous it is read in its favour. Eq. 2's t points from the goal to the robot, so that equal
/// headings would turn the robot round: its opposite is used. t\[1\] "points along the axis perpendicular to the agent's
/// optical axis but parallel to the ground": that is x (the index counts from one), positive to the right.
#[must_use]
pub fn sling_heading(pose: &CameraPose) -> SlingHeading {
    let t = pose.r * pose.p;
    let distance_m = t.norm();
    if distance_m < 1e-12 {
        return SlingHeading { distance_m, bearing_rad: 0.0 };
    }
    let phi = nalgebra::ComplexField::acos((t.z / distance_m).clamp(-1.0, 1.0)).copysign(t.x);
    SlingHeading { distance_m, bearing_rad: -phi }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;

    #[test]
    fn the_formula_is_right_for_equal_headings_and_off_by_the_angle_between_them_elsewhere() {
        for yaw_deg in [-90.0_f64, -30.0, 0.0, 30.0, 90.0] {
            let yaw = yaw_deg.to_radians();
            let r_camera_goal = Rotation3::from_axis_angle(&-Vector3::y_axis(), yaw);
            let pose = CameraPose { r: r_camera_goal.inverse().into_inner(), p: Vector3::new(0.3, 0.0, 2.0) };
            let found = sling_heading(&pose);
            let bearing = (-0.3_f64).atan2(2.0);
            assert!((found.distance_m - pose.p.norm()).abs() < 1e-12);
            assert!((found.bearing_rad - (bearing - yaw)).abs() < 1e-9, "{yaw_deg}: {}", found.bearing_rad);
            let apart = (found.position_m() - pose.p).norm();
            let chord = 2.0 * found.distance_m * (0.5 * yaw).sin().abs();
            assert!((apart - chord).abs() < 1e-9, "{yaw_deg}: {apart} m, {chord} m");
        }
    }
}
