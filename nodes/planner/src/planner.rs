//! The planner: one event in, one action out.

use homing_core::{
    Action, BearingHint, Directive, DiscoveryView, GoalDiscovery, GoalEstimate, GridGeometry, Mode, MotionOutcome,
    NavigationState, OccupancyGrid, Odometry, OdometryBuffer, PlanarPose, Sighting, Stamp, wrap_angle,
};

use crate::arrival::{Approach, Arrival};
use crate::config::{BlindPolicy, ConfigError, PlannerConfig};
use crate::event::{Mission, Perception, PlannerObservation, StepEvent};
use crate::fmm::{Marcher, Until};
use crate::goal_filter::{GoalFilter, Joined, camera_azimuth};
use crate::local::{LocalChoice, LocalPlanner};
use crate::mapper::{Integrated, Mapper};
use crate::progress::{Progress, jumped};
use crate::route::{Route, RoutePlanner};
use crate::switches::Verdict;
use crate::terrain::{Terrain, Window};

/// Odometry readings remembered: a minute at 10 Hz.
const ODOMETRY_KEPT: usize = 600;
const HINTS_MAX: usize = 16;
/// Rejected readings in a row after which the clock is taken to have restarted.
const REJECTED_MAX: u32 = 10;

/// What the planner does next and why.
#[derive(Clone, Debug)]
struct Decision {
    action: Action,
    reason: String,
}

impl Decision {
    fn new(action: Action, reason: impl Into<String>) -> Self {
        Self { action, reason: reason.into() }
    }

    fn hold(reason: impl Into<String>) -> Self {
        Self::new(Action::Hold, reason)
    }
}

/// Image-goal navigation for one body: SLING's loop on a metric map.
pub struct Planner {
    config: PlannerConfig,
    discovery: Box<dyn GoalDiscovery>,
    odometry: OdometryBuffer,
    mapper: Mapper,
    terrain: Terrain,
    travel: Marcher,
    routes: RoutePlanner,
    local: LocalPlanner,
    filter: GoalFilter,
    hints: Vec<BearingHint>,
    arrival: Arrival,
    progress: Progress,
    goal_id: Option<u64>,
    n_rejected: u32,
    restarted: bool,
    state: NavigationState,
}

impl Planner {
    /// A planner at rest.
    ///
    /// # Errors
    /// [`ConfigError`] when a knob cannot work.
    pub fn new(config: PlannerConfig, discovery: Box<dyn GoalDiscovery>) -> Result<Self, ConfigError> {
        config.check()?;
        let geometry = GridGeometry::centred(config.map_side_m, config.resolution_m);
        let terrain = Terrain::new(geometry, &config.body, config.unknown_cells);
        Ok(Self {
            odometry: OdometryBuffer::new(ODOMETRY_KEPT),
            mapper: Mapper::new(geometry, config.mapper),
            travel: Marcher::new(geometry),
            routes: RoutePlanner::new(&terrain),
            local: LocalPlanner::new(&config.body),
            filter: GoalFilter::new(config.filter),
            hints: Vec::new(),
            arrival: Arrival::default(),
            progress: Progress::default(),
            goal_id: None,
            n_rejected: 0,
            restarted: false,
            state: idle_state(),
            terrain,
            config,
            discovery,
        })
    }

    /// One decision. Total: whatever is missing, stale or not a number gives [`Action::Hold`], and the same events give the
    /// same actions.
    pub fn step(&mut self, now: Stamp, event: &StepEvent) -> Action {
        self.state.stamp = now;
        self.state.target_m = None;
        self.state.path_m.clear();
        let decision = self.decide(now, event);
        self.state.action = decision.action;
        self.state.reason = decision.reason;
        self.state.goal = self.filter.best(self.state.step).map(|h| h.report());
        self.state.frontiers_m = self.discovery.candidates_m();
        decision.action
    }

    /// What it is doing and why.
    #[must_use]
    pub fn state(&self) -> &NavigationState {
        &self.state
    }

