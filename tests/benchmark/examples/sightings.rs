//! `sightings FIRST LAST [N] [SETTINGS]...`: perception alone: N robots put near each goal and N elsewhere in the flat, what
//! it says there, and how far off it is. One line for each: what is needed to choose gates. Each SETTINGS is a list such as
//! `n=8,ratio=0.9,share=0.05,patch=0.6,gate=0.008,tries=5`; all of them are tried on the same images and keypoints.

use std::sync::{Arc, Mutex, PoisonError};

use homing_core::{
    Base, Camera, FeatureExtractor, Features, GoalEstimate, GoalPhoto, PlanarPose, RgbImage, RgbdFrame, Sighting,
    Stamp, Transform, wrap_angle,
};
use homing_perception::{GoalEstimator, MutualNearest, PerceptionConfig, PerceptionError, Sift};
use homing_sim::arena::{Arena, BodySize, SceneRef};
use homing_sim::episode::{self, EpisodeSpec, Viewpoint, in_sight, t_world_base};
use homing_sim::scene::World;
use nalgebra::Point3;
use rayon::prelude::*;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let numbers: Vec<u64> = std::env::args().skip(1).filter_map(|a| a.parse().ok()).collect();
    let [first, last, rest @ ..] = numbers.as_slice() else { return Err("sightings FIRST LAST [N]".into()) };
    let n = rest.first().copied().unwrap_or(12) as usize;
    let settings: Vec<(String, PerceptionConfig)> = std::env::args()
        .skip(1)
        .filter(|a| a.contains('='))
        .map(|text| config(&text).map(|c| (text.replace(',', ";"), c)))
        .collect::<Result<_, _>>()?;
    let settings = if settings.is_empty() { vec![("default".to_owned(), usual())] } else { settings };
    println!(
        "config,seed,kind,distance_m,yaw_deg,sight,verdict,n_inliers,n_matches,error_m,error_deg,z_m,tilt_deg,cover,zncc,colour,patch,n_patch"
    );
    (*first..=*last).into_par_iter().for_each(|seed| {
        if let Err(cause) = flat(seed, n, &settings) {
            eprintln!("{seed}: {cause}");
        }
    });
    Ok(())
}

struct Dice(u64);

impl Dice {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }
}

fn flat(seed: u64, n: usize, settings: &[(String, PerceptionConfig)]) -> Result<(), Box<dyn std::error::Error>> {
    let arena = Arc::new(Arena::load(&SceneRef::Flat { seed }, BodySize::default())?);
    let episode = episode::draw(&arena, seed, &EpisodeSpec::default())?;
    let camera = Viewpoint::default();
    let intrinsics = camera.intrinsics()?;
    let photo = GoalPhoto {
        id: 1,
        rgb: Arc::new(episode.camera.photo(&arena, episode.goal)?),
        intrinsics: episode.camera.intrinsics()?,
    };
    let memory = Arc::new(Mutex::new(Memory { of: 0, features: Features::default(), sift: Sift::new(usual().sift)? }));
    let mut estimators = Vec::new();
    for (name, config) in settings {
        let matcher = MutualNearest { ratio_max: config.ratio_max };
        let mut estimator = GoalEstimator::with_parts(*config, Remembering(memory.clone()), matcher)?;
        estimator.set_goal(photo.clone())?;
        estimators.push((name, estimator));
    }
    let goal = PlanarPose::from(episode.goal);
    let mut dice = Dice(seed);
    let (mut near, mut far) = (0, 0);
    let mut tries = 0;
    while (near < n || far < n) && tries < 20_000 {
        tries += 1;
        let i = (dice.next() * arena.space().len() as f64) as usize;
        let Some((x_m, y_m)) = arena.space().nth(i) else { continue };
        let pose = PlanarPose { x_m, y_m, yaw_rad: wrap_angle(dice.next() * core::f64::consts::TAU) };
        let distance = pose.distance_to(goal.x_m, goal.y_m);
        let turn = wrap_angle(pose.yaw_rad - goal.yaw_rad);
        let sight = in_sight(&arena, (x_m, y_m), (goal.x_m, goal.y_m));
        let is_near = distance < 5.0 && sight && turn.abs() < 1.2;
        if is_near && near < n {
            near += 1
        } else if !is_near && far < n {
            far += 1
        } else {
            continue;
        }
        let t_world_camera = t_world_base(&arena, pose) * camera.t_base_camera();
        let (rgb, depth) = arena.view(&intrinsics, &t_world_camera);
        let frame = RgbdFrame::new(Stamp(tries * 500_000_000), Arc::new(rgb), Arc::new(depth), intrinsics)?;
        let kind = if is_near { "near" } else { "far" };
        for (name, estimator) in &mut estimators {
            let estimate = estimator.estimate(&frame)?;
            let head = format!("{name},{seed},{kind},{distance:.2},{:.0},{}", turn.to_degrees(), u8::from(sight));
            println!("{head},{}", line(&estimate, &t_world_camera, &camera, &goal, &frame, &photo));
        }
    }
    Ok(())
}

