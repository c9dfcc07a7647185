//! From a configuration to an extractor and a matcher that belong together, both proven by one run before anything relies on
//! them.

use std::path::{Path, PathBuf};

use homing_core::{FeatureExtractor, Features, Matcher};

use super::contract::Contract;
use super::error::ChoiceError;
use super::extractors::homing::DIMENSION;
use super::extractors::{ExtractorConfig, ExtractorContract};
use super::file::ModelFile;
use super::inventory::{test_features, test_image};
use super::matchers::{MatcherConfig, MatcherContract};
use super::registry::{Entry, MANIFEST, Manifest, Role};
use super::session::{OrtNetwork, RunConfig};
use super::switch::{self, LearnedSwitch, SwitchChoice};
use super::{AnyExtractor, AnyMatcher, ModelError};
use crate::provider::{Runtime, RuntimeError, find_runtime};
use crate::{DualSoftmax, MutualNearest, PerceptionConfig, PerceptionError, Sift};

/// A model as a configuration names it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ModelName {
    /// Built in, or in the manifest.
    Listed(String),
    /// Any file that fulfils a contract.
    File {
        /// The contract's name.
        contract: String,
        /// The file.
        file: ModelFile,
    },
}

/// What finds keypoints.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum ExtractorChoice {
    /// OpenCV's SIFT.
    #[default]
    Sift,
    /// A model.
    Model {
        /// What it fulfils.
        contract: ExtractorContract,
        /// Its file.
        file: ModelFile,
    },
}

/// What pairs keypoints.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum MatcherChoice {
    /// Mutual nearest neighbours with a ratio test.
    #[default]
    MutualNearest,
    /// Mutual nearest neighbours by dual-softmax probability.
    DualSoftmax,
    /// A model.
    Model {
        /// What it fulfils.
        contract: MatcherContract,
        /// Its file.
        file: ModelFile,
        /// Hash of the extractor it was trained on, where the manifest tells.
        extractor_sha256: Option<String>,
        /// Smallest confidence of a match that serves it best, where the manifest tells.
        confidence_min: Option<f32>,
    },
}

const SIFT: &str = "sift";
const MUTUAL_NEAREST: &str = "mutual-nearest";
const DUAL_SOFTMAX: &str = "dual-softmax";

impl ExtractorChoice {
    /// The extractor of a name: `sift`, one of the manifest in `folder`, or a file.
    ///
    /// # Errors
    /// [`ChoiceError`] with the names that would do.
    pub fn resolve(name: &ModelName, folder: &Path) -> Result<Self, ChoiceError> {
        let contracts = || ExtractorContract::ALL.map(|c| c.contract().name);
        match name {
            ModelName::Listed(name) if name == SIFT => Ok(Self::Sift),
            ModelName::Listed(name) => {
                let entry = listed(name, Role::Extractor, &[SIFT], folder)?;
                let contract = ExtractorContract::named(&entry.contract)
                    .ok_or_else(|| unknown("contract", &entry.contract, contracts()))?;
                Ok(Self::Model { contract, file: entry.model_file(folder) })
            }
            ModelName::File { contract, file } => {
                let known =
                    ExtractorContract::named(contract).ok_or_else(|| unknown("contract", contract, contracts()))?;
                Ok(Self::Model { contract: known, file: file.clone() })
            }
        }
    }

    /// For reports.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Sift => SIFT,
            Self::Model { contract, .. } => contract.contract().name,
        }
    }
}

impl MatcherChoice {
    /// The matcher of a name: `mutual-nearest`, `dual-softmax`, one of the manifest in `folder`, or a file.
    ///
    /// # Errors
    /// [`ChoiceError`] with the names that would do.
    pub fn resolve(name: &ModelName, folder: &Path) -> Result<Self, ChoiceError> {
        let contracts = || MatcherContract::ALL.map(|c| c.contract().name);
        match name {
            ModelName::Listed(name) if name == MUTUAL_NEAREST => Ok(Self::MutualNearest),
            ModelName::Listed(name) if name == DUAL_SOFTMAX => Ok(Self::DualSoftmax),
            ModelName::Listed(name) => {
                let entry = listed(name, Role::Matcher, &[MUTUAL_NEAREST, DUAL_SOFTMAX], folder)?;
                let contract = MatcherContract::named(&entry.contract)
                    .ok_or_else(|| unknown("contract", &entry.contract, contracts()))?;
                let file = entry.model_file(folder);
                let Entry { extractor_sha256, confidence_min, .. } = entry;
                Ok(Self::Model { contract, file, extractor_sha256, confidence_min })
            }
            ModelName::File { contract, file } => {
                let known =
                    MatcherContract::named(contract).ok_or_else(|| unknown("contract", contract, contracts()))?;
                let file = file.clone();
                Ok(Self::Model { contract: known, file, extractor_sha256: None, confidence_min: None })
            }
        }
    }

