//! Small things: plants, lamps, bowls, posters, rugs.

use core::f64::consts::TAU;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::super::builder::Look;
use super::super::pen::{Mapping, Pen};
use super::super::style::{RoomStyle, Style};

/// A pot with arching leaves.
pub(super) fn plant(pen: &mut Pen<'_>, style: &Style, rng: &mut ChaCha8Rng) {
    let pot = [(0.11, 0.0), (0.16, 0.3), (0.175, 0.3), (0.175, 0.33), (0.15, 0.33), (0.14, 0.28), (0.0, 0.28)];
    pen.turned(&style.clay, (0.0, 0.25), &pot, 16);
    pen.post(&style.woods[0], (0.0, 0.25), 0.015, (0.28, 0.6));
    for k in 0..26 {
        let angle = TAU * 0.381_966 * f64::from(k) + rng.random_range(-0.2..0.2);
        let (rise, reach) = (rng.random_range(0.2..0.65), rng.random_range(0.12..0.24));
        leaf(&mut pen.at(0.0, 0.25, angle), &style.leaves, 0.38 + 0.01 * f64::from(k), rise, reach);
    }
}

/// One leaf along +x: up, over and down.
fn leaf(pen: &mut Pen<'_>, look: &Look, from: f64, rise: f64, reach: f64) {
    let spine = [
        (0.0, from, 0.006),
        (0.45 * reach, from + 0.75 * rise, 0.035),
        (0.8 * reach, from + rise, 0.045),
        (reach, from + 0.8 * rise, 0.004),
    ];
    for pair in spine.windows(2) {
        let ((x0, z0, w0), (x1, z1, w1)) = (pair[0], pair[1]);
        let corners = [[x0, w0, z0], [x0, -w0, z0], [x1, -w1, z1], [x1, w1, z1]];
        pen.face(look, corners, Mapping::Metres(x0, z0));
    }
}

/// A ribbed radiator on the wall.
pub(super) fn radiator(pen: &mut Pen<'_>, style: &Style) {
    pen.cuboid(&style.trim, [-0.45, 0.02, 0.14], [0.45, 0.06, 0.66]);
    for k in 0..12 {
        let x = -0.44 + 0.075 * f64::from(k);
        pen.cuboid(&style.trim, [x, 0.06, 0.16], [x + 0.05, 0.1, 0.64]);
    }
    pen.post(&style.metal, (0.47, 0.05), 0.018, (0.1, 0.22));
}

/// A lamp on a pole.
pub(super) fn floor_lamp(pen: &mut Pen<'_>, look: &RoomStyle, style: &Style) {
    pen.turned(&style.metal, (0.0, 0.17), &[(0.15, 0.0), (0.15, 0.02), (0.0, 0.03)], 16);
    pen.post(&style.metal, (0.0, 0.17), 0.014, (0.02, 1.5));
    pen.turned(&look.accent, (0.0, 0.17), &[(0.0, 1.29), (0.17, 1.28), (0.12, 1.58), (0.0, 1.58)], 16);
}

/// A small lamp standing at a height.
pub(super) fn table_lamp(pen: &mut Pen<'_>, style: &Style, z: f64) {
    let foot = [(0.06, z), (0.07, z + 0.03), (0.02, z + 0.08), (0.015, z + 0.2)];
    pen.turned(&style.clay, (0.0, 0.0), &foot, 12);
    let shade = [(0.0, z + 0.17), (0.11, z + 0.16), (0.07, z + 0.29), (0.0, z + 0.29)];
    pen.turned(&style.glow.tinted([0.9, 0.75, 0.5]), (0.0, 0.0), &shade, 12);
}

/// A bowl standing at a height.
pub(super) fn bowl(pen: &mut Pen<'_>, look: &Look, z: f64) {
    let outline = [(0.04, z), (0.06, z + 0.02), (0.11, z + 0.1), (0.1, z + 0.1), (0.04, z + 0.03), (0.0, z + 0.03)];
    pen.turned(look, (0.0, 0.0), &outline, 14);
}

/// A framed picture on a wall; the pen's frame is the wall's.
pub fn poster(pen: &mut Pen<'_>, picture: &Look, frame: &Look, x: (f64, f64), z: (f64, f64)) {
    let pen = &mut pen.ghost();
    let b = 0.018;
    pen.cuboid(frame, [x.0 - b, 0.0, z.0 - b], [x.1 + b, 0.018, z.1 + b]);
    pen.front(picture, x, 0.019, z);
}

/// A rug; the pen's origin is its centre.
pub fn rug(pen: &mut Pen<'_>, look: &Look, size: (f64, f64)) {
    let (hx, hy) = (0.5 * size.0, 0.5 * size.1);
    let pen = &mut pen.ghost();
    pen.face(look, [[-hx, -hy, 0.008], [hx, -hy, 0.008], [hx, hy, 0.008], [-hx, hy, 0.008]], Mapping::Picture);
}
