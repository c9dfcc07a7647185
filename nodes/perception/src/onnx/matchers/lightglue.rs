//! LightGlue (Lindenberger, Sarlin, Pollefeys, "LightGlue: Local Feature Matching at Light Speed", ICCV 2023), in the form of
//! its common ONNX exports.

use super::glue::{Form, Takes, read_pairs};
use crate::onnx::contract::{Contract, Element, Port, Side};

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

/// Matchers of this contract.
pub(super) const FORM: Form = Form { name: CONTRACT.name, takes: Takes::PositionsAndDescriptors, read: read_pairs };
