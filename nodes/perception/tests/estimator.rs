//! The whole step on rendered rooms, and on everything a camera should not send but does.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a failing test should say where")]

use std::sync::Arc;

use homing_core::{
    DepthImage, FeatureExtractor, GoalEstimate, GoalPhoto, Intrinsics, RgbImage, RgbdFrame, Sighting, Stamp,
    UnseenReason,
};
use homing_perception::{GoalEstimator, PerceptionConfig, PerceptionError, PoseSolver, Sift, SiftConfig};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

/// A box of 6 x 2.6 x 8 m around the origin, its walls covered with speckles of several sizes.
struct Room {
    seed: u32,
}

impl Room {
    /// Colour and depth along the optical axis from a camera in the room.
    fn render(&self, camera: &Intrinsics, t_room_camera: &Isometry3<f64>) -> (RgbImage, DepthImage) {
        let (mut rgb, mut depth) = (Vec::new(), Vec::new());
        for row in 0..camera.height() {
            for column in 0..camera.width() {
                let ray = camera.unproject(f64::from(column), f64::from(row), 1.0).coords;
                let (hit, z) = wall(&t_room_camera.translation.vector, &(t_room_camera.rotation * ray));
                let grey = self.speckle(&hit);
                rgb.extend([grey, grey / 2 + 40, 255 - grey]);
                depth.push(z as f32);
            }
        }
        let (width, height) = (camera.width(), camera.height());
        (RgbImage::new(width, height, rgb).unwrap(), DepthImage::from_metres(width, height, depth).unwrap())
    }

    fn speckle(&self, p: &Point3<f64>) -> u8 {
        let octave = |cells_per_m: f64| {
            let at = p.coords * cells_per_m;
            let base = at.map(f64::floor);
            let f = (at - base).map(|x| x * x * (3.0 - 2.0 * x));
            let mut value = 0.0;
            for corner in 0..8_u32 {
                let offset = Vector3::new(corner & 1, (corner >> 1) & 1, corner >> 2).map(f64::from);
                let weight = f.zip_map(&offset, |f, o| if o > 0.5 { f } else { 1.0 - f }).product();
                value += weight * self.hash(&(base + offset), cells_per_m as u32);
            }
            value
        };
        let value = 0.5 * octave(3.0) + 0.3 * octave(8.0) + 0.2 * octave(19.0);
        ((value - 0.5) * 500.0 + 128.0).clamp(0.0, 255.0) as u8
    }

    fn hash(&self, cell: &Vector3<f64>, salt: u32) -> f64 {
        let mut h = self.seed ^ salt.wrapping_mul(0x9e37_79b9);
        for x in cell.iter() {
            h = (h ^ (*x as i32).cast_unsigned()).wrapping_mul(0x85eb_ca6b);
            h ^= h >> 13;
            h = h.wrapping_mul(0xc2b2_ae35);
            h ^= h >> 16;
        }
        f64::from(h) / f64::from(u32::MAX)
    }
}

/// Where a ray from inside the box meets a wall, and at what multiple of the ray.
fn wall(origin: &Vector3<f64>, ray: &Vector3<f64>) -> (Point3<f64>, f64) {
    let half = Vector3::new(3.0, 1.3, 4.0);
    let reach = (0..3).map(|i| if ray[i] == 0.0 { f64::MAX } else { (half[i] * ray[i].signum() - origin[i]) / ray[i] });
    let k = reach.fold(f64::MAX, f64::min);
    (Point3::from(origin + ray * k), k)
}

fn camera(width: u32, height: u32, hfov_deg: f64) -> Intrinsics {
    Intrinsics::from_hfov(width, height, hfov_deg.to_radians()).unwrap()
}

/// A level camera, turned left by `yaw_deg`.
fn at(x: f64, z: f64, yaw_deg: f64) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_axis_angle(&-Vector3::y_axis(), yaw_deg.to_radians());
    Isometry3::from_parts(Translation3::new(x, 0.0, z), turn)
}

fn frame(room: &Room, camera: &Intrinsics, pose: &Isometry3<f64>) -> RgbdFrame {
    let (rgb, depth) = room.render(camera, pose);
    RgbdFrame::new(Stamp(7), Arc::new(rgb), Arc::new(depth), *camera).unwrap()
}

fn goal(room: &Room, camera: &Intrinsics, pose: &Isometry3<f64>) -> GoalPhoto {
    GoalPhoto { id: 3, rgb: Arc::new(room.render(camera, pose).0), intrinsics: *camera }
}

fn estimate(config: PerceptionConfig, goal: GoalPhoto, frame: &RgbdFrame) -> GoalEstimate {
    let mut estimator = GoalEstimator::new(config).unwrap();
    estimator.set_goal(goal).unwrap();
    estimator.estimate(frame).unwrap()
}

fn uniform(value: u8) -> RgbImage {
    RgbImage::new(320, 240, vec![value; 320 * 240 * 3]).unwrap()
}

fn without_depth(mut frame: RgbdFrame, value: f32) -> RgbdFrame {
    let (width, height) = (frame.rgb.width(), frame.rgb.height());
    let depth = vec![value; (width * height) as usize];
    frame.depth = Arc::new(DepthImage::from_metres(width, height, depth).unwrap());
    frame
}

