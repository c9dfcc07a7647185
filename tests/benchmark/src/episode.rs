//! One episode in lockstep: what the nodes do over the network, in one process.

use std::sync::Arc;
use std::time::{Duration, Instant};

use homing_core::{
    Action, Base, Camera, GoalDiscovery, GoalEstimate, GoalPhoto, Mode, Motion, MotionOutcome, NavigationState,
    Observation, OccupancyGrid, PlanarPose, Resettable, RobotBridge, Transform,
};
use homing_perception::AnyEstimator;
use homing_planner::{Mission, Perception, Planner, PlannerConfig, PlannerObservation, StepEvent};
use homing_sim::arena::Arena;
use homing_sim::episode::{Episode, t_world_base};
use homing_sim::score::Score;
use homing_sim::simulator::{SimConfig, Simulator};
use serde::{Deserialize, Serialize};

use crate::RunError;

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
    /// How it went.
    pub score: Score,
    /// The planner's last mode.
    pub mode: Mode,
    /// The planner's last words.
    pub reason: String,
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
    planner: PlannerConfig,
    discovery: Box<dyn GoalDiscovery>,
    observer: &mut dyn FnMut(&StepRecord<'_>),
) -> Result<EpisodeRun, RunError> {
    run_episode_as(SimConfig::default(), arena, episode, estimator, planner, discovery, observer)
}

/// As [`run_episode`], with a robot that is not the benchmark's: a noisy one, or one that slides along walls.
///
/// # Errors
/// [`RunError`] when a part cannot be set up or fails.
pub fn run_episode_as(
    robot: SimConfig,
    arena: &Arc<Arena>,
    episode: &Episode,
    estimator: &mut AnyEstimator,
    planner: PlannerConfig,
    discovery: Box<dyn GoalDiscovery>,
    observer: &mut dyn FnMut(&StepRecord<'_>),
) -> Result<EpisodeRun, RunError> {
    let robot = Simulator::new(Arc::clone(arena), robot)?;
    let mut lockstep = Lockstep::new(robot, arena, episode, estimator, planner, discovery)?;
    while !lockstep.step(observer)? {}
    Ok(lockstep.finish(episode))
}

/// Body, perception and planner between two steps.
struct Lockstep<'a> {
    robot: Simulator,
    estimator: &'a mut AnyEstimator,
    planner: Planner,
    config: PlannerConfig,
    goal_odom_truth: PlanarPose,
    mission: Option<Mission>,
    motion: Option<MotionOutcome>,
    steps_left: u64,
    times: StageSeconds,
}

impl<'a> Lockstep<'a> {
    fn new(
        mut robot: Simulator,
        arena: &Arc<Arena>,
        episode: &Episode,
        estimator: &'a mut AnyEstimator,
        config: PlannerConfig,
        discovery: Box<dyn GoalDiscovery>,
    ) -> Result<Self, RunError> {
        robot.reset(episode)?;
        let rgb = Arc::new(episode.camera.photo(arena, episode.goal)?);
        estimator.set_goal(GoalPhoto { id: GOAL_ID, rgb, intrinsics: episode.camera.intrinsics()? })?;
        let t_world_goal: Transform<_, Base> = t_world_base(arena, episode.goal.into());
        Ok(Self {
            planner: Planner::new(config.clone(), discovery)?,
            goal_odom_truth: (robot.t_world_odom_truth().inverse() * t_world_goal).planar(),
            mission: Some(Mission::Start { goal_id: GOAL_ID }),
            motion: None,
            steps_left: config.step_budget,
            times: StageSeconds::default(),
            robot,
            estimator,
            config,
        })
    }

    /// observe, estimate, decide, move. Returns true once the episode is over.
    fn step(&mut self, observer: &mut dyn FnMut(&StepRecord<'_>)) -> Result<bool, RunError> {
        let start = Instant::now();
        let observation = self.robot.observe()?;
        let observed = Instant::now();
        let estimate = self.estimator.estimate(&observation.frame)?;
        let event = self.event(&observation, &estimate);
        let asked = Instant::now();
        let action = self.planner.step(observation.odometry.stamp, &event);
        self.count_time(observed - start, &estimate, asked.elapsed());
        self.steps_left = self.steps_left.saturating_sub(1);

        let over = ended(self.planner.state().mode, action) || self.steps_left == 0;
        let motion = self.motion_of(action, over);
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
        action.motion(self.config.body.forward_m, self.config.body.turn_rad)
    }

    fn count_time(&mut self, observe: Duration, estimate: &GoalEstimate, plan: Duration) {
        self.times.observe += observe.as_secs_f64();
        self.times.extract += estimate.times.extract.as_secs_f64();
        self.times.matching += estimate.times.matching.as_secs_f64();
        self.times.pose += estimate.times.pose.as_secs_f64();
        self.times.plan += plan.as_secs_f64();
    }

    fn finish(self, episode: &Episode) -> EpisodeRun {
        let state = self.planner.state();
        EpisodeRun {
            score: self.robot.score_truth(episode),
            mode: state.mode,
            reason: state.reason.clone(),
            times: self.times,
        }
    }
}

fn ended(mode: Mode, action: Action) -> bool {
    matches!(mode, Mode::Arrived | Mode::Failed) || action == Action::Stop
}
