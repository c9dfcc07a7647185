//! What the supervisor says: orders to the motors, and what happened.

use homing_core::{MotionResult, Stamp};

use crate::collision::Passage;

/// What the motors are to do.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct VelocityOrder {
    /// Forward, m/s.
    pub linear_m_s: f64,
    /// Left turn, rad/s.
    pub angular_rad_s: f64,
    /// From this moment on the order is void and the body stands.
    pub valid_until: Stamp,
    /// Whose command acts: session and sequence. `None` when nobody's does.
    pub commander: Option<(u64, u64)>,
    /// Why this velocity.
    pub cause: OrderCause,
}

/// Why a velocity was ordered.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum OrderCause {
    /// Nobody asks for anything.
    Idle,
    /// A command is acted on in full.
    Commanded,
    /// A bare velocity is acted on.
    Teleop,
    /// A stop was commanded.
    Stop,
    /// The stream is back after silence and not yet trusted.
    Rearming,
    /// The odometry that the motion needs is too old.
    NoOdometry,
    /// The collision monitor changed the wish.
    Guarded(Passage),
}

/// What happened, for acknowledgements, logs and people.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// A command came to its end, or was sent again after its end.
    Finished(MotionResult),
    /// A stream of velocities fell silent in motion, and the robot was stopped.
    Silenced {
        /// Whose stream.
        session: u64,
    },
    /// An operator gave the robot to another commander.
    TakenOver {
        /// The new holder.
        session: u64,
        /// The epoch its commands must carry.
        epoch: u64,
    },
}

/// What was dropped so far because it was malformed, out of order, or because nobody took it.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub struct Dropped {
    /// Odometry readings.
    pub odometry: u64,
    /// Scans.
    pub scans: u64,
    /// Events, the oldest first.
    pub events: u64,
}
