//! Why an episode could not be run.

use homing_core::{BridgeError, FrameSizeError, IntrinsicsError};
use homing_perception::PerceptionError;
use homing_planner::ConfigError;
use homing_sim::arena::ArenaError;
use homing_sim::episode::DrawError;
use homing_sim::geodesic::GoalBlocked;
use homing_sim::views::ViewsError;
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
    /// A flat gave no views.
    #[error("views of a flat: {0}")]
    Views(#[from] ViewsError),
    /// Colour and depth do not belong together.
    #[error(transparent)]
    Frame(#[from] FrameSizeError),
    /// The goal is in no place that the robot can reach.
    #[error("the goal cannot be reached: {0}")]
    Goal(#[from] GoalBlocked),
    /// The processes that an episode was to run through failed.
    #[error("through processes: {0}")]
    Processes(Box<dyn core::error::Error + Send + Sync>),
    /// Recorded frames cannot be read.
    #[error("recorded frames: {0}")]
    Recording(Box<dyn core::error::Error + Send + Sync>),
    /// A picture whose size does not fit its data.
    #[error("a picture: {0}")]
    Image(#[source] homing_core::ImageError),
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
    /// No thread to work on.
    #[error("no worker threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}
