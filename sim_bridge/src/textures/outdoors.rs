//! What is seen through windows.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::canvas::Canvas;
use super::noise::{fractal, step};
use super::palette::{Colour, any, between, blend, hsl, noise_seed, shade};

const SIDE: f32 = 512.0;

/// Sky, clouds, hills and either houses or trees, behind a frame with bars.
pub fn window(rng: &mut ChaCha8Rng) -> Canvas {
    let seed = noise_seed(rng);
    let (zenith, horizon) = (hsl(0.58, between(rng, (0.35, 0.6)), 0.66), hsl(0.57, 0.25, 0.88));
    let mut canvas = Canvas::painted(512, 512, |u, v| {
        let cloud = step(0.52, 0.75, fractal(u, v * 2.0, (3, 6), 4, seed));
        blend(blend(zenith, horizon, (v * 1.6).min(1.0)), [0.97; 3], cloud)
    });
    for layer in 0..3 {
        let (seed, base) = (noise_seed(rng), 270.0 + 40.0 * layer as f32);
        let green = hsl(between(rng, (0.22, 0.36)), 0.3, 0.58 - 0.1 * layer as f32);
        let ridge: Vec<f32> =
            (0..512).map(|x| base - 70.0 * (fractal(x as f32 / SIDE, 0.5, (3, 3), 4, seed) - 0.4)).collect();
        canvas.fill((0.0, base - 80.0), (SIDE, SIDE), green, |x, y| ridge[x as usize % 512] - y);
    }
    for _ in 0..rng.random_range(3..7_u32) {
        let x = between(rng, (10.0, 450.0));
        if rng.random_bool(0.6) { house(&mut canvas, rng, x) } else { tree(&mut canvas, rng, x) }
    }
    frame(&mut canvas, rng);
    canvas
}

fn house(canvas: &mut Canvas, rng: &mut ChaCha8Rng, x: f32) {
    let (width, floors) = (between(rng, (60.0, 130.0)), rng.random_range(2..6_u32));
    let wall = any(rng, (0.1, 0.4), (0.55, 0.8));
    let top = 470.0 - 44.0 * floors as f32;
    canvas.rectangle((x, top), (x + width, SIDE), wall);
    let roof = hsl(between(rng, (0.0, 0.08)), 0.45, 0.36);
    canvas.polygon(&[(x - 6.0, top), (x + width + 6.0, top), (x + 0.5 * width, top - 0.4 * width)], roof);
    let n = (width / 28.0) as u32;
    for floor in 0..floors {
        for k in 0..n {
            let (wx, wy) = (x + 8.0 + 28.0 * k as f32, top + 10.0 + 44.0 * floor as f32);
            canvas.rectangle((wx, wy), (wx + 14.0, wy + 22.0), shade(wall, 0.4));
            canvas.frame((wx, wy), (wx + 14.0, wy + 22.0), 2.0, [0.9; 3]);
        }
    }
}

fn tree(canvas: &mut Canvas, rng: &mut ChaCha8Rng, x: f32) {
    let (height, green): (f32, Colour) = (between(rng, (80.0, 190.0)), hsl(between(rng, (0.22, 0.36)), 0.4, 0.3));
    canvas.stroke((x, SIDE), (x, SIDE - height), 12.0, [0.3, 0.22, 0.16]);
    for _ in 0..26 {
        let at = (x + between(rng, (-42.0, 42.0)), SIDE - height + between(rng, (-46.0, 40.0)));
        canvas.disc(at, between(rng, (9.0, 24.0)), shade(green, between(rng, (0.7, 1.4))));
    }
}

fn frame(canvas: &mut Canvas, rng: &mut ChaCha8Rng) {
    let wood = if rng.random_bool(0.6) { [0.93, 0.93, 0.91] } else { [0.45, 0.3, 0.18] };
    canvas.frame((0.0, 0.0), (SIDE, SIDE), 22.0, wood);
    canvas.frame((20.0, 20.0), (SIDE - 20.0, SIDE - 20.0), 4.0, shade(wood, 0.7));
    canvas.rectangle((244.0, 0.0), (268.0, SIDE), wood);
    canvas.rectangle((242.0, 22.0), (244.0, 490.0), shade(wood, 0.7));
    canvas.rectangle((268.0, 22.0), (270.0, 490.0), shade(wood, 0.7));
    if rng.random_bool(0.5) {
        canvas.rectangle((22.0, 168.0), (490.0, 184.0), wood);
    }
    canvas.rectangle((272.0, 250.0), (282.0, 300.0), [0.5; 3]);
}