    /// The map, obstacles not inflated.
    #[must_use]
    pub fn map(&self) -> &OccupancyGrid {
        self.mapper.map()
    }

    /// The discovery policy's name.
    #[must_use]
    pub fn policy(&self) -> &'static str {
        self.discovery.name()
    }

    /// SLING figure 1, step by step.
    fn decide(&mut self, now: Stamp, event: &StepEvent) -> Decision {
        self.follow_mission(event.mission);
        let Some(observation) = &event.observation else { return Decision::hold("no observation") };
        if now.since(observation.odometry.stamp) > self.config.observation_age_max {
            return Decision::hold("the observation is stale");
        }
        let before = self.state.pose;
        if let Err(hold) = self.remember(&observation.odometry) {
            return hold;
        }
        self.mark_blocked(&before, event.motion.as_ref());
        let seen = self.map_depth(observation);
        if !self.is_active() {
            return self.rest();
        }
        self.state.step += 1;
        self.filter.drift();
        self.fuse(observation, event.estimate.as_ref());
        if self.state.step > self.config.step_budget {
            self.state.mode = Mode::Failed;
            return Decision::hold("the step budget is spent");
        }
        if seen == Integrated::Blind {
            return self.without_sight();
        }
        if self.restarted {
            self.restarted = false;
            return Decision::hold("the odometry jumped: a new map begins");
        }
        self.switch();
        self.survey();
        let decision = match self.state.mode {
            Mode::Exploit | Mode::Align => self.exploit(now, event.perception),
            _ => self.explore(event),
        };
        self.last_chance(decision)
    }

    fn follow_mission(&mut self, mission: Option<Mission>) {
        match mission {
            Some(Mission::Start { goal_id }) => {
                self.goal_id = Some(goal_id);
                self.odometry = OdometryBuffer::new(ODOMETRY_KEPT);
                self.begin_map();
                self.restarted = false;
                self.state = NavigationState { mode: Mode::Explore, ..idle_state() };
            }
            Some(Mission::Cancel) => {
                self.goal_id = None;
                self.state.mode = Mode::Idle;
            }
            None => {}
        }
    }

    /// A new map: the old one belongs to another odometry.
    fn begin_map(&mut self) {
        self.mapper.reset();
        self.filter.reset();
        self.discovery.reset();
        self.hints.clear();
        self.arrival.reset();
        self.progress.reset();
    }

    /// Remembers where the robot is; an impossible reading gives the reason to hold.
    fn remember(&mut self, reading: &Odometry) -> Result<(), Decision> {
        let last = self.odometry.latest().copied();
        if !reading.t_odom_base.is_finite() {
            return Err(Decision::hold("the odometry is not a number"));
        }
        if !self.odometry.push(*reading) {
            self.n_rejected += 1;
            if self.n_rejected > REJECTED_MAX {
                self.odometry = OdometryBuffer::new(ODOMETRY_KEPT);
                self.n_rejected = 0;
            }
            return Err(Decision::hold("the odometry is older than the last"));
        }
        self.n_rejected = 0;
        if last.is_some_and(|last| jumped(&last, reading, &self.config.body)) {
            self.odometry = OdometryBuffer::new(ODOMETRY_KEPT);
            self.odometry.push(*reading);
            self.begin_map();
            self.restarted = true;
        }
        self.state.pose = reading.t_odom_base.planar();
        Ok(())
    }

    /// A forward that did not come through is an obstacle that depth does not show.
    fn mark_blocked(&mut self, before: &PlanarPose, outcome: Option<&MotionOutcome>) {
        let pose = self.state.pose;
        let moved_m = before.distance_to(pose.x_m, pose.y_m);
        if self.progress.was_blocked(self.state.action, outcome, moved_m, &self.config.body) {
            let resolution_m = self.config.resolution_m;
            let width_m = self.progress.bump_width_m(resolution_m);
            self.mapper.mark_bump(&pose, self.config.body.radius_m + resolution_m, width_m);
        }
        // Only what is well under the body is known to be free: odometry has errors, and so has its radius.
        self.mapper.mark_visited(&pose, 0.8 * self.config.body.radius_m);
    }

    fn map_depth(&mut self, seen: &PlannerObservation) -> Integrated {
        self.mapper.integrate(&seen.depth, &seen.intrinsics, &seen.t_base_camera, &self.state.pose)
    }

    fn is_active(&self) -> bool {
        self.goal_id.is_some() && matches!(self.state.mode, Mode::Explore | Mode::Exploit | Mode::Align)
    }

    fn rest(&self) -> Decision {
        match self.state.mode {
            Mode::Arrived => Decision::new(Action::Stop, "arrived"),
            Mode::Failed => Decision::hold("given up"),
            _ => Decision::hold("no goal"),
        }
    }

    fn without_sight(&mut self) -> Decision {
        match self.config.blind {
            BlindPolicy::Hold => Decision::hold("blind: no usable depth"),
            BlindPolicy::TurnInPlace => Decision::new(Action::TurnLeft, "blind: turning until depth comes back"),
        }
    }

    /// Applies an estimate where its image was taken (SLING 3.3, fused over time), and checks the goal against it.
    fn fuse(&mut self, observation: &PlannerObservation, estimate: Option<&GoalEstimate>) {
        let Some(estimate) = estimate.filter(|e| Some(e.goal_id) == self.goal_id) else { return };
        let Some(t_odom_base) = self.odometry.at(estimate.stamp) else { return };
        let (step, t_base_camera) = (self.state.step, &observation.t_base_camera);
        let pose = t_odom_base.planar();
        let before = self.filter.best(step).map(|h| h.n_fused);
        let mut agreed = false;
        match &estimate.sighting {
            Sighting::NotSeen { .. } => {}
            Sighting::Bearing { bearing_rad, bearing_sd_rad, n_inliers, .. } => {
                if !bearing_rad.is_finite() || !bearing_sd_rad.is_finite() {
                    return;
                }
                agreed =
                    self.filter.refine_by_bearing(&t_odom_base, t_base_camera, *bearing_rad, *bearing_sd_rad, step);
                let bearing_rad = wrap_angle(pose.yaw_rad + camera_azimuth(t_base_camera) + bearing_rad);
                self.hint(&pose, bearing_rad, *n_inliers);
            }
            Sighting::Pose { t_camera_goal, covariance, n_inliers, .. } => {
                let measured = self.filter.measure(
                    estimate.stamp,
                    &t_odom_base,
                    t_base_camera,
                    t_camera_goal,
                    covariance,
                    *n_inliers,
                );
                let Some(measured) = measured else { return };
                let joined = self.filter.join(&measured, step);
                agreed = joined == Joined::Fused && self.filter.best(step).map(|h| h.n_fused) != before;
                if joined != Joined::Refused {
                    let away = libm::atan2(measured.pose.y_m - pose.y_m, measured.pose.x_m - pose.x_m);
                    self.hint(&pose, away, *n_inliers);
                }
            }
        }
        self.arrival.hear(estimate, agreed);
        if self.filter.verify(&pose, &estimate.sighting, agreed, step) {
            self.filter.condemn(step);
            self.arrival.reset();
            self.state.mode = Mode::Explore;
        }
    }

    fn hint(&mut self, pose: &PlanarPose, bearing_rad: f64, n_inliers: usize) {
        if self.hints.len() == HINTS_MAX {
            self.hints.remove(0);
        }
        let weight = (n_inliers as f64 / self.config.switches.n_inliers_min.max(1) as f64).min(1.0);
        self.hints.push(BearingHint { x_m: pose.x_m, y_m: pose.y_m, bearing_rad, weight });
    }

    /// SLING's switches (3.4).
    fn switch(&mut self) {
        let (step, pose) = (self.state.step, self.state.pose);
        let (best, switches) = (self.filter.best(step), &self.config.switches);
        let verdict = match self.state.mode {
            Mode::Explore => switches.enter(best, &pose, step),
            _ => switches.stay(best, &pose, step),
        };
        match verdict {
            Verdict::Exploit if self.state.mode == Mode::Explore => {
                self.arrival.reset();
                self.state.mode = Mode::Exploit;
            }
            Verdict::Exploit => {}
            Verdict::Explore(_) => self.state.mode = Mode::Explore,
        }
    }

    /// Measures the ground around everything that matters now.
    fn survey(&mut self) {
        let geometry = self.mapper.map().geometry;
        let around = |x, y| Window::around(&geometry, (x, y), 1.0);
        let mut window = around(self.state.pose.x_m, self.state.pose.y_m);
        if let Some(known) = self.mapper.known() {
            window = window.union(&known);
        }
        if let Some(goal) = self.filter.best(self.state.step) {
            window = window.union(&around(goal.pose.x_m, goal.pose.y_m));
        }
        self.terrain.survey(self.mapper.map(), window.grown(12, &geometry));
        let body = &self.config.body;
        self.terrain.stand_at(self.mapper.map(), &self.state.pose, body.radius_m + body.margin_m);
    }

    /// Last-mile navigation (SLING 3.3): to the goal's position, then to its heading, then make sure.
    fn exploit(&mut self, now: Stamp, perception: Perception) -> Decision {
        let (step, pose) = (self.state.step, self.state.pose);
        let Some(goal) = self.filter.best(step).cloned() else { return Decision::hold("the goal was lost") };
        let target = (goal.pose.x_m, goal.pose.y_m);
        let route = match self.routes.plan(self.mapper.map(), &self.terrain, &pose, target, 0.8) {
            Ok(route) => route,
            Err(no_path) => {
                self.filter.park(step, step + self.config.switches.parked_steps);
                self.mapper.forget_bumps();
                self.state.mode = Mode::Explore;
                return Decision::new(Action::TurnLeft, no_path.to_string());
            }
        };
        self.show(target, &route);
        let ground = (&self.local, &self.terrain, &self.config.body);
        let around_corner = !self.local.straight(&pose, route.end_m, route.cost_m);
        let approach = if around_corner {
            Approach::Drive
        } else {
            self.arrival.approach(&self.config.arrival, now, &pose, &goal, route.end_m, ground)
        };
        self.state.mode = if self.arrival.is_aligning() { Mode::Align } else { Mode::Exploit };
        let distance_m = pose.distance_to(target.0, target.1);
        match approach {
            Approach::Drive => self.follow(&route, &format!("goal {distance_m:.2} m away")),
            Approach::Step(step) => {
                Decision::new(action(step), format!("closing in on the goal, {distance_m:.2} m away"))
            }
            Approach::Align(turn) => Decision::new(action(turn), "turning to the photo's heading"),
            Approach::Arrived => {
                self.state.mode = Mode::Arrived;
                Decision::new(Action::Stop, "arrived: position, heading and view agree")
            }
            Approach::Wait => Decision::hold("at the goal: waiting for perception to confirm"),
            Approach::Refuted if perception == Perception::Absent && goal.nearest_m < 1.0 => {
                self.state.mode = Mode::Arrived;
                Decision::new(Action::Stop, "arrived, confirmed from near before perception left")
            }
            Approach::Refuted => {
                self.filter.condemn(step);
                self.arrival.reset();
                self.state.mode = Mode::Explore;
                Decision::hold("the photo's view is not here: searching on")
            }
        }
    }

    /// Goal discovery (SLING 3.2).
    fn explore(&mut self, event: &StepEvent) -> Decision {
        let pose = self.state.pose;
        let blindly = match event.perception {
            Perception::Present => "",
            Perception::Absent => " (perception is not running)",
        };
        if let Some(action) = self.progress.escape() {
            return Decision::new(action, format!("turning away from where it was stuck{blindly}"));
        }
        self.march_travel();
        let view = DiscoveryView {
            step: self.state.step,
            pose,
            map: self.mapper.map(),
            travel_m: self.travel.arrival(),
            last_motion: event.motion.as_ref(),
            hints: &self.hints,
        };
        match self.discovery.next(&view) {
            Directive::Act(action) => Decision::new(action, format!("exploring: {}{blindly}", self.discovery.name())),
            Directive::GoTo { x_m, y_m } => self.go_to((x_m, y_m), blindly),
            Directive::Exhausted => self.start_over(),
        }
    }

    fn go_to(&mut self, target: (f64, f64), blindly: &str) -> Decision {
        match self.routes.plan(self.mapper.map(), &self.terrain, &self.state.pose, target, 0.5) {
            Ok(route) => {
                self.show(target, &route);
                self.follow(&route, &format!("exploring towards ({:.1}, {:.1}){blindly}", target.0, target.1))
            }
            Err(no_path) => {
                self.mapper.forget_bumps();
                Decision::new(Action::TurnLeft, format!("{no_path}{blindly}"))
            }
        }
    }

    /// Nothing is left to explore: believe again what was discarded, once; then give up.
    fn start_over(&mut self) -> Decision {
        if self.filter.forgive() || self.mapper.forget_bumps() > 0 {
            self.discovery.reset();
            return Decision::hold("nothing left to explore: looking again at what was discarded");
        }
        self.state.mode = Mode::Failed;
        Decision::hold("nothing left to explore, goal not found")
    }

    fn follow(&mut self, route: &Route, why: &str) -> Decision {
        let pose = self.state.pose;
        let near = pose.distance_to(route.end_m.0, route.end_m.1) < self.config.arrival.near_m
            && self.local.straight(&pose, route.end_m, route.cost_m);
        let mut choice = self.local.follow(&pose, self.routes.to_go(), &self.terrain);
        if near && choice == LocalChoice::Nowhere {
            choice = self.local.close_in(&pose, route.end_m, 0.0, &self.terrain);
        }
        if choice == LocalChoice::Nowhere {
            self.progress.begin_escape(&self.config.body);
            let turn = self.progress.escape().unwrap_or(Action::Hold);
            return Decision::new(turn, format!("{why}: no heading is clear, turning away"));
        }
        Decision::new(action(choice), why)
    }

    fn march_travel(&mut self) {
        let geometry = self.mapper.map().geometry;
        let Some((column, row)) = geometry.cell_at(self.state.pose.x_m, self.state.pose.y_m) else { return };
        let (map, terrain) = (self.mapper.map(), &self.terrain);
        let window = terrain.window();
        self.travel.march(geometry.index(column, row), &window, Until::Everywhere, |i| terrain.distance_cost(map, i));
    }

    /// The last decision of the budget: stopping is right only where the goal is believed to be.
    fn last_chance(&mut self, decision: Decision) -> Decision {
        if self.state.step < self.config.step_budget || decision.action == Action::Stop {
            return decision;
        }
        let pose = self.state.pose;
        let there = self.filter.best(self.state.step).is_some_and(|h| {
            pose.distance_to(h.pose.x_m, h.pose.y_m) < 0.8 && h.support >= self.config.switches.n_inliers_min as f64
        });
        self.state.mode = if there { Mode::Arrived } else { Mode::Failed };
        if there {
            Decision::new(Action::Stop, "the step budget ends here, at the goal's place")
        } else {
            Decision::hold("the step budget is spent")
        }
    }

    fn show(&mut self, target: (f64, f64), route: &Route) {
        self.state.target_m = Some(target);
        self.state.path_m.clone_from(&route.path_m);
    }
}

fn action(choice: LocalChoice) -> Action {
    match choice {
        LocalChoice::Forward => Action::Forward,
        LocalChoice::Left => Action::TurnLeft,
        LocalChoice::Right => Action::TurnRight,
        LocalChoice::Nowhere => Action::Hold,
    }
}

fn idle_state() -> NavigationState {
    NavigationState {
        stamp: Stamp(0),
        step: 0,
        mode: Mode::Idle,
        action: Action::Hold,
        pose: PlanarPose::default(),
        goal: None,
        target_m: None,
        path_m: Vec::new(),
        frontiers_m: Vec::new(),
        reason: "no goal".to_owned(),
    }
}
