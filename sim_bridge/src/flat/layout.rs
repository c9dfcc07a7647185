//! Floor plans: a rectangle divided into rooms, with doors between them.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::geometry::Rect;

/// Thickness of every wall, metres; a room's floor ends half of it from the line between two rooms.
pub const WALL_M: f64 = 0.12;
/// Shortest shared wall that can take a door, metres: the door, its frame and room to stand beside it.
const SHARED_M_MIN: f64 = 1.25;

/// What a room is for.
#[derive(Copy, Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum RoomKind {
    /// Connects the others.
    Corridor,
    /// Sofa, television, shelves.
    Living,
    /// Counter, fridge, table.
    Kitchen,
    /// Bed, wardrobe.
    Bedroom,
    /// Bath, basin, toilet, washing machine.
    Bath,
    /// Desk, shelves.
    Study,
    /// A table for six.
    Dining,
    /// A single bed, a desk, toys.
    Child,
    /// Shelves and boxes.
    Storage,
}

/// A room of the plan.
#[derive(Clone, Debug, PartialEq)]
pub struct Room {
    /// What it is for.
    pub kind: RoomKind,
    /// Up to the middle of its walls; the cells of all rooms tile the flat. World frame, metres.
    pub cell: Rect,
    /// The floor between its walls. World frame, metres.
    pub floor: Rect,
}

/// The line on which a wall stands.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Axis {
    /// The wall runs along x.
    X,
    /// The wall runs along y.
    Y,
}

/// An opening between two rooms that a robot can pass.
#[derive(Clone, Debug, PartialEq)]
pub struct Door {
    /// Indices of the two rooms: below or left of the wall first.
    pub rooms: (usize, usize),
    /// Direction of the wall.
    pub axis: Axis,
    /// y of a wall along x, x of a wall along y, metres: the middle of the wall.
    pub wall_m: f64,
    /// Where the opening begins along the wall, metres.
    pub from_m: f64,
    /// Where it ends, metres.
    pub to_m: f64,
    /// Its height, metres.
    pub height_m: f64,
}

impl Door {
    /// Middle of the opening (x, y), world frame, metres.
    #[must_use]
    pub fn centre(&self) -> (f64, f64) {
        let along = 0.5 * (self.from_m + self.to_m);
        match self.axis {
            Axis::X => (along, self.wall_m),
            Axis::Y => (self.wall_m, along),
        }
    }

    /// Clear width, metres.
    #[must_use]
    pub fn width_m(&self) -> f64 {
        self.to_m - self.from_m
    }
}

/// Rooms and doors, without anything in them.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Plan {
    /// 3 to 8 rooms that tile the flat.
    pub rooms: Vec<Room>,
    /// Every room can be reached through them.
    pub doors: Vec<Door>,
}

impl Plan {
    /// Draws a plan of 9 to 13.5 m by 8 to 10.8 m in which every room can be reached.
    pub fn draw(rng: &mut ChaCha8Rng) -> Self {
        loop {
            let plan = Self::draw_any(rng);
            if plan.is_connected() {
                return plan;
            }
        }
    }

    fn draw_any(rng: &mut ChaCha8Rng) -> Self {
        let outer = Rect::new(0.0, 0.0, rng.random_range(9.0..13.5), rng.random_range(8.0..10.8));
        let (cells, corridors) = if rng.random_bool(0.6) { along_a_corridor(outer, rng) } else { split(outer, rng) };
        let mut rooms: Vec<Room> = cells
            .iter()
            .enumerate()
            .map(|(i, &cell)| {
                let kind = if i < corridors { RoomKind::Corridor } else { RoomKind::Storage };
                Room { kind, cell, floor: cell.grown(-0.5 * WALL_M) }
            })
            .collect();
        let doors = connect(&rooms, rng);
        name_rooms(&mut rooms, &doors, rng);
        Self { rooms, doors }
    }

    fn is_connected(&self) -> bool {
        let mut reached = vec![false; self.rooms.len()];
        reached[0] = true;
        for _ in &self.rooms {
            for door in &self.doors {
                let either = reached[door.rooms.0] || reached[door.rooms.1];
                (reached[door.rooms.0], reached[door.rooms.1]) = (either, either);
            }
        }
        self.rooms.len() >= 3 && reached.into_iter().all(|r| r)
    }
}

