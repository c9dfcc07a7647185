//! Frames per second of the renderer: `render_speed [SCENE] [frames] [--json]`, on a walk through the scene's bounding
//! box. SCENE is a glTF file or the seed of a flat (default 1000). The processor time (all threads, from /proc) does not depend on what else
//! the machine is doing. With `--json` the one line that `tests/interop/render_peers.py` reads.

#![expect(clippy::unwrap_used, reason = "a measuring tool may fail by panicking")]

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use homing_core::{Camera, Intrinsics, Transform};
use homing_sim::render::{Render, Renderer};
use homing_sim::scene::{Scene, World};
use nalgebra::{Matrix3, Vector3};

fn main() {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().unwrap_or_else(|| "1000".to_owned());
    let frames: usize = arguments.next().map_or(200, |n| n.parse().unwrap());
    let begin = Instant::now();
    let scene = Arc::new(load(&path));
    let loaded = begin.elapsed();
    let begin = Instant::now();
    let mut renderer = Renderer::new(scene.clone());
    if arguments.next().is_some_and(|a| a == "--json") {
        return say_json(&scene, &mut renderer, frames);
    }
    println!("{}: loaded in {loaded:.0?}, prepared in {:.0?}", scene.name, begin.elapsed());
    let camera = Intrinsics::from_hfov(640, 480, 120_f64.to_radians()).unwrap();
    let poses: Vec<_> = (0..frames).map(|i| pose(&scene, i)).collect();
    let begin = Instant::now();
    let counts: Vec<_> = poses.iter().map(|p| renderer.count(&camera, p)).collect();
    let set_up = begin.elapsed().as_secs_f64() * 1e3 / frames as f64;
    let mean = counts.iter().map(|c| c.triangles).sum::<usize>() / frames;
    println!("{mean} of {} triangles set up in a frame on average, in {set_up:.2} ms", counts[0].triangles_total);
    for round in 0..3 {
        let (begin, begin_cpu) = (Instant::now(), cpu_ms());
        let mut slowest = 0.0_f64;
        for pose in &poses {
            let begin = Instant::now();
            let images = renderer.render(&camera, pose);
            assert_eq!(images.0.width(), 640);
            slowest = slowest.max(begin.elapsed().as_secs_f64() * 1e3);
        }
        let mean = begin.elapsed().as_secs_f64() * 1e3 / frames as f64;
        let cpu = (cpu_ms() - begin_cpu) / frames as f64;
        println!(
            "round {round}: {:.1} frames/s, {mean:.2} ms mean, {slowest:.2} ms at most; {cpu:.2} ms of processor time, \
             {:.1} frames/s on two free cores",
            1e3 / mean,
            2e3 / cpu
        );
    }
}

/// One round, after a first look at a tenth of the poses.
fn say_json(scene: &Scene, renderer: &mut Renderer, frames: usize) {
    let camera = Intrinsics::from_hfov(640, 480, 120_f64.to_radians()).unwrap();
    let poses: Vec<_> = (0..frames).map(|i| pose(scene, i)).collect();
    let counts: Vec<_> = poses.iter().map(|p| renderer.count(&camera, p)).collect();
    for pose in poses.iter().step_by(10) {
        renderer.render(&camera, pose);
    }
    let (begin, begin_cpu) = (Instant::now(), cpu_ms());
    for pose in &poses {
        assert_eq!(renderer.render(&camera, pose).1.width(), 640);
    }
    let (ms, cpu_ms) = (begin.elapsed().as_secs_f64() * 1e3, cpu_ms() - begin_cpu);
    println!(
        r#"{{"scene": "{}", "triangles": {}, "triangles_total": {}, "ms": {:.4}, "cpu_ms": {:.4}}}"#,
        scene.name,
        counts.iter().map(|c| c.triangles).sum::<usize>() / frames,
        counts[0].triangles_total,
        ms / frames as f64,
        cpu_ms / frames as f64
    );
}

/// A number is the seed of a flat, anything else a glTF file.
fn load(path: &str) -> Scene {
    match path.parse() {
        Ok(seed) => homing_sim::flat::generate(seed).scene,
        Err(_) => homing_sim::gltf_scene::load(Path::new(path)).unwrap(),
    }
}

/// User and system time of all threads of this process, ms.
fn cpu_ms() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap();
    let after_name = stat.rsplit(')').next().unwrap();
    // Fields 14 and 15 of the whole line, in ticks of 10 ms.
    after_name.split_whitespace().skip(11).take(2).map(|ticks| ticks.parse::<f64>().unwrap() * 10.0).sum()
}

/// A spiral around the middle of the scene at camera height, turning.
fn pose(scene: &Scene, i: usize) -> Transform<World, Camera> {
    let (mut low, mut high) = ([f64::MAX; 2], [f64::MIN; 2]);
    for vertex in scene.meshes.iter().flat_map(|m| &m.vertices) {
        for k in 0..2 {
            low[k] = low[k].min(f64::from(vertex.position[k]));
            high[k] = high[k].max(f64::from(vertex.position[k]));
        }
    }
    let angle = i as f64 * 0.1;
    let (sin, cos) = angle.sin_cos();
    let at = |k: usize, share: f64| 0.5 * (low[k] + high[k]) + 0.35 * (high[k] - low[k]) * share;
    let r = Matrix3::new(sin, 0.0, cos, -cos, 0.0, sin, 0.0, -1.0, 0.0);
    Transform::from_rotation(&r, Vector3::new(at(0, (angle * 0.37).cos()), at(1, (angle * 0.53).sin()), 1.25))
}
