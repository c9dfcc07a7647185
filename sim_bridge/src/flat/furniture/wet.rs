//! Kitchen and bath.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::super::builder::Look;
use super::super::pen::Pen;
use super::super::style::{RoomStyle, Style};

/// A counter with fronts, a sink with its tap, a hob, and cupboards above with a gap for the hood.
pub(super) fn kitchen(pen: &mut Pen<'_>, width: f64, look: &RoomStyle, style: &Style, rng: &mut ChaCha8Rng) {
    let half = 0.5 * width;
    pen.cuboid(&style.metal, [-half, 0.0, 0.0], [half, 0.52, 0.1]);
    pen.cuboid(&style.lacquer, [-half, 0.0, 0.1], [half, 0.58, 0.86]);
    pen.cuboid(&look.wood, [-half, 0.0, 0.86], [half, 0.62, 0.9]);
    let n = (width / 0.6).round().max(1.0);
    let each = width / n;
    let oven = rng.random_range(0..n as u32);
    for k in 0..n as u32 {
        let x = (-half + each * f64::from(k) + 0.005, -half + each * f64::from(k + 1) - 0.005);
        if k == oven {
            pen.front(&style.appliances[0], x, 0.59, (0.12, 0.85));
            pen.cuboid(&style.metal, [x.0 + 0.03, 0.08, 0.9], [x.1 - 0.03, 0.55, 0.91]);
            pen.cuboid(&style.metal, [x.0, 0.0, 1.65], [x.1, 0.4, 1.75]);
            pen.cuboid(&style.metal, [x.0 + 0.15, 0.0, 1.75], [x.1 - 0.15, 0.25, 2.3]);
        } else {
            pen.cuboid(&style.lacquer, [x.0, 0.58, 0.12], [x.1, 0.6, 0.85]);
            pen.cuboid(&style.metal, [x.0 + 0.08, 0.6, 0.78], [x.1 - 0.08, 0.62, 0.795]);
            pen.cuboid(&look.wood, [x.0, 0.0, 1.45], [x.1, 0.33, 2.1]);
            pen.cuboid(&style.metal, [x.1 - 0.06, 0.33, 1.5], [x.1 - 0.045, 0.345, 1.65]);
        }
    }
    let sink = -half + each * (f64::from((oven + 1) % n as u32) + 0.5);
    pen.cuboid(&style.metal, [sink - 0.24, 0.1, 0.9], [sink + 0.24, 0.52, 0.905]);
    pen.post(&style.metal, (sink, 0.07), 0.015, (0.9, 1.15));
    pen.cuboid(&style.metal, [sink - 0.012, 0.06, 1.13], [sink + 0.012, 0.26, 1.15]);
}

/// A counter with fronts and a sink, nothing above.
pub(super) fn counter(pen: &mut Pen<'_>, width: f64, look: &RoomStyle, style: &Style) {
    let half = 0.5 * width;
    pen.cuboid(&style.metal, [-half, 0.0, 0.0], [half, 0.52, 0.1]);
    pen.cuboid(&style.lacquer, [-half, 0.0, 0.1], [half, 0.58, 0.86]);
    pen.cuboid(&look.wood, [-half, 0.0, 0.86], [half, 0.62, 0.9]);
    let n = (width / 0.6).round().max(1.0);
    for k in 0..n as u32 {
        let x0 = -half + width / n * f64::from(k);
        pen.cuboid(&style.lacquer, [x0 + 0.005, 0.58, 0.12], [x0 + width / n - 0.005, 0.6, 0.85]);
        pen.cuboid(&style.metal, [x0 + 0.1, 0.6, 0.78], [x0 + width / n - 0.1, 0.62, 0.795]);
    }
    pen.cuboid(&style.metal, [-0.24, 0.1, 0.9], [0.24, 0.52, 0.905]);
    pen.post(&style.metal, (0.0, 0.07), 0.015, (0.9, 1.12));
    pen.cuboid(&style.metal, [-0.012, 0.06, 1.1], [0.012, 0.26, 1.12]);
}

