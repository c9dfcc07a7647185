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
}

impl Scorer {
    /// `chosen` are indices into `correspondences`; `gate_rad` is the angle at which an error counts in full, radians.
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
        Self { blocks, centre, n: chosen.len(), inverse_gate: (1.0 / (gate_rad * gate_rad)) as f32 }
    }

    /// Sum of squared errors in units of the gate, each cut at 1; `None` as soon as it must reach `bound`.
    pub(super) fn score(&self, pose: &CameraPose, bound: f32) -> Option<f32> {
        let r = pose.r.map(|x| x as f32);
        let t = (pose.r * (self.centre - pose.p)).map(|x| x as f32);
        let mut score = self.n as f32 - (self.blocks.len() * LANES) as f32;
        for block in &self.blocks {
            score += block.cost(&r, &t, self.inverse_gate);
            // Written so that a NaN ends it, too.
            if !(score < bound) {
                return None;
            }
        }
        Some(score)
    }
}

impl Block {
    fn cost(&self, r: &nalgebra::Matrix3<f32>, t: &Vector3<f32>, inverse_gate: f32) -> f32 {
        let mut costs = [0.0_f32; LANES];
        for lane in 0..LANES {
            let point = [self.point[0][lane], self.point[1][lane], self.point[2][lane]];
            let q = [0, 1, 2].map(|k| r[(k, 0)] * point[0] + r[(k, 1)] * point[1] + r[(k, 2)] * point[2] + t[k]);
            let dot = |axis: &[Lanes; 3]| axis[0][lane] * q[0] + axis[1][lane] * q[1] + axis[2][lane] * q[2];
            // The squared tangent of the angle between the prediction and the seen ray.
            let (ahead, first, second) = (dot(&self.ray), dot(&self.across[0]), dot(&self.across[1]));
            let (square, error) = (ahead * ahead, (first * first + second * second) * inverse_gate);
            costs[lane] = if ahead > 0.0 && error < square { error / square } else { 1.0 };
        }
        let mut width = LANES / 2;
        while width > 0 {
            for lane in 0..width {
                costs[lane] += costs[lane + width];
            }
            width /= 2;
        }
        costs[0]
    }
}

/// Two orthonormal rows that span the plane across a unit ray.
pub(super) fn tangent_basis(ray: &Vector3<f64>) -> Matrix2x3<f64> {
    let axis = Vector3::ith(ray.iamin(), 1.0);
    let first = ray.cross(&axis).normalize();
    let second = ray.cross(&first);
    Matrix2x3::from_rows(&[first.transpose(), second.transpose()])
}
