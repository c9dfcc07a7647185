//! Shows what a navigability map became: `layout_sheet MAP.png PREFIX` writes PREFIX_views.png, twelve views from
//! places spread over the floor, and prints triangles, textures, times.

#![expect(clippy::unwrap_used, reason = "a tool for looking at scenes may fail by panicking")]

use std::time::Instant;

use homing_sim::episode::FloorPose;
use homing_sim::{Arena, SceneRef, Viewpoint};

/// Views side by side.
const COLUMNS: u32 = 4;
/// Views.
const VIEWS: u32 = 12;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [map, prefix] = arguments.as_slice() else {
        eprintln!("layout_sheet MAP.png PREFIX");
        std::process::exit(2);
    };
    let scene = SceneRef::Layout { map: map.into() };
    let start = Instant::now();
    let arena = Arena::load(&scene, scene.body_size()).unwrap();
    let loaded = start.elapsed();
    let camera = Viewpoint { hfov_rad: 90_f64.to_radians(), ..Viewpoint::default() };
    let (w, h) = (camera.width, camera.height);
    let mut sheet = image::RgbImage::new(COLUMNS * w, VIEWS / COLUMNS * h);
    let mut times = Vec::new();
    for k in 0..VIEWS {
        let n = arena.space().len();
        let (x_m, y_m) = arena.space().nth((k as usize * n + n / 2) / VIEWS as usize).unwrap();
        let start = Instant::now();
        let photo = camera.photo(&arena, FloorPose { x_m, y_m, yaw_rad: 2.4 * f64::from(k) }).unwrap();
        times.push(start.elapsed().as_secs_f64() * 1e3);
        let view = image::RgbImage::from_raw(w, h, photo.data().to_vec()).unwrap();
        image::imageops::replace(&mut sheet, &view, i64::from(k % COLUMNS * w), i64::from(k / COLUMNS * h));
    }
    sheet.save(format!("{prefix}_views.png")).unwrap();
    let scene = arena.scene();
    let triangles: usize = scene.meshes.iter().map(|m| m.triangles.len()).sum();
    let texels: usize = scene.textures.iter().map(|t| t.rgba.len()).sum();
    println!(
        "{}: {triangles} triangles, {} textures ({} MB), {} lamps, {:.1} m2 free; loaded in {:.1} s, first view {:.0} ms, others {:.1} ms",
        scene.name,
        scene.textures.len(),
        texels >> 20,
        scene.lamps.len(),
        arena.space().area_m2(),
        loaded.as_secs_f64(),
        times[0],
        times[1..].iter().sum::<f64>() / (times.len() - 1) as f64
    );
}
