//! Guided matching: with a first pose, each keypoint with depth is looked for only where it must be in the goal photo.
//! Points that the ratio test gave up as ambiguous among the whole image are found again, and the pose gets its support
//! from all over the image.

use homing_core::Features;
use nalgebra::{Point3, Vector3};

use crate::pnp::CameraPose;

/// Keypoints of both images in the form guided matching needs.
pub(crate) struct Scene<'a> {
    pub query: &'a Features,
    pub goal: &'a Features,
    /// Points of the query's keypoints that have a trusted depth: (keypoint, point in the robot's camera).
    pub points: &'a [(usize, Point3<f64>)],
    /// Unit ray of every goal keypoint.
    pub goal_rays: &'a [Vector3<f64>],
}

/// Pairs (query, goal) that are each other's most similar within `window_rad` of the prediction, and at least
/// `similarity_min` alike (dot product of descriptors).
pub(crate) fn guided_matches(
    scene: &Scene<'_>,
    pose: &CameraPose,
    window_rad: f64,
    similarity_min: f32,
) -> Vec<(usize, usize)> {
    let cos_min = nalgebra::ComplexField::cos(window_rad);
    let mut of_goal: Vec<Option<(usize, f32)>> = vec![None; scene.goal_rays.len()];
    let mut of_query = Vec::new();
    for (q, point) in scene.points {
        let Some(predicted) = pose.to_goal(point).try_normalize(1e-9) else { continue };
        let descriptor = row(scene.query, *q);
        let mut best: Option<(usize, f32)> = None;
        for (g, ray) in scene.goal_rays.iter().enumerate() {
            if predicted.dot(ray) < cos_min {
                continue;
            }
            let similarity = dot(descriptor, row(scene.goal, g));
            if best.is_none_or(|(_, s)| similarity > s) {
                best = Some((g, similarity));
            }
            if of_goal[g].is_none_or(|(_, s)| similarity > s) {
                of_goal[g] = Some((*q, similarity));
            }
        }
        of_query.extend(best.filter(|(_, s)| *s >= similarity_min).map(|(g, _)| (*q, g)));
    }
    of_query.retain(|&(q, g)| of_goal[g].is_some_and(|(best, _)| best == q));
    of_query
}

/// Dot product of the descriptors of a pair.
pub(crate) fn similarity(query: &Features, goal: &Features, (q, g): (usize, usize)) -> f32 {
    dot(row(query, q), row(goal, g))
}

fn row(features: &Features, i: usize) -> &[f32] {
    &features.descriptors[i * features.dimension..(i + 1) * features.dimension]
}

/// Eight sums side by side: the compiler keeps them in vector registers, and the order of summation is fixed.
fn dot(a: &[f32], b: &[f32]) -> f32 {
    let mut sums = [0.0_f32; 8];
    let (chunks_a, chunks_b) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f32 = chunks_a.remainder().iter().zip(chunks_b.remainder()).map(|(x, y)| x * y).sum();
    for (x, y) in chunks_a.zip(chunks_b) {
        for k in 0..8 {
            sums[k] += x[k] * y[k];
        }
    }
    sums.iter().sum::<f32>() + rest
}