/// A fridge with two doors.
pub(super) fn fridge(pen: &mut Pen<'_>, style: &Style) {
    pen.cuboid(&style.white, [-0.3, 0.02, 0.02], [0.3, 0.62, 1.78]);
    pen.front(&style.appliances[1], (-0.3, 0.3), 0.621, (0.03, 1.77));
    pen.cuboid(&style.metal, [0.24, 0.62, 0.7], [0.26, 0.66, 1.1]);
    pen.cuboid(&style.metal, [0.24, 0.62, 1.25], [0.26, 0.66, 1.6]);
}

/// A washing machine.
pub(super) fn washer(pen: &mut Pen<'_>, style: &Style) {
    pen.cuboid(&style.white, [-0.3, 0.0, 0.02], [0.3, 0.56, 0.85]);
    pen.front(&style.appliances[2], (-0.3, 0.3), 0.561, (0.03, 0.84));
}

/// A tub with a rim and a hollow.
pub(super) fn bath(pen: &mut Pen<'_>, style: &Style) {
    let (half, depth, top) = (0.82, 0.75, 0.56);
    let rim = 0.07;
    pen.cuboid(&style.white, [-half, 0.0, 0.0], [-half + rim, depth, top]);
    pen.cuboid(&style.white, [half - rim, 0.0, 0.0], [half, depth, top]);
    pen.cuboid(&style.white, [-half + rim, 0.0, 0.0], [half - rim, rim, top]);
    pen.cuboid(&style.white, [-half + rim, depth - rim, 0.0], [half - rim, depth, top]);
    pen.cuboid(&style.white, [-half + rim, rim, 0.0], [half - rim, depth - rim, 0.16]);
    pen.post(&style.metal, (half - 0.035, 0.375), 0.016, (top, top + 0.16));
    pen.cuboid(&style.metal, [half - 0.2, 0.36, top + 0.13], [half - 0.03, 0.39, top + 0.16]);
}

/// A toilet with its cistern.
pub(super) fn toilet(pen: &mut Pen<'_>, style: &Style) {
    pen.cushion(&style.white, [-0.19, 0.0, 0.4], [0.19, 0.18, 0.8], 0.03);
    let bowl = [(0.12, 0.0), (0.11, 0.12), (0.19, 0.36), (0.2, 0.4), (0.15, 0.4), (0.1, 0.25), (0.0, 0.25)];
    pen.turned(&style.white, (0.0, 0.42), &bowl, 16);
    pen.cuboid(&style.white, [-0.16, 0.15, 0.0], [0.16, 0.36, 0.4]);
}

/// A basin on a cupboard, with a tap and a framed mirror.
pub(super) fn basin(pen: &mut Pen<'_>, look: &RoomStyle, style: &Style) {
    pen.cuboid(&look.wood, [-0.28, 0.0, 0.25], [0.28, 0.42, 0.78]);
    for x in [-0.27, 0.005] {
        pen.cuboid(&style.lacquer, [x, 0.42, 0.27], [x + 0.265, 0.435, 0.77]);
    }
    pen.cushion(&style.white, [-0.3, 0.0, 0.77], [0.3, 0.48, 0.88], 0.03);
    let hollow = [(0.0, 0.885), (0.0, 0.882), (0.17, 0.882), (0.19, 0.9), (0.17, 0.9), (0.1, 0.886), (0.0, 0.886)];
    pen.turned(&style.white, (0.0, 0.26), &hollow, 16);
    pen.post(&style.metal, (0.0, 0.06), 0.014, (0.88, 1.05));
    pen.cuboid(&style.metal, [-0.01, 0.05, 1.03], [0.01, 0.18, 1.05]);
    pen.cuboid(&style.metal, [-0.26, 0.0, 1.15], [0.26, 0.02, 1.75]);
    pen.cuboid(&Look::plain([0.5, 0.58, 0.62]), [-0.24, 0.02, 1.17], [0.24, 0.024, 1.73]);
}
