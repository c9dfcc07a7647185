//! LighterGlue: a LightGlue of three layers for XFeat's descriptors, as published with XFeat (Potje et al., CVPR 2024).

use homing_core::{FeatureMatch, Features, Matcher};

use super::MatcherConfig;
use super::glue::{Glue, Takes, read_pairs};
use crate::PerceptionError;
use crate::onnx::contract::{Contract, Element, Port, Side};
use crate::onnx::extractors::xfeat::DIMENSION;
use crate::onnx::network::Network;

/// Contract `lighterglue`.
pub const CONTRACT: Contract = Contract {
    name: "lighterglue",
    inputs: &[
        Port { names: &["kpts0"], element: Element::F32, shapes: &[&[Side::Is(1), Side::Any("N0"), Side::Is(2)]] },
        Port { names: &["kpts1"], element: Element::F32, shapes: &[&[Side::Is(1), Side::Any("N1"), Side::Is(2)]] },
        Port {
            names: &["desc0"],
            element: Element::F32,
            shapes: &[&[Side::Is(1), Side::Any("N0"), Side::Is(DIMENSION)]],
        },
        Port {
            names: &["desc1"],
            element: Element::F32,
            shapes: &[&[Side::Is(1), Side::Any("N1"), Side::Is(DIMENSION)]],
        },
    ],
    outputs: &[
        Port { names: &["matches"], element: Element::I64, shapes: &[&[Side::Any("M"), Side::Is(2)]] },
        Port { names: &["scores"], element: Element::F32, shapes: &[&[Side::Any("M")]] },
    ],
    explanation: "Positions are (xy - (w, h) / 2) / (max(w, h) / 2), descriptors XFeat's. Matches are pairs of indices with a \
                  confidence each.",
};

/// Matcher of contract `lighterglue`.
pub struct LighterGlue(Glue);

impl LighterGlue {
    /// Around a network that fulfils [`CONTRACT`].
    #[must_use]
    pub fn new(network: Box<dyn Network>, config: MatcherConfig) -> Self {
        Self(Glue::new(network, Takes::PositionsAndDescriptors, config))
    }
}

impl Matcher for LighterGlue {
    type Error = PerceptionError;

    fn name(&self) -> &str {
        CONTRACT.name
    }

    fn match_features(&mut self, query: &Features, goal: &Features) -> Result<Vec<FeatureMatch>, PerceptionError> {
        self.0.run(query, goal, read_pairs)
    }
}
