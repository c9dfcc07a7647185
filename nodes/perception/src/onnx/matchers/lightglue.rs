//! LightGlue (Lindenberger, Sarlin, Pollefeys, "LightGlue: Local Feature Matching at Light Speed", ICCV 2023), in the form of
//! its common ONNX exports.

use homing_core::{FeatureMatch, Features, Matcher};

use super::MatcherConfig;
use super::glue::{Glue, Takes, read_pairs};
use crate::PerceptionError;
use crate::onnx::contract::{Contract, Element, Port, Side};
use crate::onnx::network::Network;

/// Contract `lightglue`.
pub const CONTRACT: Contract = Contract {
    name: "lightglue",
    inputs: &[
        Port { names: &["kpts0"], element: Element::F32, shapes: &[&[Side::Is(1), Side::Any("N0"), Side::Is(2)]] },
        Port { names: &["kpts1"], element: Element::F32, shapes: &[&[Side::Is(1), Side::Any("N1"), Side::Is(2)]] },
        Port { names: &["desc0"], element: Element::F32, shapes: &[&[Side::Is(1), Side::Any("N0"), Side::Any("D")]] },
        Port { names: &["desc1"], element: Element::F32, shapes: &[&[Side::Is(1), Side::Any("N1"), Side::Any("D")]] },
    ],
    outputs: &[
        Port { names: &["matches0"], element: Element::I64, shapes: &[&[Side::Any("M"), Side::Is(2)]] },
        Port { names: &["mscores0"], element: Element::F32, shapes: &[&[Side::Any("M")]] },
    ],
    explanation: "Positions are (xy - (w, h) / 2) / (max(w, h) / 2), descriptors those the model was trained on: SuperPoint's \
                  (256) or ALIKED's (128). Matches are pairs of indices with a confidence each.",
};

/// Matcher of contract `lightglue`.
pub struct LightGlue(Glue);

impl LightGlue {
    /// Around a network that fulfils [`CONTRACT`].
    #[must_use]
    pub fn new(network: Box<dyn Network>, config: MatcherConfig) -> Self {
        Self(Glue::new(network, Takes::PositionsAndDescriptors, config))
    }
}

impl Matcher for LightGlue {
    type Error = PerceptionError;

    fn name(&self) -> &str {
        CONTRACT.name
    }

    fn match_features(&mut self, query: &Features, goal: &Features) -> Result<Vec<FeatureMatch>, PerceptionError> {
        self.0.run(query, goal, read_pairs)
    }
}
