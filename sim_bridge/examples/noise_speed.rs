//! Milliseconds of noise on a 640x480 image: `noise_speed [rounds]`, on all cores and on one. The processor time (all
//! threads, from /proc) does not depend on what else the machine is doing.

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
        let (begin, begin_cpu) = (Instant::now(), cpu_ms());
        (1..=rounds).for_each(work);
        let (wall, cpu) = (begin.elapsed().as_secs_f64() * 1e3, cpu_ms() - begin_cpu);
        let n = rounds as f64;
        println!("{name}: {what} {:.2} ms an image, {:.2} ms of processor time", wall / n, cpu / n);
    };
    time("depth", &|seed| _ = depth::redwood(&metres, &DepthNoise::default(), None, seed).unwrap());
    let raw = CameraNoise { jpeg_quality: None, ..CameraNoise::default() };
    time("colour", &|seed| _ = camera::expose(&colours, &raw, &lens, 0.5, seed).unwrap());
    time("colour with JPEG", &|seed| _ = camera::expose(&colours, &CameraNoise::default(), &lens, 0.5, seed).unwrap());
}

/// User time of all threads of this process, ms.
fn cpu_ms() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap();
    let after_name = stat.rsplit(')').next().unwrap();
    // Field 14 of the whole line, in ticks of 10 ms.
    after_name.split_whitespace().nth(11).unwrap().parse::<f64>().unwrap() * 10.0
}
