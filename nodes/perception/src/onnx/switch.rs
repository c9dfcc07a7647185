//! The learned switch: how likely it is that an image was taken within a step's reach of the photo. NRNS's MLP (Hahn et al.,
//! "No RL, No Simulation", NeurIPS 2021), the baseline of SLING's geometric switch, on the keypoints that were found already.

use std::path::Path;

use homing_core::Features;

use super::choice::{ExtractorChoice, ModelName, listed, unknown};
use super::contract::{Contract, Element, Port, Side};
use super::error::ChoiceError;
use super::extractors::ExtractorContract;
use super::file::ModelFile;
use super::matchers::glue;
use super::matchers::homing::CONTRACT as MATCHER;
use super::network::{Network, refuse, run_somewhere};
use super::registry::{Entry, Role};
use crate::PerceptionError;

/// Contract `homing-switch`.
pub const CONTRACT: Contract = Contract {
    name: "homing-switch",
    inputs: MATCHER.inputs,
    outputs: &[Port { names: &["probability"], element: Element::F32, shapes: &[&[Side::Is(1)]] }],
    explanation: "Takes what contract homing-matcher takes, of at least one keypoint each, and gives the probability that image 0, \
                  the robot's, was taken at most 1 m and 45 degrees from image 1, the goal photo. SLING's threshold is 0.55.",
};

/// A network that compares two images.
pub struct LearnedSwitch {
    network: Box<dyn Network>,
}

impl LearnedSwitch {
    /// Around a network that fulfils [`CONTRACT`].
    #[must_use]
    pub fn new(network: Box<dyn Network>) -> Self {
        Self { network }
    }

    /// Probability, 0 to 1, that `query`'s image was taken within a step's reach of `goal`'s; `None` where either has no
    /// keypoints.
    ///
    /// # Errors
    /// [`PerceptionError::Dimension`] or [`PerceptionError::Features`] for descriptors that the model does not take,
    /// [`PerceptionError::Model`] for a fault of the model, or an output that is no probability.
    pub fn probability(&mut self, query: &Features, goal: &Features) -> Result<Option<f32>, PerceptionError> {
        if query.keypoints.is_empty() || goal.keypoints.is_empty() {
            return Ok(None);
        }
        glue::check(&*self.network, query, goal)?;
        let sides = [query, goal].map(|features| glue::Side::of(features, usize::MAX));
        let ports = self.network.inputs().to_vec();
        let given = glue::inputs(&sides[0], &sides[1], glue::Takes::ScoresToo, &ports);
        let mut said = f32::NAN;
        run_somewhere(&mut *self.network, &given, &mut |outputs| {
            said = outputs.first().and_then(|output| output.floats().first().copied()).unwrap_or(f32::NAN);
        })?;
        if (0.0..=1.0).contains(&said) {
            return Ok(Some(said));
        }
        Err(refuse(&*self.network, "a probability of 0 to 1", said.to_string()).into())
    }
}

/// Which learned switch judges, if any.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum SwitchChoice {
    /// None: geometry decides.
    #[default]
    Geometry,
    /// A model.
    Model {
        /// Its file.
        file: ModelFile,
        /// Hash of the extractor it was trained on, where the manifest tells.
        extractor_sha256: Option<String>,
    },
}

impl SwitchChoice {
    /// The switch of a name: one of the manifest in `folder`, or a file.
    ///
    /// # Errors
    /// [`ChoiceError`] with the names that would do.
    pub fn resolve(name: &ModelName, folder: &Path) -> Result<Self, ChoiceError> {
        match name {
            ModelName::Listed(name) => {
                let entry = listed(name, Role::Switch, &[], folder)?;
                let file = entry.model_file(folder);
                let Entry { extractor_sha256, .. } = entry;
                Ok(Self::Model { file, extractor_sha256 })
            }
            ModelName::File { contract, file } if contract == CONTRACT.name => {
                Ok(Self::Model { file: file.clone(), extractor_sha256: None })
            }
            ModelName::File { contract, .. } => Err(unknown("contract", contract, [CONTRACT.name])),
        }
    }

    /// A switch knows the descriptors it was trained on, and no others.
    ///
    /// # Errors
    /// [`ChoiceError::SwitchMismatch`] or [`ChoiceError::TrainedOn`] for an extractor that it was not trained on.
    pub(super) fn check_family(&self, extractor: &ExtractorChoice) -> Result<(), ChoiceError> {
        let Self::Model { file, extractor_sha256 } = self else { return Ok(()) };
        match (extractor, extractor_sha256) {
            (ExtractorChoice::Model { contract: ExtractorContract::Homing, file: used }, Some(expected))
                if !expected.eq_ignore_ascii_case(&used.sha256) =>
            {
                Err(ChoiceError::TrainedOn {
                    matcher: file.path.display().to_string(),
                    expected: expected.clone(),
                    found: used.sha256.clone(),
                })
            }
            (ExtractorChoice::Model { contract: ExtractorContract::Homing, .. }, _) => Ok(()),
            _ => Err(ChoiceError::SwitchMismatch {
                switch: CONTRACT.name,
                expected: format!("extractor {}", ExtractorContract::Homing.contract().name),
                extractor: format!("extractor {}", extractor.name()),
            }),
        }
    }
}
