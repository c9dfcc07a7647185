//! Where the robot believes it is, and where it believed it was.

use std::collections::VecDeque;

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

/// The recent past of the odometry, so that an estimate can be applied where its image was taken.
#[derive(Clone, Debug)]
pub struct OdometryBuffer {
    readings: VecDeque<Odometry>,
    capacity: usize,
}

impl OdometryBuffer {
    /// Keeps the newest `capacity` readings.
    #[must_use]
    pub fn new(capacity: usize) -> Self {
        Self { readings: VecDeque::with_capacity(capacity), capacity: capacity.max(1) }
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

    /// Pose at `stamp`, interpolated between its neighbours; `None` outside what is remembered.
    #[must_use]
    pub fn at(&self, stamp: Stamp) -> Option<Transform<Odom, Base>> {
        let after = self.readings.iter().position(|r| r.stamp >= stamp)?;
        let b = &self.readings[after];
        if b.stamp == stamp {
            return Some(b.t_odom_base);
        }
        let a = &self.readings[after.checked_sub(1)?];
        let share = (stamp.0 - a.stamp.0) as f64 / (b.stamp.0 - a.stamp.0) as f64;
        let (ia, ib) = (a.t_odom_base.isometry(), b.t_odom_base.isometry());
        let translation = ia.translation.vector.lerp(&ib.translation.vector, share);
        let rotation = ia.rotation.try_slerp(&ib.rotation, share, 1e-9).unwrap_or(ib.rotation);
        Some(Transform::new(Isometry3::from_parts(Translation3::from(translation), rotation)))
    }
}
