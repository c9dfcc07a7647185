//! One episode in lockstep: what the nodes do over the network, in one process.

use std::sync::Arc;
use std::time::{Duration, Instant};

use homing_core::{
    Action, Base, Camera, GoalEstimate, GoalPhoto, Mode, Motion, MotionOutcome, NavigationState, Observation,
    OccupancyGrid, PlanarPose, Resettable, RobotBridge, Transform,
};
use homing_perception::AnyEstimator;
use homing_planner::{Mission, Perception, Planner, PlannerObservation, StepEvent};
use homing_sim::arena::Arena;
use homing_sim::episode::{Episode, in_odom};
use homing_sim::oracle::{landing, perfect};
use homing_sim::score::Finish;
use homing_sim::simulator::Simulator;
use serde::{Deserialize, Serialize};

use crate::cause::Moment;
use crate::{GoalPose, LastMile, RunError, Trial};

/// Names the goal photo of every episode.
const GOAL_ID: u64 = 1;

/// One step, for recorders and monitors.
#[derive(Copy, Clone, Debug)]
pub struct StepRecord<'a> {
    /// What the robot saw.
    pub observation: &'a Observation,
    /// What perception said to it.
    pub estimate: &'a GoalEstimate,
    /// What the planner decided and why.
    pub state: &'a NavigationState,
    /// The planner's map.
    pub map: &'a OccupancyGrid,
    /// The decision.
    pub action: Action,
    /// The motion sent to the body; [`Motion::Stop`] at the end.
    pub motion: Motion,
    /// Where the camera sits on the body.
    pub t_base_camera: Transform<Base, Camera>,
    /// Where the robot really is, world frame. Ground truth.
    pub pose_truth: PlanarPose,
    /// Where the photo was really taken, odometry frame. Ground truth.
    pub goal_odom_truth: PlanarPose,
}

impl StepRecord<'_> {
    /// What the step has to do with the truth.
    #[must_use]
    pub fn moment(&self) -> Moment<'_> {
        Moment {
            t_odom_base: self.observation.odometry.t_odom_base,
            t_base_camera: self.t_base_camera,
            estimate: self.estimate,
            state: self.state,
            motion: self.motion,
            pose_truth: self.pose_truth,
            goal_odom_truth: self.goal_odom_truth,
        }
    }
}

/// Time spent, summed over the steps of an episode. Read for reporting alone: no decision depends on it.
#[derive(Copy, Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StageSeconds {
    /// Rendering colour, depth and scan.
    pub observe: f64,
    /// Keypoints and descriptors.
    pub extract: f64,
    /// Matching.
    pub matching: f64,
    /// Lifting, pose, covariance.
    pub pose: f64,
    /// The planner's step.
    pub plan: f64,
}

/// An episode that is over.
#[derive(Clone, Debug, PartialEq)]
pub struct EpisodeRun {
    /// How it ended, for the scorers.
    pub finish: Finish,
    /// The planner's last mode.
    pub mode: Mode,
    /// The planner's last words.
    pub reason: String,
    /// Heading of the goal's place from the robot when it first drove to a goal, radians, left positive: believed, and true.
    pub first_heading_rad: Option<(f64, f64)>,
    /// Where the time went.
    pub times: StageSeconds,
}

/// Runs one episode to its end: the goal is declared reached, given up, or the planner's step budget is spent.
///
/// Each step waits for everything that belongs to it, perception's answer included, as the nodes do in lockstep.
/// `observer` is called once a step, after the decision and before the motion. `estimator` is given the goal's photo.
///
/// # Errors
/// [`RunError`] when a part cannot be set up or fails.
pub fn run_episode(
    arena: &Arc<Arena>,
    episode: &Episode,
    estimator: &mut AnyEstimator,
    trial: &Trial,
    observer: &mut dyn FnMut(&StepRecord<'_>),
) -> Result<EpisodeRun, RunError> {
    let mut lockstep = Lockstep::new(arena, episode, estimator, trial)?;
    while !lockstep.step(observer)? {}
    Ok(lockstep.finish())
}

/// Body, perception and planner between two steps.
struct Lockstep<'a> {
    robot: Simulator,
    estimator: &'a mut AnyEstimator,
    planner: Planner,
    trial: &'a Trial,
    arena: &'a Arc<Arena>,
    episode: &'a Episode,
    goal_odom_truth: PlanarPose,
    mission: Option<Mission>,
    motion: Option<MotionOutcome>,
    steps_left: u64,
    last_mile_steps: u64,
    first_heading_rad: Option<(f64, f64)>,
    times: StageSeconds,
}

impl<'a> Lockstep<'a> {
    fn new(
        arena: &'a Arc<Arena>,
        episode: &'a Episode,
        estimator: &'a mut AnyEstimator,
        trial: &'a Trial,
    ) -> Result<Self, RunError> {
        let mut robot = Simulator::new(Arc::clone(arena), trial.sim)?;
        robot.reset(episode)?;
        let rgb = Arc::new(episode.camera.photo(arena, episode.goal)?);
        estimator.set_goal(GoalPhoto { id: GOAL_ID, rgb, intrinsics: episode.camera.intrinsics()? })?;
        Ok(Self {
            planner: Planner::new(trial.planner.clone(), trial.policy.build(arena, episode)?)?,
            goal_odom_truth: in_odom(arena, episode.start, episode.goal.into()),
            mission: Some(Mission::Start { goal_id: GOAL_ID }),
            motion: None,
            steps_left: trial.planner.step_budget,
            last_mile_steps: 0,
            first_heading_rad: None,
            times: StageSeconds::default(),
            robot,
            estimator,
            trial,
            arena,
            episode,
        })
    }

