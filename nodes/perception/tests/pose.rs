//! Properties of the pose solvers on synthetic rooms, where the truth is known.

#![expect(clippy::unwrap_used, clippy::expect_used, reason = "a failing test should say where")]

use homing_perception::PerceptionConfig;
use homing_perception::essential::{EssentialConfig, RayPair, bearing};
use homing_perception::pnp::{
    CameraPose, Correspondence, NoPose, RansacConfig, covariance, epnp_ransac, lo_ransac, p3p, refine,
};
use nalgebra::{Matrix6, Point3, Rotation3, Unit, UnitQuaternion, Vector3, Vector6};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Focal length of a 640x480 camera with 120 degrees.
const FOCAL_PX: f64 = 184.75;

fn gaussian(rng: &mut ChaCha8Rng) -> f64 {
    // Sum of twelve uniforms: standard deviation 1, tails cut at 6.
    (0..12).map(|_| rng.random_range(0.0..1.0)).sum::<f64>() - 6.0
}

/// Keypoint noise 0.7 px in both cameras, depth noise of `depth_sd` at each point.
struct Room {
    outlier_share: f64,
    noise: f64,
    n: usize,
}

impl Room {
    /// Points on all sides within 1 to 4 m of the goal, as the robot's camera at the origin measures them.
    fn correspondences(&self, truth: &CameraPose, rng: &mut ChaCha8Rng) -> Vec<Correspondence> {
        let sd_rad = 0.7 / FOCAL_PX;
        (0..self.n)
            .map(|i| {
                let direction = Vector3::new(rng.random_range(-1.2..1.2), rng.random_range(-0.9..0.9), 1.0);
                let point = Point3::from(direction * rng.random_range(1.0..4.0));
                let depth_sd_m = 0.001 + 0.0016 * point.z * point.z;
                let ray = truth.to_goal(&point).normalize();
                let noisy_ray = Unit::new_normalize(ray + self.jitter(sd_rad, rng));
                let across = self.jitter(sd_rad * point.coords.norm(), rng);
                let along = direction * (self.noise * depth_sd_m * gaussian(rng));
                let is_outlier = (i as f64) < self.outlier_share * self.n as f64;
                let wild = Vector3::new(rng.random_range(-1.7..1.7), rng.random_range(-1.3..1.3), 1.0);
                Correspondence {
                    point: point + across + along,
                    depth_sd_m,
                    direction_sd_rad: sd_rad,
                    ray: if is_outlier { Unit::new_normalize(wild) } else { noisy_ray },
                    ray_sd_rad: sd_rad,
                }
            })
            .collect()
    }

    fn jitter(&self, sd: f64, rng: &mut ChaCha8Rng) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.noise * sd * gaussian(rng))
    }
}

/// Goal camera at `p`, turned left by `yaw_deg` about the vertical.
fn goal_at(p: Vector3<f64>, yaw_deg: f64) -> CameraPose {
    let r_camera_goal = Rotation3::from_axis_angle(&-Vector3::y_axis(), yaw_deg.to_radians());
    CameraPose { r: r_camera_goal.inverse().into_inner(), p }
}

fn ransac() -> RansacConfig {
    RansacConfig { gate_rad: 0.012, n_inliers_min: 12, confidence: 0.9999, iterations_max: 20_000 }
}

fn error_of(pose: &CameraPose, truth: &CameraPose) -> Vector6<f64> {
    let turn = UnitQuaternion::from_matrix(&(pose.r.transpose() * truth.r)).scaled_axis();
    let shift = pose.p - truth.p;
    Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z)
}

#[test]
fn the_minimal_kernel_finds_the_true_pose_among_its_roots() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut found = 0;
    for _ in 0..2000 {
        let axis = Vector3::from_fn(|_, _| rng.random_range(-2.0..2.0));
        let truth = CameraPose {
            r: Rotation3::new(axis).into_inner(),
            p: Vector3::from_fn(|_, _| rng.random_range(-2.0..2.0)),
        };
        let rays =
            [(); 3].map(|()| Vector3::new(rng.random_range(-1.0..1.0), rng.random_range(-0.8..0.8), 1.0).normalize());
        let points = rays.map(|ray| Point3::from(truth.p + truth.r.transpose() * ray * rng.random_range(0.5..5.0)));
        let mut roots = Vec::new();
        p3p(&rays, &points, &mut roots);
        assert!(roots.len() <= 4);
        for root in &roots {
            for (ray, point) in rays.iter().zip(&points) {
                let seen = root.to_goal(point).normalize();
                assert!((seen - ray).norm() < 1e-4, "a root does not see its own points: {}", (seen - ray).norm());
            }
        }
        found += usize::from(roots.iter().any(|root| error_of(root, &truth).norm() < 1e-4));
    }
    // The rest are samples in which two roots all but coincide, or whose triangle is too thin to be used.
    assert!(found >= 1980, "{found} of 2000");
}

