//! Milliseconds of noise on a 640x480 image: `noise_speed [rounds]`, on all cores and on one.

#![expect(clippy::unwrap_used, reason = "a measuring tool may fail by panicking")]

use std::time::Instant;

use homing_core::{DepthImage, Intrinsics, RgbImage};
use homing_sim::noise::{CameraNoise, DepthNoise, camera, depth};

fn main() {
    let rounds: u64 = std::env::args().nth(1).map_or(100, |n| n.parse().unwrap());
    measure("all cores", rounds);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    pool.install(|| measure("one core", rounds));
}

fn measure(name: &str, rounds: u64) {
    let metres = (0..640 * 480).map(|i| 0.5 + 9.0 * (i % 640) as f32 / 640.0).collect();
    let metres = DepthImage::from_metres(640, 480, metres).unwrap();
    let colours = (0..640 * 480 * 3).map(|i| (i / 40 % 256) as u8).collect();
    let colours = RgbImage::new(640, 480, colours).unwrap();
    let lens = Intrinsics::from_hfov(640, 480, 120_f64.to_radians()).unwrap();
    let time = |what: &str, work: &dyn Fn(u64)| {
        work(0);
        let begin = Instant::now();
        (1..=rounds).for_each(work);
        println!("{name}: {what} {:.2} ms an image", begin.elapsed().as_secs_f64() * 1e3 / rounds as f64);
    };
    time("depth", &|seed| _ = depth::redwood(&metres, &DepthNoise::default(), None, seed).unwrap());
    let raw = CameraNoise { jpeg_quality: None, ..CameraNoise::default() };
    time("colour", &|seed| _ = camera::expose(&colours, &raw, &lens, 0.5, seed).unwrap());
    time("colour with JPEG", &|seed| _ = camera::expose(&colours, &CameraNoise::default(), &lens, 0.5, seed).unwrap());
}
