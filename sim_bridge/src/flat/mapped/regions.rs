//! Rooms of a map: where the floor is wide, divided where it is narrow.

use std::collections::VecDeque;

use homing_core::GridGeometry;

use super::contour::Point;
use super::map::NavMap;

/// Two rooms are one if the way between them is at least so wide, as a share of the narrower one's width.
const NECK_SHARE: f64 = 0.62;
/// A room smaller than this belongs to its neighbour, square metres.
const ROOM_M2_MIN: f64 = 2.5;
/// A room in which the way from one end to the other is longer than this is divided, metres: long corridors, halls.
const LONG_M: f64 = 6.0;
/// Floors and looks reach this far beyond the map, metres: under the walls.
pub(super) const BEYOND_M: f64 = 0.42;

/// One room of a map.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Region {
    /// Where it is widest, world frame, metres.
    pub middle: Point,
    /// From there to the nearest wall, metres.
    pub radius_m: f64,
    /// Square metres.
    pub area_m2: f64,
}

/// Which room every place of a map belongs to.
#[derive(Clone, Debug)]
pub(super) struct Regions {
    /// Where the cells lie: those of the map with [`BEYOND_M`] around them.
    pub geometry: GridGeometry,
    /// Index into `rooms`, row-major; `None` farther than [`BEYOND_M`] from the map.
    pub of_cell: Vec<Option<u32>>,
    /// Distance to what is not navigable, metres, row-major; 0 there.
    clearance_m: Vec<f64>,
    /// The rooms, the first-found first.
    pub rooms: Vec<Region>,
}

impl Regions {
    /// Finds the rooms of a map: every hill of the distance to the walls is one, unless the saddle to a higher hill is
    /// hardly lower than its top.
    pub fn of(map: &NavMap) -> Self {
        let m = (BEYOND_M / map.geometry.resolution_m).ceil() as usize;
        let inner = &map.geometry;
        let geometry = GridGeometry {
            width: inner.width + 2 * m,
            height: inner.height + 2 * m,
            resolution_m: inner.resolution_m,
            origin_x_m: inner.origin_x_m - m as f64 * inner.resolution_m,
            origin_y_m: inner.origin_y_m - m as f64 * inner.resolution_m,
        };
        let mut open = vec![false; geometry.len()];
        for row in 0..inner.height {
            for column in 0..inner.width {
                open[geometry.index(column + m, row + m)] = map.navigable[inner.index(column, row)];
            }
        }
        let clearance_m = clearances(&open, &geometry);
        let basins = basins(&clearance_m, &geometry);
        let mut regions = Self { geometry, of_cell: basins, clearance_m, rooms: Vec::new() };
        regions.number();
        regions.divide_long_ones();
        regions.spread(m);
        regions
    }

    /// The room at a point of the world frame, metres.
    pub fn at(&self, p: Point) -> Option<u32> {
        let (column, row) = self.geometry.cell_at(p.0, p.1)?;
        self.of_cell[self.geometry.index(column, row)]
    }

    /// Distance from a point to what is not navigable, metres; 0 there.
    pub fn clearance_m(&self, p: Point) -> f64 {
        self.geometry.cell_at(p.0, p.1).map_or(0.0, |(c, r)| self.clearance_m[self.geometry.index(c, r)])
    }

    /// True if a navigable cell's centre lies within `radius_m` metres of a point.
    pub fn is_navigable_near(&self, p: Point, radius_m: f64) -> bool {
        let g = &self.geometry;
        let Some((column, row)) = g.cell_at(p.0, p.1) else { return false };
        let reach = (radius_m / g.resolution_m).ceil() as usize;
        let columns = column.saturating_sub(reach)..(column + reach + 1).min(g.width);
        let rows = row.saturating_sub(reach)..(row + reach + 1).min(g.height);
        rows.flat_map(|r| columns.clone().map(move |c| (c, r))).any(|(c, r)| {
            self.clearance_m[g.index(c, r)] > 0.0 && super::contour::distance(g.centre(c, r), p) < radius_m
        })
    }

    /// Up to `n` places of a room far from each other and at least `clear_m` from what is not navigable, the room's
    /// middle first.
    pub fn places(&self, room: u32, n: usize, clear_m: f64) -> Vec<Point> {
        let g = &self.geometry;
        let inside: Vec<Point> = (0..g.len())
            .filter(|i| self.of_cell[*i] == Some(room) && self.clearance_m[*i] >= clear_m)
            .map(|i| g.centre(i % g.width, i / g.width))
            .collect();
        let mut chosen = vec![self.rooms[room as usize].middle];
        while chosen.len() < n {
            let gap = |p: &Point| chosen.iter().map(|c| super::contour::distance(*c, *p)).fold(f64::MAX, f64::min);
            let Some(next) = inside.iter().copied().max_by(|a, b| gap(a).total_cmp(&gap(b))) else { break };
            chosen.push(next);
        }
        chosen
    }

