//! The action `navigate_to_image`: drive to where a photo was taken.
//!
//! The server stands on plain services, because a pending result request must not hold up a cancellation. A new goal
//! takes the place of the one under way: the newest wish of the operator counts.

mod client;
mod server;

use std::time::Duration;

use hiroz::action::GoalId;
use homing_core::Mode;
use thiserror::Error;

pub use self::client::{NavigateClient, NavigateGoal};
pub use self::server::NavigateServer;
use crate::convert::EncodedPhoto;

/// Name below the robot's namespace.
pub const ACTION: &str = "navigate_to_image";

/// Which of the operator's wishes is meant: a goal may end while the next one is already on its way.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct MissionId(GoalId);

/// What the planner is asked.
#[derive(Clone, Debug, PartialEq)]
pub enum Mission {
    /// Drive to this photo.
    Start(MissionId, EncodedPhoto),
    /// Leave it.
    Cancel(MissionId),
}

/// How a mission ended, in the planner's own judgement.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The planner declares the goal reached.
    Arrived,
    /// It gave up.
    Failed,
    /// It was told to.
    Cancelled,
}

/// The end of a mission.
#[derive(Clone, Debug, PartialEq)]
pub struct MissionReport {
    /// How it ended.
    pub outcome: Outcome,
    /// Steps taken.
    pub steps: u64,
    /// Way driven by odometry, metres.
    pub path_length_m: f64,
    /// One line for people.
    pub message: String,
}

/// Where a mission stands.
#[derive(Clone, Debug, PartialEq)]
pub struct Progress {
    /// Steps taken.
    pub step: u64,
    /// Phase, as [`Mode`]'s place in homing_msgs/NavigationState.
    pub mode: Mode,
    /// Straight-line distance to the goal estimate, metres.
    pub goal_distance_m: Option<f64>,
    /// One line for people.
    pub reason: String,
}

/// Why an action endpoint failed.
#[derive(Debug, Error)]
pub enum NavigateError {
    /// hiroz or zenoh refused.
    #[error("action {ACTION}: {0}")]
    Transport(String),
    /// Nobody plans.
    #[error("no planner answers on {ACTION} within {0:?}: start one first")]
    NoPlanner(Duration),
    /// The planner does not want the photo.
    #[error("the planner refused the photo")]
    Refused,
}

fn transport(cause: impl std::fmt::Display) -> NavigateError {
    NavigateError::Transport(cause.to_string())
}
