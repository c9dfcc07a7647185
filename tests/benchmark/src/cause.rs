//! Why an episode failed, judged from what really was.

use homing_core::{
    Base, Camera, GoalEstimate, Mode, Motion, NavigationState, Odom, PlanarPose, Sighting, Transform, wrap_angle,
};
use homing_sim::arena::Arena;
use homing_sim::episode::{Episode, in_sight};
use serde::{Deserialize, Serialize};

/// What a step has to do with the truth.
#[derive(Copy, Clone, Debug)]
pub struct Moment<'a> {
    /// Where the robot believes it is.
    pub t_odom_base: Transform<Odom, Base>,
    /// Where the camera sits on the body.
    pub t_base_camera: Transform<Base, Camera>,
    /// What perception said.
    pub estimate: &'a GoalEstimate,
    /// What the planner decided and why.
    pub state: &'a NavigationState,
    /// The motion sent to the body; a stop at the end.
    pub motion: Motion,
    /// Where the robot really is, world frame. Ground truth.
    pub pose_truth: PlanarPose,
    /// Where the photo was really taken, odometry frame. Ground truth.
    pub goal_odom_truth: PlanarPose,
}

/// The goal is in view from within this distance, metres, ...
pub const VIEW_M: f64 = 5.0;
/// ... looking the photo's way to within this, radians.
pub const VIEW_RAD: f64 = 50.0 / 180.0 * core::f64::consts::PI;
/// A sighting is right if its goal lies within this of the true one, metres, ...
pub const RIGHT_M: f64 = 1.0;
/// ... and its heading within this, radians.
pub const RIGHT_RAD: f64 = 30.0 / 180.0 * core::f64::consts::PI;
/// A goal that is found with fewer steps left than this was found too late.
const LATE_STEPS: u64 = 60;

/// What lost an episode.
#[derive(Copy, Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Cause {
    /// Discovery never brought the goal into view.
    NeverInView,
    /// The goal was in view, and perception never found it.
    NotMatched,
    /// Perception named only wrong places while the goal was in view.
    BadPose,
    /// The goal was found, and the robot did not get there or turned away.
    Stuck,
    /// It stopped at the wrong place.
    WrongStop,
    /// The goal was found when next to no steps were left.
    Budget,
}

impl Cause {
    /// For tables.
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            Cause::NeverInView => "goal never in view",
            Cause::NotMatched => "in view, not matched",
            Cause::BadPose => "in view, wrong pose",
            Cause::Stuck => "found, not reached",
            Cause::WrongStop => "stopped at the wrong place",
            Cause::Budget => "found too late",
        }
    }
}

/// What really happened in an episode, counted step by step. Ground truth throughout.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Watch {
    /// Steps watched.
    pub n_steps: u64,
    /// Steps with the goal in view: within [`VIEW_M`], in line of sight, looking its way to within [`VIEW_RAD`].
    pub n_in_view: u64,
    /// Of these, steps with a right pose.
    pub n_matched: u64,
    /// Steps with a right pose, in view or not.
    pub n_right: u64,
    /// Steps with a wrong pose.
    pub n_wrong: u64,
    /// Of these, with the goal in view.
    pub n_wrong_in_view: u64,
    /// First step with the goal in view.
    pub first_in_view: Option<u64>,
    /// First step with a right pose.
    pub first_right: Option<u64>,
    /// Steps spent driving to a goal that is not there.
    pub n_misled: u64,
    /// Turns in place.
    pub n_turns: u64,
}

impl Watch {
    /// Takes in one step.
    pub fn see(&mut self, arena: &Arena, episode: &Episode, record: &Moment<'_>) {
        self.n_steps += 1;
        let view = is_in_view(arena, episode, record.pose_truth);
        if view {
            self.n_in_view += 1;
            self.first_in_view.get_or_insert(self.n_steps);
        }
        match right_pose(record) {
            Some(true) => {
                self.n_right += 1;
                self.n_matched += u64::from(view);
                self.first_right.get_or_insert(self.n_steps);
            }
            Some(false) => {
                self.n_wrong += 1;
                self.n_wrong_in_view += u64::from(view);
            }
            None => {}
        }
        if matches!(record.state.mode, Mode::Exploit | Mode::Align) {
            let misled = record.state.goal.as_ref().is_some_and(|g| !agrees(&g.pose, &record.goal_odom_truth));
            self.n_misled += u64::from(misled);
        }
        self.n_turns += u64::from(matches!(record.motion, Motion::Turn { .. }));
    }

    /// Why an episode failed that ended in `mode`.
    #[must_use]
    pub fn cause(&self, mode: Mode) -> Cause {
        if mode == Mode::Arrived {
            return Cause::WrongStop;
        }
        match (self.first_in_view, self.first_right) {
            (_, Some(found)) if self.n_steps - found < LATE_STEPS => Cause::Budget,
            (_, Some(_)) => Cause::Stuck,
            (None, None) => Cause::NeverInView,
            (Some(_), None) if self.n_wrong_in_view > 0 => Cause::BadPose,
            (Some(_), None) => Cause::NotMatched,
        }
    }
}

/// True if a robot at `pose` (world frame) could be expected to recognise the photo's view.
#[must_use]
pub fn is_in_view(arena: &Arena, episode: &Episode, pose: PlanarPose) -> bool {
    let goal = (episode.goal.x_m, episode.goal.y_m);
    pose.distance_to(goal.0, goal.1) <= VIEW_M
        && wrap_angle(pose.yaw_rad - episode.goal.yaw_rad).abs() <= VIEW_RAD
        && in_sight(arena, (pose.x_m, pose.y_m), goal)
}

/// Whether the pose that perception named is right; `None` if it named none.
#[must_use]
pub fn right_pose(record: &Moment<'_>) -> Option<bool> {
    sighted_pose(record).map(|pose| agrees(&pose, &record.goal_odom_truth))
}

/// The goal that perception named, as a pose of the base in the odometry frame.
#[must_use]
pub fn sighted_pose(record: &Moment<'_>) -> Option<PlanarPose> {
    let Sighting::Pose { t_camera_goal, .. } = &record.estimate.sighting else { return None };
    let goal = record.t_odom_base.isometry()
        * record.t_base_camera.isometry()
        * t_camera_goal.isometry()
        * record.t_base_camera.inverse().isometry();
    Some(Transform::<Odom, Base>::new(goal).planar())
}

fn agrees(pose: &PlanarPose, truth: &PlanarPose) -> bool {
    truth.distance_to(pose.x_m, pose.y_m) <= RIGHT_M && wrap_angle(pose.yaw_rad - truth.yaw_rad).abs() <= RIGHT_RAD
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_thing_that_went_wrong_is_the_cause() {
        let watch = |view, right, wrong_in_view| Watch {
            n_steps: 500,
            first_in_view: view,
            first_right: right,
            n_wrong_in_view: wrong_in_view,
            ..Watch::default()
        };
        assert_eq!(watch(None, None, 0).cause(Mode::Failed), Cause::NeverInView);
        assert_eq!(watch(Some(3), None, 0).cause(Mode::Failed), Cause::NotMatched);
        assert_eq!(watch(Some(3), None, 2).cause(Mode::Failed), Cause::BadPose);
        assert_eq!(watch(Some(3), Some(9), 2).cause(Mode::Failed), Cause::Stuck);
        assert_eq!(watch(Some(3), Some(480), 0).cause(Mode::Failed), Cause::Budget);
        assert_eq!(watch(None, None, 0).cause(Mode::Arrived), Cause::WrongStop);
    }
}