/// A corridor with rooms on both sides, at times a room across its end or a branch. The corridors come first.
fn along_a_corridor(outer: Rect, rng: &mut ChaCha8Rng) -> (Vec<Rect>, usize) {
    let width = rng.random_range(1.35..1.8);
    let lower = rng.random_range(0.42..0.58) * (outer.depth() - width);
    let (c0, c1) = (lower, lower + width);
    let end = if outer.width() > 11.0 && rng.random_bool(0.5) { rng.random_range(3.2..4.4) } else { 0.0 };
    let x1 = outer.x1 - end;
    let mut cells = vec![Rect::new(0.0, c0, x1, c1)];
    let branch = (end == 0.0 && rng.random_bool(0.45)).then(|| rng.random_range(0.35..0.65) * x1);
    if let Some(at) = branch {
        cells.push(Rect::new(at - 0.5 * width, c1, at + 0.5 * width, outer.y1));
    }
    let corridors = cells.len();
    let bands = match branch {
        Some(at) => vec![
            Rect::new(0.0, 0.0, x1, c0),
            Rect::new(0.0, c1, at - 0.5 * width, outer.y1),
            Rect::new(at + 0.5 * width, c1, x1, outer.y1),
        ],
        None => vec![Rect::new(0.0, 0.0, x1, c0), Rect::new(0.0, c1, x1, outer.y1)],
    };
    if end > 0.0 {
        cells.push(Rect::new(x1, 0.0, outer.x1, outer.y1));
    }
    for band in bands {
        let left = 8 - cells.len();
        let n_max = (((band.width()) / 2.6).floor() as u32).clamp(1, 3).min(left.saturating_sub(1).max(1) as u32);
        slice(band, rng.random_range(1.max(n_max - 1)..=n_max), &mut cells, rng);
    }
    (cells, corridors)
}

/// Cuts a band into `n` rooms of uneven width.
fn slice(band: Rect, n: u32, cells: &mut Vec<Rect>, rng: &mut ChaCha8Rng) {
    let weights: Vec<f64> = (0..n).map(|_| rng.random_range(1.0..1.6)).collect();
    let total: f64 = weights.iter().sum();
    let mut x = band.x0;
    for (k, w) in weights.iter().enumerate() {
        let next = if k + 1 == weights.len() { band.x1 } else { x + band.width() * w / total };
        cells.push(Rect::new(x, band.y0, next, band.y1));
        x = next;
    }
}

/// Recursive halving of the largest room.
fn split(outer: Rect, rng: &mut ChaCha8Rng) -> (Vec<Rect>, usize) {
    let target = rng.random_range(5..=7);
    let mut cells = vec![outer];
    while cells.len() < target {
        let Some(largest) = (0..cells.len()).max_by(|&a, &b| cells[a].area().total_cmp(&cells[b].area())) else {
            break;
        };
        let r = cells[largest];
        let share = rng.random_range(0.38..0.62);
        let (a, b) = if r.width() > r.depth() {
            let x = r.x0 + share * r.width();
            (Rect { x1: x, ..r }, Rect { x0: x, ..r })
        } else {
            let y = r.y0 + share * r.depth();
            (Rect { y1: y, ..r }, Rect { y0: y, ..r })
        };
        if a.width().min(a.depth()).min(b.width()).min(b.depth()) < 2.3 {
            break;
        }
        cells[largest] = a;
        cells.push(b);
    }
    (cells, 0)
}

/// A wall that two rooms share: (direction, position, from, to).
fn shared_wall(a: &Rect, b: &Rect) -> Option<(Axis, f64, f64, f64)> {
    let touch = |p: f64, q: f64| (p - q).abs() < 1e-9;
    let (from, to) = (a.x0.max(b.x0), a.x1.min(b.x1));
    if touch(a.y1, b.y0) && to - from > 0.0 {
        return Some((Axis::X, a.y1, from, to));
    }
    let (from, to) = (a.y0.max(b.y0), a.y1.min(b.y1));
    (touch(a.x1, b.x0) && to - from > 0.0).then_some((Axis::Y, a.x1, from, to))
}

