//! One contract, one suite, every body: what holds for a robot whatever stands behind the seam.
#![expect(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test may fail by panicking")]

use std::fs;
use std::path::Path;
use std::sync::Arc;

use homing_core::{
    BridgeError, Capabilities, Motion, MotionOutcome, Observation, PlanarPose, Resettable, RobotBridge, wrap_angle,
};
use homing_robot::{Recording, ReplayBody};
use homing_sim::{Arena, BodySize, EpisodeSpec, SceneRef, SimConfig, Simulator, episode};
use homing_tests::data;
use image::{ImageBuffer, Luma, Rgb};

/// What looking does to a body.
#[derive(Copy, Clone, PartialEq, Eq)]
enum Looking {
    /// Nothing: looking twice shows the same.
    ChangesNothing,
    /// It brings the next frame, until there are no more.
    ShowsTheNext,
}

/// Motions that no body may take.
const NOT_MOTIONS: [Motion; 6] = [
    Motion::Velocity { linear_m_s: f64::NAN, angular_rad_s: 0.0 },
    Motion::Velocity { linear_m_s: 0.0, angular_rad_s: f64::INFINITY },
    Motion::Forward { distance_m: f64::NAN },
    Motion::Forward { distance_m: f64::NEG_INFINITY },
    Motion::Turn { angle_rad: f64::NAN },
    Motion::Turn { angle_rad: f64::INFINITY },
];

const TURN: Motion = Motion::Turn { angle_rad: 0.3 };
const FORWARD: Motion = Motion::Forward { distance_m: 0.25 };
const VELOCITY: Motion = Motion::Velocity { linear_m_s: 0.3, angular_rad_s: 0.2 };

/// The whole contract. The body must stand at its start, with room for a step ahead or nothing at all.
fn keeps_the_contract(body: &mut dyn RobotBridge, looking: Looking) {
    let capabilities = body.capabilities().clone();
    describes_a_possible_body(&capabilities);
    let first = body.observe().unwrap();
    fits(&first, &capabilities);
    starts_at_identity(&first);
    refuses_what_is_no_motion(body);
    if looking == Looking::ChangesNothing {
        assert_eq!(body.observe().unwrap(), first, "looking twice, or a refused motion, changed what is seen");
    }
    let last = if capabilities.drivable {
        moves_as_it_says(body, first)
    } else {
        cannot_be_driven(body);
        first
    };
    if looking == Looking::ShowsTheNext {
        shows_all_frames_and_ends(body, last);
    }
    body.stop();
    body.stop();
    assert_eq!(*body.capabilities(), capabilities, "what a body can do changed while it was used");
}

fn describes_a_possible_body(it: &Capabilities) {
    assert!(!it.name.is_empty());
    for size in [it.radius_m, it.height_m, it.linear_m_s_max, it.angular_rad_s_max] {
        assert!(size.is_finite() && size > 0.0, "{it:?}");
    }
    assert!(it.t_base_camera.is_finite());
    let camera_height_m = it.t_base_camera.translation().z;
    assert!((0.0..=it.height_m).contains(&camera_height_m), "the camera is {camera_height_m} m above the floor");
}

fn fits(seen: &Observation, capabilities: &Capabilities) {
    let size = (capabilities.intrinsics.width(), capabilities.intrinsics.height());
    assert_eq!(seen.frame.intrinsics, capabilities.intrinsics);
    assert_eq!((seen.frame.rgb.width(), seen.frame.rgb.height()), size);
    assert_eq!((seen.frame.depth.width(), seen.frame.depth.height()), size);
    assert!(seen.frame.depth.data().iter().all(|d| d.is_finite() && *d >= 0.0), "a depth that is no depth");
    assert!(seen.odometry.t_odom_base.is_finite());
    assert_eq!(seen.odometry.stamp, seen.frame.stamp, "image and odometry of one moment have one stamp");
    assert_eq!(seen.scan.is_some(), capabilities.has_scan);
    if let Some(scan) = &seen.scan {
        assert_eq!(scan.stamp, seen.frame.stamp);
        assert!(!scan.ranges_m.is_empty());
        for range_m in &scan.ranges_m {
            let valid = *range_m == f32::INFINITY || (0.0..=scan.range_max_m).contains(&f64::from(*range_m));
            assert!(valid, "a range of {range_m} m");
        }
    }
}

fn starts_at_identity(first: &Observation) {
    let t = first.odometry.t_odom_base;
    assert!(t.translation().norm() < 1e-9 && t.rotation().angle() < 1e-6, "odometry starts at {t:?}");
    assert_eq!((first.odometry.linear_m_s, first.odometry.angular_rad_s), (0.0, 0.0), "the body starts standing");
}

fn refuses_what_is_no_motion(body: &mut dyn RobotBridge) {
    for motion in NOT_MOTIONS {
        let refusal = body.apply(motion).expect_err("a motion that is not finite was taken");
        assert!(matches!(refusal, BridgeError::NotFinite { .. }), "{motion:?}: {refusal}");
    }
}

