//! ALIKED (Zhao, Wu, Chen, Chen, Xu, Lee, "ALIKED: A Lighter Keypoint and Descriptor Extraction Network via Deformable
//! Transformation", IEEE T-IM 2023), in the form of its ONNX exports: positions from -1 to 1, found inside the model.

use homing_core::{FeatureExtractor, Features, RgbImage};

use super::sparse::{N, ONE};
use super::{ExtractorConfig, ImageNetwork, sparse};
use crate::PerceptionError;
use crate::onnx::contract::{Contract, Element, Port, Side};
use crate::onnx::image::Pixels;
use crate::onnx::network::Network;

/// Length of a descriptor; the smallest variant (t16) has 64.
pub const DIMENSION: usize = 128;

/// Contract `aliked`.
pub const CONTRACT: Contract = Contract {
    name: "aliked",
    inputs: &[Port {
        names: &["image"],
        element: Element::F32,
        shapes: &[&[Side::Is(1), Side::Is(3), Side::Any("H"), Side::Any("W")]],
    }],
    outputs: &sparse::outputs(Element::F32, &[&[ONE, N, Side::Any("D")], &[N, Side::Any("D")]]),
    explanation: "The image is red, green and blue, 0 to 1, its sides multiples of 32. Keypoints are found by the model, from \
                  -1 (the centre of the first pixel) to 1 (that of the last). Descriptors have 128 or 64 elements.",
};

/// Sides of the image are multiples of this.
const MULTIPLE: usize = 32;

/// Extractor of contract `aliked`.
pub struct Aliked {
    network: ImageNetwork,
}

impl Aliked {
    /// Around a network that fulfils [`CONTRACT`].
    #[must_use]
    pub fn new(network: Box<dyn Network>, config: ExtractorConfig) -> Self {
        let pixels = Pixels::Rgb { mean: [0.0; 3], sd: [1.0; 3] };
        Self { network: ImageNetwork::new(network, pixels, MULTIPLE, config) }
    }
}

impl FeatureExtractor for Aliked {
    type Error = PerceptionError;

    fn name(&self) -> &str {
        CONTRACT.name
    }

    fn extract(&mut self, image: &RgbImage) -> Result<Features, PerceptionError> {
        self.network.extract(image, DIMENSION, |outputs, prepared, config| {
            let pixel = |v: f32, side: usize| 0.5 * (v + 1.0) * (side as f32 - 1.0);
            sparse::read(outputs, config, |x, y| (pixel(x, prepared.width), pixel(y, prepared.height)))
        })
    }
}
