//! Fronts of furniture: books, doors, appliances.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::canvas::Canvas;
use super::lettering::{self, word};
use super::noise::{random, value};
use super::palette::{Colour, WOODS, any, between, blend, noise_seed, one_of, shade};
use super::walls::lacquer;
use super::wood;

/// One row of books, standing, some leaning, with titles on their spines.
pub fn books(rng: &mut ChaCha8Rng) -> Canvas {
    const SIDE: f32 = 512.0;
    let mut canvas = Canvas::plain(512, 512, [0.08, 0.06, 0.05]);
    let mut x = 4.0;
    while x < SIDE - 14.0 {
        if rng.random_bool(0.06) {
            x += between(rng, (10.0, 40.0));
            continue;
        }
        let (width, top) = (between(rng, (14.0, 44.0)).min(SIDE - x - 2.0), between(rng, (20.0, 170.0)));
        let cover = any(rng, (0.1, 0.75), (0.2, 0.75));
        canvas.rectangle((x, top), (x + width - 1.5, SIDE), cover);
        canvas.rectangle((x, top), (x + 2.0, SIDE), shade(cover, 1.3));
        canvas.rectangle((x + width - 5.0, top), (x + width - 1.5, SIDE), shade(cover, 0.65));
        spine(&mut canvas, rng, (x, x + width - 1.5), top, cover);
        x += width;
    }
    canvas
}

fn spine(canvas: &mut Canvas, rng: &mut ChaCha8Rng, (x0, x1): (f32, f32), top: f32, cover: Colour) {
    let light = cover.iter().sum::<f32>() < 1.5;
    let ink = if light { [0.95, 0.9, 0.75] } else { [0.12, 0.1, 0.1] };
    for y in [top + between(rng, (8.0, 30.0)), 512.0 - between(rng, (20.0, 60.0))] {
        canvas.rectangle((x0, y), (x1, y + between(rng, (3.0, 9.0))), ink);
    }
    let size = (x1 - x0 - 8.0).min(24.0);
    let text = word(rng);
    if size > 7.0 && lettering::width(text, size) < 400.0 - top {
        lettering::write_upwards(canvas, text, (0.5 * (x0 + x1 - size), 440.0), size, ink);
    } else {
        canvas.rectangle((x0 + 3.0, 260.0), (x1 - 3.0, 330.0), blend(cover, ink, 0.7));
    }
}

/// A leaf with two or four panels, handle and key plate; painted or of wood.
pub fn door(rng: &mut ChaCha8Rng) -> Canvas {
    let painted = rng.random_bool(0.5);
    let colour = if painted { lacquer(rng) } else { one_of(rng, &WOODS) };
    let seed = noise_seed(rng);
    let mut canvas = Canvas::painted(256, 512, |u, v| {
        let grain = if painted {
            0.98 + 0.04 * value(u * 64.0, v * 128.0, (64, 128), seed)
        } else {
            wood::grain(v * 8.0, u * 4.0, seed)
        };
        shade(colour, grain)
    });
    let (columns, rows) = one_of(rng, &[(1, 2), (2, 2), (2, 3), (1, 3)]);
    let (w, h) = (200.0 / columns as f32, 440.0 / rows as f32);
    for i in 0..columns {
        for j in 0..rows {
            let (x, y) = (28.0 + w * i as f32, 36.0 + h * j as f32);
            panel(&mut canvas, (x + 8.0, y + 8.0), (x + w - 8.0, y + h - 8.0));
        }
    }
    let right = rng.random_bool(0.5);
    let x = if right { 236.0 } else { 20.0 };
    let metal = one_of(rng, &[[0.75, 0.75, 0.72], [0.3, 0.28, 0.26], [0.75, 0.62, 0.3]]);
    canvas.rectangle((x - 6.0, 236.0), (x + 6.0, 300.0), shade(metal, 0.8));
    let end = if right { x - 26.0 } else { x + 26.0 };
    canvas.stroke((x, 256.0), (end, 256.0), 8.0, metal);
    canvas.disc((x, 284.0), 3.0, [0.05; 3]);
    canvas
}

/// A bevelled field: light from above.
fn panel(canvas: &mut Canvas, (x0, y0): (f32, f32), (x1, y1): (f32, f32)) {
    const BEVEL: f32 = 7.0;
    canvas.alter((x0, y0), (x1, y1), |x, y, old| {
        let sides = [x - x0, x1 - x, y - y0, y1 - y];
        let nearest = sides.iter().copied().fold(f32::MAX, f32::min);
        if nearest < 0.0 {
            return old;
        }
        if nearest > BEVEL {
            return shade(old, 1.03);
        }
        shade(old, if nearest == sides[2] || nearest == sides[0] { 0.72 } else { 1.22 })
    });
}