    /// Halves every room that is long, between the two places in it that are farthest apart, until none is.
    fn divide_long_ones(&mut self) {
        let long = (LONG_M / self.geometry.resolution_m) as u32;
        let mut seeds: Vec<usize> = Vec::new();
        for (room, region) in (0_u32..).zip(&self.rooms) {
            let middle = self.geometry.cell_at(region.middle.0, region.middle.1);
            seeds.extend(middle.map(|(c, r)| self.geometry.index(c, r)).filter(|i| self.of_cell[*i] == Some(room)));
        }
        let mut rooms = seeds.len() as u32;
        while let Some(seed) = seeds.pop() {
            let Some((one, _)) = farthest(&self.steps_within(seed)) else { continue };
            let from_one = self.steps_within(one);
            let Some((other, _)) = farthest(&from_one).filter(|(_, steps)| *steps > long) else { continue };
            let from_other = self.steps_within(other);
            let nearer = (0..from_one.len()).filter(|i| from_other[*i] < from_one[*i]);
            nearer.for_each(|i| self.of_cell[i] = Some(rooms));
            rooms += 1;
            seeds.extend([one, other]);
        }
        self.rooms.clear();
        self.number();
    }

    /// Steps from a cell to all others of its room; `u32::MAX` where there is no way within it.
    fn steps_within(&self, from: usize) -> Vec<u32> {
        let room = self.of_cell[from];
        let mut steps = vec![u32::MAX; self.of_cell.len()];
        let mut queue = VecDeque::from([from]);
        steps[from] = 0;
        while let Some(at) = queue.pop_front() {
            for next in neighbours(at, &self.geometry) {
                if steps[next] == u32::MAX && self.of_cell[next] == room {
                    steps[next] = steps[at] + 1;
                    queue.push_back(next);
                }
            }
        }
        steps
    }

    /// Numbers the rooms from 0 and measures them.
    fn number(&mut self) {
        let mut names: Vec<u32> = Vec::new();
        for index in 0..self.of_cell.len() {
            let Some(basin) = self.of_cell[index] else { continue };
            let room = names.iter().position(|n| *n == basin).unwrap_or_else(|| {
                names.push(basin);
                self.rooms.push(Region { middle: (0.0, 0.0), radius_m: 0.0, area_m2: 0.0 });
                names.len() - 1
            });
            self.of_cell[index] = Some(room as u32);
            let region = &mut self.rooms[room];
            region.area_m2 += self.geometry.resolution_m * self.geometry.resolution_m;
            if self.clearance_m[index] > region.radius_m {
                region.radius_m = self.clearance_m[index];
                region.middle = self.geometry.centre(index % self.geometry.width, index / self.geometry.width);
            }
        }
    }

    /// Lets every room reach `steps` cells beyond the map.
    fn spread(&mut self, steps: usize) {
        for _ in 0..steps {
            let before = self.of_cell.clone();
            for index in 0..before.len() {
                if before[index].is_none() {
                    self.of_cell[index] = neighbours(index, &self.geometry).find_map(|n| before[n]);
                }
            }
        }
    }
}

/// The cell most steps away, and how many.
fn farthest(steps: &[u32]) -> Option<(usize, u32)> {
    steps.iter().copied().enumerate().filter(|(_, s)| *s < u32::MAX).max_by_key(|(_, s)| *s)
}

fn neighbours(index: usize, g: &GridGeometry) -> impl Iterator<Item = usize> {
    let (column, row, width, height) = (index % g.width, index / g.width, g.width, g.height);
    let near = [
        (column > 0).then(|| index - 1),
        (column + 1 < width).then_some(index + 1),
        (row > 0).then(|| index - width),
        (row + 1 < height).then_some(index + width),
    ];
    near.into_iter().flatten()
}

