//! Draws flats from above, with the free space, the doors and one episode: `floor_plan SEED.. [--out FOLDER]`.

use std::path::PathBuf;
use std::time::Instant;

use homing_sim::arena::{Arena, BodySize, SceneRef};
use homing_sim::episode::{self, Episode, EpisodeSpec};
use homing_sim::geodesic::GeodesicField;
use image::{Rgb, RgbImage};

/// Pixels a metre.
const SCALE: f64 = 60.0;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut out = PathBuf::from(".");
    let mut seeds: Vec<u64> = Vec::new();
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--out" => out = arguments.next().ok_or("--out needs a folder")?.into(),
            seed => seeds.push(seed.parse()?),
        }
    }
    for seed in seeds {
        let begun = Instant::now();
        let arena = Arena::load(&SceneRef::Flat { seed }, BodySize::default())?;
        let made = begun.elapsed();
        let episode = episode::draw(&arena, seed, &EpisodeSpec::default())?;
        let triangles: usize = arena.scene().meshes.iter().map(|m| m.triangles.len()).sum();
        println!(
            "seed {seed}: {triangles} triangles, {} textures, free {:.1} m2, path {:.2} m, made in {made:.2?}, \
             with an episode {:.2?}",
            arena.scene().textures.len(),
            arena.space().area_m2(),
            episode.shortest_path_m,
            begun.elapsed()
        );
        draw(&arena, &episode)?.save(out.join(format!("plan_{seed}.png")))?;
    }
    Ok(())
}

/// Every solid and every flat thing below 2 m, painted from low to high in the mean colour of its texture.
fn draw(arena: &Arena, episode: &Episode) -> Result<RgbImage, Box<dyn std::error::Error>> {
    let g = *arena.grid().geometry();
    let (width, depth) = (g.width as f64 * g.resolution_m, g.height as f64 * g.resolution_m);
    let mut image = RgbImage::from_pixel((width * SCALE) as u32, (depth * SCALE) as u32, Rgb([28, 30, 34]));
    let (columns, rows) = (image.width() as usize, image.height() as usize);
    let mut heights = vec![-1.0_f64; columns * rows];
    let scene = arena.scene();
    for mesh in &scene.meshes {
        let colour = colour_of(scene, mesh.material);
        for t in &mesh.triangles {
            let p = t.map(|i| mesh.vertices[i as usize].position.map(f64::from));
            if p.iter().all(|c| c[2] < 2.0) {
                let q = p.map(|c| [(c[0] - g.origin_x_m) * SCALE, (c[1] - g.origin_y_m) * SCALE, c[2]]);
                paint(&mut image, &mut heights, &q, colour);
            }
        }
    }
    shade_walls(&mut image, arena);
    let field = GeodesicField::to(arena.space(), (episode.goal.x_m, episode.goal.y_m))?;
    let path = field.path(episode.start.x_m, episode.start.y_m).unwrap_or_default();
    let pixel = |p: (f64, f64)| ((p.0 - g.origin_x_m) * SCALE, rows as f64 - (p.1 - g.origin_y_m) * SCALE);
    for pair in path.windows(2) {
        line(&mut image, pixel(pair[0]), pixel(pair[1]), 2.0, Rgb([230, 60, 40]));
    }
    for (pose, colour) in [(episode.start, Rgb([40, 170, 70])), (episode.goal, Rgb([230, 60, 40]))] {
        let from = pixel((pose.x_m, pose.y_m));
        let tip = pixel((pose.x_m + 0.4 * libm::cos(pose.yaw_rad), pose.y_m + 0.4 * libm::sin(pose.yaw_rad)));
        line(&mut image, from, from, 0.18 * SCALE, colour);
        line(&mut image, from, tip, 3.0, colour);
    }
    Ok(image)
}

fn colour_of(scene: &homing_sim::scene::Scene, material: usize) -> [f64; 3] {
    let m = &scene.materials[material];
    let mut mean = [1.0; 3];
    if let Some(texture) = m.texture.and_then(|t| scene.textures.get(t)) {
        let n = (texture.rgba.len() / 4) as f64;
        for (k, value) in mean.iter_mut().enumerate() {
            *value = texture.rgba.iter().skip(k).step_by(4).map(|v| f64::from(*v)).sum::<f64>() / n / 255.0;
        }
    }
    core::array::from_fn(|k| mean[k] * f64::from(m.base_colour[k]).powf(1.0 / 2.2))
}

fn paint(image: &mut RgbImage, heights: &mut [f64], t: &[[f64; 3]; 3], colour: [f64; 3]) {
    let area = (t[1][0] - t[0][0]) * (t[2][1] - t[0][1]) - (t[2][0] - t[0][0]) * (t[1][1] - t[0][1]);
    if area.abs() < 1e-9 {
        return;
    }
    let (columns, rows) = (image.width() as usize, image.height() as usize);
    let range = |k: usize, n: usize| {
        let low = t.iter().map(|c| c[k]).fold(f64::MAX, f64::min).max(0.0) as usize;
        low..(t.iter().map(|c| c[k]).fold(0.0, f64::max) as usize + 1).min(n)
    };
    for row in range(1, rows) {
        for column in range(0, columns) {
            let (x, y) = (column as f64 + 0.5, row as f64 + 0.5);
            let edge = |a: [f64; 3], b: [f64; 3]| ((b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])) / area;
            let w = [edge(t[1], t[2]), edge(t[2], t[0]), edge(t[0], t[1])];
            let z: f64 = (0..3).map(|k| w[k] * t[k][2]).sum();
            if w.iter().all(|v| *v >= 0.0) && z > heights[row * columns + column] {
                heights[row * columns + column] = z;
                let light = 190.0 + 65.0 * (z / 2.0).clamp(0.0, 1.0);
                let rgb = colour.map(|c| (c * light).clamp(0.0, 255.0) as u8);
                image.put_pixel(column as u32, (rows - 1 - row) as u32, Rgb(rgb));
            }
        }
    }
}

/// Dark where nobody can ever be seen: inside walls.
fn shade_walls(image: &mut RgbImage, arena: &Arena) {
    let g = arena.grid().geometry();
    let rows = image.height();
    for (x, y, pixel) in image.enumerate_pixels_mut() {
        let world = (g.origin_x_m + f64::from(x) / SCALE, g.origin_y_m + f64::from(rows - 1 - y) / SCALE);
        if arena.space().contains(world.0, world.1) {
            pixel.0[2] = pixel.0[2].saturating_add(18);
        }
    }
}

fn line(image: &mut RgbImage, from: (f64, f64), to: (f64, f64), radius: f64, colour: Rgb<u8>) {
    let n = (to.0 - from.0).hypot(to.1 - from.1).ceil().max(1.0) as u32;
    for k in 0..=n {
        let s = f64::from(k) / f64::from(n);
        let (x, y) = (from.0 + s * (to.0 - from.0), from.1 + s * (to.1 - from.1));
        for dy in -radius.ceil() as i64..=radius.ceil() as i64 {
            for dx in -radius.ceil() as i64..=radius.ceil() as i64 {
                let (px, py) = (x as i64 + dx, y as i64 + dy);
                let inside = (dx * dx + dy * dy) as f64 <= radius * radius;
                if inside && px >= 0 && py >= 0 && px < i64::from(image.width()) && py < i64::from(image.height()) {
                    image.put_pixel(px as u32, py as u32, colour);
                }
            }
        }
    }
}
