//! Models that search for their keypoints themselves: n positions, n scores, n descriptors.

use homing_core::{Features, Keypoint};

use super::{ExtractorConfig, features};
use crate::onnx::contract::{Element, Port, Side};
use crate::onnx::descriptors::normalise;
use crate::onnx::network::Output;

/// The three outputs; positions and descriptors as the model has them.
pub(super) const fn outputs(positions: Element, descriptors: &'static [&'static [Side]]) -> [Port; 3] {
    [
        Port { names: &["keypoints"], element: positions, shapes: &[&[ONE, N, Side::Is(2)], &[N, Side::Is(2)]] },
        Port { names: &["scores"], element: Element::F32, shapes: &[&[ONE, N], &[N]] },
        Port { names: &["descriptors"], element: Element::F32, shapes: descriptors },
    ]
}

/// The axis of a batch of one.
pub(super) const ONE: Side = Side::Is(1);
/// The axis of the keypoints.
pub(super) const N: Side = Side::Any("N");

/// Strongest first, in pixels of the tensor; `to_pixel` maps what the model calls a position.
pub(super) fn read(
    outputs: &[Output<'_>],
    config: &ExtractorConfig,
    to_pixel: impl Fn(f32, f32) -> (f32, f32),
) -> Result<Features, String> {
    let [positions, scores, descriptors] = outputs else { return Err(format!("{} outputs", outputs.len())) };
    let (n, dimension) = match descriptors.shape[..] {
        [.., n, dimension] => (n, dimension),
        _ => (0, 0),
    };
    let counts = (elements(positions) / 2, elements(scores));
    if counts != (n, n) {
        return Err(format!("{} positions, {} scores and {n} descriptors", counts.0, counts.1));
    }
    let score = |i: usize| scores.number(i);
    let mut order: Vec<usize> = (0..n).filter(|&i| score(i).is_finite()).collect();
    order.sort_by(|&i, &j| score(j).total_cmp(&score(i)).then(i.cmp(&j)));
    order.truncate(config.keypoints_max);
    let mut keypoints = Vec::with_capacity(order.len());
    let mut kept = Vec::with_capacity(order.len() * dimension);
    for i in order {
        let (x_px, y_px) = to_pixel(positions.number(2 * i), positions.number(2 * i + 1));
        if x_px.is_finite() && y_px.is_finite() {
            keypoints.push(Keypoint { x_px, y_px, score: score(i) });
            kept.extend_from_slice(&descriptors.floats()[i * dimension..(i + 1) * dimension]);
        }
    }
    if dimension > 0 {
        kept.chunks_exact_mut(dimension).for_each(normalise);
    }
    Ok(features(keypoints, kept, dimension))
}

fn elements(output: &Output<'_>) -> usize {
    output.shape.iter().product()
}