    /// observe, estimate, decide, move. Returns true once the episode is over.
    fn step(&mut self, observer: &mut dyn FnMut(&StepRecord<'_>)) -> Result<bool, RunError> {
        let start = Instant::now();
        let observation = self.robot.observe()?;
        let observed = Instant::now();
        let estimate = self.estimate(&observation)?;
        let event = self.event(&observation, &estimate);
        let asked = Instant::now();
        let action = self.planner.step(observation.odometry.stamp, &event);
        self.count_time(observed - start, &estimate, asked.elapsed());
        self.steps_left = self.steps_left.saturating_sub(1);

        self.note_last_mile();
        let landed = self.teleport();
        let over = landed || ended(self.planner.state().mode, action) || self.steps_left == 0;
        let motion = if landed { Motion::Stop { done: true } } else { self.motion_of(action, over) };
        observer(&StepRecord {
            observation: &observation,
            estimate: &estimate,
            state: self.planner.state(),
            map: self.planner.map(),
            action,
            motion,
            t_base_camera: self.robot.capabilities().t_base_camera,
            pose_truth: self.robot.pose_truth(),
            goal_odom_truth: self.goal_odom_truth,
        });
        self.motion = Some(self.robot.apply(motion)?);
        Ok(over)
    }

    /// Perception's answer, or the truth where an oracle stands in for it.
    fn estimate(&mut self, observation: &Observation) -> Result<GoalEstimate, RunError> {
        let estimate = self.estimator.estimate(&observation.frame)?;
        Ok(match self.trial.goal_pose {
            GoalPose::Estimated => estimate,
            GoalPose::Oracle => perfect(
                estimate,
                self.episode,
                &observation.odometry.t_odom_base.planar(),
                &self.robot.capabilities().t_base_camera,
            ),
        })
    }

    fn note_last_mile(&mut self) {
        let state = self.planner.state();
        if matches!(state.mode, Mode::Exploit | Mode::Align) {
            self.last_mile_steps += 1;
            let headings = || headings(state, &self.robot.pose_truth(), self.episode);
            self.first_heading_rad = self.first_heading_rad.or_else(headings);
        }
    }

    /// Oracle-LP: as soon as the planner drives to a goal, the robot is where it believes it to be.
    fn teleport(&mut self) -> bool {
        let state = self.planner.state();
        if self.trial.last_mile == LastMile::Driven || state.mode != Mode::Exploit {
            return false;
        }
        let Some(goal) = &state.goal else { return false };
        let t_odom_goal: Transform<_, Base> = goal.pose.to_transform();
        let (from, t_world_odom) = (self.robot.pose_truth(), self.robot.t_world_odom_truth());
        match landing(self.arena, from, (t_world_odom * t_odom_goal).planar()) {
            Some((there, way_m)) => self.robot.teleport(there, way_m),
            None => return false,
        }
        true
    }

    fn event(&mut self, observation: &Observation, estimate: &GoalEstimate) -> StepEvent {
        StepEvent {
            mission: self.mission.take(),
            observation: Some(PlannerObservation {
                odometry: observation.odometry,
                depth: Arc::clone(&observation.frame.depth),
                intrinsics: observation.frame.intrinsics,
                t_base_camera: self.robot.capabilities().t_base_camera,
            }),
            estimate: Some(estimate.clone()),
            remembered: Vec::new(),
            motion: self.motion.take(),
            perception: Perception::Present,
        }
    }

    /// Only a goal that is believed reached is declared; a planner that gave up just stands.
    fn motion_of(&self, action: Action, over: bool) -> Motion {
        if over {
            return Motion::Stop { done: self.planner.state().mode == Mode::Arrived };
        }
        action.motion(self.trial.planner.body.forward_m, self.trial.planner.body.turn_rad)
    }

    fn count_time(&mut self, observe: Duration, estimate: &GoalEstimate, plan: Duration) {
        self.times.observe += observe.as_secs_f64();
        self.times.extract += estimate.times.extract.as_secs_f64();
        self.times.matching += estimate.times.matching.as_secs_f64();
        self.times.pose += estimate.times.pose.as_secs_f64();
        self.times.plan += plan.as_secs_f64();
    }

    fn finish(self) -> EpisodeRun {
        let state = self.planner.state();
        EpisodeRun {
            finish: Finish::new(self.arena, self.episode, &self.robot.ending_truth(self.last_mile_steps)),
            mode: state.mode,
            reason: state.reason.clone(),
            first_heading_rad: self.first_heading_rad,
            times: self.times,
        }
    }
}

/// Heading of the goal's place from the robot, radians, left positive: as the planner believes, and in truth. `None` while
/// it believes in no goal.
#[must_use]
pub fn headings(state: &NavigationState, pose_truth: &PlanarPose, episode: &Episode) -> Option<(f64, f64)> {
    let believed = state.goal.as_ref()?.pose;
    let bearing_rad = state.pose.bearing_to(believed.x_m, believed.y_m);
    Some((bearing_rad, pose_truth.bearing_to(episode.goal.x_m, episode.goal.y_m)))
}

fn ended(mode: Mode, action: Action) -> bool {
    matches!(mode, Mode::Arrived | Mode::Failed) || action == Action::Stop
}