#[track_caller]
fn assert_pose(estimate: &GoalEstimate, truth: &Isometry3<f64>, tolerance_m: f64, tolerance_deg: f64) {
    let Sighting::Pose { t_camera_goal, covariance, n_inliers, rms_rad } = &estimate.sighting else {
        panic!("no pose: {:?}", estimate.sighting)
    };
    let shift = (t_camera_goal.translation() - truth.translation.vector).norm();
    let turn_deg = t_camera_goal.rotation().angle_to(&truth.rotation).to_degrees();
    assert!(shift < tolerance_m && turn_deg < tolerance_deg, "{shift} m, {turn_deg} deg off, {n_inliers} inliers");
    assert!(covariance.cholesky().is_some(), "the covariance is positive definite");
    assert!(*rms_rad < 0.008);
    assert!(!estimate.matched_points.is_empty() && estimate.n_matches > 0);
    assert_eq!((estimate.stamp, estimate.goal_id), (Stamp(7), 3));
}

#[test]
fn the_same_view_is_the_goal_itself() {
    let (room, camera, here) = (Room { seed: 1 }, camera(320, 240, 90.0), at(0.2, 0.0, 5.0));
    let found = estimate(PerceptionConfig::default(), goal(&room, &camera, &here), &frame(&room, &camera, &here));
    assert_pose(&found, &Isometry3::identity(), 0.005, 0.1);
}

#[test]
fn a_goal_seen_from_elsewhere_by_another_camera_is_found() {
    let room = Room { seed: 2 };
    let (robot, there) = (camera(640, 480, 120.0), at(0.4, 1.0, -25.0));
    for (phone, here) in [(camera(640, 480, 120.0), at(0.0, 0.0, 0.0)), (camera(300, 400, 60.0), at(0.3, 0.0, 0.0))] {
        let truth = here.inv_mul(&there);
        let (photo, seen) = (goal(&room, &phone, &there), frame(&room, &robot, &here));
        let found = estimate(PerceptionConfig::default(), photo.clone(), &seen);
        assert_pose(&found, &truth, 0.05, 1.0);
        assert_eq!(found.sighting, estimate(PerceptionConfig::default(), photo, &seen).sighting, "repeatable");
    }
}

#[test]
fn the_papers_solver_finds_it_too() {
    let (room, camera) = (Room { seed: 2 }, camera(640, 480, 90.0));
    let (here, there) = (at(0.0, 0.0, 0.0), at(0.4, 0.6, -15.0));
    let config = PerceptionConfig { solver: PoseSolver::EpnpRansac, ..PerceptionConfig::default() };
    let found = estimate(config, goal(&room, &camera, &there), &frame(&room, &camera, &here));
    assert_pose(&found, &here.inv_mul(&there), 0.15, 3.0);
}

#[test]
fn without_depth_the_bearing_is_given() {
    let (room, camera) = (Room { seed: 3 }, camera(640, 480, 90.0));
    let (here, there) = (at(0.0, 0.0, 0.0), at(0.5, 0.8, 10.0));
    for invalid in [0.0, f32::NAN, 65.535] {
        let seen = without_depth(frame(&room, &camera, &here), invalid);
        let found = estimate(PerceptionConfig::default(), goal(&room, &camera, &there), &seen);
        let Sighting::Bearing { bearing_rad, bearing_sd_rad, heading_rad, n_inliers } = found.sighting else {
            panic!("no bearing: {:?}, {} matches", found.sighting, found.n_matches)
        };
        // Half a metre to the right of 0.8 m ahead.
        let error = bearing_rad + 0.5_f64.atan2(0.8);
        assert!(error.abs() < 0.1 && error.abs() < 4.0 * bearing_sd_rad + 0.02, "{error} rad, sd {bearing_sd_rad}");
        assert!((heading_rad - 10.0_f64.to_radians()).abs() < 0.03);
        assert!(n_inliers >= 25);
    }
}

#[test]
fn another_room_is_not_the_goal() {
    let camera = camera(640, 480, 120.0);
    let mut estimator = GoalEstimator::new(PerceptionConfig::default()).unwrap();
    for seed in 10..14 {
        estimator.set_goal(goal(&Room { seed }, &camera, &at(0.0, 0.0, 0.0))).unwrap();
        for depth in [None, Some(0.0)] {
            let mut seen = frame(&Room { seed: seed + 100 }, &camera, &at(0.3, 0.2, 20.0));
            if let Some(value) = depth {
                seen = without_depth(seen, value);
            }
            let found = estimator.estimate(&seen).unwrap();
            assert!(matches!(found.sighting, Sighting::NotSeen { .. }), "{:?}", found.sighting);
            assert!(found.matched_points.is_empty());
        }
    }
}

