//! Why an episode could not be run.

use homing_core::{BridgeError, IntrinsicsError};
use homing_perception::PerceptionError;
use homing_planner::ConfigError;
use homing_sim::arena::ArenaError;
use homing_sim::episode::DrawError;
use thiserror::Error;

/// A fault of the benchmark or its parts; a goal that is not reached is none.
#[derive(Debug, Error)]
pub enum RunError {
    /// The scene cannot be used.
    #[error("the scene cannot be used: {0}")]
    Arena(#[from] ArenaError),
    /// The scene offers no episode of this kind.
    #[error(transparent)]
    Draw(#[from] DrawError),
    /// The goal's camera cannot be.
    #[error("the goal camera cannot be: {0}")]
    Camera(#[from] IntrinsicsError),
    /// Perception failed.
    #[error("perception: {0}")]
    Perception(#[from] PerceptionError),
    /// The planner's knobs are impossible.
    #[error("planner settings: {0}")]
    Planner(#[from] ConfigError),
    /// The simulated body failed.
    #[error("the body: {0}")]
    Body(#[from] BridgeError),
    /// No flat offers a pair of views as asked for.
    #[error(
        "none of {flats} flats offers two views {distance_m:.2} m and {heading_deg:.0} deg apart that share enough"
    )]
    NoPair {
        /// Metres asked for.
        distance_m: f64,
        /// Degrees asked for.
        heading_deg: f64,
        /// Flats tried.
        flats: u64,
    },
    /// An image that is none.
    #[error("the camera's images: {0}")]
    Frame(String),
    /// No thread to work on.
    #[error("no worker threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}
