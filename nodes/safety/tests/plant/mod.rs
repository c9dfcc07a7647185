//! A simulated base: a disc with wheels that lag, odometry that comes late, and a scanner in a room of points.

use core::time::Duration;

use homing_core::{Capabilities, Intrinsics, LaserScan, Odometry, PlanarPose, Stamp, Transform};
use homing_safety::{SupervisorConfig, VelocityOrder};
use nalgebra::{Matrix3, Vector3};

/// One tick at 50 Hz.
pub const TICK: Duration = Duration::from_millis(20);

/// Milliseconds on the body's clock.
pub fn ms(t: u64) -> Stamp {
    Stamp(t * 1_000_000)
}

/// A small indoor base: 0.5 m/s, 1.5 rad/s, radius 0.18 m.
pub fn body() -> Capabilities {
    Capabilities {
        name: "plant".into(),
        drivable: true,
        has_scan: true,
        intrinsics: Intrinsics::from_hfov(64, 48, 1.5).unwrap(),
        t_base_camera: Transform::from_rotation(
            &Matrix3::new(0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0),
            Vector3::new(0.0, 0.0, 1.0),
        ),
        radius_m: 0.18,
        height_m: 1.2,
        linear_m_s_max: 0.5,
        angular_rad_s_max: 1.5,
    }
}

/// The defaults for [`body`].
pub fn config() -> SupervisorConfig {
    SupervisorConfig::for_body(&body()).unwrap()
}

/// The base.
pub struct Plant {
    pub pose: PlanarPose,
    pub linear_m_s: f64,
    pub angular_rad_s: f64,
    /// Time constant of the wheels, seconds; 0 obeys at once.
    pub lag_s: f64,
    /// An immovable wall across x at this place, metres.
    pub wall_x_m: f64,
    /// True once it ran into the wall.
    pub touched: bool,
}

impl Plant {
    pub fn new(lag_s: f64) -> Self {
        Self {
            pose: PlanarPose::default(),
            linear_m_s: 0.0,
            angular_rad_s: 0.0,
            lag_s,
            wall_x_m: f64::INFINITY,
            touched: false,
        }
    }

    /// Obeys an order for `dt`, in steps of a millisecond.
    pub fn drive(&mut self, order: &VelocityOrder, dt: Duration) {
        for _ in 0..dt.as_millis() {
            let h = 1e-3;
            let share = if self.lag_s > 0.0 { h / self.lag_s } else { 1.0 };
            self.linear_m_s += (order.linear_m_s - self.linear_m_s) * share;
            self.angular_rad_s += (order.angular_rad_s - self.angular_rad_s) * share;
            let x_m = self.pose.x_m + h * self.linear_m_s * self.pose.yaw_rad.cos();
            if x_m + 0.18 < self.wall_x_m {
                self.pose.x_m = x_m;
            } else {
                self.touched = true;
            }
            self.pose.y_m += h * self.linear_m_s * self.pose.yaw_rad.sin();
            self.pose.yaw_rad = homing_core::wrap_angle(self.pose.yaw_rad + h * self.angular_rad_s);
        }
    }

    pub fn odometry(&self, stamp: Stamp) -> Odometry {
        Odometry {
            stamp,
            t_odom_base: self.pose.to_transform(),
            linear_m_s: self.linear_m_s,
            angular_rad_s: self.angular_rad_s,
        }
    }

    /// 72 rays that see the wall and nothing else.
    pub fn scan(&self, stamp: Stamp) -> LaserScan {
        let increment = std::f64::consts::TAU / 72.0;
        let ray = |i: usize| {
            let angle = -std::f64::consts::PI + i as f64 * increment + self.pose.yaw_rad;
            let along = (self.wall_x_m - self.pose.x_m) / angle.cos();
            if angle.cos() > 1e-6 && along < 10.0 { along as f32 } else { f32::INFINITY }
        };
        LaserScan {
            stamp,
            angle_min_rad: -std::f64::consts::PI,
            angle_increment_rad: increment,
            range_min_m: 0.05,
            range_max_m: 10.0,
            ranges_m: (0..72).map(ray).collect(),
        }
    }
}
