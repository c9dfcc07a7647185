//! Where the robot believes it is, and where it believed it was.

use std::collections::VecDeque;
use std::time::Duration;

use nalgebra::{Isometry3, Translation3};

use crate::frames::{Base, Odom};
use crate::stamp::Stamp;
use crate::transform::Transform;

/// One odometry reading.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Odometry {
    /// When it holds.
    pub stamp: Stamp,
    /// Pose of the base in the odometry frame; identity at start.
    pub t_odom_base: Transform<Odom, Base>,
    /// Forward speed, m/s.
    pub linear_m_s: f64,
    /// Turning speed, rad/s, left positive.
    pub angular_rad_s: f64,
}

/// Readings farther apart than this say nothing about the time in between, unless the body hardly moved.
const GAP_MAX: Duration = Duration::from_secs(2);
const STILL_M: f64 = 0.05;
const STILL_RAD: f64 = 0.05;

/// The past of the odometry, so that an estimate can be applied where its image was taken.
#[derive(Clone, Debug)]
pub struct OdometryBuffer {
    readings: VecDeque<Odometry>,
    capacity: usize,
}

impl OdometryBuffer {
    /// Keeps the newest `capacity` readings.
    #[must_use]
    pub fn new(capacity: usize) -> Self {
        Self { readings: VecDeque::new(), capacity: capacity.max(1) }
    }

    /// Adds a reading. One that is older than the newest, or not finite, is ignored and reported as `false`.
    pub fn push(&mut self, reading: Odometry) -> bool {
        if !reading.t_odom_base.is_finite() || self.readings.back().is_some_and(|last| reading.stamp < last.stamp) {
            return false;
        }
        if self.readings.back().is_some_and(|last| reading.stamp == last.stamp) {
            self.readings.pop_back();
        }
        if self.readings.len() == self.capacity {
            self.readings.pop_front();
        }
        self.readings.push_back(reading);
        true
    }

    /// The newest reading.
    #[must_use]
    pub fn latest(&self) -> Option<&Odometry> {
        self.readings.back()
    }

    /// Readings newer than `stamp`.
    #[must_use]
    pub fn n_since(&self, stamp: Stamp) -> usize {
        self.readings.len() - self.readings.partition_point(|r| r.stamp <= stamp)
    }

    /// Pose at `stamp`, interpolated between its neighbours; `None` outside what is remembered, and where the body moved
    /// while nobody listened.
    #[must_use]
    pub fn at(&self, stamp: Stamp) -> Option<Transform<Odom, Base>> {
        let after = self.readings.partition_point(|r| r.stamp < stamp);
        let b = self.readings.get(after)?;
        if b.stamp == stamp {
            return Some(b.t_odom_base);
        }
        let a = &self.readings[after.checked_sub(1)?];
        let share = (stamp.0 - a.stamp.0) as f64 / (b.stamp.0 - a.stamp.0) as f64;
        let (ia, ib) = (a.t_odom_base.isometry(), b.t_odom_base.isometry());
        let still = (ia.translation.vector - ib.translation.vector).norm() <= STILL_M
            && ia.rotation.angle_to(&ib.rotation) <= STILL_RAD;
        if b.stamp.since(a.stamp) > GAP_MAX && !still {
            return None;
        }
        let translation = ia.translation.vector.lerp(&ib.translation.vector, share);
        let rotation = ia.rotation.try_slerp(&ib.rotation, share, 1e-9).unwrap_or(ib.rotation);
        Some(Transform::new(Isometry3::from_parts(Translation3::from(translation), rotation)))
    }
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "tests")]
mod tests {
    use super::*;
    use crate::PlanarPose;

    fn reading(seconds: f64, x_m: f64) -> Odometry {
        let t_odom_base = PlanarPose { x_m, y_m: 0.0, yaw_rad: 0.0 }.to_transform();
        Odometry { stamp: Stamp((seconds * 1e9) as u64), t_odom_base, linear_m_s: 0.0, angular_rad_s: 0.0 }
    }

    fn x_at(buffer: &OdometryBuffer, seconds: f64) -> Option<f64> {
        buffer.at(Stamp((seconds * 1e9) as u64)).map(|t| t.planar().x_m)
    }

    #[test]
    fn between_readings_the_pose_is_interpolated_and_outside_it_is_unknown() {
        let mut buffer = OdometryBuffer::new(3);
        for (seconds, x_m) in [(0.0, 9.0), (1.0, 1.0), (2.0, 2.0), (3.0, 4.0)] {
            assert!(buffer.push(reading(seconds, x_m)));
        }
        assert!((x_at(&buffer, 2.5).unwrap() - 3.0).abs() < 1e-12);
        assert_eq!((x_at(&buffer, 0.0), x_at(&buffer, 3.1)), (None, None));
        assert_eq!(buffer.n_since(Stamp(1_500_000_000)), 2);
        assert!(!buffer.push(reading(2.0, 0.0)));
    }

    #[test]
    fn where_the_body_moved_unheard_nothing_is_made_up() {
        let mut buffer = OdometryBuffer::new(8);
        for (seconds, x_m) in [(0.0, 0.0), (10.0, 3.0), (20.0, 3.01)] {
            buffer.push(reading(seconds, x_m));
        }
        assert_eq!(x_at(&buffer, 5.0), None);
        assert_eq!(x_at(&buffer, 10.0), Some(3.0));
        assert!((x_at(&buffer, 15.0).unwrap() - 3.005).abs() < 1e-9, "it stood still");
    }
}
