//! Our pose estimator on the problems that `tests/interop/pose_peers.py` writes and gives to its peers, too.
//! `cargo run --example pose_peers -- problems.bin [--solver lo_ransac|gravity]`, or `-- --kernels` for the kernels' cost.
//!
//! Prints one line per problem: microseconds, 1 or 0 for found, then the rotation (row by row) and the translation that
//! map the points to the camera. The clock covers everything from pixels to pose and covariance.

use std::hint::black_box;
use std::time::Instant;

use homing_perception::PerceptionConfig;
use homing_perception::pnp::{
    CameraPose, Correspondence, RansacConfig, Upright, covariance, gravity_ransac, lo_ransac, p3p, ray_sd_rad, refine,
    up2p,
};
use nalgebra::{Matrix6, Point3, Rotation3, Unit, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

type Fallible<T> = Result<T, Box<dyn std::error::Error>>;

/// One standard deviation of a pixel in the problems.
const NOISE_PX: f64 = 0.7;

fn main() -> Fallible<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let Some(first) = arguments.first() else { return Err("which file of problems?".into()) };
    if first == "--kernels" {
        return kernels();
    }
    let solver = match arguments.get(1..3) {
        Some([flag, name]) if flag == "--solver" => name.as_str(),
        _ => "lo_ransac",
    };
    for (seed, problem) in Problem::read_all(&std::fs::read(first)?)?.iter().enumerate() {
        let start = Instant::now();
        let found = problem.solve(solver, seed as u64)?;
        let micros = start.elapsed().as_secs_f64() * 1e6;
        let pose = found.map_or(CameraPose { r: nalgebra::Matrix3::zeros(), p: Vector3::zeros() }, |(pose, _)| pose);
        let t = -(pose.r * pose.p);
        let numbers: Vec<String> = pose.r.transpose().iter().chain(t.iter()).map(|x| format!("{x:.12e}")).collect();
        println!("{micros:.2},{},{}", u8::from(found.is_some()), numbers.join(","));
    }
    Ok(())
}

/// Points and the pixels they are seen at.
struct Problem {
    focal_px: f64,
    up_camera: Vector3<f64>,
    up_goal: Vector3<f64>,
    /// X, Y, Z in metres, then the pixel relative to the principal point.
    rows: Vec<[f64; 5]>,
}

impl Problem {
    /// All little-endian: the number of problems and of points in each (u32), the focal length in pixels (f64); per
    /// problem up in the points' frame and in the camera (three f64 each), then five f64 per point.
    fn read_all(bytes: &[u8]) -> Fallible<Vec<Self>> {
        let (head, body) = bytes.split_at_checked(16).ok_or("the file is too short")?;
        let whole = |at: usize| head[at..at + 4].iter().rev().fold(0_usize, |n, &b| n << 8 | usize::from(b));
        let (n_problems, n_points) = (whole(0), whole(4));
        let float = |b: &[u8]| <[u8; 8]>::try_from(b).map(f64::from_le_bytes).unwrap_or(f64::NAN);
        let focal_px = float(&head[8..16]);
        let numbers: Vec<f64> = body.chunks_exact(8).map(float).collect();
        if numbers.len() != n_problems * (6 + 5 * n_points) {
            return Err(format!("{} numbers for {n_problems} problems of {n_points} points", numbers.len()).into());
        }
        let problem = |numbers: &[f64]| Self {
            focal_px,
            up_camera: Vector3::from_column_slice(&numbers[..3]),
            up_goal: Vector3::from_column_slice(&numbers[3..6]),
            rows: numbers[6..].chunks_exact(5).map(|r| [r[0], r[1], r[2], r[3], r[4]]).collect(),
        };
        Ok(numbers.chunks_exact(6 + 5 * n_points).map(problem).collect())
    }

    fn solve(&self, solver: &str, seed: u64) -> Fallible<Option<(CameraPose, Option<Matrix6<f64>>)>> {
        let defaults = PerceptionConfig::default();
        let correspondence = |row: &[f64; 5]| {
            let ray = Unit::new_normalize(Vector3::new(row[3], row[4], self.focal_px));
            let ray_sd_rad = ray_sd_rad(&ray, NOISE_PX / self.focal_px);
            let point = Point3::new(row[0], row[1], row[2]);
            Correspondence { point, depth_sd_m: 0.0, direction_sd_rad: 0.0, ray, ray_sd_rad }
        };
        let correspondences: Vec<_> = self.rows.iter().map(correspondence).collect();
        let config = RansacConfig {
            gate_rad: defaults.gates.error_rad_max,
            n_inliers_min: defaults.gates.n_inliers_min,
            confidence: defaults.confidence,
            iterations_max: 100_000,
        };
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let consensus = match solver {
            "lo_ransac" => lo_ransac(&correspondences, &config, &mut rng),
            "gravity" => {
                let upright = Upright::new(&self.up_camera, &self.up_goal).ok_or("which way is up?")?;
                gravity_ransac(&correspondences, &upright, &config, &mut rng)
            }
            other => return Err(format!("{other}: lo_ransac or gravity").into()),
        };
        let Ok(consensus) = consensus else { return Ok(None) };
        let pose = refine(&consensus.pose, &correspondences, &consensus.inliers, 20);
        let inliers = pose.inliers(&correspondences, config.gate_rad);
        Ok(Some((pose, covariance(&pose, &correspondences, &inliers))))
    }
}

/// Three rays, and a point on each.
type Sample = ([Vector3<f64>; 3], [Point3<f64>; 3]);

/// Nanoseconds per call of the minimal kernels, on samples in front of random poses.
fn kernels() -> Fallible<()> {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let samples: Vec<Sample> = (0..10_000)
        .map(|_| {
            let r = Rotation3::new(Vector3::y() * rng.random_range(-1.0..1.0));
            let p = Vector3::from_fn(|_, _| rng.random_range(-1.0..1.0));
            let rays = [(); 3]
                .map(|()| Vector3::new(rng.random_range(-0.6..0.6), rng.random_range(-0.45..0.45), 1.0).normalize());
            (rays, rays.map(|ray| Point3::from(p + r.inverse() * ray * rng.random_range(1.0..5.0))))
        })
        .collect();
    let upright = Upright::from_tilts(0.0, 0.0).ok_or("which way is up?")?;
    let mut poses = Vec::with_capacity(4);
    let mut cost = |kernel: &dyn Fn(&Sample, &mut Vec<CameraPose>)| {
        let (mut best, mut n_poses) = (f64::INFINITY, 0);
        for _ in 0..20 {
            n_poses = 0;
            let start = Instant::now();
            for sample in &samples {
                poses.clear();
                kernel(black_box(sample), &mut poses);
                n_poses += black_box(&poses).len();
            }
            best = best.min(start.elapsed().as_secs_f64() * 1e9 / samples.len() as f64);
        }
        (best, n_poses as f64 / samples.len() as f64)
    };
    let (p3p_ns, p3p_poses) = cost(&|(rays, points), poses| p3p(rays, points, poses));
    let (up2p_ns, up2p_poses) =
        cost(&|(rays, points), poses| up2p(&[rays[0], rays[1]], &[points[0], points[1]], &upright, poses));
    println!("p3p  {p3p_ns:6.1} ns, {p3p_poses:.2} poses a sample");
    println!("up2p {up2p_ns:6.1} ns, {up2p_poses:.2} poses a sample");
    Ok(())
}