/// Doors that join all rooms: those to a corridor, then a random tree over the rest, then a few that close loops.
fn connect(rooms: &[Room], rng: &mut ChaCha8Rng) -> Vec<Door> {
    let mut walls = Vec::new();
    for a in 0..rooms.len() {
        for b in 0..rooms.len() {
            if let Some((axis, at, from, to)) = shared_wall(&rooms[a].cell, &rooms[b].cell)
                && to - from - WALL_M >= SHARED_M_MIN
            {
                let corridors = [a, b].iter().filter(|&&r| rooms[r].kind == RoomKind::Corridor).count() as f64;
                walls.push((rng.random_range(0.0..1.0) - 2.0 * corridors, (a, b), axis, at, from, to));
            }
        }
    }
    walls.sort_by(|p, q| p.0.total_cmp(&q.0));
    let mut group: Vec<usize> = (0..rooms.len()).collect();
    let mut doors = Vec::new();
    for (_, (a, b), axis, at, from, to) in walls {
        let joins = group[a] != group[b];
        if !joins && !rng.random_bool(0.22) {
            continue;
        }
        let (old, new) = (group[a], group[b]);
        group.iter_mut().filter(|g| **g == old).for_each(|g| *g = new);
        // Two arms of a corridor meet in the open; every other opening has the width of a door.
        let one_corridor = rooms[a].kind == RoomKind::Corridor && rooms[b].kind == RoomKind::Corridor;
        let width = if one_corridor { to - from - WALL_M - 0.24 } else { rng.random_range(0.8..1.0) };
        let from_m = opening_from((from, to), width, rng);
        doors.push(Door { rooms: (a, b), axis, wall_m: at, from_m, to_m: from_m + width, height_m: 2.05 });
    }
    doors
}

/// Where an opening of that width begins on a wall. Real doors sit near a corner more often than in the middle.
fn opening_from((from, to): (f64, f64), width: f64, rng: &mut ChaCha8Rng) -> f64 {
    let margin = 0.5 * WALL_M + 0.12;
    let slack = (to - from - 2.0 * margin - width).max(0.0);
    let share = if rng.random_bool(0.6) { rng.random_range(0.0..0.25) } else { rng.random_range(0.25..1.0) };
    let share = if rng.random_bool(0.5) { share } else { 1.0 - share };
    from + margin + share * slack
}

/// Gives every room that is no corridor a purpose: the largest is the living room, the smallest the bath.
fn name_rooms(rooms: &mut [Room], doors: &[Door], rng: &mut ChaCha8Rng) {
    let mut order: Vec<usize> = (0..rooms.len()).filter(|&i| rooms[i].kind != RoomKind::Corridor).collect();
    order.sort_by(|&a, &b| rooms[b].floor.area().total_cmp(&rooms[a].floor.area()));
    let degree = |i: usize| doors.iter().filter(|d| d.rooms.0 == i || d.rooms.1 == i).count();
    let mut take = |position: usize, kind: RoomKind, order: &mut Vec<usize>| {
        if position < order.len() {
            rooms[order.remove(position)].kind = kind;
        }
    };
    take(0, RoomKind::Living, &mut order);
    let bath = order.iter().rposition(|&i| degree(i) == 1).unwrap_or(order.len().saturating_sub(1));
    take(bath, RoomKind::Bath, &mut order);
    let kitchen = rng.random_range(0..order.len().max(1) as u32) as usize;
    take(kitchen, RoomKind::Kitchen, &mut order);
    take(0, RoomKind::Bedroom, &mut order);
    let mut rest = vec![RoomKind::Bedroom, RoomKind::Study, RoomKind::Child, RoomKind::Dining, RoomKind::Storage];
    while !order.is_empty() {
        let pick = rng.random_range(0..rest.len().max(1) as u32) as usize;
        let kind = if rest.is_empty() { RoomKind::Study } else { rest.remove(pick) };
        take(order.len() - 1, kind, &mut order);
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;

    #[test]
    fn plans_tile_a_flat_of_the_promised_size() {
        for seed in 0..200 {
            let plan = Plan::draw(&mut ChaCha8Rng::seed_from_u64(seed));
            assert!((3..=8).contains(&plan.rooms.len()), "seed {seed}: {} rooms", plan.rooms.len());
            let area: f64 = plan.rooms.iter().map(|r| r.cell.area()).sum();
            assert!((72.0..=146.0).contains(&area), "seed {seed}: {area} square metres");
            for (i, a) in plan.rooms.iter().enumerate() {
                assert!(a.floor.width().min(a.floor.depth()) > 1.1, "seed {seed}: {a:?}");
                assert!(plan.rooms.iter().skip(i + 1).all(|b| !a.cell.grown(-1e-6).overlaps(&b.cell)));
            }
            assert!(plan.doors.len() + 1 >= plan.rooms.len(), "seed {seed}");
            assert!(plan.doors.iter().all(|d| d.width_m() >= 0.8), "seed {seed}");
        }
    }
}
