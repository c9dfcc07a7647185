//! Oracles: parts of a navigation system that know the truth, for the upper bounds of SLING's table 2. They stand behind
//! the same seams as the parts they replace. Only benchmarks link them: no node of a robot may name this crate.

mod discovery;
mod last_mile;

use std::sync::{Arc, Mutex, PoisonError};

use homing_core::PlanarPose;

pub use discovery::OracleDiscovery;
pub use last_mile::{landing, perfect};

/// Where the robot really is, world frame: written by whoever drives the simulator, read by oracles.
#[derive(Clone, Debug, Default)]
pub struct Truth(Arc<Mutex<PlanarPose>>);

impl Truth {
    /// The robot is there now.
    pub fn tell(&self, pose: PlanarPose) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = pose;
    }

    /// Where it is.
    #[must_use]
    pub fn pose(&self) -> PlanarPose {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