    /// The matcher that goes with an extractor: the first of the manifest in `folder` that was trained on it, else mutual
    /// nearest neighbours.
    ///
    /// # Errors
    /// [`ChoiceError`] for a manifest that cannot be read.
    pub fn belonging_to(extractor: &ExtractorChoice, folder: &Path) -> Result<Self, ChoiceError> {
        let ExtractorChoice::Model { file, .. } = extractor else { return Ok(Self::MutualNearest) };
        let manifest = Manifest::read(folder)?;
        match manifest.matcher_of(&file.sha256) {
            Some(entry) => Self::resolve(&ModelName::Listed(entry.name.clone()), folder),
            None => Ok(Self::MutualNearest),
        }
    }

    /// Smallest confidence of a match where the configuration names none: the model's own, else the common one.
    #[must_use]
    pub fn confidence_min(&self) -> f32 {
        match self {
            Self::Model { confidence_min: Some(own), .. } => *own,
            _ => MatcherConfig::default().confidence_min,
        }
    }

    /// For reports.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::MutualNearest => MUTUAL_NEAREST,
            Self::DualSoftmax => DUAL_SOFTMAX,
            Self::Model { contract, .. } => contract.contract().name,
        }
    }
}

pub(super) fn listed(name: &str, role: Role, built_in: &[&str], folder: &Path) -> Result<Entry, ChoiceError> {
    let manifest = Manifest::read(folder)?;
    manifest.find(name, role).cloned().ok_or_else(|| {
        let what = role.name();
        if manifest.models.is_empty() {
            return ChoiceError::NoModels { role: what, name: name.to_owned(), manifest: folder.join(MANIFEST) };
        }
        unknown(what, name, built_in.iter().copied().chain(manifest.names(role)))
    })
}

pub(super) fn unknown<'a>(role: &'static str, name: &str, known: impl IntoIterator<Item = &'a str>) -> ChoiceError {
    let known = known.into_iter().collect::<Vec<_>>().join(", ");
    ChoiceError::UnknownName { role, name: name.to_owned(), known }
}

/// Which features are used, and how.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FeatureChoice {
    /// What finds keypoints.
    pub extractor: ExtractorChoice,
    /// What pairs them.
    pub matcher: MatcherChoice,
    /// What says, beside them, whether an image was taken near the photo.
    pub switch: SwitchChoice,
    /// Settings of an extractor that is a model.
    pub extractor_config: ExtractorConfig,
    /// Settings of a matcher that is a model; its smallest confidence is also that of `dual-softmax`.
    pub matcher_config: MatcherConfig,
    /// Where models run.
    pub run: RunConfig,
    /// ONNX Runtime's library; `None` looks in the usual places. Not touched where no model is used.
    pub library: Option<PathBuf>,
}

/// An extractor and a matcher that belong together.
pub struct Parts {
    /// Finds keypoints.
    pub extractor: AnyExtractor,
    /// Pairs them.
    pub matcher: AnyMatcher,
}

impl FeatureChoice {
    /// Two parts with their own settings: the confidence limit is the matcher's.
    #[must_use]
    pub fn of(extractor: ExtractorChoice, matcher: MatcherChoice) -> Self {
        let matcher_config = MatcherConfig { confidence_min: matcher.confidence_min(), ..MatcherConfig::default() };
        Self { extractor, matcher, matcher_config, ..Self::default() }
    }

    /// The same, by the names of the manifest in `models`; without a matcher's name, the one that belongs to the extractor.
    ///
    /// # Errors
    /// [`ChoiceError`] for a name that is none, or a manifest that cannot be read.
    pub fn listed(extractor: &str, matcher: Option<&str>, models: &Path) -> Result<Self, ChoiceError> {
        let name = |name: &str| ModelName::Listed(name.to_owned());
        let extractor = ExtractorChoice::resolve(&name(extractor), models)?;
        let matcher = match matcher {
            Some(matcher) => MatcherChoice::resolve(&name(matcher), models)?,
            None => MatcherChoice::belonging_to(&extractor, models)?,
        };
        Ok(Self::of(extractor, matcher))
    }

    /// Opens what is chosen. `config` has the settings of SIFT and of the ratio test.
    ///
    /// # Errors
    /// [`PerceptionError::Choice`] for parts that do not belong together, [`PerceptionError::Model`] for a model that cannot
    /// be used: with path, expected and found.
    pub fn open(&self, config: &PerceptionConfig) -> Result<Parts, PerceptionError> {
        self.check_families()?;
        let mut extractor = self.open_extractor(config)?;
        let mut matcher = self.open_matcher(config)?;
        if self.uses_models() {
            self.prove(&mut extractor, &mut matcher)?;
        }
        Ok(Parts { extractor, matcher })
    }

