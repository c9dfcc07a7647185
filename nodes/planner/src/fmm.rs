//! Fast Marching (Sethian 1996; SLING appendix A): arrival times of a front that moves slower where driving costs more.

use homing_core::GridGeometry;

use crate::terrain::Window;

/// Buckets in the ring; with buckets of 0.7 cells they hold delays of 700 cells, more than any one cell may cost.
const N_BUCKETS: usize = 1024;
/// A cell may not cost more than this many free ones.
const COST_MAX: f32 = 500.0;

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
    // A front that crosses a cell in `step` at the fastest reaches no neighbour sooner than `step / sqrt(2)` later. So the
    // cells of one bucket that wide do not depend on each other, and no order is needed among them: a ring of buckets does
    // what a heap would, without sorting. A cell may lie in several buckets; only the one of its time counts.
    buckets: Vec<Vec<u32>>,
}

impl Marcher {
    /// For grids of one geometry.
    #[must_use]
    pub fn new(geometry: GridGeometry) -> Self {
        Self { geometry, arrival: vec![f32::INFINITY; geometry.len()], buckets: vec![Vec::new(); N_BUCKETS] }
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
    /// the front's slowness in a cell, at least 1; infinite closes it.
    pub fn march(&mut self, source: usize, window: &Window, until: Until, cost: impl Fn(usize) -> f32) {
        self.arrival.fill(f32::INFINITY);
        self.buckets.iter_mut().for_each(Vec::clear);
        let width = self.geometry.width;
        if source >= self.arrival.len() || !window.contains(source % width, source / width) {
            return;
        }
        self.arrival[source] = 0.0;
        self.buckets[0].push(source as u32);
        let bucket_m = 0.7 * self.geometry.resolution_m as f32;
        let (mut now, mut n_empty) = (0_usize, 0);
        let mut cells = Vec::new();
        while n_empty < N_BUCKETS {
            core::mem::swap(&mut cells, &mut self.buckets[now % N_BUCKETS]);
            n_empty = if cells.is_empty() { n_empty + 1 } else { 0 };
            let begins = now as f32 * bucket_m;
            if let Until::Reached { index, beyond } = until
                && begins > self.arrival[index] + beyond
            {
                break;
            }
            for index in cells.drain(..) {
                let index = index as usize;
                if self.bucket_of(index, bucket_m) == now {
                    self.spread(index, window, bucket_m, &cost);
                }
            }
            now += 1;
        }
    }

    fn bucket_of(&self, index: usize, bucket_m: f32) -> usize {
        (self.arrival[index] / bucket_m) as usize
    }

    /// The front passes a cell: its neighbours get their times from it.
    #[inline]
    fn spread(&mut self, index: usize, window: &Window, bucket_m: f32, cost: &impl Fn(usize) -> f32) {
        let width = self.geometry.width;
        let (column, row, time) = (index % width, index / width, self.arrival[index]);
        for (neighbour, inside) in [
            (index - 1, column > window.column_min),
            (index + 1, column + 1 < window.column_max),
            (index - width, row > window.row_min),
            (index + width, row + 1 < window.row_max),
        ] {
            if inside && self.arrival[neighbour] > time {
                let slowness = cost(neighbour);
                if slowness < f32::INFINITY {
                    self.relax(neighbour, slowness.clamp(1.0, COST_MAX) * self.geometry.resolution_m as f32, bucket_m);
                }
            }
        }
    }

    /// First-order upwind solution of |grad T| = cost at one cell.
    #[inline]
    fn relax(&mut self, index: usize, delay: f32, bucket_m: f32) {
        let width = self.geometry.width;
        let along = self.arrival[index - 1].min(self.arrival[index + 1]);
        let across = self.arrival[index - width].min(self.arrival[index + width]);
        let (near, far) = if along < across { (along, across) } else { (across, along) };
        let gap = far - near;
        let time =
            if gap < delay { 0.5 * (near + far + (2.0 * delay * delay - gap * gap).sqrt()) } else { near + delay };
        if time < self.arrival[index] {
            self.arrival[index] = time;
            let bucket = self.bucket_of(index, bucket_m) % N_BUCKETS;
            self.buckets[bucket].push(index as u32);
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
