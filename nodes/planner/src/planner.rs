//! The planner: one event in, one action out.

mod drive;
mod predict;
mod sense;

use homing_core::{
    Action, BearingHint, Cell, GoalDiscovery, GridGeometry, Mode, NavigationState, OccupancyGrid, OdometryBuffer,
    PlanarPose, Stamp,
};

use crate::angles::sin_cos;
use crate::arrival::Arrival;
use crate::config::{BlindPolicy, ConfigError, PlannerConfig};
use crate::event::{Mission, StepEvent};
use crate::fmm::Marcher;
use crate::goal_filter::GoalFilter;
use crate::local::LocalPlanner;
use crate::mapper::{Integrated, Mapper};
use crate::progress::Progress;
use crate::route::RoutePlanner;
use crate::steering::Steering;
use crate::switches::{Look, Outlook, SwitchKind, Verdict};
use crate::terrain::Terrain;

/// Odometry readings remembered, some half an hour at 10 Hz: perception speaks of images as old as its memory.
const ODOMETRY_KEPT: usize = 20_000;
const HINTS_MAX: usize = 16;
/// Nothing nearer than this may give depth, metres.
const TOO_NEAR_M: f64 = 0.8;
/// A faint sighting that came to nothing within this many steps is forgotten.
const HINT_STEPS: u64 = 60;
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

/// Whether the episode may go on.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
enum Budget {
    Left,
    Spent,
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
    hinted_at: Vec<u64>,
    arrival: Arrival,
    progress: Progress,
    steering: Steering,
    /// What the estimate of this step said, for the switches that fuse nothing.
    look: Option<Look>,
    goal_id: Option<u64>,
    /// The goal of this mission or the last.
    last_goal_id: Option<u64>,
    n_rejected: u32,
    restarted: bool,
    /// Last motion asked for: what a motion's outcome speaks of.
    commanded: Action,
    n_sweeps: u32,
    /// Images without depth in a row.
    n_blind: u32,
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
            hinted_at: Vec::new(),
            arrival: Arrival::default(),
            progress: Progress::default(),
            steering: Steering::default(),
            look: None,
            goal_id: None,
            last_goal_id: None,
            n_rejected: 0,
            restarted: false,
            commanded: Action::Hold,
            n_sweeps: 0,
            n_blind: 0,
            state: idle_state(),
            terrain,
            config,
            discovery,
        })
    }

    /// One decision. Total: whatever is missing, stale or not a number gives [`Action::Hold`], and the same events give the
    /// same actions.
    pub fn step(&mut self, now: Stamp, event: &StepEvent) -> Action {
        self.state.target_m = None;
        self.state.path_m.clear();
        let decision = self.decide(now, event);
        if !matches!(decision.action, Action::Stop | Action::Hold) {
            self.commanded = decision.action;
        }
        self.state.action = decision.action;
        self.state.reason = decision.reason;
        let best = self.goal_id.and_then(|_| self.filter.best(self.state.step));
        self.state.goal = best.map(|h| h.report());
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
        if let Err(hold) = self.remember(&observation.odometry) {
            return hold;
        }
        self.mark_blocked(event.motion.as_ref());
        let sight = self.map_depth(observation);
        if !self.is_active() {
            return self.rest();
        }
        if self.spend_step() == Budget::Spent {
            return Decision::hold("the step budget is spent");
        }
        for estimate in &event.remembered {
            self.recall(observation, estimate);
        }
        self.fuse(observation, event.estimate.as_ref());
        if core::mem::take(&mut self.restarted) {
            return Decision::hold("the odometry jumped: a new map begins");
        }
        if sight == Integrated::Blind {
            return self.without_sight();
        }
        self.n_blind = 0;
        self.switch();
        self.survey();
        let decision = match self.state.mode {
            _ if self.progress.is_escaping() => self.escape(),
            Mode::Exploit | Mode::Align => self.exploit(event.perception),
            _ => self.explore(event),
        };
        self.last_chance(decision)
    }

    fn follow_mission(&mut self, mission: Option<Mission>) {
        match mission {
            Some(Mission::Start { goal_id }) => {
                if self.last_goal_id == Some(goal_id) {
                    self.filter.begin_again();
                } else {
                    self.filter.reset();
                }
                (self.goal_id, self.last_goal_id) = (Some(goal_id), Some(goal_id));
                self.begin_search();
                self.restarted = false;
                self.commanded = Action::Hold;
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
        self.begin_search();
    }

    /// Nothing is known of where the goal may be, or of how the search goes.
    fn begin_search(&mut self) {
        self.discovery.reset();
        (self.n_sweeps, self.n_blind) = (0, 0);
        self.hints.clear();
        self.hinted_at.clear();
        self.arrival.reset();
        self.progress.reset();
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
        self.n_blind += 1;
        let whole_turn = (core::f64::consts::TAU / self.config.body.turn_rad).ceil() as u32;
        match self.config.blind {
            BlindPolicy::Hold if self.n_blind <= whole_turn && self.faces_obstacle() => {
                Decision::new(Action::TurnLeft, "too near to something to see: turning away")
            }
            BlindPolicy::Hold => Decision::hold("blind: no usable depth"),
            BlindPolicy::TurnInPlace => Decision::new(Action::TurnLeft, "blind: turning until depth comes back"),
        }
    }

    /// The map knows of something right ahead, where a depth camera may be too near to see it.
    fn faces_obstacle(&self) -> bool {
        let (map, pose) = (self.mapper.map(), &self.state.pose);
        let step_m = 0.5 * self.config.resolution_m;
        let is_occupied = |off_rad: f64, reach_m: f64| {
            let (sin, cos) = sin_cos(pose.yaw_rad + off_rad);
            let cell = map.geometry.cell_at(pose.x_m + reach_m * cos, pose.y_m + reach_m * sin);
            cell.is_some_and(|(column, row)| map.at(column, row) == Cell::Occupied)
        };
        let reaches = (1..).map(|k| f64::from(k) * step_m).take_while(|reach_m| *reach_m <= TOO_NEAR_M);
        reaches.into_iter().any(|reach_m| [-0.3, 0.0, 0.3].iter().any(|off_rad| is_occupied(*off_rad, reach_m)))
    }

    /// SLING's switches (3.4).
    fn switch(&mut self) {
        let (step, pose, look) = (self.state.step, self.state.pose, self.look.take());
        let (hypothesis, switches) = (self.filter.best(step), &self.config.switches);
        let outlook = Outlook { hypothesis, look: look.as_ref(), pose: &pose, step };
        let verdict = match self.state.mode {
            Mode::Explore => switches.enter(&outlook),
            _ => switches.stay(&outlook),
        };
        match verdict {
            Verdict::Exploit if self.state.mode == Mode::Explore => {
                self.arrival.reset();
                self.progress.begin_approach();
                self.state.mode = Mode::Exploit;
            }
            Verdict::Exploit => {}
            Verdict::Explore(_) => {
                if self.state.mode != Mode::Explore && switches.kind != SwitchKind::Fused {
                    // Nothing is kept of a prediction that was given up.
                    self.filter.reset();
                }
                self.state.mode = Mode::Explore;
            }
        }
    }

    fn spend_step(&mut self) -> Budget {
        self.state.step += 1;
        self.filter.drift();
        if self.state.step > self.config.step_budget {
            self.state.mode = Mode::Failed;
            return Budget::Spent;
        }
        Budget::Left
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