    /// Opens the learned switch, if one is chosen, and proves it by one run.
    ///
    /// # Errors
    /// [`PerceptionError::Choice`] for a switch that does not belong to the extractor, [`PerceptionError::Model`] for a model
    /// that cannot be used.
    pub fn open_switch(&self) -> Result<Option<LearnedSwitch>, PerceptionError> {
        self.switch.check_family(&self.extractor)?;
        let SwitchChoice::Model { file, .. } = &self.switch else { return Ok(None) };
        let mut switch = LearnedSwitch::new(Box::new(self.network(file, &switch::CONTRACT)?));
        let features = test_features(64, DIMENSION);
        switch.probability(&features, &features)?;
        Ok(Some(switch))
    }

    /// Whether ONNX Runtime is needed.
    #[must_use]
    pub fn uses_models(&self) -> bool {
        !matches!(self.extractor, ExtractorChoice::Sift) || matches!(self.matcher, MatcherChoice::Model { .. })
    }

    /// ONNX Runtime, loaded on first use.
    ///
    /// # Errors
    /// [`RuntimeError`] if it is not found or cannot be used.
    pub fn runtime(&self) -> Result<&'static Runtime, RuntimeError> {
        let library = self.library.clone().or_else(find_runtime).ok_or(RuntimeError::NotFound)?;
        Runtime::load(&library)
    }

    fn open_extractor(&self, config: &PerceptionConfig) -> Result<AnyExtractor, PerceptionError> {
        match &self.extractor {
            ExtractorChoice::Sift => Ok(Box::new(Sift::new(config.sift)?)),
            ExtractorChoice::Model { contract, file } => {
                let network = self.network(file, contract.contract())?;
                Ok(contract.extractor(Box::new(network), self.extractor_config))
            }
        }
    }

    fn open_matcher(&self, config: &PerceptionConfig) -> Result<AnyMatcher, PerceptionError> {
        match &self.matcher {
            MatcherChoice::MutualNearest => Ok(Box::new(MutualNearest { ratio_max: config.ratio_max })),
            MatcherChoice::DualSoftmax => {
                let confidence_min = self.matcher_config.confidence_min;
                Ok(Box::new(DualSoftmax { confidence_min, ..DualSoftmax::default() }))
            }
            MatcherChoice::Model { contract, file, .. } => {
                let network = self.network(file, contract.contract())?;
                Ok(contract.matcher(Box::new(network), self.matcher_config))
            }
        }
    }

    fn network(&self, file: &ModelFile, contract: &'static Contract) -> Result<OrtNetwork, ModelError> {
        // The file first: a wrong hash is said even where ONNX Runtime is missing.
        let model = file.verify()?;
        OrtNetwork::open(self.runtime()?, model, contract, self.run)
    }

    /// Before anything is loaded: a matcher that is a model knows the extractors it was trained on.
    fn check_families(&self) -> Result<(), ChoiceError> {
        let MatcherChoice::Model { contract, file, extractor_sha256, .. } = &self.matcher else { return Ok(()) };
        match &self.extractor {
            ExtractorChoice::Model { contract: extractor, file: trained } if contract.takes().contains(extractor) => {
                match extractor_sha256 {
                    Some(expected) if !expected.eq_ignore_ascii_case(&trained.sha256) => Err(ChoiceError::TrainedOn {
                        matcher: file.path.display().to_string(),
                        expected: expected.clone(),
                        found: trained.sha256.clone(),
                    }),
                    _ => Ok(()),
                }
            }
            _ => Err(self.mismatch(*contract, "")),
        }
    }

    /// One run of each on a test image: whatever only running tells is told now.
    fn prove(&self, extractor: &mut AnyExtractor, matcher: &mut AnyMatcher) -> Result<(), PerceptionError> {
        let features: Features = extractor.extract(&test_image())?;
        tracing::debug!(
            "{} found {} keypoints with descriptors of length {} on the test image",
            extractor.name(),
            features.keypoints.len(),
            features.dimension
        );
        match (matcher.match_features(&features, &features), &self.matcher) {
            (Ok(_), _) => Ok(()),
            (Err(PerceptionError::Dimension { .. }), MatcherChoice::Model { contract, .. }) => {
                Err(self.mismatch(*contract, &format!(" with descriptors of length {}", features.dimension)).into())
            }
            (Err(fault), _) => Err(fault),
        }
    }

    fn mismatch(&self, matcher: MatcherContract, length: &str) -> ChoiceError {
        let takes: Vec<&str> = matcher.takes().iter().map(|c| c.contract().name).collect();
        ChoiceError::Mismatch {
            matcher: matcher.contract().name.to_owned(),
            expected: format!("extractor {}", takes.join(" or ")),
            extractor: format!("extractor {}{length}", self.extractor.name()),
        }
    }
}
