//! Colours and how they are chosen.

use rand::{Rng, RngExt};
use rand_chacha::ChaCha8Rng;

use super::noise::mix;

/// sRGB, 0 to 1.
pub type Colour = [f32; 3];

/// From hue (turns), saturation and lightness, all 0 to 1.
pub fn hsl(hue: f32, saturation: f32, lightness: f32) -> Colour {
    let chroma = (1.0 - (2.0 * lightness - 1.0).abs()) * saturation;
    let channel = |shift: f32| {
        let turn = (hue + shift).rem_euclid(1.0) * 6.0;
        lightness + chroma * ((2.0 - (turn - 3.0).abs()).clamp(0.0, 1.0) - 0.5)
    };
    // Distance from the opposite hue makes a trapezoid per channel.
    [channel(0.5), channel(0.5 - 1.0 / 3.0), channel(0.5 + 1.0 / 3.0)]
}

/// Any hue, saturation and lightness within the ranges.
pub fn any(rng: &mut ChaCha8Rng, saturation: (f32, f32), lightness: (f32, f32)) -> Colour {
    hsl(hue(rng), between(rng, saturation), between(rng, lightness))
}

/// A hue, in turns. Earth colours, greens and blues are more common in flats than violet and pink.
pub fn hue(rng: &mut ChaCha8Rng) -> f32 {
    let ranges = [(0.0, 0.14), (0.05, 0.16), (0.2, 0.42), (0.48, 0.64), (0.55, 0.66), (0.0, 1.0)];
    let range = one_of(rng, &ranges);
    between(rng, range)
}

/// A number within a range.
pub fn between(rng: &mut ChaCha8Rng, (low, high): (f32, f32)) -> f32 {
    mix(low, high, rng.random())
}

/// One of a list that is not empty.
pub fn one_of<T: Copy>(rng: &mut ChaCha8Rng, list: &[T]) -> T {
    list[rng.random_range(0..list.len() as u32) as usize]
}

/// A seed for noise.
pub fn noise_seed(rng: &mut ChaCha8Rng) -> u32 {
    rng.next_u32()
}

/// From one colour to another.
pub fn blend(a: Colour, b: Colour, share: f32) -> Colour {
    core::array::from_fn(|k| mix(a[k], b[k], share))
}

/// Brighter (above 1) or darker.
pub fn shade(colour: Colour, factor: f32) -> Colour {
    colour.map(|c| c * factor)
}

/// Colours of wood, pale to dark.
pub const WOODS: [Colour; 7] = [
    [0.82, 0.69, 0.50],
    [0.76, 0.58, 0.38],
    [0.68, 0.48, 0.29],
    [0.60, 0.39, 0.24],
    [0.48, 0.31, 0.20],
    [0.36, 0.24, 0.17],
    [0.70, 0.63, 0.54],
];
