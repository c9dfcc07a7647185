//! From cost-to-go to one discrete action: roll every heading the body can turn to one step forward, take the best.
//!
//! SLING's local policy turns while the bearing to a waypoint exceeds ten degrees. Rolling out the body's own lattice of
//! headings does the same on an open floor and needs no waypoint: it sees which of them are blocked, and a turn once begun
//! stays the best choice until it is done, so the body does not swing left and right.

use homing_core::{PlanarPose, wrap_angle};

use crate::angles::{ahead, distance};
use crate::config::BodyConfig;
use crate::fmm::Marcher;
use crate::terrain::Terrain;

/// Cost of one turn, metres. A heading that is off by an angle a loses forward * (1 - cos a): with 0.25 m steps, 6 mm is
/// what 12 degrees lose, so the body tolerates a little under one turn of 15 degrees.
const TURN_COST_M: f64 = 0.006;
/// The straight line to a near target is preferred to the map's cost when it is at most this much shorter.
const STRAIGHT_RATIO: f64 = 1.4;

/// One step.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum LocalChoice {
    /// Drive one step ahead.
    Forward,
    /// Turn left once.
    Left,
    /// Turn right once.
    Right,
    /// No heading leads closer.
    Nowhere,
}

/// Chooses discrete steps for one body.
#[derive(Clone, Debug)]
pub struct LocalPlanner {
    forward_m: f64,
    turn_rad: f64,
    n_side: i32,
}

impl LocalPlanner {
    /// For one body.
    #[must_use]
    pub fn new(body: &BodyConfig) -> Self {
        let n_side = (core::f64::consts::PI / body.turn_rad).round().max(1.0) as i32;
        Self { forward_m: body.forward_m, turn_rad: body.turn_rad, n_side }
    }

    /// The step that best follows the cost-to-go.
    #[must_use]
    pub fn follow(&self, pose: &PlanarPose, to_go: &Marcher, terrain: &Terrain) -> LocalChoice {
        let here = f64::from(to_go.at(pose.x_m, pose.y_m));
        let best = self.best_heading(pose, terrain, |end| f64::from(to_go.at(end.0, end.1)));
        match best {
            Some((turns, cost)) if cost < here + 0.5 * self.forward_m => self.toward(turns),
            _ => LocalChoice::Nowhere,
        }
    }

    /// The step that leads farthest from obstacles: the way out of a trap.
    #[must_use]
    pub fn withdraw(&self, pose: &PlanarPose, terrain: &Terrain) -> LocalChoice {
        let crowding = |end: (f64, f64)| -f64::from(terrain.square_at(end.0, end.1)).sqrt() * 0.01;
        self.best_heading(pose, terrain, crowding).map_or(LocalChoice::Nowhere, |(turns, _)| self.toward(turns))
    }

    /// The step that best shortens the straight distance to a near target; `Nowhere` once no step shortens it by `gain_m`.
    #[must_use]
    pub fn close_in(&self, pose: &PlanarPose, target_m: (f64, f64), gain_m: f64, terrain: &Terrain) -> LocalChoice {
        let here = pose.distance_to(target_m.0, target_m.1);
        let best = self.best_heading(pose, terrain, |end| distance(end, target_m));
        match best {
            Some((turns, cost)) if cost + gain_m < here => self.toward(turns),
            _ => LocalChoice::Nowhere,
        }
    }

    /// True if the straight line to a target is about as short as the map's way.
    #[must_use]
    pub fn straight(&self, pose: &PlanarPose, target_m: (f64, f64), cost_m: f32) -> bool {
        // Costs near walls are up to three times the distance; what matters here is only "not around a corner".
        f64::from(cost_m) <= 3.0 * STRAIGHT_RATIO * pose.distance_to(target_m.0, target_m.1) + 2.0 * self.forward_m
    }

    /// True if the body can drive one step along `heading_rad` without touching what the map knows.
    #[must_use]
    pub fn is_clear(&self, pose: &PlanarPose, heading_rad: f64, terrain: &Terrain) -> bool {
        let start = terrain.square_at(pose.x_m, pose.y_m);
        let needed = terrain.hard_square().min(start);
        let n = (self.forward_m / terrain.geometry().resolution_m).ceil().max(1.0) as i32;
        (1..=n).all(|i| {
            let (x, y) = ahead(pose, heading_rad, self.forward_m * f64::from(i) / f64::from(n));
            let square = terrain.square_at(x, y);
            square >= needed && square > 0
        })
    }

    /// One turn towards a heading, or `Nowhere` if it is nearer than half a turn.
    #[must_use]
    pub fn face(&self, pose: &PlanarPose, heading_rad: f64) -> LocalChoice {
        let residual = wrap_angle(heading_rad - pose.yaw_rad);
        if residual.abs() <= 0.5 * self.turn_rad + 1e-3 {
            LocalChoice::Nowhere
        } else if residual > 0.0 {
            LocalChoice::Left
        } else {
            LocalChoice::Right
        }
    }

    /// (turns, cost of the end point) of the best clear heading; turns positive to the left.
    fn best_heading(
        &self,
        pose: &PlanarPose,
        terrain: &Terrain,
        cost: impl Fn((f64, f64)) -> f64,
    ) -> Option<(i32, f64)> {
        let mut best: Option<(i32, f64, f64)> = None;
        for i in 0..=2 * self.n_side {
            // 0, +1, -1, +2, -2, ...: of two equal headings the one with fewer turns, then the left one.
            let turns = if i % 2 == 1 { (i + 1) / 2 } else { -(i / 2) };
            let heading = pose.yaw_rad + f64::from(turns) * self.turn_rad;
            if !self.is_clear(pose, heading, terrain) {
                continue;
            }
            let end_cost = cost(ahead(pose, heading, self.forward_m));
            let total = end_cost + TURN_COST_M * f64::from(turns.abs());
            if total.is_finite() && best.is_none_or(|(_, _, least)| total < least) {
                best = Some((turns, end_cost, total));
            }
        }
        best.map(|(turns, end_cost, _)| (turns, end_cost))
    }

    fn toward(&self, turns: i32) -> LocalChoice {
        match turns {
            0 => LocalChoice::Forward,
            1.. => LocalChoice::Left,
            _ => LocalChoice::Right,
        }
    }
}
