//! Fast Marching (Sethian 1996; SLING appendix A): arrival times of a front that moves slower where driving costs more.

use core::cmp::Reverse;
use std::collections::BinaryHeap;

use homing_core::GridGeometry;

use crate::terrain::Window;

/// When to stop marching.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Until {
    /// Every reachable cell of the window has its time.
    Everywhere,
    /// The cell has its time, and so has everything that is at most `beyond` later.
    Reached {
        /// Index of the cell.
        index: usize,
        /// How much farther to march, in arrival time.
        beyond: f32,
    },
}

/// Buffers for marching over one grid, kept from step to step.
#[derive(Clone, Debug)]
pub struct Marcher {
    geometry: GridGeometry,
    arrival: Vec<f32>,
    // Keys are the bits of a non-negative time, which order as the times do, above the cell's index. A cell may be queued
    // more than once; only the entry that still agrees with its time counts.
    queue: BinaryHeap<Reverse<u64>>,
}

impl Marcher {
    /// For grids of one geometry.
    #[must_use]
    pub fn new(geometry: GridGeometry) -> Self {
        Self { geometry, arrival: vec![f32::INFINITY; geometry.len()], queue: BinaryHeap::new() }
    }

    /// The grid it marches over.
    #[must_use]
    pub fn geometry(&self) -> &GridGeometry {
        &self.geometry
    }

    /// Arrival time of every cell, cost times metres; infinite where the front did not come.
    #[must_use]
    pub fn arrival(&self) -> &[f32] {
        &self.arrival
    }

    /// Marches from `source` (a cell's index) inside `window`, which must keep one cell off the grid's border. `cost` gives
    /// the front's slowness in a cell; infinite closes it.
    pub fn march(&mut self, source: usize, window: &Window, until: Until, cost: impl Fn(usize) -> f32) {
        self.arrival.fill(f32::INFINITY);
        self.queue.clear();
        let width = self.geometry.width;
        if !window.contains(source % width, source / width) {
            return;
        }
        self.arrival[source] = 0.0;
        self.queue.push(Reverse(source as u64));
        let step_m = self.geometry.resolution_m as f32;
        while let Some(Reverse(entry)) = self.queue.pop() {
            let (time, index) = (f32::from_bits((entry >> 32) as u32), (entry & 0xffff_ffff) as usize);
            if time > self.arrival[index] {
                continue;
            }
            if let Until::Reached { index: goal, beyond } = until
                && time > self.arrival[goal] + beyond
            {
                break;
            }
            let (column, row) = (index % width, index / width);
            for (neighbour, c, r) in [
                (index - 1, column - 1, row),
                (index + 1, column + 1, row),
                (index - width, column, row - 1),
                (index + width, column, row + 1),
            ] {
                if self.arrival[neighbour] <= time || !window.contains(c, r) {
                    continue;
                }
                let slowness = cost(neighbour);
                if slowness < f32::INFINITY {
                    self.relax(neighbour, slowness * step_m);
                }
            }
        }
    }

    /// First-order upwind solution of |grad T| = cost at one cell.
    #[inline]
    fn relax(&mut self, index: usize, delay: f32) {
        let width = self.geometry.width;
        let along = self.arrival[index - 1].min(self.arrival[index + 1]);
        let across = self.arrival[index - width].min(self.arrival[index + width]);
        let (near, far) = if along < across { (along, across) } else { (across, along) };
        let gap = far - near;
        let time =
            if gap < delay { 0.5 * (near + far + (2.0 * delay * delay - gap * gap).sqrt()) } else { near + delay };
        if time < self.arrival[index] {
            self.arrival[index] = time;
            self.queue.push(Reverse((u64::from(time.to_bits()) << 32) | index as u64));
        }
    }

    /// Arrival time at a point, interpolated between the cells around it that the front reached; infinite if there is none.
    #[must_use]
    pub fn at(&self, x_m: f64, y_m: f64) -> f32 {
        let g = &self.geometry;
        let u = (x_m - g.origin_x_m) / g.resolution_m - 0.5;
        let v = (y_m - g.origin_y_m) / g.resolution_m - 0.5;
        if !(u >= 0.0 && v >= 0.0 && u < (g.width - 1) as f64 && v < (g.height - 1) as f64) {
            return f32::INFINITY;
        }
        let (column, row) = (u as usize, v as usize);
        let (a, b) = ((u - u.floor()) as f32, (v - v.floor()) as f32);
        let corner = g.index(column, row);
        let corners = [
            (corner, (1.0 - a) * (1.0 - b)),
            (corner + 1, a * (1.0 - b)),
            (corner + g.width, (1.0 - a) * b),
            (corner + g.width + 1, a * b),
        ];
        let (mut sum, mut weight) = (0.0, 0.0);
        for (index, share) in corners {
            if self.arrival[index] < f32::INFINITY {
                sum += share * self.arrival[index];
                weight += share;
            }
        }
        if weight > 0.25 { sum / weight } else { f32::INFINITY }
    }

    /// The way back to the source from a cell, cell by cell down the arrival times; empty if the front never came there.
    #[must_use]
    pub fn descend(&self, from: usize) -> Vec<usize> {
        let width = self.geometry.width as isize;
        let mut path = Vec::new();
        let mut at = from;
        while self.arrival.get(at).is_some_and(|t| t.is_finite()) {
            path.push(at);
            let mut next = at;
            for step in [-1, 1, -width, width, -width - 1, -width + 1, width - 1, width + 1] {
                let Some(neighbour) = at.checked_add_signed(step) else { continue };
                if self.arrival.get(neighbour).is_some_and(|t| *t < self.arrival[next]) {
                    next = neighbour;
                }
            }
            if next == at {
                break;
            }
            at = next;
        }
        path
    }
}
