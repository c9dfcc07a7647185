//! The flat without furniture: floors, walls with their openings, skirting boards, door leaves, windows, ceilings, lamps.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::builder::{Finish, Look, SceneBuilder};
use super::geometry::{Rect, Side, Spot};
use super::layout::{Axis, Door, Plan, Room, RoomKind, WALL_M};
use super::pen::{Mapping, Pen};
use super::style::{RoomStyle, Style, pick};
use crate::scene::Lamp;

/// Faces are cut into pieces no longer than this, metres: the renderer lights each on a map of its own.
const PIECE_M: f64 = 3.0;

/// A hole in one wall of one room, in the wall's frame.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(super) struct Opening {
    /// Along the wall, metres.
    pub along: (f64, f64),
    /// Heights, metres.
    pub height: (f64, f64),
    /// What it is.
    pub kind: OpeningKind,
}

/// What a hole in a wall is for.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(super) enum OpeningKind {
    /// A way into the next room.
    Passage,
    /// Daylight.
    Window,
}

/// The four walls of a room and what is fixed to them.
#[derive(Clone, Debug)]
pub(super) struct Walls {
    /// By [`Side::ALL`].
    pub openings: [Vec<Opening>; 4],
    /// Spans covered by open door leaves, by side, metres along the wall.
    pub leaves: [Vec<(f64, f64)>; 4],
}

/// Finds the openings of every room and hangs a leaf into most doors.
pub(super) fn plan_walls(plan: &Plan, height_m: f64, rng: &mut ChaCha8Rng) -> Vec<Walls> {
    let mut walls: Vec<Walls> = plan.rooms.iter().map(|room| openings_of(plan, room, height_m, rng)).collect();
    for (index, door) in plan.doors.iter().enumerate() {
        if door.width_m() > 1.05 || rng.random_bool(0.3) {
            continue;
        }
        let first = rng.random_bool(0.5);
        let order = if first { [door.rooms.0, door.rooms.1] } else { [door.rooms.1, door.rooms.0] };
        for room in order {
            if hang_leaf(plan, index, room, &mut walls) {
                break;
            }
        }
    }
    walls
}

/// The side of a room in which a door is, and the door's span along that wall.
pub(super) fn span_of(room: &Room, door: &Door) -> Option<(usize, (f64, f64))> {
    let side = match door.axis {
        Axis::X if (room.cell.y1 - door.wall_m).abs() < 1e-9 => Side::North,
        Axis::X if (room.cell.y0 - door.wall_m).abs() < 1e-9 => Side::South,
        Axis::Y if (room.cell.x1 - door.wall_m).abs() < 1e-9 => Side::East,
        Axis::Y if (room.cell.x0 - door.wall_m).abs() < 1e-9 => Side::West,
        _ => return None,
    };
    let frame = room.floor.side(side);
    let ends = match door.axis {
        Axis::X => [frame.local(door.from_m, 0.0).0, frame.local(door.to_m, 0.0).0],
        Axis::Y => [frame.local(0.0, door.from_m).0, frame.local(0.0, door.to_m).0],
    };
    let index = Side::ALL.iter().position(|s| *s == side)?;
    Some((index, (ends[0].min(ends[1]), ends[0].max(ends[1]))))
}

fn openings_of(plan: &Plan, room: &Room, height_m: f64, rng: &mut ChaCha8Rng) -> Walls {
    let mut openings: [Vec<Opening>; 4] = Default::default();
    let index = plan.rooms.iter().position(|r| r == room).unwrap_or(0);
    for door in plan.doors.iter().filter(|d| d.rooms.0 == index || d.rooms.1 == index) {
        if let Some((side, along)) = span_of(room, door) {
            openings[side].push(Opening { along, height: (0.0, door.height_m), kind: OpeningKind::Passage });
        }
    }
    let outer = plan.rooms.iter().fold(plan.rooms[0].cell, |r, c| {
        Rect::new(r.x0.min(c.cell.x0), r.y0.min(c.cell.y0), r.x1.max(c.cell.x1), r.y1.max(c.cell.y1))
    });
    for (k, side) in Side::ALL.into_iter().enumerate() {
        let outside = match side {
            Side::South => room.cell.y0 <= outer.y0,
            Side::East => room.cell.x1 >= outer.x1,
            Side::North => room.cell.y1 >= outer.y1,
            Side::West => room.cell.x0 <= outer.x0,
        };
        if outside {
            openings[k].extend(windows(room, room.floor.side_length(side), height_m, rng));
        }
        openings[k].sort_by(|a, b| a.along.0.total_cmp(&b.along.0));
    }
    Walls { openings, leaves: Default::default() }
}

