//! The local optimisation inside RANSAC: Gauss-Newton on the squared angular errors of all that agree (Chum, Matas,
//! Kittler, "Locally optimized RANSAC", DAGM 2003), that is, on the score itself: the truncated loss of MSAC.

use nalgebra::{Matrix6, Rotation3, Vector3, Vector6};

use super::scorer::{Scorer, tangent_basis};
use super::{CameraPose, Correspondence};

/// One correspondence with the axes of its ray, ready to be linearised.
struct Sight {
    point: Vector3<f64>,
    ray: Vector3<f64>,
    across: [Vector3<f64>; 2],
}

/// The correspondences of one problem.
pub(super) struct LocalOptimizer {
    sights: Vec<Sight>,
    gate: f64,
}

/// Gauss-Newton steps of one optimisation. Most end earlier.
const STEPS: usize = 8;

/// Share of the score that a step must gain for another to follow.
const GAIN_MIN: f32 = 1e-3;

impl LocalOptimizer {
    pub(super) fn new(correspondences: &[Correspondence], chosen: &[usize], gate_rad: f64) -> Self {
        let sight = |&i: &usize| {
            let c = &correspondences[i];
            let axes = tangent_basis(c.ray.as_ref());
            let across = [axes.row(0).transpose(), axes.row(1).transpose()];
            Sight { point: c.point.coords, ray: c.ray.into_inner(), across }
        };
        Self { sights: chosen.iter().map(sight).collect(), gate: gate_rad * gate_rad }
    }

    /// Follows the score down from a pose and its score; gives the best pose met.
    pub(super) fn optimise(&self, pose: CameraPose, score: f32, scorer: &Scorer) -> (f32, CameraPose) {
        let (mut best, mut best_score) = (pose, score);
        for step in 0..STEPS {
            // A pose made from three noisy points is off by more than the noise: the first step looks further.
            let gate = if step == 0 { 4.0 * self.gate } else { self.gate };
            let Some(moved) = self.step(&best, gate) else { break };
            let Some(better) = scorer.score(&moved, best_score) else { if step == 0 { continue } else { break } };
            let gain = best_score - better;
            (best, best_score) = (moved, better);
            if gain < GAIN_MIN * best_score && step > 0 {
                break;
            }
        }
        (best_score, best)
    }

    /// One Gauss-Newton step on what agrees. `None` if that does not fix the pose.
    fn step(&self, pose: &CameraPose, gate: f64) -> Option<CameraPose> {
        let (mut hessian, mut gradient, mut n) = ([[0.0; 6]; 6], [0.0; 6], 0);
        for sight in &self.sights {
            let q = pose.r * (sight.point - pose.p);
            let ahead = sight.ray.dot(&q);
            let error = sight.across.each_ref().map(|axis| axis.dot(&q));
            // Compares false for what lies behind, and for a NaN.
            if !(ahead > 0.0 && error[0] * error[0] + error[1] * error[1] < gate * ahead * ahead) {
                continue;
            }
            n += 1;
            for (axis, error) in sight.across.iter().zip(error) {
                let tangent = error / ahead;
                // d tangent = slope . dq, and the goal's camera axes turn by w and shift by s: dq = w x q + s.
                let slope = (axis - sight.ray * tangent) / ahead;
                let turn = q.cross(&slope);
                let row = [turn.x, turn.y, turn.z, slope.x, slope.y, slope.z];
                for i in 0..6 {
                    for j in 0..=i {
                        hessian[i][j] += row[i] * row[j];
                    }
                    gradient[i] += row[i] * tangent;
                }
            }
        }
        if n < 3 {
            return None;
        }
        let lower = Matrix6::from_fn(|i, j| hessian[i.max(j)][i.min(j)]);
        let damped = lower + Matrix6::from_diagonal_element(1e-9 * lower.trace());
        let step: Vector6<f64> = damped.cholesky()?.solve(&-Vector6::from(gradient));
        let turn = Rotation3::new(Vector3::new(step[0], step[1], step[2]));
        let r = turn.matrix() * pose.r;
        let moved = CameraPose { r, p: pose.p - r.tr_mul(&Vector3::new(step[3], step[4], step[5])) };
        moved.is_rigid().then_some(moved)
    }
}
