//! A disc that drives and turns: what becomes of a motion when things are in the way.

use homing_core::{PlanarPose, wrap_angle};
use serde::{Deserialize, Serialize};

use crate::nav_grid::{CELL_M, NavGrid};

/// Motions are checked this often along the way, metres: half a cell, so that no obstacle is stepped over.
const SWEEP_M: f64 = 0.5 * CELL_M;
/// Velocities are integrated in steps of this, seconds.
pub const TICK_S: f64 = 0.01;

/// What happens when the robot touches something.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Sliding {
    /// It stops there, as a real one does.
    #[default]
    Off,
    /// It slides along, as Habitat's agents may.
    On,
}

/// How far a motion came.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Travel {
    /// Length of the way made, metres.
    pub path_m: f64,
    /// Something was in the way.
    pub blocked: bool,
}

/// A disc on the floor.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Body {
    /// Where it is, world frame.
    pub pose: PlanarPose,
    /// Its radius, metres.
    pub radius_m: f64,
    /// What it does at an obstacle.
    pub sliding: Sliding,
}

impl Body {
    /// Drives straight, metres, negative backwards.
    pub fn advance(&mut self, grid: &NavGrid, distance_m: f64) -> Travel {
        let (cos, sin) = (libm::cos(self.pose.yaw_rad), libm::sin(self.pose.yaw_rad));
        self.shift(grid, distance_m * cos, distance_m * sin)
    }

    /// Goes straight to a pose given in its own frame, then turns to its heading: a motion with slip.
    pub fn displace(&mut self, grid: &NavGrid, by: &PlanarPose) -> Travel {
        let (cos, sin) = (libm::cos(self.pose.yaw_rad), libm::sin(self.pose.yaw_rad));
        let travel = self.shift(grid, by.x_m * cos - by.y_m * sin, by.x_m * sin + by.y_m * cos);
        self.turn(by.yaw_rad);
        travel
    }

    /// Turns in place, radians, left positive. A disc always can.
    pub fn turn(&mut self, angle_rad: f64) {
        self.pose.yaw_rad = wrap_angle(self.pose.yaw_rad + angle_rad);
    }

    /// Drives an arc for a while: forward speed in m/s, turning speed in rad/s, duration in seconds.
    pub fn drive(&mut self, grid: &NavGrid, linear_m_s: f64, angular_rad_s: f64, duration_s: f64) -> Travel {
        let n = (duration_s / TICK_S).ceil().max(1.0);
        let tick_s = duration_s / n;
        let mut travel = Travel { path_m: 0.0, blocked: false };
        for _ in 0..n as u64 {
            // Half the turn, the way, the other half: second-order accurate on an arc.
            self.turn(0.5 * angular_rad_s * tick_s);
            let step = self.advance(grid, linear_m_s * tick_s);
            self.turn(0.5 * angular_rad_s * tick_s);
            travel = Travel { path_m: travel.path_m + step.path_m, blocked: travel.blocked || step.blocked };
        }
        travel
    }

    fn shift(&mut self, grid: &NavGrid, dx_m: f64, dy_m: f64) -> Travel {
        let n = (libm::hypot(dx_m, dy_m) / SWEEP_M).ceil().max(1.0);
        let (dx, dy) = (dx_m / n, dy_m / n);
        let mut travel = Travel { path_m: 0.0, blocked: false };
        for _ in 0..n as u64 {
            let share = self.try_shift(grid, dx, dy);
            travel.path_m += share * libm::hypot(dx, dy);
            if share == 1.0 {
                continue;
            }
            travel.blocked = true;
            if self.sliding == Sliding::Off {
                break;
            }
            let rest = 1.0 - share;
            travel.path_m += self.try_shift(grid, rest * dx, 0.0) * (rest * dx).abs();
            travel.path_m += self.try_shift(grid, 0.0, rest * dy) * (rest * dy).abs();
        }
        travel
    }

    /// Moves as far as nothing is touched and says which share of the way that was.
    fn try_shift(&mut self, grid: &NavGrid, dx: f64, dy: f64) -> f64 {
        let (x, y) = (self.pose.x_m, self.pose.y_m);
        let is_free = |share: f64| grid.disc_is_free(x + share * dx, y + share * dy, self.radius_m);
        if is_free(1.0) {
            (self.pose.x_m, self.pose.y_m) = (x + dx, y + dy);
            return 1.0;
        }
        let (mut free, mut blocked) = (0.0, 1.0);
        for _ in 0..8 {
            let middle = 0.5 * (free + blocked);
            if is_free(middle) { free = middle } else { blocked = middle }
        }
        (self.pose.x_m, self.pose.y_m) = (x + free * dx, y + free * dy);
        free
    }
}
