//! LO-RANSAC with the MSAC score on angular errors: three points make a pose, every new best is refined on all that
//! agree with it (Chum, Matas, Kittler, "Locally optimized RANSAC", DAGM 2003; Torr and Zisserman, "MLESAC", 2000).

use nalgebra::ComplexField;
use rand::{Rng, RngExt};

use super::{CameraPose, Correspondence, p3p, refine};

/// How hard to search for a consensus.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct RansacConfig {
    /// Largest angular error of an inlier, radians.
    pub gate_rad: f64,
    /// Fewest inliers of interest: the search ends once such a set would have been found.
    pub n_inliers_min: usize,
    /// Probability of drawing at least one sample of inliers alone.
    pub confidence: f64,
    /// Most samples drawn.
    pub iterations_max: usize,
}

/// The pose most correspondences agree on.
#[derive(Clone, Debug, PartialEq)]
pub struct Consensus {
    /// The pose.
    pub pose: CameraPose,
    /// Indices of the correspondences within the gate.
    pub inliers: Vec<usize>,
    /// Samples drawn.
    pub iterations: usize,
}

/// Steps of each local optimisation.
const LOCAL_STEPS: usize = 5;

/// Searches the pose with the best MSAC score. `None` if fewer than `n_inliers_min` (at least 3) agree with any.
pub fn lo_ransac(correspondences: &[Correspondence], config: &RansacConfig, rng: &mut impl Rng) -> Option<Consensus> {
    let n = correspondences.len();
    let n_min = config.n_inliers_min.max(3);
    if n < n_min {
        return None;
    }
    let gate = config.gate_rad * config.gate_rad;
    let mut best: Option<(f64, CameraPose)> = None;
    let mut candidates = Vec::with_capacity(4);
    let mut needed = iterations_needed(n_min, n, config);
    let mut iterations = 0;
    while iterations < needed {
        iterations += 1;
        sample_poses(correspondences, rng, &mut candidates);
        for pose in candidates.drain(..) {
            let bound = best.as_ref().map_or(n as f64, |(score, _)| *score);
            let Some(score) = msac(&pose, correspondences, gate, bound) else { continue };
            best = Some(optimise_locally(pose, score, correspondences, config.gate_rad));
            let n_inliers = best.as_ref().map_or(0, |(_, pose)| pose.inliers(correspondences, config.gate_rad).len());
            needed = needed.min(iterations_needed(n_inliers.max(n_min), n, config));
        }
    }
    let (_, pose) = best?;
    let inliers = pose.inliers(correspondences, config.gate_rad);
    (inliers.len() >= n_min).then_some(Consensus { pose, inliers, iterations })
}

/// Samples after which one of three inliers has been drawn with the wanted confidence.
fn iterations_needed(n_inliers: usize, n: usize, config: &RansacConfig) -> usize {
    let draw = |k: usize| (n_inliers - k) as f64 / (n - k) as f64;
    let all_inliers = draw(0) * draw(1) * draw(2);
    if all_inliers > 0.999 {
        return 1;
    }
    let needed = ComplexField::ln(1.0 - config.confidence) / ComplexField::ln_1p(-all_inliers);
    // Saturates: a float beyond usize becomes its maximum.
    (needed.ceil() as usize).clamp(1, config.iterations_max)
}

fn sample_poses(correspondences: &[Correspondence], rng: &mut impl Rng, poses: &mut Vec<CameraPose>) {
    let n = correspondences.len();
    let i = rng.random_range(0..n);
    let j = (i + rng.random_range(1..n)) % n;
    let k = loop {
        let k = rng.random_range(0..n);
        if k != i && k != j {
            break k;
        }
    };
    let sample = [i, j, k].map(|i| &correspondences[i]);
    p3p(&sample.map(|c| c.ray.into_inner()), &sample.map(|c| c.point), poses);
}

/// Sum of squared errors in units of the gate, each cut at 1; `None` once it reaches `bound`.
fn msac(pose: &CameraPose, correspondences: &[Correspondence], gate: f64, bound: f64) -> Option<f64> {
    let mut score = 0.0;
    for correspondence in correspondences {
        score += (pose.squared_error(correspondence) / gate).min(1.0);
        if score >= bound {
            return None;
        }
    }
    Some(score)
}

/// Refines on what agrees, as long as the score falls.
fn optimise_locally(
    mut pose: CameraPose,
    mut score: f64,
    correspondences: &[Correspondence],
    gate_rad: f64,
) -> (f64, CameraPose) {
    for _ in 0..3 {
        let inliers = pose.inliers(correspondences, gate_rad);
        if inliers.len() < 4 {
            break;
        }
        let refined = refine(&pose, correspondences, &inliers, LOCAL_STEPS);
        let Some(better) = msac(&refined, correspondences, gate_rad * gate_rad, score) else { break };
        (pose, score) = (refined, better);
    }
    (score, pose)
}
