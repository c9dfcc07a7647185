//! What the planner is doing and why: for people, recordings and scorers. Nothing in the control loop reads it back.

use nalgebra::Matrix3;

use crate::action::Action;
use crate::stamp::Stamp;
use crate::transform::PlanarPose;

/// The phase of the episode (SLING fig. 1).
#[derive(Copy, Clone, Debug, PartialEq, Eq, Hash)]
pub enum Mode {
    /// No goal has been given.
    Idle,
    /// Goal discovery: the goal has not been seen, or was lost.
    Explore,
    /// Last-mile navigation towards the goal estimate.
    Exploit,
    /// At the goal's position, turning to its heading.
    Align,
    /// The goal is declared reached.
    Arrived,
    /// Given up: nothing is left to explore, or the step budget is spent.
    Failed,
}

/// Where the planner believes the goal is.
#[derive(Clone, Debug, PartialEq)]
pub struct GoalHypothesis {
    /// Position and heading of the base at the goal, odometry frame.
    pub pose: PlanarPose,
    /// Covariance of (x, y, yaw), m and rad.
    pub covariance: Matrix3<f64>,
    /// Estimates fused into it.
    pub n_fused: usize,
    /// Stamp of the newest of them.
    pub last_seen: Stamp,
}

/// The planner's state after one step.
#[derive(Clone, Debug, PartialEq)]
pub struct NavigationState {
    /// Stamp of the observation the step answered.
    pub stamp: Stamp,
    /// Steps since the goal was given.
    pub step: u64,
    /// Phase.
    pub mode: Mode,
    /// The action chosen.
    pub action: Action,
    /// Pose of the base, odometry frame.
    pub pose: PlanarPose,
    /// The goal, if it is believed to be known.
    pub goal: Option<GoalHypothesis>,
    /// Where the planner is driving right now, odometry frame, metres.
    pub target_m: Option<(f64, f64)>,
    /// Planned path to it, odometry frame, metres.
    pub path_m: Vec<(f64, f64)>,
    /// Frontier centres under consideration, odometry frame, metres.
    pub frontiers_m: Vec<(f64, f64)>,
    /// One line for people: why this action.
    pub reason: String,
}
