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
    /// The only cells that may have an arrival time.
    marched: Window,
    // A front that crosses a cell in `step` at the fastest reaches no neighbour sooner than `step / sqrt(2)` later, if the
    // front comes to it from one side. So the cells of one bucket that wide hardly depend on each other, and no order is
    // needed among them: a ring of buckets does what a heap would, without sorting. Where the front comes from two sides, a
    // cell's time may fall into the bucket of the later side: such cells are taken before the next bucket is. A cell may
    // lie in several buckets; only the one of its time counts.
    buckets: Vec<Vec<u32>>,
}

impl Marcher {
    /// For grids of one geometry.
    #[must_use]
    pub fn new(geometry: GridGeometry) -> Self {
        Self {
            geometry,
            arrival: vec![f32::INFINITY; geometry.len()],
            marched: Window { column_min: 0, column_max: 0, row_min: 0, row_max: 0 },
            buckets: vec![Vec::new(); N_BUCKETS],
        }
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
        self.clear();
        let width = self.geometry.width;
        if source >= self.arrival.len() || !window.contains(source % width, source / width) {
            return;
        }
        self.marched = *window;
        self.arrival[source] = 0.0;
        self.buckets[0].push(source as u32);
        let front = Front::new(&self.geometry, window, cost);
        let mut cells = Vec::new();
        let (mut now, mut n_empty) = (0_usize, 0);
        while n_empty < N_BUCKETS {
            if let Until::Reached { index, beyond } = until
                && now as f32 * front.bucket_m > self.arrival[index] + beyond
            {
                break;
            }
            n_empty += 1;
            while !self.buckets[now % N_BUCKETS].is_empty() {
                n_empty = 0;
                core::mem::swap(&mut cells, &mut self.buckets[now % N_BUCKETS]);
                for index in cells.drain(..) {
                    front.pass(index as usize, now, &mut self.arrival, &mut self.buckets);
                }
            }
            now += 1;
        }
    }