/// A fridge, an oven or washing machine, or a cupboard with drawers.
pub fn appliance(rng: &mut ChaCha8Rng) -> Canvas {
    let colour =
        one_of(rng, &[[0.9, 0.9, 0.9], [0.72, 0.73, 0.75], [0.2, 0.2, 0.22], [0.8, 0.86, 0.84], [0.85, 0.8, 0.7]]);
    let seed = noise_seed(rng);
    let mut canvas = Canvas::painted(512, 512, |u, v| {
        let brushed = random((v * 512.0) as i32, 0, seed);
        shade(colour, 0.97 + 0.03 * brushed + 0.04 * value(u * 4.0, v * 4.0, (4, 4), seed))
    });
    let dark = shade(colour, 0.55);
    canvas.frame((0.0, 0.0), (512.0, 512.0), 5.0, dark);
    match rng.random_range(0..3_u32) {
        0 => fridge(&mut canvas, rng, dark),
        1 => drum(&mut canvas, rng, dark),
        _ => drawers(&mut canvas, rng, colour),
    }
    canvas
}

fn fridge(canvas: &mut Canvas, rng: &mut ChaCha8Rng, dark: Colour) {
    let split = between(rng, (150.0, 340.0));
    canvas.rectangle((0.0, split), (512.0, split + 6.0), dark);
    for (from, to) in [(split - 110.0, split - 20.0), (split + 28.0, split + 140.0)] {
        canvas.stroke((450.0, from), (450.0, to), 14.0, [0.5, 0.5, 0.52]);
    }
    lettering::write(canvas, word(rng), (40.0, 40.0), 26.0, dark);
    for _ in 0..rng.random_range(3..9_u32) {
        let (x, y, r) = (between(rng, (60.0, 390.0)), between(rng, (90.0, 470.0)), between(rng, (10.0, 34.0)));
        let note = any(rng, (0.4, 0.8), (0.45, 0.75));
        canvas.rectangle((x - r, y - r), (x + r, y + 1.3 * r), note);
        lettering::write_centred(canvas, word(rng), (x, y - 0.3 * r), 1.7 * r, 14.0, [0.1; 3]);
        canvas.disc((x, y - r), 5.0, [0.1; 3]);
    }
}

fn drum(canvas: &mut Canvas, rng: &mut ChaCha8Rng, dark: Colour) {
    canvas.rectangle((14.0, 14.0), (498.0, 96.0), shade(dark, 1.3));
    lettering::write(canvas, word(rng), (30.0, 40.0), 24.0, [0.95; 3]);
    for k in 0..4 {
        let at = (290.0 + 56.0 * k as f32, 55.0);
        canvas.disc(at, 20.0, [0.15; 3]);
        let (sin, cos) = libm::sincosf(between(rng, (0.0, 6.0)));
        canvas.stroke(at, (at.0 + 16.0 * cos, at.1 + 16.0 * sin), 4.0, [0.95; 3]);
    }
    if rng.random_bool(0.5) {
        canvas.disc((256.0, 300.0), 160.0, [0.6; 3]);
        canvas.disc((256.0, 300.0), 128.0, [0.1, 0.11, 0.13]);
        canvas.ring((256.0, 300.0), 90.0, 6.0, [0.3, 0.32, 0.36]);
    } else {
        canvas.rectangle((50.0, 160.0), (462.0, 440.0), [0.07; 3]);
        canvas.frame((50.0, 160.0), (462.0, 440.0), 8.0, [0.4; 3]);
        canvas.stroke((70.0, 134.0), (442.0, 134.0), 14.0, [0.65; 3]);
        canvas.stroke((80.0, 330.0), (432.0, 330.0), 3.0, [0.35; 3]);
    }
}

fn drawers(canvas: &mut Canvas, rng: &mut ChaCha8Rng, colour: Colour) {
    let n = rng.random_range(2..5_u32);
    let h = 512.0 / n as f32;
    for k in 0..n {
        let y = h * k as f32;
        panel(canvas, (12.0, y + 8.0), (500.0, y + h - 8.0));
        canvas.rectangle((0.0, y - 2.0), (512.0, y + 2.0), shade(colour, 0.45));
        canvas.stroke((196.0, y + 34.0), (316.0, y + 34.0), 11.0, [0.35, 0.34, 0.33]);
    }
}
