//! The robust estimators against synthetic truth: success and error by share of outliers, honest covariance, up that is
//! known, known badly or wrong, and everything that fixes no pose.

#![expect(clippy::unwrap_used, clippy::expect_used, reason = "a failing test should say where")]

use homing_perception::pnp::{
    CameraPose, Consensus, Correspondence, NoPose, RansacConfig, Upright, covariance, gravity_ransac, lo_ransac,
    ray_sd_rad, refine, up2p,
};
use nalgebra::{Matrix3, Point3, Rotation3, Unit, UnitQuaternion, Vector3, Vector6};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A 640x480 camera of about 63 degrees.
const FOCAL_PX: f64 = 525.0;
const NOISE_PX: f64 = 0.7;

fn gaussian(rng: &mut ChaCha8Rng) -> f64 {
    // Sum of twelve uniforms: standard deviation 1, tails cut at 6.
    (0..12).map(|_| rng.random_range(0.0..1.0)).sum::<f64>() - 6.0
}

fn pixel(rng: &mut ChaCha8Rng) -> Vector3<f64> {
    Vector3::new(rng.random_range(-320.0..320.0), rng.random_range(-240.0..240.0), FOCAL_PX)
}

/// One problem, and what is true of it.
struct Problem {
    truth: CameraPose,
    up_camera: Vector3<f64>,
    up_goal: Vector3<f64>,
    correspondences: Vec<Correspondence>,
}

/// Cameras tilted by up to 10 degrees and turned by up to 40, `n` points 1 to 5 m from the goal camera.
fn problem(n: usize, outlier_share: f64, rng: &mut ChaCha8Rng) -> Problem {
    let tilt = |rng: &mut ChaCha8Rng| Rotation3::new(Vector3::x() * rng.random_range(-0.17..0.17));
    let (level_camera, level_goal) = (tilt(rng), tilt(rng));
    let yaw = Rotation3::new(Vector3::y() * rng.random_range(-0.7..0.7));
    let r: Matrix3<f64> = (level_goal.inverse() * yaw * level_camera).into_inner();
    let truth = CameraPose { r, p: Vector3::from_fn(|_, _| rng.random_range(-1.0..1.0)) };
    let correspondence = |i: usize| {
        let seen = pixel(rng);
        let point = Point3::from(truth.p + r.tr_mul(&(seen / FOCAL_PX * rng.random_range(1.0..5.0))));
        let noisy = seen + Vector3::new(NOISE_PX * gaussian(rng), NOISE_PX * gaussian(rng), 0.0);
        let is_outlier = (i as f64) < outlier_share * n as f64;
        let ray = Unit::new_normalize(if is_outlier { pixel(rng) } else { noisy });
        let ray_sd_rad = ray_sd_rad(&ray, NOISE_PX / FOCAL_PX);
        Correspondence { point, depth_sd_m: 0.0, direction_sd_rad: 0.0, ray, ray_sd_rad }
    };
    let correspondences = (0..n).map(correspondence).collect();
    let up = -Vector3::y();
    Problem { truth, up_camera: level_camera.inverse() * up, up_goal: level_goal.inverse() * up, correspondences }
}

fn ransac() -> RansacConfig {
    RansacConfig { gate_rad: 0.008, n_inliers_min: 7, confidence: 0.9999, iterations_max: 100_000 }
}

fn refined(consensus: &Consensus, correspondences: &[Correspondence]) -> CameraPose {
    refine(&consensus.pose, correspondences, &consensus.inliers, 20)
}

fn error_of(pose: &CameraPose, truth: &CameraPose) -> Vector6<f64> {
    let turn = UnitQuaternion::from_matrix(&(pose.r.transpose() * truth.r)).scaled_axis();
    let shift = pose.p - truth.p;
    Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z)
}

/// Share of poses within 0.1 m and 5 degrees, and the median position error of all, metres.
fn success(share: f64, trials: usize, solve: impl Fn(&Problem, &mut ChaCha8Rng) -> Option<CameraPose>) -> (f64, f64) {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let mut shifts = Vec::new();
    let mut good = 0;
    for _ in 0..trials {
        let problem = problem(300, share, &mut rng);
        let error = solve(&problem, &mut rng).map_or(Vector6::from_element(1e3), |p| error_of(&p, &problem.truth));
        let (shift, turn) = (error.fixed_rows::<3>(0).norm(), error.fixed_rows::<3>(3).norm());
        good += usize::from(shift < 0.1 && turn < 0.087);
        shifts.push(shift);
    }
    shifts.sort_by(f64::total_cmp);
    (good as f64 / trials as f64, shifts[trials / 2])
}

#[test]
fn the_pose_is_found_and_precise_at_every_share_of_outliers() {
    for (share, error_m_max) in [(0.3, 0.0035), (0.6, 0.0045), (0.8, 0.0065), (0.9, 0.010)] {
        let (rate, error_m) = success(share, 40, |problem, rng| {
            let consensus = lo_ransac(&problem.correspondences, &ransac(), rng).ok()?;
            Some(refined(&consensus, &problem.correspondences))
        });
        assert!(rate == 1.0 && error_m < error_m_max, "{share}: {rate} found, {error_m} m");
    }
}

