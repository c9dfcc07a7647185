//! Wood: the grain of one board, and furniture made of it.

use rand_chacha::ChaCha8Rng;

use super::canvas::Canvas;
use super::noise::{floor, fractal, mix, random, step, value};
use super::palette::{Colour, WOODS, between, noise_seed, one_of, shade};

/// Brightness of wood grain along `u`, about 1; `u, v` in boards' widths, `seed` per board. Does not repeat.
pub fn grain(u: f32, v: f32, seed: u32) -> f32 {
    const FAR: (i32, i32) = (1 << 20, 1 << 20);
    let bend = value(u * 0.9, v * 1.7, FAR, seed) + 0.4 * value(u * 2.3, v * 4.1, FAR, seed ^ 5);
    let rings = v * 5.0 + 3.2 * bend;
    let phase = rings - floor(rings) as f32;
    let ring = (2.0 * phase - 1.0).abs();
    let fibre = value(u * 3.0, v * 46.0, FAR, seed ^ 9);
    0.86 + 0.16 * ring * ring + 0.14 * (fibre - 0.5)
}

/// Darkness of a knot, 0 to 1, `distance` in knot radii.
pub fn knot(distance: f32) -> f32 {
    let rings = 0.75 + 0.25 * (2.0 * (distance * 3.0 - floor(distance * 3.0) as f32) - 1.0).abs();
    (1.0 - step(0.75, 1.25, distance)) * rings
}

/// A veneered or glued panel; the grain runs along u.
pub fn furniture(rng: &mut ChaCha8Rng) -> Canvas {
    let colour = one_of(rng, &WOODS);
    let (seed, bend) = (noise_seed(rng), between(rng, (0.6, 2.2)));
    let staves = one_of(rng, &[1, 1, 4, 8]);
    Canvas::painted(256, 256, |u, v| {
        let stave = floor(v * staves as f32);
        let own = random(stave, 3, seed);
        let offset = if staves > 1 { own } else { 0.0 };
        let wave = fractal(u + offset, v, (2, 5), 3, seed);
        let rings = v * 14.0 + bend * 3.0 * wave;
        let ring = (2.0 * (rings - floor(rings) as f32) - 1.0).abs();
        let fibre = value((u + offset) * 16.0, v * 128.0, (16, 128), seed ^ 7);
        let brightness = 0.84 + 0.14 * ring * ring + 0.14 * (fibre - 0.5) + 0.1 * (wave - 0.5);
        let joint = if staves > 1 { (v * staves as f32 - stave as f32) < 0.03 * staves as f32 / 8.0 } else { false };
        shade(tone(colour, own), brightness * if joint { 0.7 } else { mix(1.0, 0.9 + 0.2 * own, 0.6) })
    })
}

/// One board's own tone.
pub fn tone(colour: Colour, own: f32) -> Colour {
    [colour[0] * (0.97 + 0.06 * own), colour[1], colour[2] * (1.04 - 0.08 * own)]
}
