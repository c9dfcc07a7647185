//! What hangs on the walls of a mapped scene and stands flat against them. All of it is thin and in nobody's way: the
//! map alone says where one can go.

use core::cell::Cell;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::super::builder::{Look, SceneBuilder};
use super::super::furniture;
use super::super::geometry::Spot;
use super::super::pen::{Mapping, Pen};
use super::super::shell::cuts;
use super::super::style::{RoomStyle, Style, pick};
use super::stretches::Stretch;

/// How far things stand out of the wall, metres.
const DEPTH_M: f64 = 0.035;
/// Skirting boards leave out shorter walls, metres.
const SKIRTING_M_MIN: f64 = 0.12;
/// Walls shorter than this stay bare, metres.
const DRESSED_M_MIN: f64 = 0.45;

/// A room's looks.
pub(super) struct RoomLook {
    /// The stock it draws from.
    pub style: Style,
    /// What it takes from it.
    pub look: RoomStyle,
    /// A second wall surface.
    pub accent: Look,
    /// Pictures hung so far: none comes twice before all were hung.
    pub hung: Cell<usize>,
}

impl RoomLook {
    fn next_picture(&self) -> &Look {
        let posters = &self.style.posters;
        &posters[self.hung.replace(self.hung.get() + 1) % posters.len()]
    }
}

/// Draws one stretch of wall up to a height, metres, with what hangs on it.
pub(super) fn wall(scene: &mut SceneBuilder, stretch: &Stretch, room: &RoomLook, height_m: f64, rng: &mut ChaCha8Rng) {
    let length = stretch.length_m();
    let pen = &mut scene.pen(Spot::new(stretch.from.0, stretch.from.1, 0).turned(stretch.yaw_rad()));
    let surface = if length > 1.5 && rng.random_bool(0.3) { &room.accent } else { &room.look.wall };
    for a in cuts(0.0, length, &[]).windows(2) {
        let (z0, z1) = (-0.01, height_m + 0.01);
        let corners = [[a[1], 0.0, z0], [a[0], 0.0, z0], [a[0], 0.0, z1], [a[1], 0.0, z1]];
        pen.face(surface, corners, Mapping::Metres(-stretch.along_m - a[1], -z1));
    }
    let pen = &mut pen.ghost();
    if length > SKIRTING_M_MIN {
        pen.cuboid(&room.style.trim, [0.0, -0.01, 0.0], [length, 0.014, 0.075]);
    }
    if length > DRESSED_M_MIN {
        hang(pen, length, stretch.outer, room, height_m, rng);
    }
}

/// Something on a wall: how wide it is, and how it is drawn from its left end.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
enum Item {
    Window,
    Door,
    Shelf,
    Cupboard,
    Appliance,
    Picture,
    Wide,
    Column,
    Gallery,
    Screen,
    Hanging,
    Mirror,
}

impl Item {
    const ALL: [(Item, u32); 12] = [
        (Item::Window, 5),
        (Item::Door, 2),
        (Item::Shelf, 3),
        (Item::Cupboard, 2),
        (Item::Appliance, 1),
        (Item::Picture, 5),
        (Item::Wide, 3),
        (Item::Column, 3),
        (Item::Gallery, 2),
        (Item::Screen, 1),
        (Item::Hanging, 1),
        (Item::Mirror, 1),
    ];

    /// Metres along the wall.
    fn width_m(self, rng: &mut ChaCha8Rng) -> f64 {
        let (low, high) = match self {
            Item::Window => (1.0, 1.7),
            Item::Door => (0.86, 0.92),
            Item::Shelf => (0.8, 1.6),
            Item::Cupboard => (1.0, 1.8),
            Item::Appliance => (0.6, 0.62),
            Item::Picture => (0.35, 0.75),
            Item::Wide => (0.9, 1.5),
            Item::Column => (0.35, 0.5),
            Item::Gallery => (1.0, 1.3),
            Item::Screen => (1.0, 1.25),
            Item::Hanging => (1.1, 1.5),
            Item::Mirror => (0.45, 0.6),
        };
        rng.random_range(low..high)
    }