fn windows(room: &Room, length: f64, height_m: f64, rng: &mut ChaCha8Rng) -> Vec<Opening> {
    let (width, sill) = match room.kind {
        RoomKind::Bath => (0.7, 1.3),
        RoomKind::Kitchen => (1.0, 1.15),
        RoomKind::Living => (rng.random_range(1.3..1.9), 0.75),
        _ => (rng.random_range(1.0..1.4), 0.85),
    };
    let n = (((length - 0.4) / (width + 1.1)).floor() as usize).min(3);
    let pitch = length / n.max(1) as f64;
    let top = (height_m - 0.3).min(2.2);
    (0..n)
        .map(|k| {
            let middle = (k as f64 + 0.5) * pitch + rng.random_range(-0.1..0.1);
            let along = (middle - 0.5 * width, middle + 0.5 * width);
            Opening { along, height: (sill, top), kind: OpeningKind::Window }
        })
        .collect()
}

/// Hangs the leaf of a door into a room if the wall beside the opening is free; it stands open against that wall.
fn hang_leaf(plan: &Plan, door: usize, room: usize, walls: &mut [Walls]) -> bool {
    let Some((side, (a0, a1))) = span_of(&plan.rooms[room], &plan.doors[door]) else { return false };
    let length = plan.rooms[room].floor.side_length(Side::ALL[side]);
    let width = a1 - a0;
    for span in [(a0 - width - 0.02, a0 - 0.02), (a1 + 0.02, a1 + width + 0.02)] {
        let clear = |other: (f64, f64)| other.1 + 0.1 < span.0 || other.0 - 0.1 > span.1;
        let wall = &walls[room];
        let others = wall.openings[side].iter().map(|o| o.along).filter(|o| (o.0 - a0).abs() > 1e-9);
        if span.0 > 0.05 && span.1 < length - 0.05 && others.chain(wall.leaves[side].iter().copied()).all(clear) {
            walls[room].leaves[side].push(span);
            return true;
        }
    }
    false
}

/// Draws one room's shell.
pub(super) fn build_room(
    scene: &mut SceneBuilder,
    room: &Room,
    walls: &Walls,
    style: &Style,
    look: &RoomStyle,
    height_m: f64,
    rng: &mut ChaCha8Rng,
) {
    let plan = &mut scene.pen(Spot::new(0.0, 0.0, 0));
    slab(plan, &look.floor, &room.cell, 0.0, Facing::Up);
    slab(plan, &style.ceiling, &room.cell, height_m, Facing::Down);
    for (k, side) in Side::ALL.into_iter().enumerate() {
        let (frame, length) = (room.floor.side(side), room.floor.side_length(side));
        let pen = &mut scene.pen(frame);
        wall(pen, &look.wall, length, height_m, &walls.openings[k]);
        skirting(&mut pen.ghost(), style, length, &walls.openings[k]);
        for opening in &walls.openings[k] {
            match opening.kind {
                OpeningKind::Passage => frame_passage(pen, style, opening),
                OpeningKind::Window => frame_window(pen, style, opening, rng),
            }
        }
        for leaf in &walls.leaves[k] {
            pen.cuboid(&style.trim, [leaf.0, 0.05, 0.01], [leaf.1, 0.09, 2.02]);
            pen.front(&style.door, *leaf, 0.091, (0.01, 2.02));
        }
    }
    lamps(scene, room, style, height_m, rng);
}

