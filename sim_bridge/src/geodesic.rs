//! Distances a robot must travel: fast marching over its free space.

use core::cmp::Reverse;
use std::collections::BinaryHeap;
use std::sync::Arc;

use thiserror::Error;

use crate::free_space::FreeSpace;

/// Around the goal distances are exact up to this many cells, where a finite difference errs most.
const EXACT_CELLS: i64 = 8;
/// A point beside the free space takes its distance from cells up to this far, in cells.
const SNAP_CELLS: i64 = 6;

/// The goal is not in the free space.
#[derive(Debug, Clone, PartialEq, Error)]
#[error("({x_m:.2}, {y_m:.2}) is no place where a robot of {radius_m} m radius can be")]
pub struct GoalBlocked {
    x_m: f64,
    y_m: f64,
    radius_m: f64,
}

/// Metres to one goal from everywhere, for a robot of one radius. World frame.
#[derive(Clone, Debug)]
pub struct GeodesicField {
    space: Arc<FreeSpace>,
    goal: (f64, f64),
    metres: Vec<f64>,
}

impl GeodesicField {
    /// Marches from the goal (x, y in metres, world frame): Sethian 1999, second order where its stencil allows.
    ///
    /// # Errors
    /// [`GoalBlocked`] if the robot cannot be there.
    pub fn to(space: &Arc<FreeSpace>, goal: (f64, f64)) -> Result<Self, GoalBlocked> {
        let mut field = Self { space: Arc::clone(space), goal, metres: vec![f64::INFINITY; space.geometry().len()] };
        let blocked = GoalBlocked { x_m: goal.0, y_m: goal.1, radius_m: space.radius_m() };
        if field.snapped(goal).is_none() {
            return Err(blocked);
        }
        field.march();
        Ok(field)
    }

    /// Metres to the goal, or `None` from where it cannot be reached. A robot that stands against an obstacle, just
    /// outside the free cells, is measured from the best cell beside it.
    #[must_use]
    pub fn distance_m(&self, x_m: f64, y_m: f64) -> Option<f64> {
        let direct = self.space.line_is_free((x_m, y_m), self.goal);
        if direct {
            return Some(distance((x_m, y_m), self.goal));
        }
        self.interpolated(x_m, y_m).or_else(|| self.nearest_cell((x_m, y_m)).map(|(_, metres)| metres))
    }

    /// A shortest path from a point to the goal as corners of a line, both ends included; `None` where there is none.
    #[must_use]
    pub fn path(&self, x_m: f64, y_m: f64) -> Option<Vec<(f64, f64)>> {
        let g = self.space.geometry();
        let (mut at, _) = self.nearest_cell((x_m, y_m))?;
        let mut cells = vec![(x_m, y_m)];
        while self.metres[at] > EXACT_CELLS as f64 * 0.5 * g.resolution_m {
            cells.push(g.centre(at % g.width, at / g.width));
            let next = self.downhill(at);
            if next == at {
                break;
            }
            at = next;
        }
        cells.push(self.goal);
        Some(self.pulled_taut(&cells))
    }

    fn snapped(&self, goal: (f64, f64)) -> Option<usize> {
        let (column, row) = self.space.geometry().cell_at(goal.0, goal.1)?;
        let index = self.space.geometry().index(column, row);
        self.space.cells()[index].then_some(index)
    }

    fn march(&mut self) {
        let g = *self.space.geometry();
        let space = Arc::clone(&self.space);
        let free = space.cells();
        let mut queue = BinaryHeap::new();
        for (index, metres) in self.around_goal() {
            self.metres[index] = metres;
            queue.push(Reverse((metres.to_bits(), index as u32)));
        }
        let mut done = vec![false; g.len()];
        while let Some(Reverse((_, index))) = queue.pop() {
            let index = index as usize;
            if core::mem::replace(&mut done[index], true) {
                continue;
            }
            // The border of the grid is never free, so the four neighbours exist.
            for next in [index - 1, index + 1, index - g.width, index + g.width] {
                if free[next] && !done[next] {
                    let metres = self.update(next, &done, g.width, g.resolution_m);
                    if metres < self.metres[next] {
                        self.metres[next] = metres;
                        queue.push(Reverse((metres.to_bits(), next as u32)));
                    }
                }
            }
        }
    }

    /// Upwind solution of |grad T| = 1 at a cell from its neighbours along both axes.
    fn update(&self, index: usize, done: &[bool], width: usize, h: f64) -> f64 {
        let (a, b) = (self.upwind(index, 1, done), self.upwind(index, width, done));
        let one = |(value, weight): (f64, f64)| value + h / libm::sqrt(weight);
        let single = one(a).min(one(b));
        // (T - a)^2 wa + (T - b)^2 wb = h^2, where both axes contribute.
        let (wa, wb) = (a.1, b.1);
        let (half_p, q) = (wa * a.0 + wb * b.0, wa * a.0 * a.0 + wb * b.0 * b.0 - h * h);
        let discriminant = half_p * half_p - (wa + wb) * q;
        if !discriminant.is_finite() || discriminant < 0.0 {
            return single;
        }
        let both = (half_p + libm::sqrt(discriminant)) / (wa + wb);
        if both >= a.0.max(b.0) { both } else { single }
    }

