//! Views of flats: do their correspondences hold, and does an export go on where it stopped?

#![expect(clippy::unwrap_used, reason = "a test may fail by panicking")]

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use std::sync::atomic::{AtomicUsize, Ordering};

use homing_sim::flat::{Detail, generate_as};
use homing_sim::nav_grid::NavGrid;
use homing_sim::views::export::{Export, ExportError};
use homing_sim::views::record::{FlatRecord, SetRecord, files};
use homing_sim::views::{self, Cameras, FlatViews, OVERLAP_MIN, View, ViewSpec, agrees, overlap};

const SMALL: ViewSpec = ViewSpec { n_views: 6, width: 160, height: 120 };

static FLAT: LazyLock<FlatViews> =
    LazyLock::new(|| views::draw(200_000, &ViewSpec { n_views: 12, ..ViewSpec::default() }).unwrap());

fn luma(view: &View) -> Vec<f64> {
    view.rgb.to_luma().into_iter().map(f64::from).collect()
}

/// A pixel.
type Px = (u32, u32);

/// Where the points of some of `a`'s pixels are in `b`: pixel of `a`, pixel of `b`, depth expected there.
fn projections(a: &View, b: &View) -> Vec<(Px, Px, f64)> {
    let t_b_a = b.t_world_camera.inverse() * a.t_world_camera;
    let mut found = Vec::new();
    for row in (0..a.camera.height()).step_by(3) {
        for column in (0..a.camera.width()).step_by(3) {
            let Some(depth_m) = a.depth.at(column, row) else { continue };
            let p_b = t_b_a.apply(&a.camera.unproject(f64::from(column), f64::from(row), f64::from(depth_m)));
            let Some(pixel) = b.camera.project(&p_b) else { continue };
            let (x, y) = (pixel.x.round(), pixel.y.round());
            if x >= 0.0 && y >= 0.0 && x < f64::from(b.camera.width()) && y < f64::from(b.camera.height()) {
                found.push(((column, row), (x as u32, y as u32), p_b.z));
            }
        }
    }
    found
}

/// Correlation of two series.
fn correlation(pairs: &[(f64, f64)]) -> f64 {
    let n = pairs.len() as f64;
    let (ma, mb) = (pairs.iter().map(|p| p.0).sum::<f64>() / n, pairs.iter().map(|p| p.1).sum::<f64>() / n);
    let sum = |f: &dyn Fn(&(f64, f64)) -> f64| pairs.iter().map(f).sum::<f64>();
    sum(&|p| (p.0 - ma) * (p.1 - mb)) / (sum(&|p| (p.0 - ma).powi(2)) * sum(&|p| (p.1 - mb).powi(2))).sqrt()
}

#[test]
fn what_both_views_of_a_pair_see_has_the_same_depth_and_colour() {
    let (mut same_tone, mut median_errors) = (Vec::new(), Vec::new());
    for pair in FLAT.pairs.iter().filter(|p| p.overlap > 0.3) {
        let (a, b) = (&FLAT.views[pair.a], &FLAT.views[pair.b]);
        if a.variant != b.variant {
            continue;
        }
        let (tones_a, tones_b) = (luma(a), luma(b));
        let mut errors_m = Vec::new();
        for (from, to, expected_m) in projections(a, b) {
            let Some(measured_m) = b.depth.at(to.0, to.1) else { continue };
            if agrees(expected_m, f64::from(measured_m)) {
                errors_m.push((expected_m - f64::from(measured_m)).abs());
                let tone = |v: &[f64], (x, y): (u32, u32)| v[(y * a.camera.width() + x) as usize];
                same_tone.push((tone(&tones_a, from), tone(&tones_b, to)));
            }
        }
        errors_m.sort_by(f64::total_cmp);
        median_errors.push(errors_m[errors_m.len() / 2]);
    }
    assert!(median_errors.len() >= 3, "{} pairs", median_errors.len());
    let worst = median_errors.iter().copied().fold(0.0, f64::max);
    assert!(worst < 0.01, "median depth error of the worst pair: {worst} m");
    let r = correlation(&same_tone);
    assert!(r > 0.8, "correlation of tones: {r}");
}

