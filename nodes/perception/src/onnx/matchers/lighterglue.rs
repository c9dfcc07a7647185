//! LighterGlue: a LightGlue of three layers for XFeat's descriptors, as published with XFeat (Potje et al., CVPR 2024).

use super::glue::{Form, Takes, read_pairs};
use crate::onnx::contract::{Contract, Element, Port, Side};
use crate::onnx::extractors::xfeat::DIMENSION;

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

/// Matchers of this contract.
pub(super) const FORM: Form = Form { name: CONTRACT.name, takes: Takes::PositionsAndDescriptors, read: read_pairs };
