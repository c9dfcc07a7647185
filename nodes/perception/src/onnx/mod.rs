//! Learned features: published models and our own, run by ONNX Runtime.
//!
//! verify: hash and operator set of the file, before anything else ([`file`])\
//! bind: names, types and shapes against the contract ([`contract`]; one file per contract in [`extractors`], [`matchers`])\
//! open: on the first execution provider that takes it ([`session`])\
//! choose: from a configuration, by name ([`registry`]) or by path; what does not belong together is refused ([`choice`])

pub mod choice;
pub mod contract;
pub mod descriptors;
pub mod error;
pub mod extractors;
pub mod file;
pub mod heat;
pub mod image;
pub mod inventory;
pub mod keypoints;
pub mod matchers;
pub mod network;
pub mod registry;
pub mod session;
pub mod switch;

use homing_core::{FeatureExtractor, Matcher};

use crate::PerceptionError;

/// Any extractor.
pub type AnyExtractor = Box<dyn FeatureExtractor<Error = PerceptionError>>;
/// Any matcher.
pub type AnyMatcher = Box<dyn Matcher<Error = PerceptionError>>;

pub use choice::{ExtractorChoice, FeatureChoice, MatcherChoice, ModelName, Parts};
pub use error::{ChoiceError, ModelError};
pub use extractors::{ExtractorConfig, ExtractorContract};
pub use file::ModelFile;
pub use matchers::{MatcherConfig, MatcherContract};
pub use registry::{Entry, Manifest, Role};
pub use session::{Provider, ProviderChoice, RunConfig};
pub use switch::{LearnedSwitch, SwitchChoice};
