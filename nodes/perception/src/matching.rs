//! Mutual nearest neighbours with Lowe's ratio test.

use homing_core::{FeatureMatch, Features, Keypoint, Matcher};
use nalgebra::{DMatrix, DMatrixView};

use crate::PerceptionError;

/// Queries compared at a time: their similarities to all goal keypoints stay in the cache.
const BLOCK: usize = 128;

/// A second neighbour this close to the first shows the same point in another orientation or scale, and says nothing
/// about ambiguity. Pixels.
const SAME_POINT_PX: f32 = 3.0;

/// Pairs keypoints that are each other's nearest by descriptor and clearly nearer than the next.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct MutualNearest {
    /// Largest ratio between the distances to the nearest and to the second nearest. 1 switches the test off.
    pub ratio_max: f32,
}

impl Default for MutualNearest {
    fn default() -> Self {
        Self { ratio_max: 0.85 }
    }
}

impl Matcher for MutualNearest {
    type Error = PerceptionError;

    fn name(&self) -> &str {
        "mutual-nearest"
    }

    fn match_features(&mut self, query: &Features, goal: &Features) -> Result<Vec<FeatureMatch>, PerceptionError> {
        check(query)?;
        check(goal)?;
        if query.keypoints.is_empty() || goal.keypoints.is_empty() {
            return Ok(Vec::new());
        }
        if query.dimension != goal.dimension {
            return Err(PerceptionError::Dimension { query: query.dimension, goal: goal.dimension });
        }
        let nearest = Nearest::search(query, goal);
        let matches = nearest.of_query.iter().enumerate().filter_map(|(q, near)| {
            let ratio = (near.squared.max(0.0) / near.second_squared.max(1e-12)).sqrt();
            let mutual = nearest.of_goal[near.index].0 == q;
            (mutual && ratio <= self.ratio_max).then(|| FeatureMatch {
                query: q,
                goal: near.index,
                confidence: (1.0 - ratio).clamp(0.0, 1.0),
            })
        });
        Ok(matches.collect())
    }
}

fn check(features: &Features) -> Result<(), PerceptionError> {
    let (keypoints, found) = (features.keypoints.len(), features.descriptors.len());
    let expected = keypoints * features.dimension;
    if expected == found { Ok(()) } else { Err(PerceptionError::Features { keypoints, expected, found }) }
}

/// The goal keypoint nearest to a query.
struct Near {
    index: usize,
    squared: f32,
    second_squared: f32,
}

struct Nearest {
    of_query: Vec<Near>,
    /// Per goal keypoint: nearest query and its similarity.
    of_goal: Vec<(usize, f32)>,
}

impl Nearest {
    /// For unit descriptors |a - b|^2 = 2 - 2 a.b, so one matrix product gives all distances.
    fn search(query: &Features, goal: &Features) -> Self {
        let dimension = query.dimension;
        let goals = DMatrixView::from_slice(&goal.descriptors, dimension, goal.keypoints.len()).transpose();
        let mut of_query = Vec::with_capacity(query.keypoints.len());
        let mut of_goal = vec![(0, f32::NEG_INFINITY); goal.keypoints.len()];
        let mut similarity = DMatrix::<f32>::zeros(goal.keypoints.len(), BLOCK);
        for block in query.descriptors.chunks(BLOCK * dimension) {
            let queries = DMatrixView::from_slice(block, dimension, block.len() / dimension);
            let mut product = similarity.columns_mut(0, queries.ncols());
            product.gemm(1.0, &goals, &queries, 0.0);
            for column in product.column_iter() {
                let (similarities, q) = (column.as_slice(), of_query.len());
                for (best, &s) in of_goal.iter_mut().zip(similarities) {
                    if s > best.1 {
                        *best = (q, s);
                    }
                }
                of_query.push(nearest(similarities, &goal.keypoints));
            }
        }
        Self { of_query, of_goal }
    }
}

/// The most similar keypoint, and the squared distance to the most similar one elsewhere in the image.
fn nearest(similarities: &[f32], keypoints: &[Keypoint]) -> Near {
    let (mut index, mut best) = (0, f32::NEG_INFINITY);
    for (i, &s) in similarities.iter().enumerate() {
        if s > best {
            (index, best) = (i, s);
        }
    }
    let at = keypoints[index];
    let mut second = -1.0_f32;
    for (k, &s) in keypoints.iter().zip(similarities) {
        if s > second && (k.x_px - at.x_px).abs().max((k.y_px - at.y_px).abs()) > SAME_POINT_PX {
            second = s;
        }
    }
    Near { index, squared: 2.0 - 2.0 * best, second_squared: 2.0 - 2.0 * second }
}
