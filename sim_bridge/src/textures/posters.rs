//! Posters and screens: shapes and lettering that differ strongly from seed to seed.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::canvas::Canvas;
use super::lettering::{self, word};
use super::noise::{fractal, step};
use super::palette::{Colour, any, between, blend, hsl, noise_seed, one_of, shade};

const SIDE: f32 = 512.0;

/// Five colours that go together.
struct Scheme {
    paper: Colour,
    ink: Colour,
    accents: [Colour; 3],
}

fn scheme(rng: &mut ChaCha8Rng) -> Scheme {
    let hue: f32 = rng.random();
    let dark = rng.random_bool(0.3);
    let (paper, ink) = (hsl(hue, 0.3, if dark { 0.16 } else { 0.9 }), hsl(hue, 0.3, if dark { 0.92 } else { 0.14 }));
    let spread = between(rng, (0.12, 0.36));
    let accent = |k: f32, rng: &mut ChaCha8Rng| {
        hsl(hue + 0.5 + spread * k, between(rng, (0.35, 0.8)), between(rng, (0.36, 0.6)))
    };
    Scheme { paper, ink, accents: [accent(-1.0, rng), accent(0.0, rng), accent(1.0, rng)] }
}

/// A framed sheet.
pub fn poster(rng: &mut ChaCha8Rng) -> Canvas {
    let colours = scheme(rng);
    let mut canvas = Canvas::plain(512, 512, colours.paper);
    match rng.random_range(0..6_u32) {
        0 => big_shapes(&mut canvas, rng, &colours),
        1 => grid(&mut canvas, rng, &colours),
        2 => landscape(&mut canvas, rng, &colours),
        3 => stripes(&mut canvas, rng, &colours),
        4 => typography(&mut canvas, rng, &colours),
        _ => rays(&mut canvas, rng, &colours),
    }
    let frame = one_of(rng, &[[0.1; 3], [0.93; 3], [0.55, 0.38, 0.22]]);
    canvas.frame((0.0, 0.0), (SIDE, SIDE), 14.0, frame);
    canvas.frame((14.0, 14.0), (SIDE - 14.0, SIDE - 14.0), 2.0, shade(frame, 0.6));
    canvas
}

/// A line of lettering with a smaller one below it.
fn caption(canvas: &mut Canvas, rng: &mut ChaCha8Rng, y: f32, ink: Colour) {
    let size = lettering::write_centred(canvas, word(rng), (256.0, y), 440.0, 84.0, ink);
    let small = format!("{} {}", word(rng), rng.random_range(1920..2030_u32));
    lettering::write_centred(canvas, &small, (256.0, y + size + 10.0), 400.0, 26.0, ink);
}

fn shape(canvas: &mut Canvas, rng: &mut ChaCha8Rng, (x, y): (f32, f32), r: f32, colour: Colour) {
    match rng.random_range(0..6_u32) {
        0 => canvas.disc((x, y), r, colour),
        1 => canvas.rectangle((x - r, y - r), (x + r, y + r), colour),
        2 => canvas.polygon(&[(x - r, y + r), (x + r, y + r), (x, y - r)], colour),
        3 => canvas.ring((x, y), 0.75 * r, 0.4 * r, colour),
        4 => canvas.polygon(&[(x - r, y), (x, y - r), (x + r, y), (x, y + r)], colour),
        _ => {
            canvas.stroke((x - 0.7 * r, y - 0.7 * r), (x + 0.7 * r, y + 0.7 * r), 0.4 * r, colour);
            canvas.stroke((x - 0.7 * r, y + 0.7 * r), (x + 0.7 * r, y - 0.7 * r), 0.4 * r, colour);
        }
    }
}

fn big_shapes(canvas: &mut Canvas, rng: &mut ChaCha8Rng, c: &Scheme) {
    for k in 0..rng.random_range(5..9_usize) {
        let at = (between(rng, (90.0, 420.0)), between(rng, (80.0, 330.0)));
        let r = between(rng, (30.0, 120.0)) / (1.0 + 0.15 * k as f32);
        shape(canvas, rng, at, r, c.accents[k % 3]);
    }
    caption(canvas, rng, 376.0, c.ink);
}

fn grid(canvas: &mut Canvas, rng: &mut ChaCha8Rng, c: &Scheme) {
    let n = rng.random_range(3..6_usize);
    let pitch = 440.0 / n as f32;
    for i in 0..n {
        for j in 0..n {
            let centre = (36.0 + pitch * (i as f32 + 0.5), 36.0 + pitch * (j as f32 + 0.5));
            let (back, front) = (rng.random_range(0..3_usize), rng.random_range(1..3_usize));
            let h = 0.47 * pitch;
            canvas.rectangle((centre.0 - h, centre.1 - h), (centre.0 + h, centre.1 + h), c.accents[back]);
            let colour = if rng.random_bool(0.4) { c.paper } else { c.accents[(back + front) % 3] };
            let size = between(rng, (0.2, 0.4)) * pitch;
            shape(canvas, rng, centre, size, colour);
        }
    }
    if rng.random_bool(0.5) {
        let y = 36.0 + pitch * (n / 2) as f32;
        canvas.rectangle((36.0, y), (476.0, y + 72.0), c.paper);
        lettering::write_centred(canvas, word(rng), (256.0, y + 10.0), 420.0, 54.0, c.ink);
    }
}

