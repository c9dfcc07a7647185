//! Letters of an 8x8 font, enlarged with smooth edges.

use font8x8::{BASIC_FONTS, UnicodeFonts};
use rand_chacha::ChaCha8Rng;

use super::canvas::Canvas;
use super::noise::floor;
use super::palette::{Colour, one_of};

const WORDS: [&str; 48] = [
    "HOME", "OCEAN", "NORTH", "JAZZ", "COFFEE", "LUNA", "PARIS", "TOKYO", "BREAD", "WINTER", "GARDEN", "MUSIC",
    "RIVER", "STONE", "FOREST", "OPERA", "SUNDAY", "CINEMA", "ORANGE", "MOUNTAIN", "SUMMER", "DREAM", "ATLAS", "COMET",
    "HARBOR", "VELVET", "PIANO", "TIGER", "ISLAND", "MARKET", "BICYCLE", "EXPO 67", "LEMON", "SAFARI", "GALAXY",
    "TANGO", "VIENNA", "POLAR", "CIRCUS", "AUTUMN", "ROCKET", "SALT", "LISBOA", "HONEY", "WAVES", "BALLET", "THYME",
    "ZEBRA",
];

/// A word.
pub fn word(rng: &mut ChaCha8Rng) -> &'static str {
    one_of(rng, &WORDS)
}

/// Width of a text whose letters are `size` pixels high.
pub fn width(text: &str, size: f32) -> f32 {
    text.len() as f32 * size
}

/// Writes with the top left corner of the first letter at `at`, letters `size` pixels high.
pub fn write(canvas: &mut Canvas, text: &str, at: (f32, f32), size: f32, colour: Colour) {
    for (i, letter) in text.chars().enumerate() {
        glyph(canvas, letter, size, colour, (at.0 + i as f32 * size, at.1), (size, size), |x, y| (x, y));
    }
}

/// Writes upwards: `at` is the bottom left corner of the turned text.
pub fn write_upwards(canvas: &mut Canvas, text: &str, at: (f32, f32), size: f32, colour: Colour) {
    for (i, letter) in text.chars().enumerate() {
        let corner = (at.0, at.1 - (i + 1) as f32 * size);
        glyph(canvas, letter, size, colour, corner, (size, size), |x, y| (size - y, x));
    }
}

/// Writes centred about `x`, as large as fits into `span` pixels and not larger than `size`; returns the size taken.
pub fn write_centred(canvas: &mut Canvas, text: &str, (x, y): (f32, f32), span: f32, size: f32, colour: Colour) -> f32 {
    let size = size.min(span / text.len().max(1) as f32);
    write(canvas, text, (x - 0.5 * width(text, size), y), size, colour);
    size
}

fn glyph(
    canvas: &mut Canvas,
    letter: char,
    size: f32,
    colour: Colour,
    corner: (f32, f32),
    extent: (f32, f32),
    turn: impl Fn(f32, f32) -> (f32, f32),
) {
    let Some(rows) = BASIC_FONTS.get(letter) else { return };
    let cell = |column: i32, row: i32| {
        let inside = (0..8).contains(&column) && (0..8).contains(&row);
        if inside && rows[row as usize] >> column & 1 == 1 { 1.0_f32 } else { 0.0 }
    };
    let per_pixel = 8.0 / size;
    // Distance to the contour where the blurred bitmap is one half, in pixels.
    let distance = |x: f32, y: f32| {
        let (gx, gy) = turn(x - corner.0, y - corner.1);
        let (gx, gy) = (gx * per_pixel - 0.5, gy * per_pixel - 0.5);
        let (ix, iy) = (floor(gx), floor(gy));
        let (fx, fy) = (gx - ix as f32, gy - iy as f32);
        let top = cell(ix, iy) + (cell(ix + 1, iy) - cell(ix, iy)) * fx;
        let bottom = cell(ix, iy + 1) + (cell(ix + 1, iy + 1) - cell(ix, iy + 1)) * fx;
        (0.42 - (top + (bottom - top) * fy)) / per_pixel.min(1.0)
    };
    canvas.fill(corner, (corner.0 + extent.0, corner.1 + extent.1), colour, distance);
}
