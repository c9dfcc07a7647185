//! The seam for goal discovery: where to look while the goal has not been seen (SLING 3.2).

use crate::action::{Action, MotionOutcome};
use crate::grid::OccupancyGrid;
use crate::transform::PlanarPose;

/// What a policy is told before each of its decisions.
#[derive(Copy, Clone, Debug)]
pub struct DiscoveryView<'a> {
    /// Steps taken so far in the episode.
    pub step: u64,
    /// Pose of the base in the odometry frame.
    pub pose: PlanarPose,
    /// The map so far, obstacles not inflated.
    pub map: &'a OccupancyGrid,
    /// Travel distance from the robot to every cell of `map` over traversable cells, metres; infinite where unreachable.
    pub travel_m: &'a [f32],
    /// Result of the last motion, if there was one.
    pub last_motion: Option<&'a MotionOutcome>,
    /// Directions in which the goal was faintly seen: (x, y) of where from, bearing in the odometry frame (rad), weight.
    pub hints: &'a [BearingHint],
}

/// A faint sighting: the goal lies somewhere along a ray.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct BearingHint {
    /// Where it was seen from, odometry frame, metres.
    pub x_m: f64,
    /// Where it was seen from, odometry frame, metres.
    pub y_m: f64,
    /// Direction in the odometry frame, radians.
    pub bearing_rad: f64,
    /// Larger is surer.
    pub weight: f64,
}

/// What a policy asks for.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Directive {
    /// Take this action.
    Act(Action),
    /// Plan a path to this point of the odometry frame, metres.
    GoTo {
        /// Metres.
        x_m: f64,
        /// Metres.
        y_m: f64,
    },
    /// Nothing is left to explore.
    Exhausted,
}

/// A goal-discovery policy: told what happened, asked where to go next. No clock, no global randomness.
pub trait GoalDiscovery: Send {
    /// Name for configuration and reports.
    fn name(&self) -> &'static str;
    /// Forget everything: a new episode begins.
    fn reset(&mut self);
    /// Where to go next.
    fn next(&mut self, view: &DiscoveryView<'_>) -> Directive;
    /// Places under consideration, odometry frame (x, y), metres, best first: for people to look at.
    fn candidates_m(&self) -> Vec<(f64, f64)> {
        Vec::new()
    }
}