    fn draw(outer: bool, rng: &mut ChaCha8Rng) -> Self {
        let fits = |item: Item| item != Item::Window || outer;
        let total: u32 = Item::ALL.iter().filter(|(i, _)| fits(*i)).map(|(_, w)| w).sum();
        let mut ticket = rng.random_range(0..total);
        for (item, weight) in Item::ALL.into_iter().filter(|(i, _)| fits(*i)) {
            if ticket < weight {
                return item;
            }
            ticket -= weight;
        }
        Item::Picture
    }
}

/// Fills a wall from one end to the other, with gaps.
fn hang(pen: &mut Pen<'_>, length: f64, outer: bool, room: &RoomLook, height_m: f64, rng: &mut ChaCha8Rng) {
    let mut at = rng.random_range(0.06..0.3);
    while at < length - 0.4 {
        let item = Item::draw(outer, rng);
        let width = item.width_m(rng);
        if at + width < length - 0.06 {
            let pen = &mut pen.at(at, 0.0, 0.0);
            put(pen, item, width, room, height_m, rng);
            at += width + rng.random_range(0.15..0.7);
        } else if length - at < 1.0 {
            let width = (length - at - 0.1).min(0.6);
            if width > 0.28 {
                column(&mut pen.at(at, 0.0, 0.0), width, room, rng);
            }
            break;
        } else {
            at += 0.1;
        }
    }
}

fn put(pen: &mut Pen<'_>, item: Item, width: f64, room: &RoomLook, height_m: f64, rng: &mut ChaCha8Rng) {
    let (style, look) = (&room.style, &room.look);
    match item {
        Item::Window => window(pen, width, (rng.random_range(0.75..1.0), (height_m - 0.3).min(2.2)), style, rng),
        Item::Door => door(pen, width, style),
        Item::Shelf => shelf(pen, width, rng.random_range(1.5..2.2), style, look, rng),
        Item::Cupboard => cupboard(pen, width, style, look, rng),
        Item::Appliance => appliance(pen, width, rng.random_range(1.4..1.9), style, rng),
        Item::Picture => {
            let (middle, height) = (rng.random_range(1.35..1.65), width * rng.random_range(0.9..1.45));
            picture(pen, (0.0, width), (middle - 0.5 * height, middle + 0.5 * height), room);
        }
        Item::Wide => {
            let (low, height) = (rng.random_range(0.85..1.2), width * rng.random_range(0.55..0.75));
            picture(pen, (0.0, width), (low, low + height), room);
        }
        Item::Column => column(pen, width, room, rng),
        Item::Gallery => gallery(pen, width, room, rng),
        Item::Screen => {
            let low = rng.random_range(0.8..1.1);
            pen.cuboid(&style.metal, [0.0, 0.0, low], [width, DEPTH_M, low + 0.58 * width]);
            let screen = pick(&style.screens, rng);
            pen.front(screen, (0.015, width - 0.015), DEPTH_M + 0.001, (low + 0.02, low + 0.58 * width - 0.015));
        }
        Item::Hanging => pen.front(pick(&style.rugs, rng), (0.0, width), 0.012, (0.55, 0.55 + 1.1 * width)),
        Item::Mirror => {
            let low = rng.random_range(0.9..1.1);
            pen.cuboid(&look.wood, [0.0, 0.0, low], [width, 0.02, low + 0.9]);
            pen.front(pick(&style.windows, rng), (0.04, width - 0.04), 0.021, (low + 0.04, low + 0.86));
        }
    }
}

fn picture(pen: &mut Pen<'_>, x: (f64, f64), z: (f64, f64), room: &RoomLook) {
    furniture::poster(pen, room.next_picture(), &room.look.wood, x, z);
}

/// Two or three pictures above each other.
fn column(pen: &mut Pen<'_>, width: f64, room: &RoomLook, rng: &mut ChaCha8Rng) {
    let each = rng.random_range(0.45..0.6);
    let n = rng.random_range(2..=3_u32);
    let low = 1.5 - 0.5 * each * f64::from(n);
    for k in 0..n {
        let z0 = low + each * f64::from(k);
        picture(pen, (0.02, width - 0.02), (z0 + 0.04, z0 + each - 0.03), room);
    }
}

/// Six small pictures.
fn gallery(pen: &mut Pen<'_>, width: f64, room: &RoomLook, rng: &mut ChaCha8Rng) {
    let each = width / 3.0;
    for k in 0..6_u32 {
        let (x, z) = (each * f64::from(k % 3), 1.05 + 0.45 * f64::from(k / 3));
        let (dx, dz) = (rng.random_range(0.03..0.07), rng.random_range(0.0..0.08));
        picture(pen, (x + dx, x + each - 0.04), (z + dz, z + 0.4), room);
    }
}

