//! The seam between the system and a body, real, recorded or simulated.

use thiserror::Error;

use crate::action::{Motion, MotionOutcome};
use crate::camera::Intrinsics;
use crate::frames::{Base, Camera};
use crate::observation::Observation;
use crate::transform::Transform;

/// What a body can do, known before starting.
#[derive(Clone, Debug, PartialEq)]
pub struct Capabilities {
    /// Name for reports.
    pub name: String,
    /// False for a recording: it shows, it does not move.
    pub drivable: bool,
    /// True if it has a laser scanner.
    pub has_scan: bool,
    /// Its camera.
    pub intrinsics: Intrinsics,
    /// Where the camera sits on the body.
    pub t_base_camera: Transform<Base, Camera>,
    /// Radius of the circle that holds the body's footprint, metres.
    pub radius_m: f64,
    /// Height of the body, metres.
    pub height_m: f64,
    /// Fastest forward speed, m/s.
    pub linear_m_s_max: f64,
    /// Fastest turn, rad/s.
    pub angular_rad_s_max: f64,
}

/// Why a body did not do as asked.
#[derive(Debug, Error)]
pub enum BridgeError {
    /// A recording cannot be driven.
    #[error("{name} cannot be driven: it is a recording")]
    NotDrivable {
        /// The body's name.
        name: String,
    },
    /// A recording is over.
    #[error("{name} has no more frames")]
    Exhausted {
        /// The body's name.
        name: String,
    },
    /// A command that is not a motion (NaN, infinite).
    #[error("refused: {motion:?} is not a finite motion")]
    NotFinite {
        /// What was asked.
        motion: Motion,
    },
    /// A sensor or actuator failed.
    #[error("{name}: {what}")]
    Device {
        /// The body's name.
        name: String,
        /// What failed.
        what: String,
    },
}

/// A body. One conformance suite runs over every implementation.
pub trait RobotBridge: Send {
    /// What it can do.
    fn capabilities(&self) -> &Capabilities;
    /// What it sees now.
    ///
    /// # Errors
    /// [`BridgeError`] when a sensor fails or a recording is over.
    fn observe(&mut self) -> Result<Observation, BridgeError>;
    /// Moves, and says what was really done after limits and obstacles.
    ///
    /// # Errors
    /// [`BridgeError`] when the body cannot be driven or the motion is not finite.
    fn apply(&mut self, motion: Motion) -> Result<MotionOutcome, BridgeError>;
    /// Stands still. Cannot fail.
    fn stop(&mut self);
}

/// A body that can be put back to the start: simulators only.
pub trait Resettable {
    /// What an episode is described by.
    type Episode;
    /// Puts the body at the episode's start; odometry begins at identity again.
    ///
    /// # Errors
    /// [`BridgeError`] when the episode does not fit the scene.
    fn reset(&mut self, episode: &Self::Episode) -> Result<(), BridgeError>;
}