fn line(
    estimate: &GoalEstimate,
    t_world_camera: &Transform<World, Camera>,
    camera: &Viewpoint,
    goal: &PlanarPose,
    frame: &RgbdFrame,
    photo: &GoalPhoto,
) -> String {
    let (t_camera_goal, n_inliers) = match &estimate.sighting {
        Sighting::NotSeen { reason } => return format!("{reason:?},0,{},,,,,,,,,", estimate.n_matches),
        Sighting::Bearing { n_inliers, .. } => return format!("bearing,{n_inliers},{},,,,,,,,,", estimate.n_matches),
        Sighting::Pose { t_camera_goal, n_inliers, .. } => (t_camera_goal, n_inliers),
    };
    let t_world_goal = t_world_camera.isometry() * t_camera_goal.isometry();
    let said: Transform<World, Base> = Transform::new(t_world_goal * camera.t_base_camera().inverse().isometry());
    let planar = said.planar();
    let error_m = planar.distance_to(goal.x_m, goal.y_m);
    let error = wrap_angle(planar.yaw_rad - goal.yaw_rad).to_degrees();
    let tilt = (said.rotation() * nalgebra::Vector3::z()).z.clamp(-1.0, 1.0).acos().to_degrees();
    let right = error_m < 1.0 && error.abs() < 30.0;
    let s = agreement(frame, photo, t_camera_goal);
    format!(
        "{},{n_inliers},{},{error_m:.2},{error:.1},{:.2},{tilt:.1},{:.3},{:.3},{:.3},{:.3},{}",
        if right { "right" } else { "wrong" },
        estimate.n_matches,
        said.translation().z,
        s.cover,
        s.zncc,
        s.colour,
        s.patch,
        s.n_patch
    )
}

fn usual() -> PerceptionConfig {
    let mut config = PerceptionConfig { threads: Some(1), ..PerceptionConfig::default() };
    if let Ok(text) = std::env::var("SIFT")
        && let Some((n, contrast)) = text.split_once(',')
    {
        config.sift.keypoints_max = n.parse().unwrap_or(config.sift.keypoints_max);
        config.sift.contrast_min = contrast.parse().unwrap_or(config.sift.contrast_min);
    }
    config
}

fn config(text: &str) -> Result<PerceptionConfig, Box<dyn std::error::Error>> {
    let mut config = usual();
    for knob in text.split(',') {
        let (name, value) = knob.split_once('=').ok_or("NAME=VALUE")?;
        match name {
            "n" => config.gates.n_inliers_min = value.parse()?,
            "ratio" => config.ratio_max = value.parse()?,
            "share" => config.gates.inlier_share_min = value.parse()?,
            "patch" => config.gates.patch_share_min = value.parse()?,
            "gate" => config.gates.error_rad_max = value.parse()?,
            "tries" => config.hypotheses_max = value.parse()?,
            _ => return Err(format!("no knob {name}").into()),
        }
    }
    Ok(config)
}

/// The keypoints of the last image, so that several settings cost one extraction.
struct Memory {
    of: u64,
    features: Features,
    sift: Sift,
}

struct Remembering(Arc<Mutex<Memory>>);

impl FeatureExtractor for Remembering {
    type Error = PerceptionError;

    fn name(&self) -> &str {
        "sift"
    }

    fn extract(&mut self, image: &RgbImage) -> Result<Features, PerceptionError> {
        let mut memory = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let mix = |h: u64, byte: &u8| (h ^ u64::from(*byte)).wrapping_mul(0x100_0000_01b3);
        let key = image.data().iter().step_by(7).fold(0xcbf2_9ce4_8422_2325, mix);
        if memory.of != key {
            memory.features = memory.sift.extract(image)?;
            memory.of = key;
        }
        Ok(memory.features.clone())
    }
}

struct Agreement {
    cover: f64,
    zncc: f64,
    colour: f64,
    patch: f64,
    n_patch: usize,
}

const CELL: usize = 8;