#[test]
fn a_wrong_pose_is_noticed() {
    let pair = FLAT.pairs.iter().max_by(|p, q| p.overlap.total_cmp(&q.overlap)).unwrap();
    let (a, b) = (&FLAT.views[pair.a], &FLAT.views[pair.b]);
    let mut moved = b.clone();
    moved.t_world_camera = a.t_world_camera;
    assert!(overlap(a, &moved) < pair.overlap, "a pose that is not its own");
}

#[test]
fn overlap_is_symmetric_complete_and_whole_with_itself() {
    for (i, a) in FLAT.views.iter().enumerate() {
        assert!(overlap(a, a) > 0.999);
        for (j, b) in FLAT.views.iter().enumerate().skip(i + 1) {
            let shared = overlap(a, b);
            assert_eq!(shared, overlap(b, a));
            let listed = FLAT.pairs.iter().find(|p| (p.a, p.b) == (i, j));
            assert_eq!(listed.is_some(), shared >= OVERLAP_MIN, "views {i} and {j}: {shared}");
            assert!(listed.is_none_or(|p| p.overlap == shared));
        }
    }
}

#[test]
fn most_views_have_partners_and_pairs_are_of_all_kinds() {
    assert_eq!(FLAT.views.len(), 12);
    let lonely = (0..FLAT.views.len()).filter(|i| !FLAT.pairs.iter().any(|p| p.a == *i || p.b == *i)).count();
    assert!(lonely <= 1, "{lonely} views without a partner");
    let share = |f: &dyn Fn(&views::ViewPair) -> bool| FLAT.pairs.iter().filter(|p| f(p)).count();
    assert!(share(&|p| p.overlap > 0.4) >= 2 && share(&|p| p.overlap < 0.4) >= 2, "{:?}", FLAT.pairs);
    assert!(share(&|p| p.yaw_rad > 0.5) >= 2 && share(&|p| p.distance_m > 1.0) >= 2, "{:?}", FLAT.pairs);
}

#[test]
fn cameras_stand_free_and_are_as_promised() {
    let scene = generate_as(FLAT.seed, Detail::Shape).scene;
    let grid = NavGrid::new(&scene, 1.75).unwrap();
    for view in FLAT.views.iter().filter(|v| v.variant == 0) {
        let p = view.t_world_camera.translation();
        assert!(grid.disc_is_free(p.x, p.y, 0.2), "camera at {p:?}");
    }
    for view in &FLAT.views {
        let height_m = view.t_world_camera.translation().z - grid.floor_z_m();
        assert!((0.4..1.6).contains(&height_m), "{height_m} m high");
        assert!((54.9..120.1).contains(&view.camera.hfov_rad().to_degrees()));
        let forward = view.t_world_camera.rotation() * nalgebra::Vector3::z();
        let right = view.t_world_camera.rotation() * nalgebra::Vector3::x();
        assert!(forward.z.asin().to_degrees().abs() <= 15.01 && right.z.asin().to_degrees().abs() <= 5.01);
        assert!(view.depth.valid_share() > 0.99, "{} of the pixels have depth", view.depth.valid_share());
    }
}

#[test]
fn every_view_shows_something_to_match() {
    for (i, view) in FLAT.views.iter().enumerate() {
        let (tones, w) = (luma(view), view.camera.width() as usize);
        let edge = |k: usize| (tones[k] - tones[k + 1]).abs().max((tones[k] - tones[k + w]).abs()) > 10.0;
        let edges = (0..tones.len() - w - 1).filter(|k| edge(*k)).count() as f64 / tones.len() as f64;
        assert!(edges > 0.01, "view {i}: {edges} of its pixels lie on an edge");
    }
}

#[test]
fn equal_seeds_give_equal_bytes_and_other_seeds_other_ones() {
    let bytes = |seed: u64| files(&views::draw(seed, &SMALL).unwrap()).unwrap();
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let first = bytes(7);
    assert!(first == one_thread.install(|| bytes(7)));
    assert!(first[0].bytes != bytes(8)[0].bytes);
}

fn new_folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&path);
    path
}

