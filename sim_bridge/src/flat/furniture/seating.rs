//! Sofas, chairs and the tables that belong to them.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::super::builder::Look;
use super::super::pen::Pen;
use super::super::style::{RoomStyle, Style, pick};
use super::decor;

/// A sofa with arms, one cushion a seat and one behind it, and a throw pillow.
pub(super) fn sofa(pen: &mut Pen<'_>, seats: u32, look: &RoomStyle) {
    let width = 0.4 + 0.62 * f64::from(seats);
    seat(pen, width, seats, 0.9, look);
    let x = 0.5 * width - 0.48;
    pen.at(x, 0.42, 0.2).cushion(&look.accent, [-0.18, -0.06, 0.46], [0.18, 0.08, 0.78], 0.06);
}

/// A seat for one.
pub(super) fn armchair(pen: &mut Pen<'_>, look: &RoomStyle) {
    seat(pen, 0.85, 1, 0.85, look);
}

fn seat(pen: &mut Pen<'_>, width: f64, seats: u32, depth: f64, look: &RoomStyle) {
    let half = 0.5 * width;
    let arm = 0.18;
    pen.cuboid(&look.fabric, [-half + 0.02, 0.03, 0.08], [half - 0.02, depth - 0.03, 0.3]);
    pen.cushion(&look.fabric, [-half + 0.02, 0.0, 0.1], [half - 0.02, 0.22, 0.8], 0.06);
    for x in [-half, half - arm] {
        pen.cushion(&look.fabric, [x, 0.02, 0.08], [x + arm, depth, 0.6], 0.06);
    }
    let each = (width - 2.0 * arm) / f64::from(seats);
    for k in 0..seats {
        let x0 = -half + arm + each * f64::from(k);
        pen.cushion(&look.fabric, [x0 + 0.005, 0.2, 0.28], [x0 + each - 0.005, depth - 0.01, 0.46], 0.05);
        pen.cushion(&look.fabric, [x0 + 0.01, 0.14, 0.44], [x0 + each - 0.01, 0.34, 0.78], 0.08);
    }
    for (x, y) in [(-half + 0.08, 0.08), (half - 0.08, 0.08), (-half + 0.08, depth - 0.08), (half - 0.08, depth - 0.08)]
    {
        pen.post(&look.wood, (x, y), 0.025, (0.0, 0.1));
    }
}

/// A low table with something on it.
pub(super) fn coffee_table(pen: &mut Pen<'_>, look: &RoomStyle, style: &Style, rng: &mut ChaCha8Rng) {
    table(&mut pen.at(0.0, 0.275, 0.0), &look.wood, 0.95, 0.55, 0.42);
    pen.cuboid(&look.wood, [-0.4, 0.06, 0.14], [0.4, 0.49, 0.16]);
    let (x, y) = (rng.random_range(-0.25..0.25), 0.275);
    pen.at(x, y, rng.random_range(0.0..3.0)).cuboid(pick(&style.rugs, rng), [-0.11, -0.15, 0.42], [0.11, 0.15, 0.45]);
    decor::bowl(&mut pen.at(-x - 0.1, y, 0.0), &style.clay, 0.42);
}

/// A table top on four legs, centred on the pen's origin.
fn table(pen: &mut Pen<'_>, wood: &Look, width: f64, depth: f64, height: f64) {
    let (hx, hy) = (0.5 * width, 0.5 * depth);
    pen.cuboid(wood, [-hx, -hy, height - 0.04], [hx, hy, height]);
    pen.cuboid(wood, [-hx + 0.07, -hy + 0.07, height - 0.11], [hx - 0.07, hy - 0.07, height - 0.04]);
    for (x, y) in [(-hx + 0.06, -hy + 0.06), (hx - 0.06, -hy + 0.06), (hx - 0.06, hy - 0.06), (-hx + 0.06, hy - 0.06)] {
        pen.beam(wood, [x, y, 0.0], [x, y, height - 0.04], 0.06);
    }
}