#[test]
fn the_minimal_kernel_refuses_degenerate_samples() {
    let line = [Point3::new(0.0, 0.0, 2.0), Point3::new(0.5, 0.0, 2.0), Point3::new(1.0, 0.0, 2.0)];
    let mut poses = Vec::new();
    p3p(&line.map(|p| p.coords.normalize()), &line, &mut poses);
    assert!(poses.is_empty());
    let same = [Point3::new(0.1, 0.2, 2.0); 3];
    p3p(&same.map(|p| p.coords.normalize()), &same, &mut poses);
    assert!(poses.is_empty());
    let triangle = [Point3::new(0.0, 0.0, 2.0), Point3::new(0.5, 0.0, 2.0), Point3::new(0.0, 0.7, 2.5)];
    p3p(&[Vector3::z(); 3], &triangle, &mut poses);
    p3p(&[Vector3::from_element(f64::NAN); 3], &triangle, &mut poses);
    assert!(poses.iter().all(CameraPose::is_rigid));
}

#[test]
fn the_pose_is_found_among_many_outliers() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    for (outlier_share, tolerance_m) in [(0.0, 0.05), (0.6, 0.06), (0.8, 0.1)] {
        for trial in 0..10 {
            let truth = goal_at(Vector3::new(0.6, -0.1, 0.9), 25.0);
            let correspondences = Room { outlier_share, noise: 1.0, n: 200 }.correspondences(&truth, &mut rng);
            let consensus = lo_ransac(&correspondences, &ransac(), &mut rng).expect("a consensus");
            let pose = refine(&consensus.pose, &correspondences, &consensus.inliers, 20);
            let error = error_of(&pose, &truth);
            let (shift, turn) = (error.fixed_rows::<3>(0).norm(), error.fixed_rows::<3>(3).norm());
            assert!(shift < tolerance_m && turn < 0.02, "{outlier_share}, {trial}: {shift} m, {turn} rad");
        }
    }
}

#[test]
fn outliers_alone_give_no_consensus() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    for _ in 0..10 {
        let truth = goal_at(Vector3::new(0.0, 0.0, 1.0), 0.0);
        let correspondences = Room { outlier_share: 1.0, noise: 1.0, n: 60 }.correspondences(&truth, &mut rng);
        let found = lo_ransac(&correspondences, &ransac(), &mut rng);
        assert!(matches!(found, Err(NoPose::NoConsensus { n_min: 12, .. })), "{found:?}");
    }
}

/// The goal's position is p = -R^T t whatever the angle between the two cameras; t itself would be off by that angle.
#[test]
fn the_goal_is_where_it_is_at_every_heading() {
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    for yaw_deg in [-90.0, -60.0, -30.0, 0.0, 30.0, 45.0, 60.0, 90.0] {
        let truth = goal_at(Vector3::new(-0.8, 0.05, 1.2), yaw_deg);
        let mut correspondences = Room { outlier_share: 0.3, noise: 1.0, n: 400 }.correspondences(&truth, &mut rng);
        correspondences.retain(|c| truth.to_goal(&c.point).z > 0.2);
        let consensus = lo_ransac(&correspondences, &ransac(), &mut rng).expect("a consensus");
        let refined = refine(&consensus.pose, &correspondences, &consensus.inliers, 20);
        let epnp = epnp_ransac(&correspondences, 8.0 / FOCAL_PX).unwrap().expect("an EPnP pose");
        for (pose, tolerance_m) in [(refined, 0.06), (epnp, 0.3)] {
            let p = pose.t_camera_goal().translation();
            assert!((p - truth.p).norm() < tolerance_m, "{yaw_deg} deg: {p:?}");
        }
    }
}