fn cannot_be_driven(body: &mut dyn RobotBridge) {
    for motion in [FORWARD, TURN, VELOCITY, Motion::Stop { done: false }] {
        let refusal = body.apply(motion).expect_err("a body that cannot be driven was driven");
        assert!(matches!(refusal, BridgeError::NotDrivable { .. }), "{motion:?}: {refusal}");
    }
}

/// Drives about, and compares what the body says it did with what its odometry says.
fn moves_as_it_says(body: &mut dyn RobotBridge, first: Observation) -> Observation {
    let capabilities = body.capabilities().clone();
    let (mut before, mut way_m, mut turned_rad) = (first, 0.0, 0.0);
    for motion in [TURN, FORWARD, TURN, FORWARD, VELOCITY, VELOCITY, Motion::Stop { done: false }, FORWARD, TURN] {
        let (outcome, after) = moved_by(body, &before, motion);
        let elapsed_s = after.frame.stamp.since(before.frame.stamp).as_secs_f64();
        let distance_m = outcome.moved.distance_to(0.0, 0.0);
        match motion {
            Motion::Turn { angle_rad } if !outcome.blocked => {
                assert!(wrap_angle(outcome.moved.yaw_rad - angle_rad).abs() < 0.05, "{motion:?} came to {outcome:?}");
                assert!(distance_m < 0.05, "turning on the spot went {distance_m} m");
            }
            Motion::Forward { distance_m: asked_m } if !outcome.blocked => {
                assert!((outcome.moved.x_m - asked_m).abs() < 0.05, "{motion:?} came to {outcome:?}");
            }
            Motion::Forward { distance_m: asked_m } => assert!(distance_m < asked_m + 1e-9),
            Motion::Stop { .. } => assert!(distance_m < 1e-6 && outcome.moved.yaw_rad.abs() < 1e-6, "{outcome:?}"),
            _ => {}
        }
        assert!(distance_m <= capabilities.linear_m_s_max * elapsed_s + 1e-6, "{motion:?}: {outcome:?} is too fast");
        way_m += distance_m;
        turned_rad += outcome.moved.yaw_rad.abs();
        before = after;
    }
    assert!(way_m > 0.1 && turned_rad > 0.5, "the body hardly moved: {way_m} m, {turned_rad} rad");
    before = is_held_to_its_speed(body, before, &capabilities);
    is_stopped_by_obstacles(body, before)
}

/// One motion, its outcome, and the view after it.
fn moved_by(body: &mut dyn RobotBridge, before: &Observation, motion: Motion) -> (MotionOutcome, Observation) {
    let outcome = body.apply(motion).unwrap();
    let after = body.observe().unwrap();
    fits(&after, body.capabilities());
    assert!(after.frame.stamp > before.frame.stamp, "{motion:?}: time stood still or went back");
    assert_eq!(outcome.stamp, after.odometry.stamp, "{motion:?}: it ended at the moment seen next");
    let by_odometry = (before.odometry.t_odom_base.inverse() * after.odometry.t_odom_base).planar();
    assert!(near(&outcome.moved, &by_odometry), "{motion:?}: says {:?}, odometry {by_odometry:?}", outcome.moved);
    (outcome, after)
}

fn near(a: &PlanarPose, b: &PlanarPose) -> bool {
    a.distance_to(b.x_m, b.y_m) < 1e-9 && wrap_angle(a.yaw_rad - b.yaw_rad).abs() < 1e-9
}

fn is_held_to_its_speed(body: &mut dyn RobotBridge, before: Observation, it: &Capabilities) -> Observation {
    let (_, after) = moved_by(body, &before, Motion::Velocity { linear_m_s: -100.0, angular_rad_s: 100.0 });
    let elapsed_s = after.frame.stamp.since(before.frame.stamp).as_secs_f64();
    let moved = (before.odometry.t_odom_base.inverse() * after.odometry.t_odom_base).planar();
    assert!(moved.distance_to(0.0, 0.0) <= it.linear_m_s_max * elapsed_s + 1e-6, "{moved:?} in {elapsed_s} s");
    assert!(moved.yaw_rad.abs() <= it.angular_rad_s_max * elapsed_s + 1e-6, "{moved:?} in {elapsed_s} s");
    assert!(after.odometry.linear_m_s.abs() <= it.linear_m_s_max);
    assert!(after.odometry.angular_rad_s.abs() <= it.angular_rad_s_max);
    after
}

/// Indoors every straight line ends at a wall.
fn is_stopped_by_obstacles(body: &mut dyn RobotBridge, mut before: Observation) -> Observation {
    const STEPS_MAX: usize = 200;
    for _ in 0..STEPS_MAX {
        let (outcome, after) = moved_by(body, &before, FORWARD);
        if outcome.blocked {
            assert!(outcome.moved.x_m < 0.25, "blocked, but the whole step was made");
            let (again, after) = moved_by(body, &after, FORWARD);
            assert!(again.blocked && again.moved.x_m.abs() < 0.05, "{again:?} into what blocked the last step");
            return after;
        }
        before = after;
    }
    panic!("{STEPS_MAX} steps ahead, and nothing in the way");
}

