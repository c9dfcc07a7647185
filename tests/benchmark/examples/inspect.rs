//! `inspect EPISODE FOLDER [straight]`: one episode, by seed or by name as `train-easy-57`, in detail: a line for every step, and a plan of it seen from above.
//!
//! Plan: what is known white, obstacles black, never seen grey (the planner's map over the true floor plan), the way in
//! blue while exploring and orange while driving to the goal, the true goal a green arrow, right sightings green dots, wrong
//! ones red. `goal.png` is the photo. With `wrong`, the image and the matched points of every wrong sighting are drawn too;
//! with `blind` perception finds nothing, to watch exploration alone; with `own` it uses our own models instead of SIFT.

use std::path::Path;
use std::sync::Arc;

use homing_benchmark::cause::{is_in_view, right_pose, sighted_pose};
use homing_benchmark::suite::sets::{self, Photographer};
use homing_benchmark::{Policy, StepRecord, Trial, run_episode};
use homing_core::{Cell, Mode, OccupancyGrid, PlanarPose, Sighting};
use homing_perception::onnx::FeatureChoice;
use homing_perception::{AnyEstimator, PerceptionConfig, SiftConfig};
use homing_sim::arena::{Arena, BodySize, SceneRef};
use homing_sim::episode::{self, Episode, EpisodeSpec, Level, Shape};
use homing_sim::folds::{Fold, Split};
use image::{Rgb, RgbImage};

const SCALE: f64 = 80.0;

/// The benchmark's episode of a seed, or one of the suite's curved folds by its name: `easy-57`, on training flats `train-easy-57`.
fn task(name: &str) -> Result<(Arc<Arena>, Episode), Box<dyn std::error::Error>> {
    if let Ok(seed) = name.parse() {
        let arena = Arc::new(Arena::load(&SceneRef::Flat { seed }, BodySize::default())?);
        let episode = episode::draw(&arena, seed, &EpisodeSpec::default())?;
        return Ok((arena, episode));
    }
    let (split, id) = name.strip_prefix("train-").map_or((Split::Test, name), |id| (Split::Train, id));
    let (level, number) = id.rsplit_once('-').ok_or("neither a seed nor an episode such as easy-57")?;
    let level = Level::ALL.into_iter().find(|l| l.name() == level).ok_or("no such level")?;
    let fold = Fold { split, shape: Shape::Curved, level };
    let all = sets::flats(fold, number.parse::<usize>()? + 1, Photographer::Robot);
    let wanted = all.last().ok_or("no episode")?;
    let arena = Arc::new(Arena::load(&wanted.scene, wanted.body)?);
    let episode = wanted.episode(&arena)?;
    Ok((arena, episode))
}

struct Mark {
    pose: PlanarPose,
    mode: Mode,
    sighted: Option<(PlanarPose, bool)>,
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [seed, folder, flags @ ..] = arguments.as_slice() else {
        return Err("inspect SEED FOLDER [straight] [wrong]".into());
    };
    let folder = Path::new(folder);
    let has = |flag: &str| flags.iter().any(|f| f == flag);
    std::fs::create_dir_all(folder)?;
    let (arena, episode) = task(seed)?;
    let photo = episode.camera.photo(&arena, episode.goal)?;
    save(&photo, &folder.join("goal.png"))?;
    let policy = if has("straight") { Policy::Straight } else { Policy::Frontier };
    // Nothing to recognise: the planner alone, fast.
    let nothing = SiftConfig { keypoints_max: 8, side_max_px: 64, ..SiftConfig::default() };
    let sift = if has("blind") { nothing } else { SiftConfig::default() };
    let perception = PerceptionConfig { sift, ..PerceptionConfig::default() };
    let features = if has("own") {
        FeatureChoice::listed("homing", None, Path::new("nodes/perception/models"))?
    } else {
        FeatureChoice::default()
    };
    let mut estimator = AnyEstimator::open(perception, &features)?;
    let mut marks = Vec::new();
    let mut map = None;
    let trial = Trial { policy, ..Trial::default() };
    let run = run_episode(&arena, &episode, &mut estimator, &trial, &mut |r| {
        print_step(&arena, &episode, r);
        let sighted = sighted_pose(&r.moment()).zip(right_pose(&r.moment()));
        if has("frames") || (has("wrong") && sighted.is_some_and(|(_, right)| !right)) {
            let name = folder.join(format!("step{:03}.png", r.state.step));
            if let Err(cause) = save_matches(r, &photo, &name) {
                eprintln!("{cause}");
            }
        }
        let to_world = |p: PlanarPose| in_world(&episode, p);
        marks.push(Mark {
            pose: r.pose_truth,
            mode: r.state.mode,
            sighted: sighted.map(|(p, right)| (to_world(p), right)),
        });
        map = Some(r.map.clone());
    })?;
    println!("{:?}: {}\n{:#?}", run.mode, run.reason, homing_sim::Score::strict(&run.finish));
    plan(&arena, &episode, map.as_ref(), &marks).save(folder.join("plan.png"))?;
    Ok(())
}

