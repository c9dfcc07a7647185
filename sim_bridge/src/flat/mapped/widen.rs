//! From where an agent's centre can be to the floor between the walls.
//!
//! A map of agents' centres ends one agent's radius before the walls. So the floor is wider than the map, but widening
//! must not join what a thin wall divides, nor swallow a chair in the open: cells are added nearest first, and only
//! where that changes neither the number of floors nor that of holes (simple points; Kong and Rosenfeld 1989).

use homing_core::GridGeometry;

use super::map::NavMap;

/// Cells of the widened floor are about so large, metres.
const CELL_M: f64 = 0.025;
/// Passes over the cells that could not be added at first.
const PASSES: usize = 6;

/// The eight neighbours in order around a cell; those across a side come at even places.
const AROUND: [(i64, i64); 8] = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)];

/// A floor plan as cells.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Floor {
    /// Where the cells lie, world frame; the outermost are never floor.
    pub geometry: GridGeometry,
    /// One flag a cell, row-major.
    pub open: Vec<bool>,
}

impl Floor {
    /// The floor of a map, `by_m` metres wider on all sides.
    pub fn of(map: &NavMap, by_m: f64) -> Self {
        let (coarse, times) = (&map.geometry, (map.geometry.resolution_m / CELL_M).round().clamp(1.0, 16.0) as usize);
        let cell_m = coarse.resolution_m / times as f64;
        let margin = (by_m / cell_m).ceil() as usize + 2;
        let geometry = GridGeometry {
            width: coarse.width * times + 2 * margin,
            height: coarse.height * times + 2 * margin,
            resolution_m: cell_m,
            origin_x_m: coarse.origin_x_m - margin as f64 * cell_m,
            origin_y_m: coarse.origin_y_m - margin as f64 * cell_m,
        };
        let mut floor = Self { geometry, open: vec![false; geometry.len()] };
        for row in 0..coarse.height * times {
            for column in 0..coarse.width * times {
                let index = geometry.index(column + margin, row + margin);
                floor.open[index] = map.navigable[coarse.index(column / times, row / times)];
            }
        }
        floor.widen(by_m / cell_m);
        floor
    }

    fn widen(&mut self, reach: f64) {
        let mut waiting = self.within(reach + 0.5);
        for _ in 0..PASSES {
            let before = waiting.len();
            waiting.retain(|&(_, index)| {
                let simple = self.is_simple(index);
                self.open[index] = simple;
                !simple
            });
            if waiting.len() == before {
                break;
            }
        }
    }

    /// Cells that are no floor, by squared distance (in cells, centre to centre) from it, nearest first.
    fn within(&self, reach: f64) -> Vec<(u32, usize)> {
        let (width, r) = (self.geometry.width as i64, reach.floor() as i64);
        let mut nearest = vec![u32::MAX; self.open.len()];
        for index in (0..self.open.len()).filter(|i| self.open[*i]) {
            if AROUND.iter().all(|(dc, dr)| self.open[(index as i64 + dr * width + dc) as usize]) {
                continue;
            }
            for (dr, dc) in (-r..=r).flat_map(|dr| (-r..=r).map(move |dc| (dr, dc))) {
                let squared = (dr * dr + dc * dc) as u32;
                if f64::from(squared) <= reach * reach {
                    let at = (index as i64 + dr * width + dc) as usize;
                    nearest[at] = nearest[at].min(squared);
                }
            }
        }
        let mut cells: Vec<(u32, usize)> = nearest
            .into_iter()
            .enumerate()
            .filter(|(i, d)| *d < u32::MAX && !self.open[*i])
            .map(|(i, d)| (d, i))
            .collect();
        cells.sort_unstable();
        cells
    }

    /// True if opening a cell joins no two floors (through sides or corners) and closes no hole (through sides).
    fn is_simple(&self, index: usize) -> bool {
        let width = self.geometry.width as i64;
        let open = AROUND.map(|(dc, dr)| self.open[(index as i64 + dr * width + dc) as usize]);
        // Yokoi's number: runs of closed cells around this one that reach it through a side.
        let side = |k: usize| !open[(2 * k) % 8];
        let runs = (0..4).filter(|k| side(*k) && (open[2 * k + 1] || !side(k + 1))).count();
        runs == 1 && open.contains(&true)
    }

    /// True if the cell is floor; outside the grid nothing is.
    pub fn is_open(&self, column: i64, row: i64) -> bool {
        let g = &self.geometry;
        let inside = column >= 0 && row >= 0 && column < g.width as i64 && row < g.height as i64;
        inside && self.open[g.index(column as usize, row as usize)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A map from a drawing, `.` navigable, 0.1 m a cell.
    fn map(rows: &[&str]) -> NavMap {
        let geometry = GridGeometry {
            width: rows[0].len(),
            height: rows.len(),
            resolution_m: 0.1,
            origin_x_m: 0.0,
            origin_y_m: 0.0,
        };
        let navigable = rows.iter().flat_map(|r| r.bytes().map(|b| b == b'.')).collect();
        NavMap { name: "drawn".into(), geometry, navigable, floor_y_m: 0.0 }
    }

    /// Number of open and of closed components, by corners and by sides.
    fn components(floor: &Floor) -> (usize, usize) {
        let count = |open: bool| {
            let mut seen: Vec<bool> = floor.open.iter().map(|o| *o != open).collect();
            let step = if open { 1 } else { 2 };
            let mut n = 0;
            for seed in 0..seen.len() {
                if core::mem::replace(&mut seen[seed], true) {
                    continue;
                }
                n += 1;
                let mut stack = vec![seed];
                while let Some(at) = stack.pop() {
                    let (column, row) = ((at % floor.geometry.width) as i64, (at / floor.geometry.width) as i64);
                    for (dc, dr) in AROUND.iter().step_by(step) {
                        let (c, r) = (column + dc, row + dr);
                        let inside =
                            c >= 0 && r >= 0 && c < floor.geometry.width as i64 && r < floor.geometry.height as i64;
                        if inside && !core::mem::replace(&mut seen[floor.geometry.index(c as usize, r as usize)], true)
                        {
                            stack.push(floor.geometry.index(c as usize, r as usize));
                        }
                    }
                }
            }
            n
        };
        (count(true), count(false))
    }

    #[test]
    fn a_lone_square_grows_by_its_margin() {
        let floor = Floor::of(&map(&["......"; 6]), 0.1);
        let area = floor.open.iter().filter(|o| **o).count() as f64 * floor.geometry.resolution_m.powi(2);
        // 0.6 m squared, four borders of 0.1 m, four quarters of a disc of 0.1 m radius: 0.6314.
        assert!((area - 0.6314).abs() < 0.02, "{area}");
    }

    #[test]
    fn neither_thin_walls_nor_small_things_are_swallowed() {
        let drawn = map(&["...#...", "...#...", "...#...", "...#...", "...#...", "...#.#.", "...#..."]);
        let before = components(&Floor::of(&drawn, 0.0));
        assert_eq!(before, (2, 2), "two rooms; the outside and a post");
        let floor = Floor::of(&drawn, 0.2);
        assert_eq!(components(&floor), (2, 2));
        let blocked = |x: f64| {
            let (c, r) = floor.geometry.cell_at(x, 0.3).unwrap_or_default();
            !floor.open[floor.geometry.index(c, r)]
        };
        assert!((30..40).any(|k| blocked(0.01 * f64::from(k) + 0.005)), "the wall still stands");
    }
}
