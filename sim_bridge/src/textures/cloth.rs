//! Fabric, rugs, leaves.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::canvas::Canvas;
use super::noise::{floor, fractal, random, step, value};
use super::palette::{Colour, any, between, blend, hsl, hue, noise_seed, one_of, shade};

/// A weave in one colour, striped or chequered.
pub fn fabric(rng: &mut ChaCha8Rng) -> Canvas {
    let ground = any(rng, (0.06, 0.36), (0.3, 0.72));
    let thread = any(rng, (0.08, 0.4), (0.3, 0.8));
    let (seed, kind) = (noise_seed(rng), rng.random_range(0..4_u32));
    let bands: Vec<f32> = (0..16).map(|_| if rng.random_bool(0.4) { 1.0 } else { 0.0 }).collect();
    Canvas::painted(256, 256, |u, v| {
        let (warp, weft) = (bands[(u * 16.0) as usize % 16], bands[(v * 16.0) as usize % 16]);
        let share = match kind {
            0 => 0.0,
            1 => warp,
            2 => 0.5 * (warp + weft),
            _ => 0.25 * (step(0.45, 0.55, fractal(u, v, (6, 6), 2, seed)) + warp * weft),
        };
        let (x, y) = (u * 64.0, v * 64.0);
        let (fx, fy) = (x - floor(x) as f32 - 0.5, y - floor(y) as f32 - 0.5);
        let over = (floor(x) + floor(y)) % 2 == 0;
        let bulge = if over { 1.0 - 2.2 * fx * fx } else { 1.0 - 2.2 * fy * fy };
        let own = random(floor(x), floor(y), seed);
        let cloud = fractal(u, v, (4, 4), 3, seed ^ 1);
        let brightness = bulge * (0.9 + 0.2 * own) * (0.85 + 0.3 * cloud);
        shade(blend(ground, thread, 0.8 * share), brightness)
    })
}

/// A border with teeth, a field with rows of motifs, a medallion.
pub fn rug(rng: &mut ChaCha8Rng) -> Canvas {
    const SIDE: f32 = 512.0;
    let hue = hue(rng);
    let ground = hsl(hue, between(rng, (0.25, 0.5)), between(rng, (0.25, 0.4)));
    let border = hsl(hue + between(rng, (0.3, 0.6)), 0.4, between(rng, (0.25, 0.45)));
    let light = any(rng, (0.15, 0.4), (0.72, 0.85));
    let accent = any(rng, (0.3, 0.6), (0.4, 0.6));
    let mut canvas = Canvas::plain(512, 512, light);
    canvas.rectangle((10.0, 6.0), (SIDE - 10.0, SIDE - 6.0), border);
    canvas.frame((22.0, 18.0), (SIDE - 22.0, SIDE - 18.0), 5.0, light);
    canvas.frame((64.0, 60.0), (SIDE - 64.0, SIDE - 60.0), 6.0, accent);
    canvas.rectangle((70.0, 66.0), (SIDE - 70.0, SIDE - 66.0), ground);
    border_motifs(&mut canvas, light, accent);
    field_motifs(&mut canvas, rng, [light, accent, border]);
    medallion(&mut canvas, rng, [border, light, accent, ground]);
    let seed = noise_seed(rng);
    canvas.alter((0.0, 0.0), (SIDE, SIDE), |x, y, old| {
        let knot = random(x as i32 / 2, y as i32 / 2, seed);
        let worn = value(x / 64.0, y / 64.0, (8, 8), seed ^ 1);
        shade(old, 0.88 + 0.14 * knot + 0.1 * (worn - 0.5))
    });
    canvas
}

fn border_motifs(canvas: &mut Canvas, light: Colour, accent: Colour) {
    for k in 0..12 {
        let along = 58.0 + 36.0 * k as f32;
        for centre in [(along, 41.0), (along, 471.0), (45.0, along), (467.0, along)] {
            diamond(canvas, centre, 14.0, light);
            diamond(canvas, centre, 7.0, accent);
        }
    }
}

