//! Mutual nearest neighbours with the dual-softmax probability as confidence (Rocco et al., NeurIPS 2018; Sun et al.,
//! "LoFTR", CVPR 2021, eq. 3): how much more alike a pair is than either point is to any other.

use homing_core::{FeatureMatch, Features, Matcher};
use nalgebra::{DMatrix, DMatrixView};

use crate::PerceptionError;
use crate::onnx::heat::exp;

/// Pairs keypoints that are each other's most probable partner, and probable enough.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct DualSoftmax {
    /// Similarities (cosines) are multiplied by this before the softmax: the inverse temperature.
    pub scale: f32,
    /// Smallest probability of a match.
    pub confidence_min: f32,
}

impl Default for DualSoftmax {
    /// The scale is the one that descriptors are commonly trained with.
    fn default() -> Self {
        Self { scale: 20.0, confidence_min: 0.1 }
    }
}

impl Matcher for DualSoftmax {
    type Error = PerceptionError;

    fn name(&self) -> &str {
        "dual-softmax"
    }

    fn match_features(&mut self, query: &Features, goal: &Features) -> Result<Vec<FeatureMatch>, PerceptionError> {
        let (n_query, n_goal) = (query.keypoints.len(), goal.keypoints.len());
        if n_query == 0 || n_goal == 0 {
            return Ok(Vec::new());
        }
        if query.dimension != goal.dimension {
            return Err(PerceptionError::Dimension { query: query.dimension, goal: goal.dimension });
        }
        for (n, features) in [(n_query, query), (n_goal, goal)] {
            let (expected, found) = (n * features.dimension, features.descriptors.len());
            if expected != found {
                return Err(PerceptionError::Features { keypoints: n, expected, found });
            }
        }
        let weights = self.weights(query, goal);
        Ok(mutual_best(&weights, self.confidence_min))
    }
}

impl DualSoftmax {
    /// exp(scale (similarity - 1)): at most 1 for unit descriptors. One column per query keypoint, one row per goal's.
    fn weights(&self, query: &Features, goal: &Features) -> DMatrix<f32> {
        let dimension = query.dimension;
        let goals = DMatrixView::from_slice(&goal.descriptors, dimension, goal.keypoints.len()).transpose();
        let queries = DMatrixView::from_slice(&query.descriptors, dimension, query.keypoints.len());
        let mut weights = DMatrix::<f32>::zeros(goals.nrows(), queries.ncols());
        weights.gemm(self.scale, &goals, &queries, 0.0);
        for weight in weights.as_mut_slice() {
            *weight = exp(*weight - self.scale);
        }
        weights
    }
}

/// With E the weights, the probability of a pair is E_ij / sum_i E_ij * E_ij / sum_j E_ij.
fn mutual_best(weights: &DMatrix<f32>, confidence_min: f32) -> Vec<FeatureMatch> {
    let (n_goal, n_query) = weights.shape();
    let column_sums: Vec<f32> = weights.column_iter().map(|column| column.as_slice().iter().sum()).collect();
    let mut inverse_row_sums = vec![0.0_f32; n_goal];
    for column in weights.column_iter() {
        for (sum, weight) in inverse_row_sums.iter_mut().zip(column.as_slice()) {
            *sum += weight;
        }
    }
    for sum in &mut inverse_row_sums {
        *sum = 1.0 / *sum;
    }
    let mut of_goal = vec![(0.0_f32, 0_usize); n_goal];
    let mut of_query = vec![(0.0_f32, 0_usize); n_query];
    for (q, (column, sum)) in weights.column_iter().zip(&column_sums).enumerate() {
        let inverse = 1.0 / sum;
        let pairs = column.as_slice().iter().zip(&inverse_row_sums).zip(&mut of_goal);
        for (g, ((&weight, &row), best)) in pairs.enumerate() {
            let probability = weight * inverse * (weight * row);
            if probability > of_query[q].0 {
                of_query[q] = (probability, g);
            }
            if probability > best.0 {
                *best = (probability, q);
            }
        }
    }
    let matches = of_query.iter().enumerate();
    matches
        .filter(|&(q, &(probability, g))| probability >= confidence_min && probability > 0.0 && of_goal[g].1 == q)
        .map(|(query, &(probability, goal))| FeatureMatch { query, goal, confidence: probability.min(1.0) })
        .collect()
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "tests")]
mod tests {
    use homing_core::Keypoint;

    use super::*;
    use crate::onnx::descriptors::normalise;

    /// n descriptors that follow from the seed, each its own.
    fn features(n: usize, seed: usize) -> Features {
        let random = |i: usize| {
            let mixed = ((i + 1_000_003 * seed) as u32).wrapping_mul(0x9e37_79b9);
            ((mixed ^ (mixed >> 15)).wrapping_mul(0x85eb_ca6b) >> 8) as f32 / (1 << 24) as f32 - 0.5
        };
        let mut descriptors: Vec<f32> = (0..n * 64).map(random).collect();
        descriptors.chunks_exact_mut(64).for_each(normalise);
        let keypoints = vec![Keypoint { x_px: 0.0, y_px: 0.0, score: 1.0 }; n];
        Features { keypoints, descriptors, dimension: 64, ..Features::default() }
    }

    #[test]
    fn each_finds_its_own_among_others_in_another_order() {
        let query = features(200, 1);
        let mut goal = query.clone();
        let turned: Vec<f32> = query.descriptors.chunks_exact(64).rev().flatten().copied().collect();
        goal.descriptors = turned;
        let matches = DualSoftmax::default().match_features(&query, &goal).unwrap();
        assert_eq!(matches.len(), 200);
        assert!(matches.iter().all(|m| m.goal == 199 - m.query && m.confidence > 0.5));
    }

    #[test]
    fn a_point_that_is_there_twice_is_unsure() {
        let query = features(50, 1);
        let mut goal = query.clone();
        goal.descriptors.copy_within(0..64, 64);
        let matches =
            DualSoftmax { confidence_min: 0.6, ..DualSoftmax::default() }.match_features(&query, &goal).unwrap();
        assert!(matches.iter().all(|m| m.query > 1), "{matches:?}");
        assert_eq!(matches.len(), 48);
    }

    #[test]
    fn nothing_matches_nothing_and_lengths_must_agree() {
        let mut matcher = DualSoftmax::default();
        assert!(matcher.match_features(&features(0, 1), &features(9, 1)).unwrap().is_empty());
        let short = Features { dimension: 32, ..features(4, 1) };
        assert!(matches!(
            matcher.match_features(&short, &features(4, 1)),
            Err(PerceptionError::Dimension { query: 32, goal: 64 })
        ));
        let cut = Features { descriptors: vec![0.0; 3], ..features(4, 1) };
        assert!(matches!(matcher.match_features(&features(4, 1), &cut), Err(PerceptionError::Features { .. })));
        let blank = Features { descriptors: vec![f32::NAN; 256], ..features(4, 1) };
        assert!(matcher.match_features(&features(4, 1), &blank).unwrap().is_empty());
    }
}