    /// The nearer neighbour along an axis as (value, weight) of its squared difference; of second order where the cell
    /// behind it is settled too.
    fn upwind(&self, index: usize, stride: usize, done: &[bool]) -> (f64, f64) {
        let (back, front) = (index - stride, index + stride);
        let (near, outward) = if self.metres[back] <= self.metres[front] { (back, -1) } else { (front, 1) };
        let t1 = self.metres[near];
        let far = near.checked_add_signed(outward * stride as isize).filter(|f| *f < done.len() && done[*f]);
        match far.map(|f| self.metres[f]) {
            Some(t2) if done[near] && t2 <= t1 => ((4.0 * t1 - t2) / 3.0, 2.25),
            _ => (t1, 1.0),
        }
    }

    fn around_goal(&self) -> Vec<(usize, f64)> {
        let g = self.space.geometry();
        let Some((column, row)) = g.cell_at(self.goal.0, self.goal.1) else { return Vec::new() };
        let mut cells = Vec::new();
        for (c, r) in neighbourhood((column, row), EXACT_CELLS) {
            if c < g.width && r < g.height && self.space.cells()[g.index(c, r)] {
                let centre = g.centre(c, r);
                let metres = distance(centre, self.goal);
                if metres <= EXACT_CELLS as f64 * g.resolution_m && self.space.line_is_free(centre, self.goal) {
                    cells.push((g.index(c, r), metres));
                }
            }
        }
        cells
    }

    fn interpolated(&self, x_m: f64, y_m: f64) -> Option<f64> {
        let g = self.space.geometry();
        let (u, v) = ((x_m - g.origin_x_m) / g.resolution_m - 0.5, (y_m - g.origin_y_m) / g.resolution_m - 0.5);
        if !(u >= 0.0 && v >= 0.0 && u < g.width as f64 - 1.0 && v < g.height as f64 - 1.0) {
            return None;
        }
        let (column, row, fu, fv) = (u as usize, v as usize, u.fract(), v.fract());
        let at = |dc: usize, dr: usize| self.metres[g.index(column + dc, row + dr)];
        let low = at(0, 0) * (1.0 - fu) + at(1, 0) * fu;
        let high = at(0, 1) * (1.0 - fu) + at(1, 1) * fu;
        let metres = low * (1.0 - fv) + high * fv;
        metres.is_finite().then_some(metres)
    }

    /// The cell near a point from which the goal is nearest, and the whole distance by way of it.
    fn nearest_cell(&self, p: (f64, f64)) -> Option<(usize, f64)> {
        let g = self.space.geometry();
        let near = neighbourhood(g.cell_at(p.0, p.1)?, SNAP_CELLS)
            .filter(|(c, r)| *c < g.width && *r < g.height)
            .map(|(c, r)| (g.index(c, r), distance(p, g.centre(c, r)) + self.metres[g.index(c, r)]))
            .filter(|(_, metres)| metres.is_finite());
        near.min_by(|a, b| a.1.total_cmp(&b.1))
    }

    fn downhill(&self, at: usize) -> usize {
        let width = self.space.geometry().width;
        let h = self.space.geometry().resolution_m;
        let side = [at - 1, at + 1, at - width, at + width].map(|n| (n, h));
        let corner = [at - width - 1, at - width + 1, at + width - 1, at + width + 1]
            .map(|n| (n, h * core::f64::consts::SQRT_2));
        let slope = |(n, d): &(usize, f64)| (self.metres[*n] - self.metres[at]) / d;
        let best = side.into_iter().chain(corner).min_by(|a, b| slope(a).total_cmp(&slope(b)));
        best.filter(|b| self.metres[b.0] < self.metres[at]).map_or(at, |b| b.0)
    }

    /// Leaves out every corner that is not needed to stay in the free space.
    fn pulled_taut(&self, cells: &[(f64, f64)]) -> Vec<(f64, f64)> {
        let mut taut = vec![cells[0]];
        let mut from = 0;
        while from + 1 < cells.len() {
            let visible = |to: &usize| self.space.line_is_free(cells[from], cells[*to]);
            let to = (from + 2..cells.len()).rev().find(visible).unwrap_or(from + 1);
            taut.push(cells[to]);
            from = to;
        }
        taut
    }
}

fn neighbourhood((column, row): (usize, usize), reach: i64) -> impl Iterator<Item = (usize, usize)> {
    let offsets = move || -reach..=reach;
    offsets().flat_map(move |dr| offsets().map(move |dc| (dc, dr))).filter_map(move |(dc, dr)| {
        Some((usize::try_from(column as i64 + dc).ok()?, usize::try_from(row as i64 + dr).ok()?))
    })
}

fn distance(a: (f64, f64), b: (f64, f64)) -> f64 {
    libm::hypot(a.0 - b.0, a.1 - b.1)
}