/// Which way a slab looks.
#[derive(Copy, Clone, PartialEq, Eq)]
pub(super) enum Facing {
    /// A floor.
    Up,
    /// A ceiling.
    Down,
}

/// A level rectangle at a height, metres.
pub(super) fn slab(pen: &mut Pen<'_>, look: &Look, area: &Rect, z: f64, facing: Facing) {
    let (xs, ys) = (cuts(area.x0, area.x1, &[]), cuts(area.y0, area.y1, &[]));
    for x in xs.windows(2) {
        for y in ys.windows(2) {
            let mut c = [[x[0], y[0], z], [x[1], y[0], z], [x[1], y[1], z], [x[0], y[1], z]];
            if facing == Facing::Down {
                c = [c[3], c[2], c[1], c[0]];
            }
            pen.face(look, c, Mapping::Metres(x[0], -y[1]));
        }
    }
}

/// The plane of a wall without its openings. It is a little larger than the room, so that no crack shows in a corner.
fn wall(pen: &mut Pen<'_>, look: &Look, length: f64, height_m: f64, openings: &[Opening]) {
    let ends: Vec<f64> = openings.iter().flat_map(|o| [o.along.0, o.along.1]).collect();
    let levels: Vec<f64> = openings.iter().flat_map(|o| [o.height.0, o.height.1]).collect();
    let (along, up) = (cuts(-0.01, length + 0.01, &ends), cuts(-0.01, height_m + 0.01, &levels));
    for a in along.windows(2) {
        for z in up.windows(2) {
            let (am, zm) = (0.5 * (a[0] + a[1]), 0.5 * (z[0] + z[1]));
            let inside = |o: &Opening| o.along.0 < am && am < o.along.1 && o.height.0 < zm && zm < o.height.1;
            if !openings.iter().any(inside) {
                let c = [[a[1], 0.0, z[0]], [a[0], 0.0, z[0]], [a[0], 0.0, z[1]], [a[1], 0.0, z[1]]];
                pen.face(look, c, Mapping::Metres(length - a[1], height_m - z[1]));
            }
        }
    }
}

/// From `from` to `to` through all `marks`, in pieces no longer than [`PIECE_M`].
pub(super) fn cuts(from: f64, to: f64, marks: &[f64]) -> Vec<f64> {
    let mut fixed: Vec<f64> = marks.iter().copied().filter(|m| *m > from && *m < to).collect();
    fixed.extend([from, to]);
    fixed.sort_by(f64::total_cmp);
    fixed.dedup_by(|a, b| (*a - *b).abs() < 1e-6);
    let mut all = vec![fixed[0]];
    for pair in fixed.windows(2) {
        let n = ((pair[1] - pair[0]) / PIECE_M).ceil().max(1.0);
        all.extend((1..=n as u32).map(|k| pair[0] + (pair[1] - pair[0]) * f64::from(k) / n));
    }
    all
}

fn skirting(pen: &mut Pen<'_>, style: &Style, length: f64, openings: &[Opening]) {
    let mut from = 0.0;
    let doors = openings.iter().filter(|o| o.kind == OpeningKind::Passage).map(|o| o.along);
    for (a0, a1) in doors.chain([(length, length)]) {
        if a0 - from > 0.1 {
            pen.cuboid(&style.trim, [from, -0.01, 0.0], [a0 - 0.05, 0.014, 0.075]);
        }
        from = a1 + 0.05;
    }
}