/// The frame seen from the goal, compared with the photo, in cells of 8 pixels.
fn agreement(
    frame: &RgbdFrame,
    photo: &GoalPhoto,
    t_camera_goal: &Transform<homing_core::Camera, homing_core::Goal>,
) -> Agreement {
    let t_goal_camera = t_camera_goal.inverse();
    let (columns, rows) = (photo.rgb.width() as usize / CELL, photo.rgb.height() as usize / CELL);
    let mut nearest = vec![f64::INFINITY; columns * rows];
    let mut points = Vec::new();
    for v in (0..frame.rgb.height()).step_by(2) {
        for u in (0..frame.rgb.width()).step_by(2) {
            let Some(d) = frame.depth.at(u, v) else { continue };
            let p: Point3<f64> =
                t_goal_camera.apply(&frame.intrinsics.unproject(f64::from(u), f64::from(v), f64::from(d)));
            let Some(px) = photo.intrinsics.project(&p) else { continue };
            if px.x < 0.0 || px.y < 0.0 {
                continue;
            }
            let (c, r) = (px.x as usize / CELL, px.y as usize / CELL);
            if p.z < 0.1 || c >= columns || r >= rows {
                continue;
            }
            let cell = r * columns + c;
            nearest[cell] = nearest[cell].min(p.z);
            let i = 3 * (v * frame.rgb.width() + u) as usize;
            let rgb = [0, 1, 2].map(|k| f64::from(frame.rgb.data()[i + k]));
            points.push((cell, p.z, rgb));
        }
    }
    let mut sums = vec![([0.0; 3], 0.0); columns * rows];
    for (cell, z, rgb) in points {
        if z < nearest[cell] * 1.1 + 0.05 {
            for k in 0..3 {
                sums[cell].0[k] += rgb[k];
            }
            sums[cell].1 += 1.0;
        }
    }
    let mut pairs: Vec<Option<([f64; 3], [f64; 3])>> = Vec::new();
    for r in 0..rows {
        for c in 0..columns {
            let (sum, n) = sums[r * columns + c];
            if n < 1.0 {
                pairs.push(None);
                continue;
            }
            let mut mean = [0.0; 3];
            for y in 0..CELL {
                for x in 0..CELL {
                    let i = 3 * ((r * CELL + y) * photo.rgb.width() as usize + c * CELL + x);
                    for k in 0..3 {
                        mean[k] += f64::from(photo.rgb.data()[i + k]) / (CELL * CELL) as f64;
                    }
                }
            }
            pairs.push(Some((sum.map(|s| s / n), mean)));
        }
    }
    let known: Vec<_> = pairs.iter().flatten().copied().collect();
    let cover = known.len() as f64 / pairs.len() as f64;
    let luma = |p: [f64; 3]| 0.299 * p[0] + 0.587 * p[1] + 0.114 * p[2];
    let lumas: Vec<(f64, f64)> = known.iter().map(|(a, b)| (luma(*a), luma(*b))).collect();
    let zncc = correlation(&lumas).map_or(0.0, |c| c.0);
    let colour = known.iter().filter(|(a, b)| (0..3).map(|k| (a[k] - b[k]).abs()).fold(0.0, f64::max) < 25.0).count()
        as f64
        / known.len().max(1) as f64;
    let mut patches = Vec::new();
    const SIDE: usize = 5;
    for r in (0..rows.saturating_sub(SIDE - 1)).step_by(2) {
        for c in (0..columns.saturating_sub(SIDE - 1)).step_by(2) {
            let patch: Vec<(f64, f64)> = (0..SIDE * SIDE)
                .filter_map(|i| pairs[(r + i / SIDE) * columns + c + i % SIDE])
                .map(|(a, b)| (luma(a), luma(b)))
                .collect();
            if patch.len() < 20 {
                continue;
            }
            if let Some((z, sd_a, sd_b)) = correlation(&patch)
                && sd_a.max(sd_b) > 8.0
            {
                patches.push(z);
            }
        }
    }
    patches.sort_by(f64::total_cmp);
    let good = patches.iter().filter(|z| **z > 0.6).count() as f64 / patches.len().max(1) as f64;
    Agreement { cover, zncc, colour, patch: good, n_patch: patches.len() }
}

fn correlation(pairs: &[(f64, f64)]) -> Option<(f64, f64, f64)> {
    let n = pairs.len() as f64;
    if n < 4.0 {
        return None;
    }
    let (ma, mb) = pairs.iter().fold((0.0, 0.0), |(x, y), p| (x + p.0 / n, y + p.1 / n));
    let (mut aa, mut bb, mut ab) = (0.0, 0.0, 0.0);
    for (a, b) in pairs {
        aa += (a - ma) * (a - ma) / n;
        bb += (b - mb) * (b - mb) / n;
        ab += (a - ma) * (b - mb) / n;
    }
    Some((ab / (aa * bb).sqrt().max(1e-9), aa.sqrt(), bb.sqrt()))
}
