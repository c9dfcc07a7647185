//! Our own extractor: a heat map at full resolution, descriptors and reliability on cells of 8 x 8 pixels.

use homing_core::{FeatureExtractor, Features, RgbImage};

use super::{ExtractorConfig, ImageNetwork, check_sizes, features, sides};
use crate::PerceptionError;
use crate::onnx::contract::{Contract, Element, Port, Side};
use crate::onnx::descriptors::{DenseMap, describe};
use crate::onnx::heat::{CELL, weigh};
use crate::onnx::image::{Pixels, Prepared};
use crate::onnx::keypoints::{PeakRule, keep_strongest, peaks, refined};
use crate::onnx::network::{Network, Output};

/// Length of a descriptor.
pub const DIMENSION: usize = 64;

/// Contract `homing`.
pub const CONTRACT: Contract = Contract {
    name: "homing",
    inputs: &[Port {
        names: &["image"],
        element: Element::F32,
        shapes: &[&[Side::Is(1), Side::Is(1), Side::Any("H"), Side::Any("W")]],
    }],
    outputs: &[
        Port {
            names: &["heat_map", "heatmap"],
            element: Element::F32,
            shapes: &[&[Side::Is(1), Side::Is(1), Side::Any("H"), Side::Any("W")]],
        },
        Port {
            names: &["descriptors"],
            element: Element::F32,
            shapes: &[&[Side::Is(1), Side::Is(DIMENSION), Side::Any("H/8"), Side::Any("W/8")]],
        },
        Port {
            names: &["reliability"],
            element: Element::F32,
            shapes: &[&[Side::Is(1), Side::Is(1), Side::Any("H/8"), Side::Any("W/8")]],
        },
    ],
    explanation: "The image is luma (BT.601), 0 to 255, its sides multiples of 32. Keypoints are the local maxima (5x5) of \
                  heat map times reliability, to a fraction of a pixel. Descriptors have unit length, are sampled bilinearly \
                  and brought to unit length again.",
};

/// Sides of the image are multiples of this.
const MULTIPLE: usize = 32;
/// A blank cell of a softmax over 65 gives each pixel 0.015 before its reliability.
const RULE: PeakRule = PeakRule { radius: 2, min: 0.01, border: 4 };

/// Extractor of contract `homing`.
pub struct Homing {
    network: ImageNetwork,
    weighted: Vec<f32>,
}

impl Homing {
    /// Around a network that fulfils [`CONTRACT`].
    #[must_use]
    pub fn new(network: Box<dyn Network>, config: ExtractorConfig) -> Self {
        let pixels = Pixels::Luma { range: 255.0 };
        Self { network: ImageNetwork::new(network, pixels, MULTIPLE, config), weighted: Vec::new() }
    }
}

impl FeatureExtractor for Homing {
    type Error = PerceptionError;

    fn name(&self) -> &str {
        CONTRACT.name
    }

    fn extract(&mut self, image: &RgbImage) -> Result<Features, PerceptionError> {
        let Self { network, weighted } = self;
        network.extract(image, DIMENSION, |outputs, prepared, config| read(outputs, prepared, config, weighted))
    }
}

fn read(
    outputs: &[Output<'_>],
    prepared: &Prepared,
    config: &ExtractorConfig,
    weighted: &mut Vec<f32>,
) -> Result<Features, String> {
    let [heat, descriptors, reliability] = outputs else { return Err(format!("{} outputs", outputs.len())) };
    let (width, height) = (prepared.width, prepared.height);
    let (columns, rows) = (width / CELL, height / CELL);
    check_sizes(&[
        ("heat_map", sides(heat), (columns * CELL, rows * CELL)),
        ("descriptors", sides(descriptors), (columns, rows)),
        ("reliability", sides(reliability), (columns, rows)),
    ])?;
    weigh(heat.floats(), reliability.floats(), columns, rows, weighted);
    let mut found = peaks(weighted, width, height, &RULE);
    keep_strongest(&mut found, config.keypoints_max);
    let keypoints: Vec<_> = found.iter().map(|peak| refined(weighted, width, height, peak)).collect();
    let map = DenseMap { planes: descriptors.floats(), dimension: DIMENSION, columns, rows, cell: CELL as f32 };
    let described = describe(&map, &keypoints);
    Ok(features(keypoints, described, DIMENSION))
}
