//! What the planner decides, what the body is told, and what it really did.

use core::time::Duration;

use crate::stamp::Stamp;
use crate::transform::PlanarPose;

/// The planner's decision for one step (SLING 3.1: move forward, turn, stop).
#[derive(Copy, Clone, Debug, PartialEq, Eq, Hash)]
pub enum Action {
    /// One step straight ahead (0.25 m unless the robot says otherwise).
    Forward,
    /// One turn to the left, counter-clockwise (15 degrees unless the robot says otherwise).
    TurnLeft,
    /// One turn to the right, clockwise.
    TurnRight,
    /// The last turn to the goal's heading, finer than a whole one; left positive.
    Face {
        /// Thousandths of a radian: whole numbers, so that actions stay comparable.
        milliradians: i32,
    },
    /// Arrived: end the episode here.
    Stop,
    /// Stand still and wait: something that is needed is missing or stale.
    Hold,
}

impl Action {
    /// The motion that carries it out, with steps of `forward_m` metres and `turn_rad` radians.
    #[must_use]
    pub fn motion(self, forward_m: f64, turn_rad: f64) -> Motion {
        match self {
            Action::Forward => Motion::Forward { distance_m: forward_m },
            Action::TurnLeft => Motion::Turn { angle_rad: turn_rad },
            Action::TurnRight => Motion::Turn { angle_rad: -turn_rad },
            Action::Face { milliradians } => Motion::Turn { angle_rad: f64::from(milliradians) * 1e-3 },
            Action::Stop => Motion::Stop { done: true },
            Action::Hold => Motion::Stop { done: false },
        }
    }
}

/// One motion of the body.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Motion {
    /// Drive with these velocities until the command expires.
    Velocity {
        /// Forward, m/s.
        linear_m_s: f64,
        /// Left turn, rad/s.
        angular_rad_s: f64,
    },
    /// Drive straight for a distance, metres, negative backwards.
    Forward {
        /// Metres.
        distance_m: f64,
    },
    /// Turn in place, left positive.
    Turn {
        /// Radians.
        angle_rad: f64,
    },
    /// Stand still. `done` declares the goal reached: it ends the episode.
    Stop {
        /// True when the planner declares the goal reached.
        done: bool,
    },
}

impl Motion {
    /// True if every number is finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        match *self {
            Motion::Velocity { linear_m_s, angular_rad_s } => linear_m_s.is_finite() && angular_rad_s.is_finite(),
            Motion::Forward { distance_m } => distance_m.is_finite(),
            Motion::Turn { angle_rad } => angle_rad.is_finite(),
            Motion::Stop { .. } => true,
        }
    }
}

/// A motion with what makes it safe to send over a network: an expired, repeated or reordered one never moves the robot.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct MotionCommand {
    /// The sender's session, drawn anew at each start.
    pub session: u64,
    /// Lease epoch under which it is sent.
    pub epoch: u64,
    /// Grows by one with every command of a session.
    pub sequence: u64,
    /// Stamp of the observation it answers, on the robot's clock.
    pub stamp: Stamp,
    /// Not to be acted on later than this after `stamp`.
    pub time_to_live: Duration,
    /// What to do.
    pub motion: Motion,
}

/// What a motion came to.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct MotionOutcome {
    /// When the motion ended.
    pub stamp: Stamp,
    /// Motion really made, in the base frame before it, by odometry.
    pub moved: PlanarPose,
    /// An obstacle or the safety gate cut the motion short.
    pub blocked: bool,
}

/// The body's answer to a command.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct MotionResult {
    /// The command's session.
    pub session: u64,
    /// The command's sequence.
    pub sequence: u64,
    /// What it came to.
    pub outcome: MotionOutcome,
}
