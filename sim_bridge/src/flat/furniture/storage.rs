//! Shelves, cupboards and boxes.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::super::builder::Look;
use super::super::pen::Pen;
use super::super::style::{RoomStyle, Style, pick};
use super::decor;

/// A box of boards, open to the front: sides, bottom, top, back and boards at the heights given.
fn carcass(pen: &mut Pen<'_>, wood: &Look, size: (f64, f64, f64), boards: &[f64]) {
    let (half, depth, height) = (0.5 * size.0, size.1, size.2);
    for x in [-half, half - 0.02] {
        pen.cuboid(wood, [x, 0.0, 0.0], [x + 0.02, depth, height]);
    }
    pen.cuboid(wood, [-half + 0.02, 0.0, 0.0], [half - 0.02, 0.015, height]);
    for z in boards.iter().copied().chain([height - 0.022]) {
        pen.cuboid(wood, [-half + 0.02, 0.015, z], [half - 0.02, depth - 0.005, z + 0.022]);
    }
}

/// A closed body with doors of equal width and their handles.
fn cupboard(pen: &mut Pen<'_>, look: (&Look, &Look, &Look), x: (f64, f64), depth: f64, z: (f64, f64)) {
    let (body, front, handle) = look;
    pen.cuboid(body, [x.0, 0.0, z.0], [x.1, depth - 0.02, z.1]);
    let n = ((x.1 - x.0) / 0.55).round().max(1.0);
    let each = (x.1 - x.0) / n;
    for k in 0..n as u32 {
        let (d0, d1) = (x.0 + each * f64::from(k) + 0.004, x.0 + each * f64::from(k + 1) - 0.004);
        pen.cuboid(front, [d0, depth - 0.02, z.0 + 0.004], [d1, depth, z.1 - 0.004]);
        let at = if k % 2 == 0 { d1 - 0.05 } else { d0 + 0.04 };
        let mid = 0.5 * (z.0 + z.1);
        pen.cuboid(handle, [at, depth, mid - 0.08], [at + 0.012, depth + 0.025, mid + 0.08]);
    }
}

/// Five boards with books, vases and gaps.
pub(super) fn bookshelf(pen: &mut Pen<'_>, width: f64, look: &RoomStyle, style: &Style, rng: &mut ChaCha8Rng) {
    let boards = [0.06, 0.44, 0.81, 1.18, 1.55];
    carcass(pen, &look.wood, (width, 0.3, 1.95), &boards);
    let half = 0.5 * width - 0.03;
    for z in boards {
        let full = rng.random_range(0.45..1.0) * 2.0 * half;
        let books = pick(&style.books, rng);
        let (x0, x1) = if rng.random_bool(0.5) { (-half, -half + full) } else { (half - full, half) };
        let top = z + 0.022 + rng.random_range(0.24..0.31);
        pen.cuboid(&look.accent, [x0, 0.02, z + 0.022], [x1, 0.22, top - 0.01]);
        pen.front(books, (x0, x1), 0.225, (z + 0.022, top));
        let gap = 2.0 * half - full;
        if gap > 0.22 {
            let x = if x0 > -half { -half + 0.5 * gap } else { half - 0.5 * gap };
            decor::bowl(&mut pen.at(x, 0.16, 0.0), &style.clay, z + 0.022);
        }
    }
}

/// A wardrobe with doors.
pub(super) fn wardrobe(pen: &mut Pen<'_>, width: f64, look: &RoomStyle, style: &Style) {
    let half = 0.5 * width;
    pen.cuboid(&style.metal, [-half + 0.02, 0.02, 0.0], [half - 0.02, 0.55, 0.06]);
    cupboard(pen, (&look.wood, &look.wood, &style.metal), (-half, half), 0.6, (0.06, 2.07));
    pen.cuboid(&look.wood, [-half - 0.015, 0.0, 2.07], [half + 0.015, 0.62, 2.1]);
}

