//! What the planner is told in one step. The log of these events is the recording that a replay plays.

use std::sync::Arc;

use homing_core::{Base, Camera, DepthImage, GoalEstimate, Intrinsics, MotionOutcome, Odometry, Transform};

/// A change of mission.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Mission {
    /// A goal photo was given: begin a new episode. What is known of the surroundings stays known.
    Start {
        /// The photo's name; estimates that speak of another photo are ignored.
        goal_id: u64,
    },
    /// Forget the goal and stand still.
    Cancel,
}

/// Whether perception answers at all.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Perception {
    /// It runs: a missing estimate is only late.
    Present,
    /// It does not run, or hangs.
    Absent,
}

/// What the body sensed at one moment.
#[derive(Clone, Debug)]
pub struct PlannerObservation {
    /// Where the robot believes it is.
    pub odometry: Odometry,
    /// Depth along the optical axis, metres.
    pub depth: Arc<DepthImage>,
    /// The camera that took it.
    pub intrinsics: Intrinsics,
    /// Where the camera sits on the body.
    pub t_base_camera: Transform<Base, Camera>,
}

/// Everything new since the last step.
#[derive(Clone, Debug)]
pub struct StepEvent {
    /// A change of mission, if any.
    pub mission: Option<Mission>,
    /// What the body senses; without it the planner holds.
    pub observation: Option<PlannerObservation>,
    /// Perception's newest finding, possibly of an older image.
    pub estimate: Option<GoalEstimate>,
    /// What it found in images from before: a place that was seen long ago, for a photo that was given now. Oldest first.
    pub remembered: Vec<GoalEstimate>,
    /// What the last motion came to.
    pub motion: Option<MotionOutcome>,
    /// Whether perception answers.
    pub perception: Perception,
}

impl StepEvent {
    /// An event in which nothing happened.
    #[must_use]
    pub fn nothing() -> Self {
        Self {
            mission: None,
            observation: None,
            estimate: None,
            remembered: Vec::new(),
            motion: None,
            perception: Perception::Absent,
        }
    }
}
