//! From a mode to an action: last-mile navigation and goal discovery.

use homing_core::{Action, Directive, DiscoveryView, Mode};

use super::{Decision, Planner};
use crate::arrival::Approach;
use crate::event::{Perception, StepEvent};
use crate::fmm::Until;
use crate::local::LocalChoice;
use crate::route::Route;
use crate::steering::Ahead;
use crate::terrain::Window;

/// Steps of an approach without coming closer before something else is tried.
const STALLED_MAX: u32 = 50;
/// Times the whole flat is searched again after nothing was left to explore: once on the map there is, then on new ones.
const SWEEPS_MAX: u32 = 3;

impl Planner {
    /// Measures the ground around everything that matters now.
    pub(super) fn survey(&mut self) {
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
    pub(super) fn exploit(&mut self, perception: Perception) -> Decision {
        let (step, pose) = (self.state.step, self.state.pose);
        let Some(goal) = self.filter.best(step).cloned() else { return Decision::hold("the goal was lost") };
        let target = (goal.pose.x_m, goal.pose.y_m);
        let route = match self.routes.plan(self.mapper.map(), &self.terrain, &pose, target, 0.8) {
            Ok(route) => route,
            Err(no_path) => return self.give_up_for_now(&no_path.to_string()),
        };
        if self.progress.is_stalled(route.cost_m, STALLED_MAX) {
            return self.give_up_for_now("no closer to the goal for long");
        }
        self.show(target, &route);
        let ground = (&self.local, &self.terrain, &self.config.body);
        let around_corner = !self.local.straight(&pose, route.end_m, route.cost_m);
        let approach = if around_corner {
            Approach::Drive
        } else {
            self.arrival.approach(&self.config.arrival, self.state.stamp, &pose, &goal, route.end_m, ground)
        };
        self.state.mode = if self.arrival.is_aligning() { Mode::Align } else { Mode::Exploit };
        let distance_m = pose.distance_to(target.0, target.1);
        match approach {
            Approach::Drive => self.follow(&route, &format!("goal {distance_m:.2} m away")),
            Approach::Step(step) => {
                Decision::new(action(step), format!("closing in on the goal, {distance_m:.2} m away"))
            }
            Approach::Align(turn) => Decision::new(action(turn), "turning to the photo's heading"),
            Approach::Face(milliradians) => {
                Decision::new(Action::Face { milliradians }, "turning the last bit to the photo's heading")
            }
            Approach::Arrived => {
                self.state.mode = Mode::Arrived;
                Decision::new(Action::Stop, "arrived: position, heading and view agree")
            }
            Approach::Wait | Approach::Refuted if !self.may_turn_back() => {
                self.stop_here("at the goal: there is no way back to look elsewhere")
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

    /// The goal stays believed, but cannot be reached: search on, and try again later. Without recovery
    /// this is the end.
    fn give_up_for_now(&mut self, why: &str) -> Decision {
        if !self.may_turn_back() {
            if self.mapper.forget_bumps() > 0 {
                return Decision::new(Action::TurnLeft, why);
            }
            return self.stop_here(why);
        }
        let step = self.state.step;
        self.filter.park(step, step + self.config.switches.parked_steps);
        self.mapper.forget_bumps();
        self.state.mode = Mode::Explore;
        Decision::new(Action::TurnLeft, why)
    }

    pub(super) fn escape(&mut self) -> Decision {
        Decision::new(self.progress.escape(), "turning away from where it was stuck")
    }

    /// Goal discovery (SLING 3.2).
    pub(super) fn explore(&mut self, event: &StepEvent) -> Decision {
        let pose = self.state.pose;
        let blindly = match event.perception {
            Perception::Present => "",
            Perception::Absent => " (perception is not running)",
        };
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

    /// Nothing is left to explore: believe again what was discarded and look once more; then doubt the map, in which odometry
    /// that drifts may have closed every way; then give up.
    fn start_over(&mut self) -> Decision {
        let forgiven = self.filter.forgive() || self.mapper.forget_bumps() > 0;
        self.n_sweeps += u32::from(!forgiven);
        if self.n_sweeps > SWEEPS_MAX {
            self.state.mode = Mode::Failed;
            return Decision::hold("nothing left to explore, goal not found");
        }
        self.discovery.reset();
        if forgiven || self.n_sweeps == 1 {
            return Decision::hold("nothing left to explore: looking again");
        }
        self.mapper.reset();
        Decision::hold("nothing left to explore: mapping anew")
    }

    fn follow(&mut self, route: &Route, why: &str) -> Decision {
        let pose = self.state.pose;
        let near = pose.distance_to(route.end_m.0, route.end_m.1) < self.config.arrival.near_m
            && self.local.straight(&pose, route.end_m, route.cost_m);
        let mut choice = self.local.follow(&pose, self.routes.to_go(), &self.terrain);
        if near && choice == LocalChoice::Nowhere {
            choice = self.local.close_in(&pose, route.end_m, 0.0, &self.terrain);
        }
        if choice == LocalChoice::Nowhere && self.progress.is_trapped() {
            choice = self.local.withdraw(&pose, &self.terrain);
        }
        if choice == LocalChoice::Nowhere {
            self.progress.begin_escape(&self.config.body);
            return Decision::new(self.progress.escape(), format!("{why}: no heading is clear, turning away"));
        }
        let ahead = self.local.is_clear(&pose, pose.yaw_rad, &self.terrain);
        let ahead = if ahead { Ahead::Clear } else { Ahead::Blocked };
        Decision::new(action(self.steering.settle(self.state.step, choice, ahead)), why)
    }

    fn march_travel(&mut self) {
        let geometry = self.mapper.map().geometry;
        let Some((column, row)) = geometry.cell_at(self.state.pose.x_m, self.state.pose.y_m) else { return };
        let (map, terrain) = (self.mapper.map(), &self.terrain);
        let window = terrain.window();
        self.travel.march(geometry.index(column, row), &window, Until::Everywhere, |i| terrain.distance_cost(map, i));
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
