//! The score of a pose, fast: MSAC on angular errors (Torr and Zisserman, "MLESAC", 2000), sixteen correspondences side by
//! side in single precision. The compiler keeps them in vector registers; every operation is one of IEEE 754's exact ones
//! and in a fixed order, so that all CPUs agree on the bits.

use nalgebra::{Matrix2x3, Vector3};

use super::{CameraPose, Correspondence};

/// Correspondences side by side.
const LANES: usize = 16;

/// One number of each of them.
type Lanes = [f32; LANES];

/// Sixteen correspondences: the point relative to the scorer's centre, and the axes of the goal ray.
#[derive(Copy, Clone)]
struct Block {
    point: [Lanes; 3],
    /// The ray itself, and two axes across it.
    ray: [Lanes; 3],
    across: [[Lanes; 3]; 2],
}

/// Correspondences laid out for scoring.
pub(super) struct Scorer {
    blocks: Vec<Block>,
    /// Mean of the points: single precision resolves a room to a micrometre, wherever the room is.
    centre: Vector3<f64>,
    n: usize,
    inverse_gate: f32,
    /// Fewest that must agree, of those of the first block, of the first two, and so on.
    n_agree_min: Vec<usize>,
}

/// Share of the correspondences that agree with a wrong pose by chance, at most.
const CHANCE: f64 = 0.005;

/// Natural logarithm of how much likelier a wrong pose must be for it to be given up: one right one in twenty is.
const EVIDENCE: f64 = 3.0;

impl Scorer {
    /// `chosen` are indices into `correspondences`, in random order; `gate_rad` is the angle at which an error counts in full, radians.
    pub(super) fn new(correspondences: &[Correspondence], chosen: &[usize], gate_rad: f64) -> Self {
        let sum: Vector3<f64> = chosen.iter().map(|&i| correspondences[i].point.coords).sum();
        let centre = sum / chosen.len().max(1) as f64;
        // A lane left empty has no ray, lies behind every camera and costs 1: `score` starts below zero by as many.
        let zero = [0.0; LANES];
        let empty = Block { point: [zero; 3], ray: [zero; 3], across: [[zero; 3]; 2] };
        let mut blocks = vec![empty; chosen.len().div_ceil(LANES)];
        for (at, &i) in chosen.iter().enumerate() {
            let (block, lane) = (&mut blocks[at / LANES], at % LANES);
            let (point, ray) = (correspondences[i].point.coords - centre, correspondences[i].ray.into_inner());
            let axes = tangent_basis(&ray);
            for k in 0..3 {
                block.point[k][lane] = point[k] as f32;
                block.ray[k][lane] = ray[k] as f32;
                block.across[0][k][lane] = axes[(0, k)] as f32;
                block.across[1][k][lane] = axes[(1, k)] as f32;
            }
        }
        let n_agree_min = vec![0; blocks.len()];
        Self { blocks, centre, n: chosen.len(), inverse_gate: (1.0 / (gate_rad * gate_rad)) as f32, n_agree_min }
    }

    /// From now on poses are of interest with which at least half as many as `n_inliers` agree: samples are noisy. What
    /// [`Self::score_sample`] gives up follows from Wald's sequential probability ratio (Chum and Matas, "Optimal
    /// Randomized RANSAC", PAMI 2008).
    pub(super) fn expect(&mut self, n_inliers: usize) {
        let share = (0.5 * n_inliers as f64 / self.n as f64).min(0.9);
        if share <= 2.0 * CHANCE {
            return;
        }
        let ln = nalgebra::ComplexField::ln;
        let (miss, hit): (f64, f64) = (ln((1.0 - CHANCE) / (1.0 - share)), ln(share / CHANCE));
        for (block, least) in self.n_agree_min.iter_mut().enumerate() {
            let n_seen = ((block + 1) * LANES) as f64;
            // Saturates: what is below zero becomes zero.
            *least = ((n_seen * miss - EVIDENCE) / (miss + hit)).ceil() as usize;
        }
    }

