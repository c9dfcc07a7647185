//! Can a robot still go from every door of a room to every other?

use super::geometry::Rect;

/// Cell side, metres.
const CELL_M: f64 = 0.05;
/// Distance kept from walls and furniture, metres: the largest robot (0.2 m) and a margin.
const CLEAR_M: f64 = 0.27;
/// Share of the empty room that must stay within reach.
const REACH_MIN: f64 = 0.4;

/// A raster of the places where the middle of a robot may be.
#[derive(Clone, Debug)]
pub(super) struct Passable {
    inner: Rect,
    width: usize,
    height: usize,
    free: Vec<bool>,
    doors: Vec<usize>,
    reach_min: usize,
}

impl Passable {
    /// An empty room; `doors` are points (x, y) just inside it.
    pub fn new(floor: Rect, doors: Vec<(f64, f64)>) -> Self {
        let inner = floor.grown(-CLEAR_M);
        let width = ((inner.width() / CELL_M).ceil() as usize).max(1);
        let height = ((inner.depth() / CELL_M).ceil() as usize).max(1);
        let mut raster =
            Self { inner, width, height, free: vec![true; width * height], doors: Vec::new(), reach_min: 0 };
        raster.doors = doors.into_iter().map(|d| raster.index(d)).collect();
        raster.reach_min = (REACH_MIN * (width * height) as f64) as usize;
        raster
    }

    /// True if the doors stay connected, and enough of the room with them, with this footprint blocked.
    pub fn admits(&self, footprint: &Rect) -> bool {
        let mut trial = self.clone();
        trial.block(footprint);
        trial.is_passable()
    }

    /// Blocks a footprint for good.
    pub fn block(&mut self, footprint: &Rect) {
        let b = footprint.grown(CLEAR_M);
        for row in 0..self.height {
            for column in 0..self.width {
                let x = self.inner.x0 + (column as f64 + 0.5) * CELL_M;
                let y = self.inner.y0 + (row as f64 + 0.5) * CELL_M;
                if b.contains(x, y) {
                    self.free[row * self.width + column] = false;
                }
            }
        }
    }

    fn index(&self, (x, y): (f64, f64)) -> usize {
        let clamp = |v: f64, n: usize| ((v / CELL_M).max(0.0) as usize).min(n - 1);
        clamp(y - self.inner.y0, self.height) * self.width + clamp(x - self.inner.x0, self.width)
    }

    fn is_passable(&self) -> bool {
        let Some(&first) = self.doors.first() else { return true };
        if !self.free[first] {
            return false;
        }
        let mut seen = vec![false; self.free.len()];
        let mut stack = vec![first];
        seen[first] = true;
        let mut reached = 0;
        while let Some(at) = stack.pop() {
            reached += 1;
            let (row, column) = (at / self.width, at % self.width);
            let near = [
                (column > 0).then(|| at - 1),
                (column + 1 < self.width).then_some(at + 1),
                (row > 0).then(|| at - self.width),
                (row + 1 < self.height).then_some(at + self.width),
            ];
            for next in near.into_iter().flatten() {
                if self.free[next] && !seen[next] {
                    seen[next] = true;
                    stack.push(next);
                }
            }
        }
        reached >= self.reach_min && self.doors.iter().all(|d| seen[*d])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_barrier_is_refused_and_a_gap_is_enough() {
        let room = Passable::new(Rect::new(0.0, 0.0, 4.0, 3.0), vec![(0.4, 1.5), (3.6, 1.5)]);
        assert!(!room.admits(&Rect::new(1.9, 0.0, 2.1, 3.0)));
        assert!(!room.admits(&Rect::new(1.9, 0.0, 2.1, 2.5)));
        assert!(room.admits(&Rect::new(1.9, 0.0, 2.1, 2.3)));
    }
}