fn print_step(arena: &Arena, episode: &Episode, r: &StepRecord<'_>) {
    let goal = (episode.goal.x_m, episode.goal.y_m);
    let sighting = match &r.estimate.sighting {
        Sighting::NotSeen { reason } => format!("{reason:?}({})", r.estimate.n_matches),
        Sighting::Bearing { n_inliers, .. } => format!("bearing({n_inliers}/{})", r.estimate.n_matches),
        Sighting::Pose { n_inliers, .. } => {
            let error =
                sighted_pose(&r.moment()).map_or(0.0, |p| p.distance_to(r.goal_odom_truth.x_m, r.goal_odom_truth.y_m));
            format!("POSE({n_inliers}/{}) off {error:.2} m", r.estimate.n_matches)
        }
    };
    let turn = homing_core::wrap_angle(r.pose_truth.yaw_rad - episode.goal.yaw_rad).to_degrees();
    let in_view = if is_in_view(arena, episode, r.pose_truth) { "VIEW" } else { "    " };
    println!(
        "{:3} {:9} {:9} {in_view} goal {:4.1} m {turn:6.1} deg {sighting:28} {}",
        r.state.step,
        format!("{:?}", r.state.mode),
        format!("{:?}", r.action),
        r.pose_truth.distance_to(goal.0, goal.1),
        r.state.reason
    );
}

fn in_world(episode: &Episode, p: PlanarPose) -> PlanarPose {
    let (sin, cos) = episode.start.yaw_rad.sin_cos();
    PlanarPose {
        x_m: episode.start.x_m + cos * p.x_m - sin * p.y_m,
        y_m: episode.start.y_m + sin * p.x_m + cos * p.y_m,
        yaw_rad: episode.start.yaw_rad + p.yaw_rad,
    }
}

fn plan(arena: &Arena, episode: &Episode, map: Option<&OccupancyGrid>, marks: &[Mark]) -> RgbImage {
    let g = *arena.grid().geometry();
    let (width, height) = (g.width as f64 * g.resolution_m, g.height as f64 * g.resolution_m);
    let mut image = RgbImage::new((width * SCALE) as u32, (height * SCALE) as u32);
    let rows = image.height();
    for (column, row, pixel) in image.enumerate_pixels_mut() {
        let at = (
            g.origin_x_m + (f64::from(column) + 0.5) / SCALE,
            g.origin_y_m + (f64::from(rows - 1 - row) + 0.5) / SCALE,
        );
        let blocked = g.cell_at(at.0, at.1).is_none_or(|(c, r)| arena.grid().is_blocked(c, r));
        let known = map.map_or(Cell::Unknown, |map| seen(episode, map, at));
        *pixel = match (blocked, known) {
            (true, Cell::Occupied) => Rgb([0, 0, 0]),
            (true, _) => Rgb([90, 90, 90]),
            (false, Cell::Unknown) => Rgb([190, 190, 190]),
            (false, Cell::Free) => Rgb([255, 255, 255]),
            (false, Cell::Occupied) => Rgb([255, 190, 190]),
        };
    }
    let pixel = |x: f64, y: f64| ((x - g.origin_x_m) * SCALE, f64::from(rows) - (y - g.origin_y_m) * SCALE);
    for mark in marks {
        if let Some((p, right)) = mark.sighted {
            arrow(
                &mut image,
                pixel(p.x_m, p.y_m),
                p.yaw_rad,
                14.0,
                if right { Rgb([0, 160, 0]) } else { Rgb([230, 0, 0]) },
            );
        }
    }
    for pair in marks.windows(2) {
        let colour = match pair[1].mode {
            Mode::Exploit | Mode::Align => Rgb([255, 140, 0]),
            _ => Rgb([40, 90, 255]),
        };
        line(
            &mut image,
            pixel(pair[0].pose.x_m, pair[0].pose.y_m),
            pixel(pair[1].pose.x_m, pair[1].pose.y_m),
            colour,
            1,
        );
    }
    let (start, goal) = (episode.start, episode.goal);
    arrow(&mut image, pixel(start.x_m, start.y_m), start.yaw_rad, 34.0, Rgb([0, 0, 255]));
    arrow(&mut image, pixel(goal.x_m, goal.y_m), goal.yaw_rad, 40.0, Rgb([0, 200, 0]));
    image
}

