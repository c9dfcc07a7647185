//! Renders a scene to PNG: `snapshot SCENE PREFIX X,Y,YAW_DEG[,Z[,PITCH_DEG]] ...` writes PREFIX_0.png (colour) and
//! PREFIX_0_depth.png for every pose. SCENE is a glTF file, the seed of a flat, or a
//! navigability map (.png).

#![expect(clippy::unwrap_used, reason = "a tool for looking at scenes may fail by panicking")]

use std::path::Path;
use std::sync::Arc;

use homing_core::{Camera, DepthImage, Intrinsics, RgbImage, Transform};
use homing_sim::flat::Detail;
use homing_sim::flat::mapped::{self, NavMap};
use homing_sim::render::{Render, Renderer};
use homing_sim::scene::{Scene, World};
use nalgebra::{Matrix3, Rotation3, Vector3};

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [scene, prefix, poses @ ..] = arguments.as_slice() else {
        eprintln!("snapshot SCENE PREFIX X,Y,YAW_DEG[,Z[,PITCH_DEG]] ...");
        std::process::exit(2);
    };
    let mut renderer = Renderer::new(Arc::new(load(scene)));
    let camera = Intrinsics::from_hfov(640, 480, 120_f64.to_radians()).unwrap();
    for (i, text) in poses.iter().enumerate() {
        let numbers: Vec<f64> = text.split(',').map(|n| n.parse().unwrap()).collect();
        let (rgb, depth) = renderer.render(&camera, &pose(&numbers));
        save(&format!("{prefix}_{i}.png"), rgb.width(), rgb.height(), colour(&rgb));
        save(&format!("{prefix}_{i}_depth.png"), depth.width(), depth.height(), rainbow(&depth));
        println!("pose {text}: {:.1} % of the pixels have depth", 100.0 * depth.valid_share());
    }
}

/// A number is the seed of a flat, a PNG a map, anything else a glTF file.
fn load(scene: &str) -> Scene {
    match scene.parse() {
        Ok(seed) => homing_sim::flat::generate(seed).scene,
        Err(_) if scene.ends_with(".png") => {
            mapped::build(&NavMap::read(Path::new(scene)).unwrap(), Detail::Full).unwrap()
        }
        Err(_) => homing_sim::gltf_scene::load(Path::new(scene)).unwrap(),
    }
}

fn pose(numbers: &[f64]) -> Transform<World, Camera> {
    let yaw = numbers[2].to_radians();
    let pitch = numbers.get(4).copied().unwrap_or(0.0).to_radians();
    let r_body_camera = Matrix3::new(0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0);
    let r_world_body = Rotation3::from_euler_angles(0.0, -pitch, yaw);
    let height = numbers.get(3).copied().unwrap_or(1.25);
    Transform::from_rotation(&(r_world_body.matrix() * r_body_camera), Vector3::new(numbers[0], numbers[1], height))
}

fn save(path: &str, width: u32, height: u32, data: Vec<u8>) {
    image::RgbImage::from_raw(width, height, data).unwrap().save(path).unwrap();
}

fn colour(rgb: &RgbImage) -> Vec<u8> {
    rgb.data().to_vec()
}

/// Blue near, red far, 0 to 10 m; black where there is no depth.
fn rainbow(depth: &DepthImage) -> Vec<u8> {
    let colour = |d: &f32| {
        let t = (d / 10.0).min(1.0);
        let band = |centre: f32| (255.0 * (1.5 - 4.0 * (t - centre).abs()).clamp(0.0, 1.0)) as u8;
        if *d > 0.0 { [band(0.75), band(0.5), band(0.25)] } else { [0; 3] }
    };
    depth.data().iter().flat_map(colour).collect()
}
