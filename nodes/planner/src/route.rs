//! A route from the robot to a target on the map, as cost-to-go around the robot.

use homing_core::{OccupancyGrid, PlanarPose};
use thiserror::Error;

use crate::angles::distance;
use crate::fmm::{Marcher, Until};
use crate::terrain::{Room, Terrain, Window};

/// Times a target in a closed pocket is moved to another cell before giving up.
const SNAPS_MAX: usize = 4;

/// No way to a target.
#[derive(Copy, Clone, Debug, PartialEq, Error)]
#[error("no path to ({x_m:.2}, {y_m:.2}): {why}")]
pub struct NoPath {
    /// The target, odometry frame, metres.
    pub x_m: f64,
    /// The target, odometry frame, metres.
    pub y_m: f64,
    /// What is in the way.
    pub why: &'static str,
}

/// A way to a target.
#[derive(Clone, Debug, PartialEq)]
pub struct Route {
    /// Where it ends: the target, or the nearest place with room for the body, metres.
    pub end_m: (f64, f64),
    /// Cost-to-go from the robot, metres over comfortable free cells, more elsewhere.
    pub cost_m: f32,
    /// The way, from the robot to the end, metres.
    pub path_m: Vec<(f64, f64)>,
}

/// Plans routes; keeps the cost-to-go of the last one.
#[derive(Clone, Debug)]
pub struct RoutePlanner {
    to_go: Marcher,
}

impl RoutePlanner {
    /// For one terrain.
    #[must_use]
    pub fn new(terrain: &Terrain) -> Self {
        Self { to_go: Marcher::new(*terrain.geometry()) }
    }

    /// Cost-to-go of the last route.
    #[must_use]
    pub fn to_go(&self) -> &Marcher {
        &self.to_go
    }

    /// A route from `pose` to within `snap_m` of `target_m`: with comfortable room if there is one, else a tight one.
    ///
    /// # Errors
    /// [`NoPath`] when the target lies off the map, or everything near it is closed or cut off.
    pub fn plan(
        &mut self,
        map: &OccupancyGrid,
        terrain: &Terrain,
        pose: &PlanarPose,
        target_m: (f64, f64),
        snap_m: f64,
    ) -> Result<Route, NoPath> {
        let no_path = |why| NoPath { x_m: target_m.0, y_m: target_m.1, why };
        let geometry = *terrain.geometry();
        let start = geometry.cell_at(pose.x_m, pose.y_m).filter(|&(c, r)| terrain.window().contains(c, r));
        let (column, row) = start.ok_or(no_path("the robot is off the map"))?;
        let start = geometry.index(column, row);
        let mut why = "no room for the body there";
        for room in [Room::Comfortable, Room::Tight] {
            let mut tried: Vec<usize> = Vec::new();
            while tried.len() < SNAPS_MAX {
                let cost = |index: usize| if index == start { 1.0 } else { terrain.cost(map, index, room) };
                let fresh = |index: usize| {
                    cost(index).is_finite() && (tried.is_empty() || self.to_go.arrival()[index].is_infinite())
                };
                let Some(source) = nearest(terrain, target_m, snap_m, fresh) else { break };
                let until = Until::Reached { index: start, beyond: 1.5 };
                self.to_go.march(source, &terrain.window(), until, cost);
                if self.to_go.arrival()[start].is_finite() {
                    return Ok(self.route(start, source));
                }
                tried.push(source);
                why = "it is cut off from the robot";
            }
        }
        Err(no_path(why))
    }

    fn route(&self, start: usize, source: usize) -> Route {
        let geometry = self.to_go.geometry();
        let centre = |index: usize| geometry.centre(index % geometry.width, index / geometry.width);
        Route {
            end_m: centre(source),
            cost_m: self.to_go.arrival()[start],
            path_m: self.to_go.descend(start).into_iter().map(centre).collect(),
        }
    }
}

/// The cell nearest to a point that is `open`, no farther than `within_m`.
fn nearest(terrain: &Terrain, at_m: (f64, f64), within_m: f64, open: impl Fn(usize) -> bool) -> Option<usize> {
    let geometry = terrain.geometry();
    let mut best: Option<(f64, usize)> = None;
    for (column, row) in Window::around(geometry, at_m, within_m.max(geometry.resolution_m)).cells() {
        let away = distance(geometry.centre(column, row), at_m);
        let index = geometry.index(column, row);
        let nearer = best.is_none_or(|(nearest, _)| away < nearest);
        if nearer
            && away <= within_m.max(geometry.resolution_m)
            && terrain.window().contains(column, row)
            && open(index)
        {
            best = Some((away, index));
        }
    }
    best.map(|(_, index)| index)
}