fn seen(episode: &Episode, map: &OccupancyGrid, at: (f64, f64)) -> Cell {
    let (sin, cos) = episode.start.yaw_rad.sin_cos();
    let (dx, dy) = (at.0 - episode.start.x_m, at.1 - episode.start.y_m);
    map.geometry.cell_at(cos * dx + sin * dy, cos * dy - sin * dx).map_or(Cell::Unknown, |(c, r)| map.at(c, r))
}

fn arrow(image: &mut RgbImage, at: (f64, f64), yaw_rad: f64, length: f64, colour: Rgb<u8>) {
    let tip = (at.0 + length * yaw_rad.cos(), at.1 - length * yaw_rad.sin());
    line(image, at, tip, colour, 1);
    line(image, at, at, colour, 4);
}

fn line(image: &mut RgbImage, a: (f64, f64), b: (f64, f64), colour: Rgb<u8>, radius: i32) {
    let n = (b.0 - a.0).hypot(b.1 - a.1).ceil().max(1.0) as u32;
    for k in 0..=n {
        let s = f64::from(k) / f64::from(n);
        let (x, y) = (a.0 + s * (b.0 - a.0), a.1 + s * (b.1 - a.1));
        for dy in -radius..=radius {
            for dx in -radius..=radius {
                let (px, py) = (x as i32 + dx, y as i32 + dy);
                if px >= 0 && py >= 0 && (px as u32) < image.width() && (py as u32) < image.height() {
                    image.put_pixel(px as u32, py as u32, colour);
                }
            }
        }
    }
}

fn save(rgb: &homing_core::RgbImage, path: &Path) -> Result<(), Box<dyn std::error::Error>> {
    let image = RgbImage::from_raw(rgb.width(), rgb.height(), rgb.data().to_vec()).ok_or("not an image")?;
    Ok(image.save(path)?)
}

/// The robot's image above, the photo below, the matched points joined.
fn save_matches(
    r: &StepRecord<'_>,
    photo: &homing_core::RgbImage,
    path: &Path,
) -> Result<(), Box<dyn std::error::Error>> {
    let seen = &r.observation.frame.rgb;
    let mut image = RgbImage::new(seen.width().max(photo.width()), seen.height() + photo.height());
    for (rgb, top) in [(seen.as_ref(), 0), (photo, seen.height())] {
        for (i, p) in rgb.data().chunks_exact(3).enumerate() {
            let (column, row) = (i as u32 % rgb.width(), i as u32 / rgb.width());
            image.put_pixel(column, top + row, Rgb([p[0], p[1], p[2]]));
        }
    }
    let below = f64::from(seen.height());
    for (i, m) in r.estimate.matched_points.iter().enumerate() {
        let colour = [Rgb([255, 0, 0]), Rgb([0, 255, 0]), Rgb([255, 255, 0]), Rgb([0, 255, 255])][i % 4];
        let (query, goal) = (m.query_px, m.goal_px);
        line(
            &mut image,
            (f64::from(query.0), f64::from(query.1)),
            (f64::from(goal.0), f64::from(goal.1) + below),
            colour,
            0,
        );
    }
    Ok(image.save(path)?)
}