fn shows_all_frames_and_ends(body: &mut dyn RobotBridge, mut last: Observation) {
    let mut shown = 1;
    let end = loop {
        match body.observe() {
            Ok(next) => {
                fits(&next, body.capabilities());
                assert!(next.frame.stamp > last.frame.stamp, "time went back");
                assert_ne!(next.odometry.t_odom_base, last.odometry.t_odom_base, "the recording stands still");
                (last, shown) = (next, shown + 1);
            }
            Err(end) => break end,
        }
    };
    assert!(shown > 1 && matches!(end, BridgeError::Exhausted { .. }), "{end} after {shown} frames");
    assert!(matches!(body.observe(), Err(BridgeError::Exhausted { .. })), "the end is not final");
}

fn simulator(scene: &SceneRef, config: SimConfig) -> Simulator {
    let arena = Arc::new(Arena::load(scene, BodySize::default()).unwrap());
    let episode = episode::draw(&arena, 11, &EpisodeSpec::default()).unwrap();
    let mut simulator = Simulator::new(arena, config).unwrap();
    simulator.reset(&episode).unwrap();
    simulator
}

#[test]
fn a_generated_flat() {
    let mut body = simulator(&SceneRef::Flat { seed: 11 }, SimConfig::default());
    keeps_the_contract(&mut body, Looking::ChangesNothing);
}

#[test]
fn a_robot_without_a_scanner() {
    let config = SimConfig { laser: None, ..SimConfig::default() };
    let mut body = simulator(&SceneRef::Flat { seed: 12 }, config);
    assert!(!body.capabilities().has_scan);
    keeps_the_contract(&mut body, Looking::ChangesNothing);
}

#[test]
fn a_scene_from_a_file() {
    let Some(path) = data().map(|d| d.join("scenes/small_house.glb")).filter(|p| p.is_file()) else {
        return println!("SKIPPED: small_house.glb is not among the data");
    };
    keeps_the_contract(&mut simulator(&SceneRef::Glb { path }, SimConfig::default()), Looking::ChangesNothing);
}

#[test]
fn a_reset_body_is_a_new_body() {
    let mut body = simulator(&SceneRef::Flat { seed: 11 }, SimConfig::default());
    let episode = episode::draw(&Arc::clone(body.arena()), 11, &EpisodeSpec::default()).unwrap();
    let first = body.observe().unwrap();
    body.apply(FORWARD).unwrap();
    body.apply(VELOCITY).unwrap();
    assert_ne!(body.observe().unwrap(), first);
    body.reset(&episode).unwrap();
    assert_eq!(body.observe().unwrap(), first);
    keeps_the_contract(&mut body, Looking::ChangesNothing);
}

/// Frames in the layout of 7-Scenes: a patterned wall, seen from ever farther to the right.
fn record(folder: &Path, numbers: &[u32]) {
    for &number in numbers {
        let file = |ending: &str| folder.join(format!("frame-{number:06}.{ending}"));
        let pattern = |x: u32, y: u32| Rgb([(x + number) as u8, y as u8, (x ^ y) as u8]);
        ImageBuffer::from_fn(640, 480, pattern).save(file("color.png")).unwrap();
        let depth_mm = |x: u32, y: u32| Luma([if (x + y).is_multiple_of(7) { 65_535 } else { 1_500 + x as u16 }]);
        ImageBuffer::from_fn(640, 480, depth_mm).save(file("depth.png")).unwrap();
        let right_m = f64::from(number) * 0.02;
        fs::write(file("pose.txt"), format!("1 0 0 {right_m}\n0 1 0 0\n0 0 1 0\n0 0 0 1\n")).unwrap();
    }
}

#[test]
fn a_small_recording() {
    let folder = tempfile::tempdir().unwrap();
    record(folder.path(), &[10, 20, 30, 50]);
    let mut body = ReplayBody::new(Recording::open(folder.path()).unwrap()).unwrap();
    keeps_the_contract(&mut body, Looking::ShowsTheNext);
    let frame = Recording::open(folder.path()).unwrap().frame(10).unwrap();
    assert_eq!(frame.depth.at(0, 0), None, "65535 is no depth");
    assert_eq!(frame.depth.at(1, 0), Some(1.501));
}

#[test]
fn seven_scenes() {
    let Some(folder) = data().map(|d| d.join("rgbd/7scenes_redkitchen")).filter(|p| p.is_dir()) else {
        return println!("SKIPPED: 7scenes_redkitchen is not among the data");
    };
    let recording = Recording::open(folder).unwrap();
    let frames: Vec<u32> = recording.numbers().take(12).collect();
    assert_eq!(frames.len(), 12);
    keeps_the_contract(&mut ReplayBody::with_playlist(recording, frames).unwrap(), Looking::ShowsTheNext);
}