    /// Sum of squared errors in units of the gate, each cut at 1; `None` as soon as it must reach `bound`.
    pub(super) fn score(&self, pose: &CameraPose, bound: f32) -> Option<f32> {
        self.sum(pose, bound, |_, _| true)
    }

    /// The same for a pose made from a sample (positions in `chosen`); `None` also as soon as too few others agree.
    pub(super) fn score_sample(&self, pose: &CameraPose, bound: f32, sample: &[usize]) -> Option<f32> {
        self.sum(pose, bound, |block, n_agree| {
            let least = self.n_agree_min[block];
            // The sample agrees with its own pose, and does not count.
            let own = || sample.iter().filter(|&&at| at < (block + 1) * LANES).count();
            least == 0 || n_agree as usize >= own() + least
        })
    }

    fn sum(&self, pose: &CameraPose, bound: f32, goes_on: impl Fn(usize, u32) -> bool) -> Option<f32> {
        let view = View::of(pose, &self.centre, self.inverse_gate);
        let mut score = self.n as f32 - (self.blocks.len() * LANES) as f32;
        let mut n_agree = 0;
        for (at, block) in self.blocks.iter().enumerate() {
            let (cost, agree) = view.cost(block);
            score += cost;
            n_agree += agree;
            // Written so that a NaN ends it, too.
            if !(score < bound && goes_on(at, n_agree)) {
                return None;
            }
        }
        Some(score)
    }
}

/// A pose in single precision.
struct View {
    /// Rows of the rotation, and the translation, that map points relative to the centre to the goal camera.
    rows: [[f32; 3]; 3],
    t: [f32; 3],
    inverse_gate: f32,
}

impl View {
    fn of(pose: &CameraPose, centre: &Vector3<f64>, inverse_gate: f32) -> Self {
        let t = pose.r * (centre - pose.p);
        let row = |k: usize| [pose.r[(k, 0)] as f32, pose.r[(k, 1)] as f32, pose.r[(k, 2)] as f32];
        Self { rows: [row(0), row(1), row(2)], t: [t.x as f32, t.y as f32, t.z as f32], inverse_gate }
    }

    /// Sum of the costs, and how many are within the gate.
    fn cost(&self, block: &Block) -> (f32, u32) {
        let [r0, r1, r2] = &self.rows;
        let [x, y, z] = &block.point;
        let mut costs = [0.0_f32; LANES];
        for lane in 0..LANES {
            let q = [
                r0[0] * x[lane] + r0[1] * y[lane] + r0[2] * z[lane] + self.t[0],
                r1[0] * x[lane] + r1[1] * y[lane] + r1[2] * z[lane] + self.t[1],
                r2[0] * x[lane] + r2[1] * y[lane] + r2[2] * z[lane] + self.t[2],
            ];
            let dot = |axis: &[Lanes; 3]| axis[0][lane] * q[0] + axis[1][lane] * q[1] + axis[2][lane] * q[2];
            // The squared tangent of the angle between the prediction and the seen ray.
            let (ahead, first, second) = (dot(&block.ray), dot(&block.across[0]), dot(&block.across[1]));
            let (square, error) = (ahead * ahead, (first * first + second * second) * self.inverse_gate);
            costs[lane] = if ahead > 0.0 && error < square { error / square } else { 1.0 };
        }
        let mut n_agree = 0_u32;
        for cost in &costs {
            n_agree += u32::from(*cost < 1.0);
        }
        // By halves: the compiler adds whole registers.
        let mut width = LANES / 2;
        while width > 0 {
            for lane in 0..width {
                costs[lane] += costs[lane + width];
            }
            width /= 2;
        }
        (costs[0], n_agree)
    }
}

/// Two orthonormal rows that span the plane across a unit ray.
pub(super) fn tangent_basis(ray: &Vector3<f64>) -> Matrix2x3<f64> {
    let axis = Vector3::ith(ray.iamin(), 1.0);
    let first = ray.cross(&axis).normalize();
    let second = ray.cross(&first);
    Matrix2x3::from_rows(&[first.transpose(), second.transpose()])
}