/// The half of a passage that belongs to this room: jambs, lintel and the frame around them.
fn frame_passage(pen: &mut Pen<'_>, style: &Style, o: &Opening) {
    let ((a0, a1), top, deep) = (o.along, o.height.1, -0.5 * WALL_M - 0.001);
    for (x0, x1) in [(a0 - 0.02, a0 + 0.012), (a1 - 0.012, a1 + 0.02)] {
        pen.cuboid(&style.trim, [x0, deep, 0.0], [x1, 0.0, top]);
    }
    pen.cuboid(&style.trim, [a0 - 0.02, deep, top - 0.012], [a1 + 0.02, 0.0, top + 0.02]);
    let pen = &mut pen.ghost();
    for (x0, x1) in [(a0 - 0.06, a0 + 0.012), (a1 - 0.012, a1 + 0.06)] {
        pen.cuboid(&style.trim, [x0, 0.0, 0.0], [x1, 0.018, top]);
    }
    pen.cuboid(&style.trim, [a0 - 0.06, 0.0, top - 0.012], [a1 + 0.06, 0.018, top + 0.06]);
}

/// A window set back into the outer wall, its frame, its sill and at times curtains.
fn frame_window(pen: &mut Pen<'_>, style: &Style, o: &Opening, rng: &mut ChaCha8Rng) {
    let ((a0, a1), (z0, z1), deep) = (o.along, o.height, -0.1);
    let view = pick(&style.windows, rng);
    pen.front(view, (a0 - 0.01, a1 + 0.01), deep + 0.01, (z0 - 0.01, z1 + 0.01));
    let pen = &mut pen.ghost();
    for (x0, x1) in [(a0 - 0.05, a0), (a1, a1 + 0.05)] {
        pen.cuboid(&style.trim, [x0, deep, z0 - 0.05], [x1, 0.012, z1 + 0.05]);
    }
    pen.cuboid(&style.trim, [a0, deep, z1], [a1, 0.012, z1 + 0.05]);
    pen.cuboid(&style.trim, [a0 - 0.08, deep, z0 - 0.04], [a1 + 0.08, 0.1, z0]);
    if z0 < 1.0 && rng.random_bool(0.6) {
        let fabric = pick(&style.fabrics, rng).finished(Finish::TwoSided);
        curtain(pen, &fabric, a0 - 0.3, z1 + 0.12);
        curtain(pen, &fabric, a1 + 0.02, z1 + 0.12);
    }
}

/// A curtain in folds, 0.28 m wide, from the height given down to the floor.
fn curtain(pen: &mut Pen<'_>, fabric: &Look, from: f64, top: f64) {
    for k in 0..8 {
        let (x0, x1) = (from + 0.035 * f64::from(k), from + 0.035 * f64::from(k + 1));
        let (y0, y1) = if k % 2 == 0 { (0.05, 0.1) } else { (0.1, 0.05) };
        let c = [[x1, y1, 0.03], [x0, y0, 0.03], [x0, y0, top], [x1, y1, top]];
        pen.face(fabric, c, Mapping::Metres(0.06 * f64::from(k), 0.0));
    }
}

fn lamps(scene: &mut SceneBuilder, room: &Room, style: &Style, height_m: f64, rng: &mut ChaCha8Rng) {
    let n = ((room.floor.width().max(room.floor.depth()) / 4.5).ceil() as u32).max(1);
    let warm = rng.random_range(0.75..0.95_f32);
    for k in 0..n {
        let share = (f64::from(k) + 0.5) / f64::from(n);
        let (cx, cy) = room.floor.centre();
        let (x, y) = if room.floor.width() > room.floor.depth() {
            (room.floor.x0 + share * room.floor.width(), cy)
        } else {
            (cx, room.floor.y0 + share * room.floor.depth())
        };
        let pen = &mut scene.pen(Spot::new(x, y, 0));
        let low = height_m - 0.22;
        let shade = [(0.0, low), (0.16, low), (0.19, low + 0.1), (0.03, low + 0.14)];
        pen.ghost().turned(&style.glow, (0.0, 0.0), &shade, 14);
        pen.ghost().post(&style.metal, (0.0, 0.0), 0.012, (low + 0.12, height_m));
        let colour = [1.0, 0.5 + 0.5 * warm, warm];
        scene.lamps.push(Lamp { position: [x as f32, y as f32, (low - 0.12) as f32], colour, reach_m: 7.0 });
    }
}
