//! Lattice noise that repeats.

/// A well-mixed 32-bit hash of a lattice point.
pub fn hash(x: i32, y: i32, seed: u32) -> u32 {
    let mut h =
        (x as u32).wrapping_mul(0x9e37_79b1) ^ (y as u32).wrapping_mul(0x85eb_ca6b) ^ seed.wrapping_mul(0xc2b2_ae35);
    h = (h ^ (h >> 15)).wrapping_mul(0x2c1b_3c6d);
    h = (h ^ (h >> 12)).wrapping_mul(0x297a_2d39);
    h ^ (h >> 15)
}

/// The hash as a number in 0..1.
pub fn random(x: i32, y: i32, seed: u32) -> f32 {
    (hash(x, y, seed) >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// Smooth noise in 0..1 over a lattice that repeats after `period` points.
pub fn value(x: f32, y: f32, period: (i32, i32), seed: u32) -> f32 {
    let (xi, yi) = (floor(x), floor(y));
    let (fx, fy) = (ease(x - xi as f32), ease(y - yi as f32));
    let (x0, x1) = (wrapped(xi, period.0), wrapped(xi + 1, period.0));
    let (y0, y1) = (wrapped(yi, period.1), wrapped(yi + 1, period.1));
    let top = mix(random(x0, y0, seed), random(x1, y0, seed), fx);
    let bottom = mix(random(x0, y1, seed), random(x1, y1, seed), fx);
    mix(top, bottom, fy)
}

/// Into 0..period. Nearly every point lies there already, and a division costs more than the rest.
fn wrapped(i: i32, period: i32) -> i32 {
    if (0..period).contains(&i) { i } else { i.rem_euclid(period) }
}

/// Octaves of [`value`] over `u, v` in 0..1, about 0..1; `cells` lattice points in the first octave.
pub fn fractal(u: f32, v: f32, cells: (i32, i32), octaves: u32, seed: u32) -> f32 {
    let (mut sum, mut weight, mut total) = (0.0, 1.0, 0.0);
    for octave in 0..octaves {
        let (nx, ny) = (cells.0 << octave, cells.1 << octave);
        sum += weight * value(u * nx as f32, v * ny as f32, (nx, ny), seed.wrapping_add(octave * 101));
        total += weight;
        weight *= 0.5;
    }
    sum / total
}

/// Rounds down.
pub fn floor(x: f32) -> i32 {
    let cut = x as i32;
    cut - i32::from((cut as f32) > x)
}

/// From `a` to `b`.
pub fn mix(a: f32, b: f32, share: f32) -> f32 {
    a + (b - a) * share
}

/// 0 below `low`, 1 above `high`, smooth between.
pub fn step(low: f32, high: f32, x: f32) -> f32 {
    ease(((x - low) / (high - low)).clamp(0.0, 1.0))
}

fn ease(t: f32) -> f32 {
    t * t * (3.0 - 2.0 * t)
}