#[test]
fn files_give_back_what_was_seen() {
    let flat = views::draw(9, &SMALL).unwrap();
    let files = files(&flat).unwrap();
    assert_eq!(files.last().unwrap().name, "views.json");
    let record: FlatRecord = serde_json::from_slice(&files.last().unwrap().bytes).unwrap();
    let find = |name: &str| image::load_from_memory(&files.iter().find(|f| f.name == name).unwrap().bytes).unwrap();
    for (view, written) in flat.views.iter().zip(&record.views) {
        assert_eq!(find(&written.rgb).as_rgb8().unwrap().as_raw(), view.rgb.data());
        let depth = find(&written.depth);
        let metres = depth.as_luma16().unwrap().as_raw().iter().map(|mm| f32::from(*mm) * 1e-3);
        assert!(metres.zip(view.depth.data()).all(|(a, b)| a == *b));
        let t = view.t_world_camera.isometry().to_homogeneous();
        assert!((0..16).all(|k| (written.t_world_camera[k / 4][k % 4] - t[(k / 4, k % 4)]).abs() < 1e-12));
        assert!((written.fx - view.camera.fx()).abs() < 1e-9);
    }
    assert_eq!(record.pairs.len(), flat.pairs.len());
}

#[test]
fn an_export_goes_on_where_it_stopped() {
    let path = new_folder("export_goes_on");
    let export = Export::open(&path, 3..5, SMALL).unwrap();
    assert_eq!(export.pending(), [3, 4]);
    let written = AtomicUsize::new(0);
    let count = |_: &_| {
        written.fetch_add(1, Ordering::Relaxed);
    };
    export.run(2, &count).unwrap();
    let bytes = fs::read(path.join("4/000.png")).unwrap();
    fs::remove_file(path.join("4/views.json")).unwrap();
    fs::remove_file(path.join("4/000.png")).unwrap();
    let resumed = Export::open(&path, 3..5, SMALL).unwrap();
    assert_eq!(resumed.pending(), [4]);
    resumed.run(1, &count).unwrap();
    assert_eq!((written.load(Ordering::Relaxed), fs::read(path.join("4/000.png")).unwrap()), (3, bytes));
    let set: SetRecord = serde_json::from_slice(&fs::read(path.join("set.json")).unwrap()).unwrap();
    assert_eq!((set.scenes, set.size, set.n_views, set.format), (vec![3, 4], [160, 120], 6, 1));
}

#[test]
fn folders_of_others_are_left_alone() {
    let path = new_folder("export_of_others");
    Export::open(&path, 3..5, SMALL).unwrap();
    let larger = ViewSpec { n_views: 7, ..SMALL };
    let refused = Export::open(&path, 3..5, larger).unwrap_err();
    assert!(matches!(refused, ExportError::Another { .. }), "{refused}");
    fs::write(path.join("plan.json"), b"{").unwrap();
    assert!(matches!(Export::open(&path, 3..5, SMALL), Err(ExportError::Another { .. })));
    fs::remove_file(path.join("plan.json")).unwrap();
    fs::write(path.join("thesis.txt"), b"all of it").unwrap();
    assert!(matches!(Export::open(&path, 3..5, SMALL), Err(ExportError::NotAnExport { .. })));
    let on_a_file = Export::open(&path.join("thesis.txt"), 3..5, SMALL).unwrap_err();
    assert!(matches!(on_a_file, ExportError::Write { .. }), "{on_a_file}");
    let no_image = Export::open(&new_folder("export_no_image"), 3..5, ViewSpec { width: 0, ..SMALL }).unwrap();
    assert!(matches!(no_image.run(1, &|_| {}), Err(ExportError::Views { .. })));
}

#[test]
fn the_robots_own_camera_is_level_and_always_the_same() {
    let spec = ViewSpec { n_views: 4, width: 160, height: 120 };
    let flat = views::draw_with(200_001, &spec, &Cameras::ROBOT).unwrap();
    assert_eq!(flat.views.len(), 4);
    for view in &flat.views {
        assert!((view.camera.hfov_rad().to_degrees() - 120.0).abs() < 1e-9);
        let forward = view.t_world_camera.rotation() * nalgebra::Vector3::z();
        assert!(forward.z.abs() < 1e-12, "level: {forward}");
        let floor_m = flat.views[0].t_world_camera.translation().z;
        assert_eq!(view.t_world_camera.translation().z, floor_m);
    }
    assert_eq!(views::draw_with(200_001, &SMALL, &Cameras::Drawn).unwrap(), views::draw(200_001, &SMALL).unwrap());
}
