//! Extractors: one file per contract.

pub mod aliked;
pub mod homing;
pub mod r2d2;
mod sparse;
pub mod superpoint;
pub mod xfeat;

use homing_core::{Features, Keypoint, RgbImage};

use super::contract::Contract;
use super::image::{InputSize, Pixels, Prepared};
use super::network::{Input, Network, Output, run_somewhere};
use super::{AnyExtractor, error::ModelError};
use crate::PerceptionError;

/// Contracts of extractors.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum ExtractorContract {
    /// Our own.
    Homing,
    /// XFeat (Potje et al., CVPR 2024).
    Xfeat,
    /// SuperPoint (DeTone, Malisiewicz, Rabinovich, CVPR workshops 2018).
    Superpoint,
    /// ALIKED (Zhao et al., IEEE T-IM 2023).
    Aliked,
    /// R2D2 (Revaud et al., NeurIPS 2019).
    R2d2,
}

/// How many keypoints to keep, and from what size of image.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct ExtractorConfig {
    /// Most keypoints kept, strongest first.
    pub keypoints_max: usize,
    /// A larger image is shrunk to this longer side first, pixels, where the model takes any size.
    pub side_max_px: u32,
}

impl Default for ExtractorConfig {
    fn default() -> Self {
        Self { keypoints_max: 1024, side_max_px: 640 }
    }
}

impl ExtractorContract {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Homing, Self::Xfeat, Self::Superpoint, Self::Aliked, Self::R2d2];

    /// The contract as data.
    #[must_use]
    pub fn contract(self) -> &'static Contract {
        match self {
            Self::Homing => &homing::CONTRACT,
            Self::Xfeat => &xfeat::CONTRACT,
            Self::Superpoint => &superpoint::CONTRACT,
            Self::Aliked => &aliked::CONTRACT,
            Self::R2d2 => &r2d2::CONTRACT,
        }
    }

    /// The contract of that name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|c| c.contract().name == name)
    }

    /// An extractor around a network that fulfils this contract.
    #[must_use]
    pub fn extractor(self, network: Box<dyn Network>, config: ExtractorConfig) -> AnyExtractor {
        match self {
            Self::Homing => Box::new(homing::Homing::new(network, config)),
            Self::Xfeat => Box::new(xfeat::Xfeat::new(network, config)),
            Self::Superpoint => Box::new(superpoint::Superpoint::new(network, config)),
            Self::Aliked => Box::new(aliked::Aliked::new(network, config)),
            Self::R2d2 => Box::new(r2d2::R2d2::new(network, config)),
        }
    }
}

/// Networks shrink an image by up to 32: smaller ones have nothing to show.
const SIDE_MIN_PX: u32 = 16;

/// What all extractors have: a network that takes one image.
struct ImageNetwork {
    network: Box<dyn Network>,
    pixels: Pixels,
    size: InputSize,
    config: ExtractorConfig,
    prepared: Prepared,
}

impl ImageNetwork {
    /// `multiple` is what the sides of the image must be multiples of, where the model takes any size.
    fn new(network: Box<dyn Network>, pixels: Pixels, multiple: usize, config: ExtractorConfig) -> Self {
        let size = network.inputs().first().map_or(InputSize::MultipleOf(multiple), |i| InputSize::of(i, multiple));
        Self { network, pixels, size, config, prepared: Prepared::default() }
    }

    /// Runs on an image; `read` makes features of the outputs, in pixels of the tensor. `dimension` is that of the
    /// features of an image too small to have any.
    fn extract(
        &mut self,
        image: &RgbImage,
        dimension: usize,
        mut read: impl FnMut(&[Output<'_>], &Prepared, &ExtractorConfig) -> Result<Features, String>,
    ) -> Result<Features, PerceptionError> {
        let original = (image.width(), image.height());
        if original.0.min(original.1) < SIDE_MIN_PX {
            return Ok(Features { dimension, image_size_px: original, ..Features::default() });
        }
        let size = self.size.for_image((original.0 as usize, original.1 as usize), self.config.side_max_px as usize);
        self.prepared.fill(image, size, self.pixels)?;
        let mut features = Ok(Features::default());
        let input = Input { shape: self.prepared.shape(), data: &self.prepared.data };
        run_somewhere(&mut *self.network, &[input], &mut |outputs| {
            features = read(outputs, &self.prepared, &self.config);
        })?;
        let mut features = features.map_err(|found| self.misfit(found))?;
        for keypoint in &mut features.keypoints {
            (keypoint.x_px, keypoint.y_px) = self.prepared.to_image(keypoint.x_px, keypoint.y_px);
        }
        features.image_size_px = original;
        Ok(features)
    }

    fn misfit(&self, found: String) -> ModelError {
        super::network::refuse(&*self.network, "outputs whose sizes belong together", found)
    }
}

/// Sides of a map: the last two of its shape, columns first.
fn sides(output: &Output<'_>) -> (usize, usize) {
    match output.shape[..] {
        [.., rows, columns] => (columns, rows),
        _ => (0, 0),
    }
}

/// A map's name, its sides and those it should have.
type MapSides<'a> = (&'a str, (usize, usize), (usize, usize));

/// Refuses maps that are not of the stated sizes; networks leave sizes open, so this is known only now.
fn check_sizes(maps: &[MapSides<'_>]) -> Result<(), String> {
    let wrong = maps.iter().find(|(_, found, wanted)| found != wanted || wanted.0 == 0 || wanted.1 == 0);
    match wrong {
        Some((name, found, wanted)) => {
            Err(format!("{name} of {}x{} instead of {}x{}", found.0, found.1, wanted.0, wanted.1))
        }
        None => Ok(()),
    }
}

/// Features of places on the tensor with descriptors n x `dimension`.
fn features(keypoints: Vec<Keypoint>, descriptors: Vec<f32>, dimension: usize) -> Features {
    Features { keypoints, descriptors, dimension, ..Features::default() }
}