#[test]
fn two_points_and_up_find_it_in_fewer_samples() {
    for share in [0.3, 0.6, 0.8, 0.9] {
        let (rate, error_m) = success(share, 40, |problem, rng| {
            // A mount is known to a fraction of a degree.
            let off = Rotation3::new(Vector3::x() * (0.005 * gaussian(rng)));
            let upright = Upright::new(&(off * problem.up_camera), &problem.up_goal).unwrap();
            let consensus = gravity_ransac(&problem.correspondences, &upright, &ransac(), rng).ok()?;
            Some(refined(&consensus, &problem.correspondences))
        });
        assert!(rate == 1.0 && error_m < 0.01, "{share}: {rate} found, {error_m} m");
    }
    let mut rng = ChaCha8Rng::seed_from_u64(12);
    let hard = problem(300, 0.9, &mut rng);
    let upright = Upright::new(&hard.up_camera, &hard.up_goal).unwrap();
    let by_two = gravity_ransac(&hard.correspondences, &upright, &ransac(), &mut rng).unwrap();
    let by_three = lo_ransac(&hard.correspondences, &ransac(), &mut rng).unwrap();
    assert!(3 * by_two.iterations < by_three.iterations, "{} and {}", by_two.iterations, by_three.iterations);
}

#[test]
fn a_wrong_up_costs_time_and_not_the_pose() {
    let (rate, error_m) = success(0.6, 20, |problem, rng| {
        let off = Rotation3::new(Vector3::x() * 0.35);
        let upright = Upright::new(&(off * problem.up_camera), &problem.up_goal).unwrap();
        let consensus = gravity_ransac(&problem.correspondences, &upright, &ransac(), rng).ok()?;
        Some(refined(&consensus, &problem.correspondences))
    });
    assert!(rate == 1.0 && error_m < 0.005, "{rate} found, {error_m} m");
}

#[test]
fn the_kernel_with_up_finds_the_true_pose_among_its_roots() {
    let mut rng = ChaCha8Rng::seed_from_u64(13);
    let mut found = 0;
    for _ in 0..2000 {
        let mut exact = problem(2, 0.0, &mut rng);
        for c in &mut exact.correspondences {
            c.ray = Unit::new_normalize(exact.truth.to_goal(&c.point));
        }
        let [first, second] = [exact.correspondences[0], exact.correspondences[1]];
        let upright = Upright::new(&exact.up_camera, &exact.up_goal).unwrap();
        assert!(upright.off_rad(&exact.truth) < 1e-9);
        let mut roots = Vec::new();
        up2p(&[first.ray.into_inner(), second.ray.into_inner()], &[first.point, second.point], &upright, &mut roots);
        assert!(roots.len() <= 2);
        for root in &roots {
            assert!(root.is_rigid() && upright.off_rad(root) < 1e-9);
            for c in [&first, &second] {
                assert!(root.squared_error(c) < 1e-12, "a root does not see its own points");
            }
        }
        found += usize::from(roots.iter().any(|root| error_of(root, &exact.truth).norm() < 1e-5));
    }
    assert!(found >= 1990, "{found} of 2000");
}

#[test]
fn the_covariance_tells_the_error_among_outliers() {
    let mut rng = ChaCha8Rng::seed_from_u64(14);
    let trials = 300;
    let (mut mean, mut outside) = (0.0, 0);
    for _ in 0..trials {
        let problem = problem(150, 0.6, &mut rng);
        let consensus = lo_ransac(&problem.correspondences, &ransac(), &mut rng).expect("a consensus");
        let pose = refined(&consensus, &problem.correspondences);
        let inliers = pose.inliers(&problem.correspondences, ransac().gate_rad);
        let covariance = covariance(&pose, &problem.correspondences, &inliers).expect("a covariance");
        let error = error_of(&pose, &problem.truth);
        let squared = error.dot(&covariance.cholesky().unwrap().solve(&error));
        mean += squared / f64::from(trials);
        outside += u32::from(squared > 16.81);
    }
    // Chi-square with six degrees of freedom: mean 6, one in a hundred beyond 16.81.
    assert!((5.0..7.5).contains(&mean), "mean squared normalised error {mean}");
    assert!(outside <= 12, "{outside} of {trials} beyond the 99 % quantile");
}

#[test]
fn the_same_seed_gives_the_same_pose_with_up() {
    let run = || {
        let mut rng = ChaCha8Rng::seed_from_u64(15);
        let problem = problem(200, 0.8, &mut rng);
        let upright = Upright::new(&problem.up_camera, &problem.up_goal).unwrap();
        gravity_ransac(&problem.correspondences, &upright, &ransac(), &mut rng)
    };
    assert_eq!(run(), run());
}

