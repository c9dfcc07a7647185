//! Frontier: drive to where most of what was never looked at comes into sight, per metre of way; look around there.
//!
//! Yamauchi's frontiers, valued by views instead of cells. The unknown behind a frontier counts as views still to be had;
//! so do known places that were not yet looked at in some direction (see [`super::coverage`]).

use homing_core::{Action, BearingHint, Directive, DiscoveryView, GoalDiscovery, wrap_angle};

use super::coverage::{Coverage, Likeness, Place};
use crate::angles::distance;

/// Decisions granted for any target, and eight more per metre of way: two per step forward.
const PATIENCE: u32 = 40;

/// Knobs of the frontier policy.
#[derive(Clone, Debug, PartialEq)]
pub struct FrontierConfig {
    /// Angle of one turn, radians.
    pub turn_rad: f64,
    /// What a look stands for: first generously, then, when nothing is left, more strictly.
    pub passes: Vec<(f64, f64)>,
    /// A look around begins when it shows at least this much, square metres times share of directions.
    pub look_min_m2: f64,
    /// What one turn costs, as metres of way: turns take steps, but no way.
    pub turn_cost_m: f64,
    /// Places that show less are not worth the way.
    pub gain_min_m2: f64,
    /// An unknown place is worth this share of a known one.
    pub unknown_worth: f64,
    /// How far into the unknown a view is hoped to reach, metres.
    pub hope_m: f64,
    /// What a metre of way takes off the worth of what lies there, as an exponent: whoever goes far leaves much behind, and
    /// comes back for it. So near things are seen first, and a look around is finished before a long way.
    pub decay_per_m: f64,
    /// That fades, and is gone after so many steps: looking around costs steps, and they are counted, too.
    pub patient_steps: u64,
    /// Added to the way: near targets do not win by being near alone, metres.
    pub way_offset_m: f64,
    /// Another target must be this much better than the present one.
    pub hysteresis: f64,
    /// Half width of a bearing hint's cone, radians.
    pub hint_rad: f64,
}

impl Default for FrontierConfig {
    fn default() -> Self {
        Self {
            turn_rad: 15.0_f64.to_radians(),
            passes: vec![(3.0, 0.70), (1.75, 0.53)],
            look_min_m2: 0.4,
            turn_cost_m: 0.08,
            gain_min_m2: 0.8,
            unknown_worth: 0.5,
            hope_m: 2.5,
            decay_per_m: 0.25,
            patient_steps: 200,
            way_offset_m: 1.0,
            hysteresis: 1.3,
            hint_rad: 0.45,
        }
    }
}

/// A place to look around from.
#[derive(Copy, Clone, Debug, PartialEq)]
struct Viewpoint {
    x_m: f64,
    y_m: f64,
    place: usize,
    utility: f64,
}

/// The frontier policy.
#[derive(Clone, Debug)]
pub struct Frontier {
    config: FrontierConfig,
    coverage: Coverage,
    pass: usize,
    fresh: bool,
    turning: Option<Action>,
    target: Option<Viewpoint>,
    /// Decisions left to reach the target before it is given up.
    patience: u32,
    /// Places that promised something and did not keep it.
    barren: Vec<usize>,
    candidates: Vec<Viewpoint>,
}

impl Frontier {
    /// A new episode's policy.
    #[must_use]
    pub fn new(config: FrontierConfig) -> Self {
        Self {
            config,
            coverage: Coverage::default(),
            pass: 0,
            fresh: true,
            turning: None,
            target: None,
            patience: 0,
            barren: Vec::new(),
            candidates: Vec::new(),
        }
    }
}

impl Default for Frontier {
    fn default() -> Self {
        Self::new(FrontierConfig::default())
    }
}

impl GoalDiscovery for Frontier {
    fn name(&self) -> &'static str {
        "frontier"
    }

    fn reset(&mut self) {
        *self = Self::new(self.config.clone());
    }

    fn next(&mut self, view: &DiscoveryView<'_>) -> Directive {
        if self.fresh || !self.coverage.fits(view.map) {
            self.coverage.reset(view.map);
            self.fresh = false;
        }
        loop {
            let Some(likeness) = self.likeness() else { return Directive::Exhausted };
            let Some(here) = view.map.geometry.cell_at(view.pose.x_m, view.pose.y_m) else {
                return Directive::Exhausted;
            };
            let viewpoints = self.coverage.find_reachable(view.map, view.travel_m);
            let places = self.coverage.in_sight(view.map, here, likeness.range_m, self.config.hope_m);
            self.coverage.look(&places, view.pose.yaw_rad, &likeness);
            let target = self.choose(view, &viewpoints, &likeness);
            if let Some(turn) = self.look_around(view, &places, &likeness, target) {
                return Directive::Act(turn);
            }
            if let Some(target) = target {
                return Directive::GoTo { x_m: target.x_m, y_m: target.y_m };
            }
            self.pass += 1;
            self.target = None;
            self.barren.clear();
            self.coverage.reset(view.map);
        }
    }

    fn candidates_m(&self) -> Vec<(f64, f64)> {
        self.candidates.iter().map(|v| (v.x_m, v.y_m)).collect()
    }
}

impl Frontier {
    fn likeness(&self) -> Option<Likeness> {
        self.config.passes.get(self.pass).map(|&(range_m, half_angle_rad)| Likeness { range_m, half_angle_rad })
    }

