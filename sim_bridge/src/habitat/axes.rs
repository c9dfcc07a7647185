//! Habitat's world frame and ours.
//!
//! Habitat is y up and its agents look along -z; so are glTF scenes. We are z up: (x, y, z) becomes (x, -z, y), the
//! same quarter turn about x as in [`crate::gltf_scene`], so that a scene file and the episodes in it stay together. It
//! is a rotation, not a mirror: left stays left. A heading is counted from +x here and from -z there, a quarter turn
//! apart.

use core::f64::consts::FRAC_PI_2;

use homing_core::wrap_angle;

/// Habitat's position, metres, in the world frame.
#[must_use]
pub fn to_world(p: [f64; 3]) -> [f64; 3] {
    [p[0], -p[2], p[1]]
}

/// A position of the world frame, metres, in Habitat's.
#[must_use]
pub fn from_world(p: [f64; 3]) -> [f64; 3] {
    [p[0], p[2], -p[1]]
}

/// Where an agent looks whose rotation is the quaternion (x, y, z, w): (yaw, pitch) in the world frame, radians, pitch
/// positive upwards. `None` if the quaternion is none: not finite, or far from unit length.
#[must_use]
pub fn heading(q: [f64; 4]) -> Option<(f64, f64)> {
    let [x, y, z, w] = q;
    let norm = x * x + y * y + z * z + w * w;
    if !(0.9..=1.1).contains(&norm) {
        return None;
    }
    // The third column of the rotation, reversed: where -z goes.
    let forward = [-2.0 * (x * z + w * y), -2.0 * (y * z - w * x), -(norm - 2.0 * (x * x + y * y))];
    let world = to_world(forward);
    let level = libm::hypot(world[0], world[1]);
    Some((libm::atan2(world[1], world[0]), libm::atan2(world[2], level)))
}

/// The quaternion (x, y, z, w) of an agent with that yaw and pitch in the world frame, radians.
#[must_use]
pub fn rotation(yaw_rad: f64, pitch_rad: f64) -> [f64; 4] {
    let (about_y, about_x) = (0.5 * from_heading(yaw_rad), 0.5 * pitch_rad);
    let ((sy, cy), (sx, cx)) = ((libm::sin(about_y), libm::cos(about_y)), (libm::sin(about_x), libm::cos(about_x)));
    [cy * sx, sy * cx, -sy * sx, cy * cx]
}

/// The yaw of the world frame that an angle about Habitat's y axis stands for, radians.
#[must_use]
pub fn to_heading(about_y_rad: f64) -> f64 {
    wrap_angle(about_y_rad + FRAC_PI_2)
}

/// The angle about Habitat's y axis that a yaw of the world frame stands for, radians.
#[must_use]
pub fn from_heading(yaw_rad: f64) -> f64 {
    yaw_rad - FRAC_PI_2
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test may fail by panicking")]
mod tests {
    use super::*;

    fn close(a: f64, b: f64) -> bool {
        wrap_angle(a - b).abs() < 1e-9
    }

    #[test]
    fn positions_turn_and_are_not_mirrored() {
        assert_eq!(to_world([1.0, 2.0, 3.0]), [1.0, -3.0, 2.0]);
        assert_eq!(from_world(to_world([1.0, 2.0, 3.0])), [1.0, 2.0, 3.0]);
        let [x, y, z] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(to_world);
        let cross = [x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]];
        assert_eq!(cross, z, "x cross y is z in both frames");
    }

    #[test]
    fn an_agent_at_rest_looks_along_minus_z_and_a_left_turn_is_a_left_turn() {
        // No rotation: along -z, which is +y here. A quarter turn to the left: along -x.
        assert!(close(heading([0.0, 0.0, 0.0, 1.0]).unwrap().0, FRAC_PI_2));
        let quarter = core::f64::consts::FRAC_1_SQRT_2;
        assert!(close(heading([0.0, quarter, 0.0, quarter]).unwrap().0, core::f64::consts::PI));
        assert!(close(to_heading(FRAC_PI_2), core::f64::consts::PI));
        assert_eq!(heading([0.0; 4]), None);
    }

    #[test]
    fn yaw_and_pitch_survive_the_quaternion() {
        for (yaw, pitch) in [(0.3, 0.0), (-2.9, 0.4), (1.6, -0.25), (3.1, 0.1)] {
            let back = heading(rotation(yaw, pitch)).unwrap();
            assert!(close(back.0, yaw) && close(back.1, pitch), "{yaw} {pitch}: {back:?}");
        }
    }
}
