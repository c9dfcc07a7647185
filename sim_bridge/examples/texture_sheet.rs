//! Every procedural surface on one sheet, and the time they take: `texture_sheet OUT.png [first seed]`.

#![expect(clippy::unwrap_used, reason = "a tool for looking at textures may fail by panicking")]

use std::time::Instant;

use homing_sim::scene::Texture;
use homing_sim::textures::{Surface, draw};

/// Pixels of one picture on the sheet.
const CELL: usize = 192;
/// Seeds a surface.
const SEEDS: usize = 6;

fn main() {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().unwrap();
    let first: u64 = arguments.next().map_or(0, |n| n.parse().unwrap());
    let (width, height) = (2 * SEEDS * CELL, Surface::ALL.len() / 2 * CELL);
    let mut sheet = vec![0_u8; width * height * 3];
    for (i, surface) in Surface::ALL.into_iter().enumerate() {
        let begin = Instant::now();
        let textures: Vec<Texture> = (0..SEEDS as u64).map(|s| draw(surface, first + s)).collect();
        println!("{surface:?}: {:.1} ms each", begin.elapsed().as_secs_f64() * 1e3 / SEEDS as f64);
        for (s, texture) in textures.iter().enumerate() {
            paste(&mut sheet, width, ((i % 2 * SEEDS + s) * CELL, i / 2 * CELL), texture);
        }
    }
    image::RgbImage::from_raw(width as u32, height as u32, sheet).unwrap().save(path).unwrap();
}

fn paste(sheet: &mut [u8], width: usize, (x0, y0): (usize, usize), texture: &Texture) {
    let image = image::RgbaImage::from_raw(texture.width, texture.height, texture.rgba.clone()).unwrap();
    let side = CELL as u32 - 4;
    let small = image::imageops::resize(&image, side, side, image::imageops::FilterType::Triangle);
    for (x, y, pixel) in small.enumerate_pixels() {
        let at = 3 * ((y0 + y as usize) * width + x0 + x as usize);
        sheet[at..at + 3].copy_from_slice(&pixel.0[..3]);
    }
}