#[test]
fn few_coincident_and_unreal_correspondences_are_refused_with_their_reason() {
    let mut rng = ChaCha8Rng::seed_from_u64(16);
    for n in [0, 1, 2, 3, 6] {
        let few = problem(n, 0.0, &mut rng).correspondences;
        assert_eq!(lo_ransac(&few, &ransac(), &mut rng), Err(NoPose::TooFew { n, n_usable: n, n_min: 7 }));
    }
    let same = vec![problem(1, 0.0, &mut rng).correspondences[0]; 50];
    assert!(matches!(lo_ransac(&same, &ransac(), &mut rng), Err(NoPose::Degenerate { .. })));
    let mut unreal = problem(50, 0.0, &mut rng).correspondences;
    for (i, c) in unreal.iter_mut().enumerate() {
        match i % 3 {
            0 => c.point.x = f64::NAN,
            1 => c.point.z = f64::INFINITY,
            _ => c.ray = Unit::new_unchecked(Vector3::new(0.0, f64::NAN, 1.0)),
        }
    }
    let found = lo_ransac(&unreal, &ransac(), &mut rng);
    assert_eq!(found, Err(NoPose::TooFew { n: 50, n_usable: 0, n_min: 7 }));
}

#[test]
fn unreal_correspondences_among_good_ones_are_passed_over() {
    let mut rng = ChaCha8Rng::seed_from_u64(17);
    let mut mixed = problem(90, 0.3, &mut rng);
    for c in mixed.correspondences.iter_mut().skip(60) {
        c.point = Point3::new(f64::NAN, f64::INFINITY, 0.0);
    }
    let upright = Upright::new(&mixed.up_camera, &mixed.up_goal).unwrap();
    for found in [
        lo_ransac(&mixed.correspondences, &ransac(), &mut rng),
        gravity_ransac(&mixed.correspondences, &upright, &ransac(), &mut rng),
    ] {
        let consensus = found.expect("a consensus");
        assert!(consensus.inliers.iter().all(|&i| (27..60).contains(&i)), "{:?}", consensus.inliers);
        assert!(error_of(&refined(&consensus, &mixed.correspondences), &mixed.truth).norm() < 0.1);
    }
    assert!(Upright::new(&Vector3::zeros(), &Vector3::y()).is_none());
    assert!(Upright::from_tilts(f64::NAN, 0.0).is_none());
}

/// Puts the points elsewhere, and the rays with them, up to the noise.
fn moved(problem: &mut Problem, rng: &mut ChaCha8Rng, place: impl Fn(f64, f64) -> Point3<f64>) {
    for c in &mut problem.correspondences {
        c.point = place(rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0));
        let seen = problem.truth.to_goal(&c.point).normalize();
        let off = Vector3::from_fn(|_, _| NOISE_PX / FOCAL_PX * gaussian(rng));
        c.ray = Unit::new_normalize(seen + off);
    }
}

#[test]
fn a_line_is_refused_and_a_plane_is_not() {
    let mut rng = ChaCha8Rng::seed_from_u64(18);
    for _ in 0..10 {
        let mut line = problem(80, 0.0, &mut rng);
        moved(&mut line, &mut rng, |u, _| Point3::new(u, 0.3 * u, 3.0 + 0.1 * u));
        let found = lo_ransac(&line.correspondences, &ransac(), &mut rng);
        assert!(matches!(found, Err(NoPose::Degenerate { .. })), "{found:?}");
        // A line with a millimetre of width has samples, but no certainty.
        moved(&mut line, &mut rng, |u, v| Point3::new(u, 0.3 * u + 0.001 * v, 3.0 + 0.1 * u));
        let found = lo_ransac(&line.correspondences, &ransac(), &mut rng);
        assert!(matches!(found, Err(NoPose::Undetermined { .. } | NoPose::Degenerate { .. })), "{found:?}");
        let mut wall = problem(80, 0.0, &mut rng);
        moved(&mut wall, &mut rng, |u, v| Point3::new(u, v, 3.0));
        let consensus = lo_ransac(&wall.correspondences, &ransac(), &mut rng).expect("a wall fixes the pose");
        assert!(error_of(&refined(&consensus, &wall.correspondences), &wall.truth).norm() < 0.15);
    }
}

#[test]
fn identical_photos_are_at_the_same_place_and_mirrored_ones_nowhere() {
    let mut rng = ChaCha8Rng::seed_from_u64(19);
    let mut same = problem(100, 0.0, &mut rng).correspondences;
    for c in &mut same {
        c.point = Point3::from(pixel(&mut rng) / FOCAL_PX * rng.random_range(1.0..5.0));
        c.ray = Unit::new_normalize(c.point.coords);
    }
    let consensus = lo_ransac(&same, &ransac(), &mut rng).expect("a consensus");
    let here = CameraPose { r: Matrix3::identity(), p: Vector3::zeros() };
    assert!(error_of(&refined(&consensus, &same), &here).norm() < 1e-6);
    assert_eq!(consensus.inliers.len(), 100);
    for c in &mut same {
        c.ray = Unit::new_normalize(Vector3::new(-c.point.x, c.point.y, c.point.z));
    }
    let found = lo_ransac(&same, &RansacConfig { n_inliers_min: 30, ..ransac() }, &mut rng);
    assert!(matches!(found, Err(NoPose::NoConsensus { .. } | NoPose::Undetermined { .. })), "{found:?}");
}