    /// Forgets the last march. A map is mostly unknown: only the window is touched.
    fn clear(&mut self) {
        let (w, width) = (self.marched, self.geometry.width);
        for row in w.row_min..w.row_max {
            self.arrival[row * width + w.column_min..row * width + w.column_max].fill(f32::INFINITY);
        }
        self.buckets.iter_mut().for_each(Vec::clear);
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

/// What a march does not change.
struct Front<F> {
    width: usize,
    window: Window,
    step_m: f32,
    bucket_m: f32,
    buckets_per_m: f32,
    cost: F,
}

impl<F: Fn(usize) -> f32> Front<F> {
    fn new(geometry: &GridGeometry, window: &Window, cost: F) -> Self {
        let step_m = geometry.resolution_m as f32;
        let bucket_m = 0.7 * step_m;
        Self { width: geometry.width, window: *window, step_m, bucket_m, buckets_per_m: 1.0 / bucket_m, cost }
    }

    fn bucket_of(&self, time: f32) -> usize {
        (time * self.buckets_per_m) as usize
    }

    /// The front passes a cell of bucket `now`: its neighbours get their times from it.
    #[inline]
    fn pass(&self, index: usize, now: usize, arrival: &mut [f32], buckets: &mut [Vec<u32>]) {
        let (w, width, time) = (&self.window, self.width, arrival[index]);
        if self.bucket_of(time) != now {
            return;
        }
        let (column, row) = (index % width, index / width);
        for (neighbour, inside) in [
            (index - 1, column > w.column_min),
            (index + 1, column + 1 < w.column_max),
            (index - width, row > w.row_min),
            (index + width, row + 1 < w.row_max),
        ] {
            if inside && arrival[neighbour] > time {
                let slowness = (self.cost)(neighbour);
                if slowness < f32::INFINITY {
                    self.relax(neighbour, slowness.clamp(1.0, COST_MAX) * self.step_m, now, arrival, buckets);
                }
            }
        }
    }

    /// First-order upwind solution of |grad T| = cost at one cell.
    #[inline]
    fn relax(&self, index: usize, delay: f32, now: usize, arrival: &mut [f32], buckets: &mut [Vec<u32>]) {
        let along = arrival[index - 1].min(arrival[index + 1]);
        let across = arrival[index - self.width].min(arrival[index + self.width]);
        let (near, far) = if along < across { (along, across) } else { (across, along) };
        let gap = far - near;
        let time =
            if gap < delay { 0.5 * (near + far + (2.0 * delay * delay - gap * gap).sqrt()) } else { near + delay };
        let before = arrival[index];
        if time < before {
            arrival[index] = time;
            let bucket = self.bucket_of(time);
            // In a bucket to come it lies already; in this one it may have been taken.
            if bucket == now || bucket != self.bucket_of(before) {
                buckets[bucket % N_BUCKETS].push(index as u32);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    /// A litter of closed cells on 8 x 8 m, the others up to `cost_max` times as slow as free ones.
    fn littered(cost_max: f32) -> (GridGeometry, Vec<f32>) {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let geometry = GridGeometry::centred(8.0, 0.05);
        let mut cost = || if rng.random_bool(0.25) { f32::INFINITY } else { rng.random_range(1.0..cost_max) };
        (geometry, (0..geometry.len()).map(|_| cost()).collect())
    }

    fn inner(g: &GridGeometry, margin: usize) -> Window {
        Window { column_min: margin, column_max: g.width - margin, row_min: margin, row_max: g.height - margin }
    }

    /// The definition of the solution: no cell is later than its neighbours let it be, and none is earlier.
    #[test]
    fn every_cell_has_the_time_its_neighbours_give_it() {
        for cost_max in [1.001, 1.5, 3.0, 50.0] {
            let (g, cost) = littered(cost_max);
            let (source, window) = (g.index(80, 80), inner(&g, 1));
            let mut marcher = Marcher::new(g);
            marcher.march(source, &window, Until::Everywhere, |i| cost[i]);
            let t = marcher.arrival();
            let mut n_reached = 0;
            for (column, row) in window.cells() {
                let i = g.index(column, row);
                let (along, across) = (t[i - 1].min(t[i + 1]), t[i - g.width].min(t[i + g.width]));
                let (near, far, delay) = (along.min(across), along.max(across), 0.05 * cost[i]);
                if i == source || cost[i] == f32::INFINITY || near == f32::INFINITY {
                    assert!(i == source || t[i] == f32::INFINITY, "{column}, {row}: {}", t[i]);
                    continue;
                }
                let gap = far - near;
                let both = 0.5 * (near + far + (2.0 * delay * delay - gap * gap).sqrt());
                let due = if gap < delay { both } else { near + delay };
                assert!((t[i] - due).abs() <= 1e-6 * due, "{column}, {row}: {} instead of {due}", t[i]);
                n_reached += 1;
            }
            assert!(n_reached > 18_000, "{n_reached}");
        }
    }

    #[test]
    fn a_march_leaves_nothing_to_the_next() {
        let (g, cost) = littered(3.0);
        let mut used = Marcher::new(g);
        used.march(g.index(80, 80), &inner(&g, 1), Until::Everywhere, |_| 1.0);
        let mut fresh = Marcher::new(g);
        for marcher in [&mut used, &mut fresh] {
            marcher.march(g.index(60, 70), &inner(&g, 40), Until::Everywhere, |i| cost[i].min(9.0));
        }
        assert_eq!(used.arrival(), fresh.arrival());
        assert_eq!(used.arrival().iter().filter(|t| t.is_finite()).count(), 80 * 80);
        used.march(g.index(10, 10), &inner(&g, 40), Until::Everywhere, |_| 1.0);
        assert!(used.arrival().iter().all(|t| *t == f32::INFINITY), "the source lies outside the window");
    }
}