    /// One more turn, if looking around from here shows more for its cost than driving on.
    fn look_around(
        &mut self,
        view: &DiscoveryView<'_>,
        places: &[Place],
        likeness: &Likeness,
        best: Option<Viewpoint>,
    ) -> Option<Action> {
        let n_turns = (core::f64::consts::TAU / self.config.turn_rad).round() as usize;
        let worth = |sign: f64| {
            let turn = (sign * self.config.turn_rad, n_turns);
            let gains =
                self.coverage.gains_of_turns_m2(places, view.pose.yaw_rad, turn, likeness, self.config.unknown_worth);
            let at = |(i, gain): (usize, &f64)| *gain / (self.config.turn_cost_m * (i as f64 + 1.0) + 0.15);
            let all = gains.last().copied().unwrap_or(0.0);
            (gains.iter().enumerate().map(at).fold(0.0, f64::max), all)
        };
        let ((left, all), (right, _)) = (worth(1.0), worth(-1.0));
        // To go on is cheaper than to come back.
        let (patience, least) = if self.turning.is_some() { (0.7, 0.1) } else { (1.0, self.config.look_min_m2) };
        let elsewhere = best.map_or(0.0, |b| b.utility);
        if all < least || left.max(right) < patience * elsewhere {
            self.turning = None;
            return None;
        }
        let turn = match self.turning {
            Some(Action::TurnLeft) if left > 0.5 * right => Action::TurnLeft,
            Some(Action::TurnRight) if right > 0.5 * left => Action::TurnRight,
            _ if left >= right => Action::TurnLeft,
            _ => Action::TurnRight,
        };
        self.turning = Some(turn);
        Some(turn)
    }

    fn at_target(&self, view: &DiscoveryView<'_>) -> bool {
        self.target.is_some_and(|t| view.pose.distance_to(t.x_m, t.y_m) < 0.3)
    }

    /// The best viewpoint; the present one unless another is clearly better.
    fn choose(
        &mut self,
        view: &DiscoveryView<'_>,
        viewpoints: &[(usize, (usize, usize))],
        likeness: &Likeness,
    ) -> Option<Viewpoint> {
        self.patience = self.patience.saturating_sub(1);
        if (self.at_target(view) || self.patience == 0)
            && let Some(target) = self.target.take()
        {
            self.barren.push(target.place);
        }
        self.candidates.clear();
        let patience = (1.0 - view.step as f64 / self.config.patient_steps.max(1) as f64).max(0.0);
        let decay_per_m = self.config.decay_per_m * patience;
        for &(place, (column, row)) in viewpoints {
            let kept = self.target.is_some_and(|t| t.place == place);
            let checkered = (column / 10 + row / 10) % 2 == 0;
            if (!kept && !checkered) || self.barren.contains(&place) {
                continue;
            }
            let at = view.map.geometry.centre(column, row);
            let travel_m = f64::from(view.travel_m[view.map.geometry.index(column, row)]);
            let places = self.coverage.in_sight(view.map, (column, row), likeness.range_m, self.config.hope_m);
            let gain_m2 = self.coverage.gain_m2(&places, self.config.unknown_worth);
            if gain_m2 < self.config.gain_min_m2 {
                continue;
            }
            let favour = hinted(view.hints, at, self.config.hint_rad);
            let turns = view.pose.bearing_to(at.0, at.1).abs() / self.config.turn_rad;
            let cost_m = travel_m + self.config.way_offset_m + self.config.turn_cost_m * turns;
            let utility = gain_m2 * favour * libm::exp(-decay_per_m * travel_m) / cost_m;
            self.candidates.push(Viewpoint { x_m: at.0, y_m: at.1, place, utility });
        }
        self.candidates.sort_by(|a, b| b.utility.total_cmp(&a.utility).then(a.place.cmp(&b.place)));
        let best = self.candidates.first().copied();
        let kept = self.target.and_then(|t| self.candidates.iter().find(|c| c.place == t.place).copied());
        let before = self.target.map(|t| t.place);
        self.target = match (kept, best) {
            (Some(kept), Some(best)) if kept.utility * self.config.hysteresis >= best.utility => Some(kept),
            (_, best) => best,
        };
        if let Some(target) = self.target.filter(|t| Some(t.place) != before) {
            let travel_m = view.travel_m
                [view.map.geometry.cell_at(target.x_m, target.y_m).map_or(0, |(c, r)| view.map.geometry.index(c, r))];
            self.patience = PATIENCE + (8.0 * travel_m) as u32;
        }
        self.candidates.truncate(24);
        self.target
    }
}

/// More than 1 for points in the cone of a hint.
fn hinted(hints: &[BearingHint], at_m: (f64, f64), cone_rad: f64) -> f64 {
    hints.iter().fold(1.0, |favour, hint| {
        let (dx, dy) = (at_m.0 - hint.x_m, at_m.1 - hint.y_m);
        if distance(at_m, (hint.x_m, hint.y_m)) < 0.3 {
            return favour;
        }
        let off = wrap_angle(libm::atan2(dy, dx) - hint.bearing_rad).abs();
        favour + 2.0 * hint.weight * (1.0 - off / cone_rad).max(0.0)
    })
}
