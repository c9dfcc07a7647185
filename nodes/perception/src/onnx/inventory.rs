//! What `homing models` says: which models there are, whether they work, and what their contracts mean.

use std::time::{Duration, Instant};

use homing_core::{FeatureExtractor, Features, Keypoint, Matcher, RgbImage};

use super::contract::Contract;
use super::descriptors::normalise;
use super::extractors::homing::DIMENSION;
use super::extractors::{ExtractorConfig, ExtractorContract};
use super::file::ModelFile;
use super::matchers::{MatcherConfig, MatcherContract};
use super::network::Network;
use super::session::{OrtNetwork, Provider, RunConfig};
use super::switch::{self, LearnedSwitch};
use crate::PerceptionError;
use crate::provider::Runtime;

/// What one run of a model told.
#[derive(Clone, Debug, PartialEq)]
pub struct Checked {
    /// Its operator set.
    pub opset: i64,
    /// Where it ran.
    pub provider: Provider,
    /// Providers tried before, each with its reason.
    pub refused: Vec<(Provider, String)>,
    /// From the file to the first result.
    pub start: Duration,
    /// The shortest of three further runs, with all that is done before and after the network.
    pub run: Duration,
    /// What came out, in words.
    pub result: String,
}

/// A contract of any kind.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum AnyContract {
    /// An extractor's.
    Extractor(ExtractorContract),
    /// A matcher's.
    Matcher(MatcherContract),
    /// The learned switch's.
    Switch,
}

impl AnyContract {
    /// All there are.
    pub fn all() -> impl Iterator<Item = Self> {
        let extractors = ExtractorContract::ALL.into_iter().map(Self::Extractor);
        extractors.chain(MatcherContract::ALL.into_iter().map(Self::Matcher)).chain([Self::Switch])
    }

    /// As data.
    #[must_use]
    pub fn contract(self) -> &'static Contract {
        match self {
            Self::Extractor(contract) => contract.contract(),
            Self::Matcher(contract) => contract.contract(),
            Self::Switch => &switch::CONTRACT,
        }
    }

    /// In words: inputs, outputs, what they mean, and what it belongs with.
    #[must_use]
    pub fn explain(self) -> String {
        let contract = self.contract();
        let belonging = |takes: &[&str]| format!("\n  belongs with {}", takes.join(" or "));
        let (role, belongs) = match self {
            Self::Extractor(_) => ("extractor", String::new()),
            Self::Matcher(matcher) => {
                let takes: Vec<&str> = matcher.takes().iter().map(|c| c.contract().name).collect();
                ("matcher", belonging(&takes))
            }
            Self::Switch => ("switch", belonging(&[ExtractorContract::Homing.contract().name])),
        };
        let mut text = format!("{} ({role}){belongs}", contract.name);
        for (kind, ports) in [("in", contract.inputs), ("out", contract.outputs)] {
            for port in ports {
                text += &format!("\n  {kind:<3} {port}");
            }
        }
        text + "\n  " + contract.explanation
    }

    /// Hash, operator set, ports, provider, and one run on a test image.
    ///
    /// # Errors
    /// [`PerceptionError::Model`] for the first thing that is wrong.
    pub fn check(
        self,
        file: &ModelFile,
        runtime: &'static Runtime,
        run: RunConfig,
    ) -> Result<Checked, PerceptionError> {
        let begin = Instant::now();
        let network = OrtNetwork::open(runtime, file.verify()?, self.contract(), run)?;
        let (opset, provider, refused) = (network.opset(), network.provider(), network.refused().to_vec());
        let mut work: Box<dyn FnMut() -> Result<String, PerceptionError>> = match self {
            Self::Extractor(contract) => {
                let mut extractor = contract.extractor(Box::new(network), ExtractorConfig::default());
                let image = test_image();
                Box::new(move || {
                    let features = extractor.extract(&image)?;
                    Ok(format!("{} keypoints, {} long", features.keypoints.len(), features.dimension))
                })
            }
            Self::Switch => {
                let features = test_features(512, DIMENSION);
                let mut switch = LearnedSwitch::new(Box::new(network));
                Box::new(move || {
                    let probability = switch.probability(&features, &features)?.unwrap_or_default();
                    Ok(format!("keypoints beside themselves: probability {probability:.2}"))
                })
            }
            Self::Matcher(contract) => {
                let dimension = network.inputs().get(2).and_then(|p| p.shape.last().copied().flatten());
                let features = test_features(512, dimension.unwrap_or(256));
                let mut matcher = contract.matcher(Box::new(network), MatcherConfig::default());
                Box::new(move || {
                    let matches = matcher.match_features(&features, &features)?;
                    Ok(format!("{} of {} matched with themselves", matches.len(), features.keypoints.len()))
                })
            }
        };
        let result = work()?;
        let start = begin.elapsed();
        let mut best = Duration::MAX;
        for _ in 0..3 {
            let begin = Instant::now();
            work()?;
            best = best.min(begin.elapsed());
        }
        Ok(Checked { opset, provider, refused, start, run: best, result })
    }
}

/// An image of 640x480 with corners everywhere: blocks of two sizes, each of one grey.
#[must_use]
pub fn test_image() -> RgbImage {
    let grey = |cell: u32, salt: u32| {
        let mixed = (cell ^ salt).wrapping_mul(0x9e37_79b9);
        (mixed ^ (mixed >> 15)).wrapping_mul(0x85eb_ca6b) >> 25
    };
    let pixel = |i: u32| {
        let (x, y) = (i % 640, i / 640);
        let value = grey((x / 40) * 64 + y / 40, 1) + grey((x / 13) * 64 + y / 13, 2);
        [value.min(255) as u8; 3]
    };
    let data = (0..640 * 480).flat_map(pixel).collect();
    match RgbImage::new(640, 480, data) {
        Ok(image) => image,
        Err(_) => unreachable!("640 * 480 pixels are 640 * 480 pixels"),
    }
}

/// Features of an image of 640x480 that follow no image.
pub(super) fn test_features(n: usize, dimension: usize) -> Features {
    let random = |i: usize| {
        let mixed = (i as u32).wrapping_mul(0x9e37_79b9);
        ((mixed ^ (mixed >> 15)).wrapping_mul(0x85eb_ca6b) >> 8) as f32 / (1 << 24) as f32
    };
    let mut descriptors: Vec<f32> = (0..n * dimension).map(|i| random(i) - 0.5).collect();
    descriptors.chunks_exact_mut(dimension.max(1)).for_each(normalise);
    let place = |i: usize| Keypoint { x_px: 640.0 * random(7 * i), y_px: 480.0 * random(7 * i + 1), score: 0.5 };
    Features { keypoints: (0..n).map(place).collect(), descriptors, dimension, image_size_px: (640, 480) }
}