/// Distances to the nearest closed cell by chamfer 3-4 (Borgefors 1986), metres.
fn clearances(open: &[bool], g: &GridGeometry) -> Vec<f64> {
    let mut steps: Vec<u32> = open.iter().map(|o| if *o { u32::MAX / 2 } else { 0 }).collect();
    let relax = |steps: &mut Vec<u32>, index: usize, sign: i64| {
        let w = g.width as i64;
        let (column, row) = ((index as i64) % w, index as i64 / w);
        for (dc, dr, cost) in [(-1, 0, 3), (0, -1, 3), (-1, -1, 4), (1, -1, 4)] {
            let (c, r) = (column + sign * dc, row + sign * dr);
            if c >= 0 && r >= 0 && c < w && r < g.height as i64 {
                steps[index] = steps[index].min(steps[(r * w + c) as usize] + cost);
            }
        }
    };
    (0..open.len()).for_each(|i| relax(&mut steps, i, 1));
    (0..open.len()).rev().for_each(|i| relax(&mut steps, i, -1));
    steps.into_iter().map(|s| f64::from(s) / 3.0 * g.resolution_m).collect()
}

/// Hills of a height field by flooding from the tops down; each cell gets the name of its hill.
fn basins(height: &[f64], g: &GridGeometry) -> Vec<Option<u32>> {
    let mut order: Vec<usize> = (0..height.len()).filter(|i| height[*i] > 0.0).collect();
    order.sort_by(|a, b| height[*b].total_cmp(&height[*a]).then(a.cmp(b)));
    let mut of_cell: Vec<Option<u32>> = vec![None; height.len()];
    // By name: top, cells, and the hill it became part of.
    let mut hills: Vec<(f64, usize, u32)> = Vec::new();
    let root = |hills: &[(f64, usize, u32)], mut name: u32| {
        while hills[name as usize].2 != name {
            name = hills[name as usize].2;
        }
        name
    };
    let cells_min = ROOM_M2_MIN / (g.resolution_m * g.resolution_m);
    for index in order {
        let mut near: Vec<u32> = neighbours(index, g).filter_map(|n| of_cell[n]).map(|n| root(&hills, n)).collect();
        near.sort_by(|a, b| hills[*b as usize].0.total_cmp(&hills[*a as usize].0).then(a.cmp(b)));
        near.dedup();
        let Some(&highest) = near.first() else {
            let name = hills.len() as u32;
            hills.push((height[index], 1, name));
            of_cell[index] = Some(name);
            continue;
        };
        for &lower in &near[1..] {
            let (top, cells, _) = hills[lower as usize];
            if height[index] > NECK_SHARE * top || (cells as f64) < cells_min {
                hills[lower as usize].2 = highest;
                hills[highest as usize].1 += cells;
            }
        }
        hills[highest as usize].1 += 1;
        of_cell[index] = Some(highest);
    }
    of_cell.into_iter().map(|name| name.map(|n| root(&hills, n))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(rows: &[&str], resolution_m: f64) -> NavMap {
        let geometry =
            GridGeometry { width: rows[0].len(), height: rows.len(), resolution_m, origin_x_m: 0.0, origin_y_m: 0.0 };
        let navigable = rows.iter().flat_map(|r| r.bytes().map(|b| b == b'.')).collect();
        NavMap { name: "drawn".into(), geometry, navigable, floor_y_m: 0.0 }
    }

    #[test]
    fn a_door_divides_two_rooms_and_a_wide_way_does_not() {
        let door = ["......#......", "......#......", ".............", "......#......", "......#......"];
        let rooms = Regions::of(&map(&door, 0.5)).rooms;
        assert_eq!(rooms.len(), 2, "{rooms:?}");
        let area: f64 = rooms.iter().map(|r| r.area_m2).sum();
        assert!((area - 61.0 * 0.25).abs() < 1e-9);
        let wide = ["......#......", ".............", ".............", ".............", "......#......"];
        assert_eq!(Regions::of(&map(&wide, 0.35)).rooms.len(), 1);
    }

    #[test]
    fn a_long_corridor_is_more_than_one_room() {
        let rooms = Regions::of(&map(&["........................................"; 3], 0.5)).rooms;
        assert!((3..=6).contains(&rooms.len()), "20 m: {} rooms", rooms.len());
        let area: f64 = rooms.iter().map(|r| r.area_m2).sum();
        assert!((area - 30.0).abs() < 1e-9 && rooms.iter().all(|r| r.area_m2 > 2.0), "{rooms:?}");
    }

    #[test]
    fn a_room_reaches_under_its_walls_and_no_farther() {
        let regions = Regions::of(&map(&["....", "....", "....", "...."], 0.5));
        assert_eq!(regions.at((-0.2, 1.0)), Some(0));
        assert_eq!(regions.at((-0.9, 1.0)), None);
        assert_eq!(regions.clearance_m((-0.2, 1.0)), 0.0);
        assert!((regions.rooms[0].radius_m - 1.0).abs() < 1e-9, "two cells from the border");
    }
}