/// A sideboard with a lamp or a plant on it.
pub(super) fn sideboard(pen: &mut Pen<'_>, width: f64, look: &RoomStyle, style: &Style, rng: &mut ChaCha8Rng) {
    let half = 0.5 * width;
    for (x, y) in [(-half + 0.06, 0.06), (half - 0.06, 0.06), (-half + 0.06, 0.36), (half - 0.06, 0.36)] {
        pen.post(&style.metal, (x, y), 0.018, (0.0, 0.14));
    }
    cupboard(pen, (&look.wood, &style.lacquer, &style.metal), (-half, half), 0.42, (0.12, 0.82));
    pen.cuboid(&look.wood, [-half, 0.0, 0.82], [half, 0.42, 0.85]);
    let x = rng.random_range(-0.3..0.3) * width;
    if rng.random_bool(0.5) {
        decor::table_lamp(&mut pen.at(x, 0.2, 0.0), style, 0.85);
    } else {
        decor::bowl(&mut pen.at(x, 0.2, 0.0), &style.clay, 0.85);
    }
}

/// A narrow cabinet with flaps.
pub(super) fn shoe_cabinet(pen: &mut Pen<'_>, look: &RoomStyle, style: &Style) {
    pen.cuboid(&style.lacquer, [-0.4, 0.0, 0.05], [0.4, 0.2, 0.93]);
    pen.cuboid(&look.wood, [-0.41, 0.0, 0.93], [0.41, 0.24, 0.95]);
    for z in [0.07, 0.37, 0.65] {
        pen.cuboid(&look.wood, [-0.39, 0.2, z], [0.39, 0.22, z + 0.26]);
        pen.cuboid(&style.metal, [-0.06, 0.22, z + 0.2], [0.06, 0.235, z + 0.215]);
    }
}

/// A bedside table with a lamp.
pub(super) fn nightstand(pen: &mut Pen<'_>, look: &RoomStyle, style: &Style) {
    pen.cuboid(&look.wood, [-0.22, 0.0, 0.06], [0.22, 0.38, 0.46]);
    for z in [0.09, 0.28] {
        pen.cuboid(&style.lacquer, [-0.2, 0.38, z], [0.2, 0.395, z + 0.16]);
        pen.cuboid(&style.metal, [-0.04, 0.395, z + 0.07], [0.04, 0.41, z + 0.085]);
    }
    decor::table_lamp(&mut pen.at(0.05, 0.18, 0.0), style, 0.46);
}

/// A low bench with a screen on it.
pub(super) fn tv_stand(pen: &mut Pen<'_>, look: &RoomStyle, style: &Style, rng: &mut ChaCha8Rng) {
    carcass(pen, &look.wood, (1.5, 0.42, 0.5), &[0.08, 0.28]);
    pen.cuboid(&style.lacquer, [-0.73, 0.02, 0.1], [-0.25, 0.41, 0.47]);
    pen.front(pick(&style.books, rng), (0.0, 0.6), 0.3, (0.302, 0.45));
    pen.cuboid(&style.metal, [-0.25, 0.12, 0.5], [0.25, 0.32, 0.52]);
    pen.cuboid(&style.metal, [-0.05, 0.2, 0.52], [0.05, 0.24, 0.6]);
    pen.cuboid(&style.metal, [-0.56, 0.2, 0.57], [0.56, 0.24, 1.23]);
    pen.front(pick(&style.screens, rng), (-0.545, 0.545), 0.241, (0.585, 1.215));
}

/// Moving boxes and a basket.
pub(super) fn boxes(pen: &mut Pen<'_>, look: &RoomStyle, style: &Style, rng: &mut ChaCha8Rng) {
    let cardboard = style.woods[1].tinted([0.9, 0.75, 0.55]);
    pen.at(-0.2, 0.22, rng.random_range(-0.1..0.1)).cuboid(&cardboard, [-0.22, -0.18, 0.0], [0.22, 0.18, 0.36]);
    pen.at(-0.2, 0.22, rng.random_range(-0.2..0.2)).cuboid(&cardboard, [-0.18, -0.16, 0.36], [0.18, 0.16, 0.66]);
    let basket = [(0.14, 0.0), (0.17, 0.4), (0.15, 0.4), (0.12, 0.08), (0.0, 0.08)];
    pen.turned(&look.accent, (0.22, 0.22), &basket, 14);
}