fn landscape(canvas: &mut Canvas, rng: &mut ChaCha8Rng, c: &Scheme) {
    let (low, high) = (c.accents[0], blend(c.accents[1], [1.0; 3], 0.5));
    canvas.alter((0.0, 0.0), (SIDE, 400.0), |_, y, _| blend(low, high, y / 400.0));
    let sun = (between(rng, (120.0, 390.0)), between(rng, (90.0, 180.0)));
    canvas.disc(sun, between(rng, (36.0, 70.0)), blend(c.accents[2], [1.0, 0.9, 0.5], 0.5));
    for layer in 0..4 {
        let (seed, base) = (noise_seed(rng), 190.0 + 58.0 * layer as f32);
        let colour = shade(c.accents[1], 1.0 - 0.22 * layer as f32);
        let ridge: Vec<f32> =
            (0..512).map(|x| base - 80.0 * (fractal(x as f32 / SIDE, 0.5, (4, 4), 4, seed) - 0.3)).collect();
        canvas.fill((0.0, base - 90.0), (SIDE, 400.0), colour, |x, y| ridge[x as usize % 512] - y);
    }
    canvas.rectangle((0.0, 394.0), (SIDE, SIDE), c.paper);
    caption(canvas, rng, 404.0, c.ink);
}

fn stripes(canvas: &mut Canvas, rng: &mut ChaCha8Rng, c: &Scheme) {
    let (n, lean) = (rng.random_range(6..14_usize), between(rng, (-260.0, 260.0)));
    let pitch = 900.0 / n as f32;
    for k in 0..n {
        let x = -200.0 + pitch * k as f32;
        let width = pitch * between(rng, (0.3, 0.8));
        let corners = [(x, 0.0), (x + width, 0.0), (x + width + lean, SIDE), (x + lean, SIDE)];
        canvas.polygon(&corners, c.accents[k % 3]);
    }
    let y = between(rng, (90.0, 330.0));
    canvas.rectangle((44.0, y - 14.0), (468.0, y + 106.0), c.paper);
    lettering::write_centred(canvas, word(rng), (256.0, y), 400.0, 60.0, c.ink);
    lettering::write_centred(canvas, word(rng), (256.0, y + 66.0), 300.0, 28.0, c.accents[1]);
}

fn typography(canvas: &mut Canvas, rng: &mut ChaCha8Rng, c: &Scheme) {
    let mut y = 40.0;
    let mut k = 0;
    while y < 440.0 {
        let text = word(rng);
        let size = (430.0 / text.len() as f32).min(between(rng, (40.0, 110.0)));
        let colour = if k % 2 == 0 { c.ink } else { c.accents[k % 3] };
        if rng.random_bool(0.25) {
            canvas.rectangle((36.0, y - 5.0), (476.0, y + size + 3.0), colour);
            lettering::write(canvas, text, (44.0, y), size, c.paper);
        } else {
            lettering::write(canvas, text, (44.0, y), size, colour);
        }
        y += size + 12.0;
        k += 1;
    }
}

fn rays(canvas: &mut Canvas, rng: &mut ChaCha8Rng, c: &Scheme) {
    let (n, centre) = (rng.random_range(7..16_usize), (between(rng, (150.0, 360.0)), between(rng, (160.0, 300.0))));
    for k in 0..n {
        let turn = core::f32::consts::TAU / n as f32;
        let end = |angle: f32| {
            let (sin, cos) = libm::sincosf(angle);
            (centre.0 + 600.0 * cos, centre.1 + 600.0 * sin)
        };
        canvas.polygon(&[centre, end(turn * k as f32), end(turn * (k as f32 + 0.5))], c.accents[k % 2]);
    }
    for (k, r) in [120.0, 92.0, 60.0, 26.0].into_iter().enumerate() {
        canvas.disc(centre, r, [c.paper, c.accents[2], c.ink, c.accents[0]][k]);
    }
    canvas.rectangle((30.0, 380.0), (482.0, 482.0), c.paper);
    caption(canvas, rng, 388.0, c.ink);
}

/// A monitor or television that is on: windows with text, or a film.
pub fn screen(rng: &mut ChaCha8Rng) -> Canvas {
    let colours = scheme(rng);
    let mut canvas = Canvas::plain(512, 512, colours.accents[0]);
    if rng.random_bool(0.5) {
        landscape(&mut canvas, rng, &colours);
    } else {
        desktop(&mut canvas, rng, &colours);
    }
    canvas.frame((0.0, 0.0), (SIDE, SIDE), 16.0, [0.04; 3]);
    canvas.disc((490.0, 504.0), 3.0, [0.9, 0.2, 0.2]);
    canvas
}

fn desktop(canvas: &mut Canvas, rng: &mut ChaCha8Rng, c: &Scheme) {
    let seed = noise_seed(rng);
    let (a, b) = (c.accents[0], c.accents[1]);
    canvas.alter((0.0, 0.0), (SIDE, SIDE), |x, y, _| {
        blend(a, b, step(0.3, 0.7, fractal(x / SIDE, y / SIDE, (3, 3), 2, seed)))
    });
    for _ in 0..3 {
        let (x, y) = (between(rng, (30.0, 230.0)), between(rng, (30.0, 250.0)));
        let (w, h) = (between(rng, (160.0, 250.0)), between(rng, (120.0, 220.0)));
        canvas.rectangle((x, y), (x + w, y + h), [0.95; 3]);
        canvas.rectangle((x, y), (x + w, y + 24.0), any(rng, (0.3, 0.6), (0.25, 0.4)));
        lettering::write(canvas, word(rng), (x + 8.0, y + 5.0), 15.0, [0.95; 3]);
        for line in 0..((h - 40.0) / 22.0) as usize {
            let colour = if rng.random_bool(0.2) { c.accents[2] } else { [0.2; 3] };
            lettering::write(canvas, word(rng), (x + 10.0, y + 34.0 + 22.0 * line as f32), 14.0, colour);
        }
    }
}
