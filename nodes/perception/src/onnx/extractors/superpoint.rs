//! SuperPoint (DeTone, Malisiewicz, Rabinovich, "SuperPoint: Self-Supervised Interest Point Detection and Description", CVPR
//! workshops 2018), in the form exported for LightGlue: keypoints are searched inside the model.

use homing_core::{FeatureExtractor, Features, RgbImage};

use super::sparse::{N, ONE};
use super::{ExtractorConfig, ImageNetwork, sparse};
use crate::PerceptionError;
use crate::onnx::contract::{Contract, Element, Port, Side};
use crate::onnx::image::Pixels;
use crate::onnx::network::Network;

/// Length of a descriptor.
pub const DIMENSION: usize = 256;

/// Contract `superpoint`.
pub const CONTRACT: Contract = Contract {
    name: "superpoint",
    inputs: &[Port {
        names: &["image"],
        element: Element::F32,
        shapes: &[&[Side::Is(1), Side::Is(1), Side::Any("H"), Side::Any("W")]],
    }],
    outputs: &sparse::outputs(Element::F32OrI64, &[&[ONE, N, Side::Is(DIMENSION)], &[N, Side::Is(DIMENSION)]]),
    explanation: "The image is luma (BT.601), 0 to 1, its sides multiples of 8. Keypoints are columns and rows of pixels, \
                  found by the model.",
};

/// Sides of the image are multiples of this.
const MULTIPLE: usize = 8;

/// Extractor of contract `superpoint`.
pub struct Superpoint {
    network: ImageNetwork,
}

impl Superpoint {
    /// Around a network that fulfils [`CONTRACT`].
    #[must_use]
    pub fn new(network: Box<dyn Network>, config: ExtractorConfig) -> Self {
        Self { network: ImageNetwork::new(network, Pixels::Luma { range: 1.0 }, MULTIPLE, config) }
    }
}

impl FeatureExtractor for Superpoint {
    type Error = PerceptionError;

    fn name(&self) -> &str {
        CONTRACT.name
    }

    fn extract(&mut self, image: &RgbImage) -> Result<Features, PerceptionError> {
        self.network.extract(image, DIMENSION, |outputs, _, config| sparse::read(outputs, config, |x, y| (x, y)))
    }
}