/// A chair facing +y, centred on the pen's origin.
pub(super) fn chair(pen: &mut Pen<'_>, wood: &Look, seat: &Look) {
    pen.cushion(seat, [-0.21, -0.2, 0.43], [0.21, 0.21, 0.48], 0.025);
    pen.cuboid(wood, [-0.2, -0.19, 0.4], [0.2, 0.2, 0.435]);
    for x in [-0.18, 0.18] {
        pen.beam(wood, [x, 0.18, 0.0], [x, 0.17, 0.41], 0.036);
        pen.beam(wood, [x, -0.19, 0.0], [x, -0.18, 0.41], 0.036);
        pen.beam(wood, [x, -0.18, 0.41], [x, -0.24, 0.9], 0.034);
    }
    for z in [0.56, 0.68, 0.8] {
        let y = -0.18 - 0.06 * (z - 0.41) / 0.49;
        pen.cuboid(wood, [-0.19, y - 0.012, z], [0.19, y + 0.012, z + 0.07]);
    }
}

/// A table with chairs along both sides, some pulled out a little.
pub(super) fn dining_set(pen: &mut Pen<'_>, chairs: u32, look: &RoomStyle, style: &Style, rng: &mut ChaCha8Rng) {
    let width = 0.2 + 0.62 * f64::from(chairs);
    table(&mut pen.at(0.0, 0.85, 0.0), &look.wood, width, 0.85, 0.75);
    decor::bowl(&mut pen.at(rng.random_range(-0.2..0.2), 0.85, 0.0), &style.clay, 0.75);
    for k in 0..chairs {
        let x = -0.5 * width + 0.1 + 0.62 * (f64::from(k) + 0.5);
        let pulled = [rng.random_range(0.0..0.1), rng.random_range(0.0..0.1)];
        chair(&mut pen.at(x, 0.36 - pulled[0], rng.random_range(-0.1..0.1)), &look.wood, &style.fabrics[0]);
        let turn = core::f64::consts::PI + rng.random_range(-0.1..0.1);
        chair(&mut pen.at(x, 1.34 + pulled[1], turn), &look.wood, &style.fabrics[0]);
    }
}

/// A desk with a screen, a drawer unit, books and a chair before it.
pub(super) fn desk(pen: &mut Pen<'_>, look: &RoomStyle, style: &Style, rng: &mut ChaCha8Rng) {
    table(&mut pen.at(0.0, 0.33, 0.0), &look.wood, 1.3, 0.66, 0.74);
    pen.cuboid(&style.lacquer, [0.2, 0.08, 0.08], [0.58, 0.6, 0.62]);
    for z in [0.1, 0.28, 0.46] {
        pen.cuboid(&look.wood, [0.21, 0.6, z], [0.57, 0.615, z + 0.15]);
        pen.cuboid(&style.metal, [0.34, 0.615, z + 0.07], [0.44, 0.63, z + 0.085]);
    }
    let x = rng.random_range(-0.2..0.1);
    pen.cuboid(&style.metal, [x - 0.12, 0.12, 0.74], [x + 0.12, 0.3, 0.755]);
    pen.cuboid(&style.metal, [x - 0.03, 0.18, 0.75], [x + 0.03, 0.21, 0.9]);
    pen.cuboid(&style.metal, [x - 0.29, 0.2, 0.84], [x + 0.29, 0.235, 1.19]);
    pen.front(pick(&style.screens, rng), (x - 0.28, x + 0.28), 0.236, (0.85, 1.18));
    pen.cuboid(&style.metal, [x - 0.2, 0.42, 0.74], [x + 0.2, 0.56, 0.76]);
    decor::table_lamp(&mut pen.at(if x > -0.05 { -0.5 } else { 0.5 }, 0.2, 0.0), style, 0.74);
    let turn = core::f64::consts::PI + rng.random_range(-0.5..0.5);
    chair(&mut pen.at(-0.1, 0.8, turn), &look.wood, &style.fabrics[1]);
}