#[test]
fn errors_are_as_large_as_the_covariance_says() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let (mut mean, trials) = (0.0, 300);
    let mut outside = 0;
    for _ in 0..trials {
        let truth = goal_at(Vector3::new(0.5, 0.1, 0.7), 20.0);
        let correspondences = Room { outlier_share: 0.3, noise: 1.0, n: 120 }.correspondences(&truth, &mut rng);
        let wide = RansacConfig { gate_rad: 0.03, ..ransac() };
        let consensus = lo_ransac(&correspondences, &wide, &mut rng).expect("a consensus");
        let pose = refine(&consensus.pose, &correspondences, &consensus.inliers, 30);
        let inliers = pose.inliers(&correspondences, wide.gate_rad);
        let covariance: Matrix6<f64> = covariance(&pose, &correspondences, &inliers).expect("a covariance");
        let error = error_of(&pose, &truth);
        let squared = error.dot(&covariance.cholesky().unwrap().solve(&error));
        mean += squared / f64::from(trials);
        outside += u32::from(squared > 16.81);
    }
    // Chi-square with six degrees of freedom: mean 6, one in a hundred beyond 16.81.
    assert!((4.5..8.0).contains(&mean), "mean squared normalised error {mean}");
    assert!(outside <= 12, "{outside} of {trials} beyond the 99 % quantile");
}

#[test]
fn the_same_seed_gives_the_same_pose() {
    let truth = goal_at(Vector3::new(0.5, 0.1, 0.7), 20.0);
    let run = || {
        let mut rng = ChaCha8Rng::seed_from_u64(6);
        let correspondences = Room { outlier_share: 0.7, noise: 1.0, n: 150 }.correspondences(&truth, &mut rng);
        lo_ransac(&correspondences, &ransac(), &mut rng)
    };
    assert_eq!(run(), run());
}

#[test]
fn too_few_or_flat_correspondences_are_survived() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let truth = goal_at(Vector3::new(0.3, 0.0, 0.5), 10.0);
    for n in [0, 1, 2, 3] {
        let few = Room { outlier_share: 0.0, noise: 0.0, n }.correspondences(&truth, &mut rng);
        let found = lo_ransac(&few, &ransac(), &mut rng);
        assert_eq!(found, Err(NoPose::TooFew { n, n_usable: n, n_min: 12 }));
    }
    let on = |place: &dyn Fn(f64, f64) -> Point3<f64>, rng: &mut ChaCha8Rng| -> Vec<Correspondence> {
        let mut room = Room { outlier_share: 0.0, noise: 0.0, n: 60 }.correspondences(&truth, rng);
        for c in &mut room {
            c.point = place(rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0));
            c.ray = Unit::new_normalize(truth.to_goal(&c.point));
        }
        room
    };
    let line = on(&|u, _| Point3::new(u, 0.0, 2.0), &mut rng);
    let found = lo_ransac(&line, &ransac(), &mut rng);
    assert!(matches!(found, Err(NoPose::Degenerate { .. })), "points in line fix no pose: {found:?}");
    let wall = on(&|u, v| Point3::new(u, v, 2.0), &mut rng);
    let consensus = lo_ransac(&wall, &ransac(), &mut rng).expect("a wall fixes the pose");
    assert!(error_of(&consensus.pose, &truth).norm() < 1e-3);
}

#[test]
fn without_depth_the_direction_is_found() {
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    let config = EssentialConfig { gate_rad: 0.012, confidence: 0.9999, iterations_max: 2000, ray_sd_rad: 0.0054 };
    let mut normalised = Vec::new();
    for trial in 0..30 {
        let position = Vector3::new(rng.random_range(-1.0..1.0), 0.0, rng.random_range(0.5..1.5));
        let yaw_deg = rng.random_range(-30.0..30.0);
        let truth = goal_at(position, yaw_deg);
        let correspondences = Room { outlier_share: 0.3, noise: 0.7, n: 300 }.correspondences(&truth, &mut rng);
        let seen = correspondences.iter().filter(|c| c.ray.z > 0.2 && c.point.z > 0.2);
        let pairs: Vec<RayPair> =
            seen.map(|c| RayPair { query: Unit::new_normalize(c.point.coords), goal: c.ray }).collect();
        let found = bearing(&pairs, &config).unwrap().expect("a bearing");
        let true_bearing = (-position.x).atan2(position.z);
        let error = homing_core::wrap_angle(found.bearing_rad - true_bearing);
        assert!(error.abs() < 0.2, "{trial}: {error} rad off, sd {}", found.bearing_sd_rad);
        assert!((found.heading_rad - yaw_deg.to_radians()).abs() < 0.05, "{trial}: heading");
        normalised.push((error / found.bearing_sd_rad).powi(2));
    }
    let mean = normalised.iter().sum::<f64>() / normalised.len() as f64;
    assert!((0.2..3.0).contains(&mean), "mean squared normalised bearing error {mean}");
}

#[test]
fn a_setting_out_of_range_is_named() {
    let config = PerceptionConfig { ratio_max: f32::NAN, ..PerceptionConfig::default() };
    let message = config.check().unwrap_err().to_string();
    assert!(message.contains("ratio_max"), "{message}");
}
