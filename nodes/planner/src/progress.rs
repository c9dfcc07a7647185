//! Is the body where its commands should have brought it: blocked forwards, being stuck, odometry that jumps.

use core::time::Duration;

use homing_core::{Action, MotionOutcome, Odometry, PlanarPose, wrap_angle};

use crate::config::BodyConfig;

/// Longer than any step between two observations of a lockstep run, metres.
const JUMP_MARGIN_M: f64 = 0.6;
const JUMP_MARGIN_RAD: f64 = 1.2;

/// Watches what became of the commands.
#[derive(Clone, Debug, Default)]
pub struct Progress {
    /// Forwards in a row that were blocked.
    pub n_blocked: u32,
    /// Turns still to make to get away from where the body is stuck.
    escape_turns: u32,
    n_escapes: u32,
    least_cost_m: f32,
    n_stalled: u32,
}

impl Progress {
    /// Begins anew.
    pub fn reset(&mut self) {
        *self = Self::default();
    }

    /// True if the last motion was a forward that did not come through (SLING: it moved less than 0.10 m).
    pub fn was_blocked(&mut self, commanded: Action, outcome: &MotionOutcome, body: &BodyConfig) -> bool {
        if commanded != Action::Forward || !outcome.moved.x_m.is_finite() {
            return false;
        }
        let share = outcome.moved.x_m / body.forward_m;
        let blocked = share < 0.4 || (outcome.blocked && share < 0.8);
        self.n_blocked = if blocked { self.n_blocked + 1 } else { 0 };
        if !blocked {
            self.n_escapes = 0;
        }
        blocked
    }

    /// Width of the obstacle to mark for the last blocked forward, metres: wider the longer it goes on (at most 9 cells).
    pub fn bump_width_m(&self, resolution_m: f64) -> f64 {
        let cells = (1 + 2 * self.n_blocked.saturating_sub(1)).min(9);
        f64::from(cells) * resolution_m
    }

    /// No forward led anywhere: turn away for a while, alternately left and right.
    pub fn begin_escape(&mut self, body: &BodyConfig) {
        self.n_escapes += 1;
        self.escape_turns = ((core::f64::consts::FRAC_PI_2 / body.turn_rad).ceil() as u32).clamp(1, 24);
    }

    /// True while turning away.
    pub fn is_escaping(&self) -> bool {
        self.escape_turns > 0
    }

    /// Turned away several times without one forward coming through in between.
    pub fn is_trapped(&self) -> bool {
        self.n_escapes >= 3
    }

    /// The next turn of an escape.
    pub fn escape(&mut self) -> Action {
        self.escape_turns = self.escape_turns.saturating_sub(1);
        if self.n_escapes % 2 == 1 { Action::TurnLeft } else { Action::TurnRight }
    }

    /// Watches the way left to a goal. Returns true once it has not become shorter for `steps_max` steps.
    pub fn is_stalled(&mut self, cost_m: f32, steps_max: u32) -> bool {
        if cost_m < self.least_cost_m - 0.1 {
            self.least_cost_m = cost_m;
            self.n_stalled = 0;
        } else {
            self.n_stalled += 1;
        }
        self.n_stalled > steps_max
    }

    /// A new approach to a goal begins.
    pub fn begin_approach(&mut self) {
        self.least_cost_m = f32::INFINITY;
        self.n_stalled = 0;
    }
}

/// Odometry that is at its origin after a gap in which the body was not heard began anew there.
const ORIGIN_M: f64 = 0.02;
const ORIGIN_RAD: f64 = 0.02;
const ORIGIN_GAP: Duration = Duration::from_secs(2);

/// True if the body cannot have come from one reading to the next: it was carried, or its odometry restarted.
pub fn jumped(from: &Odometry, to: &Odometry, body: &BodyConfig) -> bool {
    let seconds = to.stamp.since(from.stamp).as_secs_f64();
    let (a, b): (PlanarPose, PlanarPose) = (from.t_odom_base.planar(), to.t_odom_base.planar());
    let begins_at_origin = b.distance_to(0.0, 0.0) < ORIGIN_M && b.yaw_rad.abs() < ORIGIN_RAD;
    begins_at_origin && a.distance_to(0.0, 0.0) > JUMP_MARGIN_M && to.stamp.since(from.stamp) > ORIGIN_GAP
        || a.distance_to(b.x_m, b.y_m) > body.linear_m_s_max * seconds + JUMP_MARGIN_M
        || wrap_angle(b.yaw_rad - a.yaw_rad).abs() > body.angular_rad_s_max * seconds + JUMP_MARGIN_RAD
}
