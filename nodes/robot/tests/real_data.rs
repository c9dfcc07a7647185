//! The real recordings, where they are. Without them these tests say that they were skipped.
#![expect(clippy::unwrap_used, reason = "tests")]

use std::path::{Path, PathBuf};

use homing_core::RobotBridge;
use homing_robot::{Layout, PairScore, Recording, ReplayBody};

/// A folder below HOMING_DATA, or below ../shared/data as seen from the workspace.
fn data(name: &str) -> Option<PathBuf> {
    let default = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let folder = std::env::var_os("HOMING_DATA").map_or(default, PathBuf::from).join(name);
    if folder.is_dir() {
        return Some(folder);
    }
    eprintln!("SKIPPED: {} is not there; set HOMING_DATA to the folder that holds {name}", folder.display());
    None
}

#[test]
fn red_kitchen() {
    let Some(folder) = data("rgbd/7scenes_redkitchen") else { return };
    let recording = Recording::open(folder).unwrap();
    assert_eq!((recording.layout(), recording.len()), (Layout::SevenScenes, 100));
    assert_eq!(recording.pairs(50, 10).len(), 95);
    assert_eq!(recording.pairs(100, 10).len(), 90);
    assert_eq!(recording.pairs(50, 50).len(), 19);
    let frame = recording.frame(500).unwrap();
    assert!(frame.depth.valid_share() > 0.5, "{}", frame.depth.valid_share());
    assert!(frame.depth.data().iter().all(|&d| d < 20.0), "65535 is masked");
    for (query, goal) in recording.pairs(50, 10) {
        let truth = recording.relative_pose_truth(query, goal).unwrap();
        let back = recording.relative_pose_truth(goal, query).unwrap();
        let round_trip = truth.isometry() * back.isometry();
        assert!(round_trip.translation.vector.norm() < 1e-9 && round_trip.rotation.angle() < 1e-9);
        assert!(truth.translation().norm() < 2.5, "{query} to {goal}: {}", truth.translation().norm());
    }
}

/// Depth and poses belong together: surfaces seen in one frame are where the next frame sees them.
#[test]
fn depth_agrees_with_the_poses() {
    for (name, query, goal) in [("rgbd/7scenes_redkitchen", 500, 510), ("rgbd/o3d_livingroom1", 100, 104)] {
        let Some(folder) = data(name) else { continue };
        let recording = Recording::open(folder).unwrap();
        let (a, b) = (recording.frame(query).unwrap(), recording.frame(goal).unwrap());
        let t_goal_query = recording.relative_pose_truth(query, goal).unwrap().inverse();
        let k = recording.intrinsics();
        let mut errors_m = Vec::new();
        for (x, y) in (0..k.width()).step_by(7).flat_map(|x| (0..k.height()).step_by(7).map(move |y| (x, y))) {
            let Some(d) = a.depth.at(x, y) else { continue };
            let p_goal = t_goal_query.apply(&k.unproject(f64::from(x), f64::from(y), f64::from(d)));
            let Some(px) = k.project(&p_goal).filter(|p| p.x >= 0.0 && p.y >= 0.0) else { continue };
            let Some(seen) = b.depth.at(px.x.round() as u32, px.y.round() as u32) else { continue };
            errors_m.push((f64::from(seen) - p_goal.z).abs());
        }
        errors_m.sort_by(f64::total_cmp);
        let median_m = errors_m[errors_m.len() / 2];
        println!("{name}: {} points, median depth error {:.1} mm", errors_m.len(), 1e3 * median_m);
        assert!(errors_m.len() > 1000 && median_m < 0.03, "{name}: {median_m} m");
    }
}

#[test]
fn living_room() {
    let Some(folder) = data("rgbd/o3d_livingroom1") else { return };
    let recording = Recording::open(folder).unwrap();
    assert_eq!((recording.layout(), recording.len()), (Layout::Open3d, 106));
    assert_eq!(recording.numbers().last(), Some(210));
    assert_eq!((recording.intrinsics().fx(), recording.intrinsics().cx()), (525.0, 319.5));
    let truth = recording.relative_pose_truth(0, 2).unwrap();
    let exact = PairScore::of(&truth, &truth);
    assert!(exact.is_within(1e-9, 1e-5), "{exact:?}");
}

#[test]
fn plays_to_the_end() {
    let Some(folder) = data("rgbd/7scenes_redkitchen") else { return };
    let recording = Recording::open(folder).unwrap();
    let mut body = ReplayBody::with_playlist(recording, (0..200).step_by(20).collect()).unwrap();
    let mut stamps = Vec::new();
    while let Ok(observation) = body.observe() {
        assert!(observation.odometry.t_odom_base.is_finite());
        assert!(observation.odometry.linear_m_s.abs() < 3.0);
        stamps.push(observation.frame.stamp);
    }
    assert_eq!(stamps.len(), 10);
    assert!(stamps.is_sorted());
}
