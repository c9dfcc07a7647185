//! Floors: planks, parquet, tiles.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::canvas::Canvas;
use super::noise::{floor, fractal, mix, random, step};
use super::palette::{Colour, WOODS, any, between, blend, noise_seed, one_of, shade};
use super::wood;

const SIDE: usize = 512;

/// Boards of different lengths, tones and grain, some with a knot.
pub fn planks(rng: &mut ChaCha8Rng) -> Canvas {
    let colour = one_of(rng, &WOODS);
    let n_rows = one_of(rng, &[8, 10, 12]);
    let seed = noise_seed(rng);
    let variety = between(rng, (0.12, 0.34));
    let gap_px = 1.3;
    // Each row has two boards that meet at these places, in 0..1.
    let joints: Vec<[f32; 2]> = (0..n_rows)
        .map(|_| {
            let first = rng.random::<f32>();
            [first, (first + between(rng, (0.35, 0.65))).fract()]
        })
        .collect();
    Canvas::painted(SIDE, SIDE, |u, v| {
        let across = v * n_rows as f32;
        let row = floor(across);
        let [a, b] = joints[row as usize];
        let after = |joint: f32| (u - joint).rem_euclid(1.0);
        let (along, board) = if after(a) < after(b) { (after(a), 2 * row) } else { (after(b), 2 * row + 1) };
        let board_seed = seed.wrapping_add(board as u32 * 7919);
        let own = random(board, 1, seed);
        let inside = across - row as f32;
        let mut brightness = (1.0 + variety * (own - 0.5)) * wood::grain(along * n_rows as f32, inside, board_seed);
        if random(board, 2, seed) < 0.45 {
            let (x, y) = (0.08 + 0.25 * random(board, 3, seed), 0.25 + 0.5 * random(board, 4, seed));
            let (dx, dy) = ((along - x) * n_rows as f32, inside - y);
            let distance = (dx * dx * 0.6 + dy * dy).sqrt() / (0.09 + 0.1 * random(board, 5, seed));
            brightness *= 1.0 - 0.5 * wood::knot(distance);
        }
        let edge_px = (inside.min(1.0 - inside) / n_rows as f32).min(after(a).min(after(b))) * SIDE as f32;
        shade(wood::tone(colour, own), brightness * mix(0.45, 1.0, step(0.0, gap_px, edge_px)))
    })
}

/// Strips in herringbone, or squares of strips that alternate in direction.
pub fn parquet(rng: &mut ChaCha8Rng) -> Canvas {
    let colour = one_of(rng, &WOODS[..5]);
    let seed = noise_seed(rng);
    let variety = between(rng, (0.15, 0.35));
    let herringbone = rng.random_bool(0.6);
    Canvas::painted(SIDE, SIDE, |u, v| {
        let strip = if herringbone { herringbone_strip(u * 16.0, v * 16.0) } else { block_strip(u * 20.0, v * 20.0) };
        let strips = if herringbone { 16.0 } else { 20.0 };
        let own = random(strip.id.0, strip.id.1, seed);
        let board_seed = seed.wrapping_add(super::noise::hash(strip.id.0, strip.id.1, 77));
        let edge_px = strip.across.min(1.0 - strip.across).min(strip.along.min(strip.length - strip.along))
            * SIDE as f32
            / strips;
        let brightness = (1.0 + variety * (own - 0.5)) * wood::grain(strip.along, strip.across, board_seed);
        shade(wood::tone(colour, own), brightness * mix(0.5, 1.0, step(0.0, 1.2, edge_px)))
    })
}

/// Where a point lies in its strip, in strip widths.
struct Strip {
    id: (i32, i32),
    along: f32,
    across: f32,
    length: f32,
}

/// Strips of 1x4 cells over a torus of 16x16 cells.
fn herringbone_strip(x: f32, y: f32) -> Strip {
    let (i, j) = (floor(x), floor(y));
    let (fx, fy) = (x - i as f32, y - j as f32);
    let place = (i - j).rem_euclid(8);
    if place < 4 {
        Strip { id: ((i - place).rem_euclid(16), j), along: place as f32 + fx, across: fy, length: 4.0 }
    } else {
        let down = 7 - place;
        Strip { id: (i + 32, (j - down).rem_euclid(16)), along: down as f32 + fy, across: fx, length: 4.0 }
    }
}

/// Blocks of five strips over 20x20 cells.
fn block_strip(x: f32, y: f32) -> Strip {
    let (bi, bj) = (floor(x / 5.0), floor(y / 5.0));
    let (lx, ly) = (x - 5.0 * bi as f32, y - 5.0 * bj as f32);
    let (along, side) = if (bi + bj).rem_euclid(2) == 0 { (lx, ly) } else { (ly, lx) };
    let strip = floor(side);
    Strip { id: (bi * 8 + strip, bj), along, across: side - strip as f32, length: 5.0 }
}

/// Square tiles, marbled, at times in two colours or with an ornament.
pub fn tiles(rng: &mut ChaCha8Rng) -> Canvas {
    let n = one_of(rng, &[4, 4, 6, 8]);
    let first = any(rng, (0.03, 0.25), (0.6, 0.88));
    let second = any(rng, (0.1, 0.45), (0.3, 0.7));
    let joint = shade(first, between(rng, (0.55, 0.8)));
    let (seed, style) = (noise_seed(rng), rng.random_range(0..4_u32));
    Canvas::painted(SIDE, SIDE, |u, v| {
        let (x, y) = (u * n as f32, v * n as f32);
        let (i, j) = (floor(x), floor(y));
        let (fx, fy) = (x - i as f32, y - j as f32);
        let base = match style {
            0 if (i + j) % 2 == 0 => second,
            1 => ornament(first, second, fx, fy),
            _ => first,
        };
        let own = random(i, j, seed);
        // Every tile shows another piece of the marble.
        let (mu, mv) = (u + random(i, j, seed ^ 1), v + random(i, j, seed ^ 2));
        let cloud = fractal(mu, mv, (8, 8), 4, seed);
        let vein = 1.0 - step(0.0, 0.035, (cloud - 0.5).abs());
        let brightness = 0.96 + 0.07 * (own - 0.5) + 0.1 * (cloud - 0.5) - 0.1 * vein;
        let edge_px = fx.min(1.0 - fx).min(fy.min(1.0 - fy)) * SIDE as f32 / n as f32;
        blend(joint, shade(base, brightness), step(0.6, 2.2, edge_px))
    })
}

/// Quarter circles in the corners and a diamond in the middle: neighbours complete each other.
fn ornament(first: Colour, second: Colour, x: f32, y: f32) -> Colour {
    let (cx, cy) = (x.min(1.0 - x), y.min(1.0 - y));
    let corner = (cx * cx + cy * cy).sqrt();
    let diamond = (x - 0.5).abs() + (y - 0.5).abs();
    let ring = 1.0 - step(0.0, 0.02, (corner - 0.36).abs() - 0.05);
    let middle = 1.0 - step(0.14, 0.17, diamond);
    blend(first, second, ring.max(middle))
}