#[test]
fn images_that_show_nothing_are_not_seen_and_never_fail() {
    let (room, camera) = (Room { seed: 4 }, camera(320, 240, 90.0));
    let textured = frame(&room, &camera, &at(0.0, 0.0, 0.0));
    let mut estimator = GoalEstimator::new(PerceptionConfig::default()).unwrap();
    let none = estimator.estimate(&textured).unwrap();
    assert_eq!(none.sighting, Sighting::NotSeen { reason: UnseenReason::NoGoal });
    for value in [0, 128, 255] {
        let blank = RgbdFrame { rgb: Arc::new(uniform(value)), ..textured.clone() };
        estimator.set_goal(goal(&room, &camera, &at(0.0, 0.0, 0.0))).unwrap();
        let unseen = estimator.estimate(&blank).unwrap();
        assert_eq!(unseen.sighting, Sighting::NotSeen { reason: UnseenReason::NoTexture });
        estimator.set_goal(GoalPhoto { id: 3, rgb: Arc::clone(&blank.rgb), intrinsics: camera }).unwrap();
        for seen in [&textured, &blank] {
            let unseen = estimator.estimate(seen).unwrap();
            assert_eq!(unseen.sighting, Sighting::NotSeen { reason: UnseenReason::NoTexture });
        }
    }
}

#[test]
fn images_of_a_few_pixels_or_keypoints_are_survived() {
    let room = Room { seed: 5 };
    let robot = camera(320, 240, 90.0);
    let seen = frame(&room, &robot, &at(0.0, 0.0, 0.0));
    let mut estimator = GoalEstimator::new(PerceptionConfig::default()).unwrap();
    for (width, height) in [(1, 1), (8, 8), (1, 500), (17, 16), (24, 18)] {
        let tiny = camera(width, height, 90.0);
        estimator.set_goal(goal(&room, &tiny, &at(0.0, 0.0, 0.0))).unwrap();
        let found = estimator.estimate(&seen).unwrap();
        assert!(matches!(found.sighting, Sighting::NotSeen { .. }), "{width}x{height}: {:?}", found.sighting);
    }
}

#[test]
fn a_photo_and_a_camera_that_disagree_are_refused_and_the_old_goal_stays() {
    let (room, small) = (Room { seed: 6 }, camera(320, 240, 90.0));
    let mut estimator = GoalEstimator::new(PerceptionConfig::default()).unwrap();
    estimator.set_goal(goal(&room, &small, &at(0.0, 0.0, 0.0))).unwrap();
    let wrong = GoalPhoto { id: 9, rgb: Arc::new(uniform(1)), intrinsics: camera(640, 480, 90.0) };
    assert!(matches!(estimator.set_goal(wrong), Err(PerceptionError::PhotoSize { .. })));
    assert_eq!(estimator.goal().map(|goal| goal.id), Some(3));
}

#[test]
fn keypoints_do_not_depend_on_the_number_of_threads() {
    let image = Room { seed: 7 }.render(&camera(640, 480, 90.0), &at(0.0, 0.0, 0.0)).0;
    let mut sift = Sift::new(SiftConfig::default()).unwrap();
    let features = [2, 1].map(|threads| {
        opencv::core::set_num_threads(threads).unwrap();
        sift.extract(&image).unwrap()
    });
    assert!(features[0].keypoints.len() > 300, "{}", features[0].keypoints.len());
    assert!(features.iter().all(|f| *f == features[0]));
    assert!(features[0].keypoints.is_sorted_by(|a, b| a.score >= b.score));
    for descriptor in features[0].descriptors.chunks(128) {
        assert!((descriptor.iter().map(|x| x * x).sum::<f32>() - 1.0).abs() < 1e-4);
    }
}

#[test]
fn keypoints_lie_where_the_blobs_are() {
    let (width, height) = (160_u32, 120_u32);
    for (cx, cy) in [(80.0, 60.0), (70.3, 51.7), (40.5, 80.25)] {
        let blob = |i: u32| {
            let (x, y) = (f64::from(i % width) - cx, f64::from(i / width) - cy);
            let value = (40.0 + 200.0 * (-(x * x + y * y) / (2.0 * 9.0)).exp()).round() as u8;
            [value; 3]
        };
        let image = RgbImage::new(width, height, (0..width * height).flat_map(blob).collect()).unwrap();
        let features = Sift::new(SiftConfig::default()).unwrap().extract(&image).unwrap();
        let strongest = features.keypoints[0];
        let (dx, dy) = (f64::from(strongest.x_px) - cx, f64::from(strongest.y_px) - cy);
        assert!(dx.abs() < 0.06 && dy.abs() < 0.06, "off by ({dx}, {dy})");
    }
}

#[test]
fn a_large_photo_is_shrunk_and_its_keypoints_are_given_in_its_own_pixels() {
    let (room, small, large) = (Room { seed: 8 }, camera(640, 480, 90.0), camera(2400, 1800, 90.0));
    let there = at(0.3, 0.3, -10.0);
    let found =
        estimate(PerceptionConfig::default(), goal(&room, &large, &there), &frame(&room, &small, &at(0.0, 0.0, 0.0)));
    assert_pose(&found, &there, 0.05, 1.0);
    assert!(found.matched_points.iter().any(|m| m.goal_px.0 > 1300.0), "in the photo's pixels");
}
