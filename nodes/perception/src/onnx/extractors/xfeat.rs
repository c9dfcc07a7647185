//! XFeat (Potje, Cadar, Araujo, Martins, Nascimento, "XFeat: Accelerated Features for Lightweight Image Matching", CVPR
//! 2024), in the form its common ONNX exports have: the network alone, without the search for keypoints.

use homing_core::{FeatureExtractor, Features, RgbImage};

use super::{ExtractorConfig, ImageNetwork, check_sizes, features, sides};
use crate::PerceptionError;
use crate::onnx::contract::{Contract, Element, Port, Side};
use crate::onnx::descriptors::{DenseMap, describe};
use crate::onnx::heat::{CELL, LOGITS, heat_from_logits, sample};
use crate::onnx::image::{Pixels, Prepared};
use crate::onnx::keypoints::{PeakRule, keep_strongest, peaks};
use crate::onnx::network::{Network, Output};

/// Length of a descriptor.
pub const DIMENSION: usize = 64;

/// Contract `xfeat`.
pub const CONTRACT: Contract = Contract {
    name: "xfeat",
    inputs: &[Port {
        names: &["input", "images", "image"],
        element: Element::F32,
        shapes: &[&[Side::Is(1), Side::Is(1), Side::Any("H"), Side::Any("W")]],
    }],
    outputs: &[
        Port {
            names: &["output_feats", "feats", "M1"],
            element: Element::F32,
            shapes: &[&[Side::Is(1), Side::Is(DIMENSION), Side::Any("H/8"), Side::Any("W/8")]],
        },
        Port {
            names: &["output_keypoints", "keypoints", "K1"],
            element: Element::F32,
            shapes: &[&[Side::Is(1), Side::Is(LOGITS), Side::Any("H/8"), Side::Any("W/8")]],
        },
        Port {
            names: &["output_heatmap", "heatmaps", "H1"],
            element: Element::F32,
            shapes: &[&[Side::Is(1), Side::Is(1), Side::Any("H/8"), Side::Any("W/8")]],
        },
    ],
    explanation: "The image is the mean of red, green and blue, 0 to 255; a model with a fixed size gets the image resized. \
                  Heat map: softmax over the 65 keypoint logits of a cell, the last dropped, 8x8 pixels a cell. Keypoints are \
                  its local maxima (5x5) over 0.05, their score is heat times the bilinear value of the third output. \
                  Descriptors are sampled bilinearly and brought to unit length.",
};

/// Sides of the image are multiples of this.
const MULTIPLE: usize = 32;
/// As published.
const RULE: PeakRule = PeakRule { radius: 2, min: 0.05, border: 0 };

/// Extractor of contract `xfeat`.
pub struct Xfeat {
    network: ImageNetwork,
    heat: Vec<f32>,
}

impl Xfeat {
    /// Around a network that fulfils [`CONTRACT`].
    #[must_use]
    pub fn new(network: Box<dyn Network>, config: ExtractorConfig) -> Self {
        Self { network: ImageNetwork::new(network, Pixels::MeanOfRgb, MULTIPLE, config), heat: Vec::new() }
    }
}

impl FeatureExtractor for Xfeat {
    type Error = PerceptionError;

    fn name(&self) -> &str {
        CONTRACT.name
    }

    fn extract(&mut self, image: &RgbImage) -> Result<Features, PerceptionError> {
        let Self { network, heat } = self;
        network.extract(image, DIMENSION, |outputs, prepared, config| read(outputs, prepared, config, heat))
    }
}

fn read(
    outputs: &[Output<'_>],
    prepared: &Prepared,
    config: &ExtractorConfig,
    heat: &mut Vec<f32>,
) -> Result<Features, String> {
    let [descriptors, logits, reliability] = outputs else { return Err(format!("{} outputs", outputs.len())) };
    let (columns, rows) = (prepared.width / CELL, prepared.height / CELL);
    check_sizes(&[
        ("features", sides(descriptors), (columns, rows)),
        ("keypoints", sides(logits), (columns, rows)),
        ("heat map", sides(reliability), (columns, rows)),
    ])?;
    heat_from_logits(logits.floats(), columns, rows, heat);
    let mut found = peaks(heat, columns * CELL, rows * CELL, &RULE);
    for peak in &mut found {
        peak.value *= sample(reliability.floats(), columns, rows, CELL as f32, peak.x as f32, peak.y as f32);
    }
    keep_strongest(&mut found, config.keypoints_max);
    let keypoint =
        |p: &crate::onnx::keypoints::Peak| homing_core::Keypoint { x_px: p.x as f32, y_px: p.y as f32, score: p.value };
    let keypoints: Vec<_> = found.iter().map(keypoint).collect();
    let map = DenseMap { planes: descriptors.floats(), dimension: DIMENSION, columns, rows, cell: CELL as f32 };
    let described = describe(&map, &keypoints);
    Ok(features(keypoints, described, DIMENSION))
}