fn field_motifs(canvas: &mut Canvas, rng: &mut ChaCha8Rng, colours: [Colour; 3]) {
    let kind = rng.random_range(0..3_u32);
    let pitch = one_of(rng, &[46.0, 58.0, 72.0]);
    let n = (330.0 / pitch) as i32;
    let start = 256.0 - 0.5 * pitch * n as f32;
    for i in 0..=n {
        for j in 0..=n {
            let centre = (start + pitch * i as f32, start + pitch * j as f32);
            let colour = colours[(i + 2 * j) as usize % 3];
            match kind {
                0 => diamond(canvas, centre, 0.3 * pitch, colour),
                1 => {
                    canvas.ring(centre, 0.24 * pitch, 4.0, colour);
                    canvas.disc(centre, 0.1 * pitch, colour);
                }
                _ => {
                    let h = 0.26 * pitch;
                    canvas.stroke((centre.0 - h, centre.1), (centre.0 + h, centre.1), 5.0, colour);
                    canvas.stroke((centre.0, centre.1 - h), (centre.0, centre.1 + h), 5.0, colour);
                }
            }
        }
    }
}

fn medallion(canvas: &mut Canvas, rng: &mut ChaCha8Rng, colours: [Colour; 4]) {
    let radius = between(rng, (70.0, 130.0));
    for (k, colour) in colours.iter().enumerate() {
        let size = radius * (1.0 - 0.22 * k as f32);
        diamond(canvas, (256.0, 256.0), size, *colour);
        if k % 2 == 0 {
            let h = 0.62 * size;
            canvas.rectangle((256.0 - h, 256.0 - h), (256.0 + h, 256.0 + h), *colour);
        }
    }
    let petals = rng.random_range(5..9_u32);
    for k in 0..petals {
        let (sin, cos) = libm::sincosf(core::f32::consts::TAU * k as f32 / petals as f32);
        canvas.disc((256.0 + 0.2 * radius * cos, 256.0 + 0.2 * radius * sin), 0.07 * radius, colours[1]);
    }
}

fn diamond(canvas: &mut Canvas, (x, y): (f32, f32), size: f32, colour: Colour) {
    canvas.polygon(&[(x - size, y), (x, y - size), (x + size, y), (x, y + size)], colour);
}

/// Overlapping leaves with ribs, painted across the edges so that they repeat.
pub fn leaves(rng: &mut ChaCha8Rng) -> Canvas {
    const SIDE: f32 = 256.0;
    let green = hsl(between(rng, (0.25, 0.38)), between(rng, (0.35, 0.55)), between(rng, (0.25, 0.36)));
    let mut canvas = Canvas::plain(256, 256, shade(green, 0.6));
    let seed = noise_seed(rng);
    for _ in 0..46 {
        let (x, y) = (between(rng, (0.0, SIDE)), between(rng, (0.0, SIDE)));
        let (sin, cos) = libm::sincosf(between(rng, (0.0, core::f32::consts::TAU)));
        let (length, colour) = (between(rng, (20.0, 40.0)), shade(green, between(rng, (0.75, 1.5))));
        for (ox, oy) in [(0.0, 0.0), (SIDE, 0.0), (-SIDE, 0.0), (0.0, SIDE), (0.0, -SIDE)] {
            let (cx, cy) = (x + ox, y + oy);
            canvas.fill((cx - length, cy - length), (cx + length, cy + length), colour, |px, py| {
                let (a, b) = ((px - cx) * cos + (py - cy) * sin, (py - cy) * cos - (px - cx) * sin);
                let t = a / length;
                b.abs() - 0.36 * length * (1.0 - t * t).max(-1.0)
            });
            let tip = (cx + length * cos, cy + length * sin);
            canvas.stroke((cx - length * cos, cy - length * sin), tip, 1.6, shade(colour, 0.7));
        }
    }
    canvas.alter((0.0, 0.0), (SIDE, SIDE), |px, py, old| {
        shade(old, 0.9 + 0.2 * value(px / 8.0, py / 8.0, (32, 32), seed))
    });
    canvas
}
