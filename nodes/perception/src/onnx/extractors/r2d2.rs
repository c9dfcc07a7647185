//! R2D2 (Revaud, Weinzaepfel, de Souza, Humenberger, "R2D2: Repeatable and Reliable Detector and Descriptor", NeurIPS 2019)
//! at a single scale: dense descriptors, reliability and repeatability.

use homing_core::{FeatureExtractor, Features, Keypoint, RgbImage};

use super::{ExtractorConfig, ImageNetwork, check_sizes, features, sides};
use crate::PerceptionError;
use crate::onnx::contract::{Contract, Element, Port, Side};
use crate::onnx::descriptors::{DenseMap, describe};
use crate::onnx::image::{Pixels, Prepared};
use crate::onnx::keypoints::{PeakRule, keep_strongest, peaks};
use crate::onnx::network::{Network, Output};

/// Length of a descriptor.
pub const DIMENSION: usize = 128;

/// Contract `r2d2`.
pub const CONTRACT: Contract = Contract {
    name: "r2d2",
    inputs: &[Port {
        names: &["image", "imgs", "input"],
        element: Element::F32,
        shapes: &[&[Side::Is(1), Side::Is(3), Side::Any("H"), Side::Any("W")]],
    }],
    outputs: &[
        Port {
            names: &["descriptors"],
            element: Element::F32,
            shapes: &[&[Side::Is(1), Side::Is(DIMENSION), Side::Any("H"), Side::Any("W")]],
        },
        Port {
            names: &["reliability"],
            element: Element::F32,
            shapes: &[&[Side::Is(1), Side::Is(1), Side::Any("H"), Side::Any("W")]],
        },
        Port {
            names: &["repeatability"],
            element: Element::F32,
            shapes: &[&[Side::Is(1), Side::Is(1), Side::Any("H"), Side::Any("W")]],
        },
    ],
    explanation: "The image is red, green and blue, 0 to 1, less ImageNet's mean and over its deviation; one scale. Keypoints \
                  are local maxima (3x3) of the repeatability where both maps reach 0.7, their score is the product of the \
                  two. The maps are of the image's size; the descriptors may instead have a cell for every 8x8 pixels.",
};

/// ImageNet's mean and deviation per channel.
const PIXELS: Pixels = Pixels::Rgb { mean: [0.485, 0.456, 0.406], sd: [0.229, 0.224, 0.225] };
/// Sides of the image are multiples of this: a pyramid down to 1/32 needs no less.
const MULTIPLE: usize = 32;
/// Side of a cell of descriptors that are not of the image's size, pixels.
const CELL: usize = 8;
/// As published, like the rule.
const RELIABILITY_MIN: f32 = 0.7;
const RULE: PeakRule = PeakRule { radius: 1, min: 0.7, border: 0 };

/// Extractor of contract `r2d2`.
pub struct R2d2 {
    network: ImageNetwork,
}

impl R2d2 {
    /// Around a network that fulfils [`CONTRACT`].
    #[must_use]
    pub fn new(network: Box<dyn Network>, config: ExtractorConfig) -> Self {
        Self { network: ImageNetwork::new(network, PIXELS, MULTIPLE, config) }
    }
}

impl FeatureExtractor for R2d2 {
    type Error = PerceptionError;

    fn name(&self) -> &str {
        CONTRACT.name
    }

    fn extract(&mut self, image: &RgbImage) -> Result<Features, PerceptionError> {
        self.network.extract(image, DIMENSION, read)
    }
}

fn read(outputs: &[Output<'_>], prepared: &Prepared, config: &ExtractorConfig) -> Result<Features, String> {
    let [descriptors, reliability, repeatability] = outputs else { return Err(format!("{} outputs", outputs.len())) };
    let (width, height) = (prepared.width, prepared.height);
    let cell = if sides(descriptors) == (width, height) { 1 } else { CELL };
    check_sizes(&[
        ("descriptors", sides(descriptors), (width / cell, height / cell)),
        ("reliability", sides(reliability), (width, height)),
        ("repeatability", sides(repeatability), (width, height)),
    ])?;
    let mut found = peaks(repeatability.floats(), width, height, &RULE);
    let reliable = |x: usize, y: usize| reliability.floats()[y * width + x];
    found.retain(|peak| reliable(peak.x, peak.y) >= RELIABILITY_MIN);
    for peak in &mut found {
        peak.value *= reliable(peak.x, peak.y);
    }
    keep_strongest(&mut found, config.keypoints_max);
    let keypoints: Vec<Keypoint> =
        found.iter().map(|p| Keypoint { x_px: p.x as f32, y_px: p.y as f32, score: p.value }).collect();
    let (columns, rows) = sides(descriptors);
    let map = DenseMap { planes: descriptors.floats(), dimension: DIMENSION, columns, rows, cell: cell as f32 };
    let described = describe(&map, &keypoints);
    Ok(features(keypoints, described, DIMENSION))
}
