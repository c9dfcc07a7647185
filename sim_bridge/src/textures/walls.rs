//! Walls: brick, plaster, wallpaper.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::canvas::Canvas;
use super::noise::{floor, fractal, random, step, value};
use super::palette::{Colour, any, between, blend, hsl, noise_seed, one_of, shade};

const SIDE: usize = 512;

/// Bricks in running bond, each fired differently; bare or painted over.
pub fn brick(rng: &mut ChaCha8Rng) -> Canvas {
    let painted = rng.random_bool(0.4);
    let clay = if painted { any(rng, (0.02, 0.1), (0.78, 0.9)) } else { hsl(between(rng, (0.01, 0.06)), 0.45, 0.42) };
    let mortar = if painted { shade(clay, 0.8) } else { hsl(0.1, 0.08, between(rng, (0.6, 0.75))) };
    let variety = if painted { 0.06 } else { 0.4 };
    let seed = noise_seed(rng);
    Canvas::painted(SIDE, SIDE, |u, v| {
        let y = v * 16.0;
        let row = floor(y);
        let x = u * 5.0 + if row % 2 == 0 { 0.0 } else { 0.5 };
        let column = floor(x);
        let id = (column.rem_euclid(5), row);
        let (fx, fy) = (x - column as f32, y - row as f32);
        let rough = fractal(u, v, (40, 40), 3, seed);
        let edge_px = (fx.min(1.0 - fx) * 102.4).min(fy.min(1.0 - fy) * 32.0) - 2.0 + 2.4 * (rough - 0.5);
        let own = random(id.0, id.1, seed);
        let other = if painted { clay } else { [clay[0] * 0.86, clay[1] * 0.92, clay[2] * 1.05] };
        let hue = blend(clay, other, random(id.0, id.1, seed ^ 3));
        let lit = 1.0 + 0.1 * (step(2.0, 0.0, fy * 32.0 - 2.0) - step(28.0, 30.0, fy * 32.0));
        let face = shade(hue, lit * (1.0 + variety * (own - 0.5) + 0.3 * (rough - 0.5)));
        blend(shade(mortar, 0.9 + 0.25 * (rough - 0.5)), face, step(0.0, 2.0, edge_px))
    })
}

/// Paint with the marks of a roller, a few stains, scratches and dents.
pub fn plaster(rng: &mut ChaCha8Rng) -> Canvas {
    let paint = any(rng, (0.05, 0.3), (0.78, 0.92));
    let seed = noise_seed(rng);
    let mut canvas = Canvas::painted(SIDE, SIDE, |u, v| {
        let broad = fractal(u, v, (3, 3), 3, seed);
        let roller = value(u * 128.0, v * 256.0, (128, 256), seed ^ 1);
        shade(paint, 1.0 + 0.05 * (broad - 0.5) + 0.025 * (roller - 0.5))
    });
    let inner = |rng: &mut ChaCha8Rng| between(rng, (40.0, SIDE as f32 - 40.0));
    for _ in 0..rng.random_range(2..5_u32) {
        let (x, y, radius) = (inner(rng), inner(rng), between(rng, (8.0, 30.0)));
        let dark = between(rng, (0.02, 0.07));
        canvas.alter((x - radius, y - radius), (x + radius, y + radius), |px, py, old| {
            let r = ((px - x) * (px - x) + (py - y) * (py - y)).sqrt() / radius;
            shade(old, 1.0 - dark * (1.0 - step(0.3, 1.0, r)))
        });
    }
    for _ in 0..rng.random_range(3..8_u32) {
        let at = (inner(rng), inner(rng));
        let to = (at.0 + between(rng, (-26.0, 26.0)), at.1 + between(rng, (-26.0, 26.0)));
        canvas.stroke(at, to, 1.2, shade(paint, between(rng, (0.68, 0.88))));
    }
    for _ in 0..rng.random_range(5..12_u32) {
        let at = (inner(rng), inner(rng));
        canvas.disc(at, between(rng, (1.2, 2.8)), shade(paint, between(rng, (0.5, 0.8))));
    }
    canvas
}

/// Stripes, medallions, leaves or dots at a fixed pitch.
pub fn wallpaper(rng: &mut ChaCha8Rng) -> Canvas {
    let ground = any(rng, (0.1, 0.4), (0.68, 0.88));
    let motif = any(rng, (0.2, 0.6), (0.35, 0.7));
    let (seed, kind) = (noise_seed(rng), rng.random_range(0..4_u32));
    let n = one_of(rng, &[4, 5, 6]);
    Canvas::painted(SIDE, SIDE, |u, v| {
        let x = u * n as f32;
        let column = floor(x);
        // Every second column is half a pitch lower; an odd number of columns keeps them level.
        let shift = if n % 2 == 0 && column % 2 == 1 { 0.5 } else { 0.0 };
        let y = v * n as f32 + shift;
        let (fx, fy) = (x - column as f32 - 0.5, y - floor(y) as f32 - 0.5);
        let cover = match kind {
            0 => stripe(fx),
            1 => medallion(fx, fy),
            2 => sprig(fx, fy),
            _ => 1.0 - step(0.10, 0.13, (fx * fx + fy * fy).sqrt()),
        };
        let paper = 1.0 + 0.04 * (value(u * 256.0, v * 256.0, (256, 256), seed) - 0.5);
        shade(blend(ground, motif, 0.85 * cover), paper)
    })
}

fn stripe(x: f32) -> f32 {
    let wide = 1.0 - step(0.16, 0.18, x.abs());
    let fine = 1.0 - step(0.005, 0.02, (x.abs() - 0.3).abs());
    wide.max(fine)
}

/// A pointed oval with rings and a heart.
fn medallion(x: f32, y: f32) -> f32 {
    let oval = x.abs() * 1.5 + y * y * 1.9;
    let rim = 1.0 - step(0.015, 0.04, (oval - 0.42).abs());
    let inner = 1.0 - step(0.01, 0.03, (oval - 0.28).abs());
    let heart = 1.0 - step(0.08, 0.11, (x * x + (y + 0.1 * x.abs()) * (y + 0.1 * x.abs())).sqrt());
    rim.max(inner).max(heart)
}

/// A stem with five leaves.
fn sprig(x: f32, y: f32) -> f32 {
    let stem = if y.abs() < 0.36 { 1.0 - step(0.01, 0.025, (x - 0.04 * y).abs()) } else { 0.0 };
    let leaf = |cx: f32, cy: f32, lean: f32| {
        let (dx, dy) = (x - cx, y - cy);
        let (a, b) = (dx + lean * dy, dy - lean * dx);
        1.0 - step(0.9, 1.1, (a * a * 30.0 + b * b * 190.0).sqrt())
    };
    let leaves = [(0.15, 0.18, 0.6), (-0.15, 0.1, -0.6), (0.14, -0.06, 0.6), (-0.13, -0.14, -0.6), (0.0, -0.34, 3.0)];
    leaves.iter().fold(stem, |most, (cx, cy, lean)| most.max(leaf(*cx, *cy, *lean)))
}

/// A colour for painted wood.
pub fn lacquer(rng: &mut ChaCha8Rng) -> Colour {
    let white = any(rng, (0.02, 0.12), (0.82, 0.92));
    let coloured = any(rng, (0.1, 0.35), (0.35, 0.6));
    if rng.random_bool(0.6) { white } else { coloured }
}