fn window(pen: &mut Pen<'_>, width: f64, z: (f64, f64), style: &Style, rng: &mut ChaCha8Rng) {
    pen.front(pick(&style.windows, rng), (0.0, width), 0.006, z);
    for x in [(-0.05, 0.0), (width, width + 0.05)] {
        pen.cuboid(&style.trim, [x.0, 0.0, z.0 - 0.05], [x.1, 0.022, z.1 + 0.05]);
    }
    pen.cuboid(&style.trim, [0.0, 0.0, z.1], [width, 0.022, z.1 + 0.05]);
    pen.cuboid(&style.trim, [-0.06, 0.0, z.0 - 0.04], [width + 0.06, 0.05, z.0]);
}

/// A closed door in its frame.
fn door(pen: &mut Pen<'_>, width: f64, style: &Style) {
    pen.front(&style.door, (0.05, width - 0.05), 0.012, (0.0, 2.02));
    for x in [(0.0, 0.06), (width - 0.06, width)] {
        pen.cuboid(&style.trim, [x.0, 0.0, 0.0], [x.1, 0.024, 2.02]);
    }
    pen.cuboid(&style.trim, [0.0, 0.0, 2.01], [width, 0.024, 2.08]);
}

/// Boards with books, seen from the front.
fn shelf(pen: &mut Pen<'_>, width: f64, height: f64, style: &Style, look: &RoomStyle, rng: &mut ChaCha8Rng) {
    pen.cuboid(&look.wood, [0.0, 0.0, 0.0], [width, 0.004, height]);
    for x in [0.0, width - 0.025] {
        pen.cuboid(&look.wood, [x, 0.0, 0.0], [x + 0.025, DEPTH_M, height]);
    }
    let n = (height / 0.37).floor();
    let each = height / n;
    for k in 0..=n as u32 {
        let z = (each * f64::from(k)).min(height - 0.022);
        pen.cuboid(&look.wood, [0.0, 0.0, z], [width, DEPTH_M, z + 0.022]);
        if f64::from(k) < n {
            let full = rng.random_range(0.5..1.0) * (width - 0.06);
            let from = if rng.random_bool(0.5) { 0.03 } else { width - 0.03 - full };
            let top = z + 0.022 + rng.random_range(0.7..0.9) * (each - 0.03);
            pen.front(pick(&style.books, rng), (from, from + full), 0.02, (z + 0.022, top));
        }
    }
}

/// A row of fronts with handles, at times with a second row above.
fn cupboard(pen: &mut Pen<'_>, width: f64, style: &Style, look: &RoomStyle, rng: &mut ChaCha8Rng) {
    let front = if rng.random_bool(0.5) { look.wood } else { style.lacquer };
    let n = (width / 0.5).round().max(1.0);
    let each = width / n;
    let rows: &[(f64, f64)] = match rng.random_range(0..3_u32) {
        0 => &[(0.06, 2.05)],
        1 => &[(0.1, 0.86)],
        _ => &[(0.1, 0.86), (1.45, 2.1)],
    };
    for &(z0, z1) in rows {
        for k in 0..n as u32 {
            let (x0, x1) = (each * f64::from(k) + 0.004, each * f64::from(k + 1) - 0.004);
            pen.cuboid(&front, [x0, 0.0, z0], [x1, 0.026, z1]);
            let at = if k % 2 == 0 { x1 - 0.05 } else { x0 + 0.04 };
            let middle = 0.5 * (z0 + z1);
            pen.cuboid(&style.metal, [at, 0.026, middle - 0.08], [at + 0.012, 0.045, middle + 0.08]);
        }
        if z0 < 0.2 && z1 < 1.0 {
            pen.cuboid(&look.wood, [-0.01, 0.0, z1], [width + 0.01, 0.045, z1 + 0.03]);
        }
    }
}

fn appliance(pen: &mut Pen<'_>, width: f64, height: f64, style: &Style, rng: &mut ChaCha8Rng) {
    pen.cuboid(&style.white, [0.0, 0.0, 0.02], [width, DEPTH_M, height]);
    pen.front(pick(&style.appliances, rng), (0.0, width), DEPTH_M + 0.001, (0.03, height - 0.01));
}
