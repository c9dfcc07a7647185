//! Our own matcher: attention over both images, partial assignment by optimal transport.

use super::glue::{Form, Takes, read_per_keypoint};
use crate::onnx::contract::{Contract, Element, Port, Side};
use crate::onnx::extractors::homing::DIMENSION;

/// Contract `homing` of matchers.
pub const CONTRACT: Contract = Contract {
    name: "homing-matcher",
    inputs: &[
        positions(&["keypoints0", "kpts0"]),
        positions(&["keypoints1", "kpts1"]),
        descriptors(&["descriptors0", "desc0"]),
        descriptors(&["descriptors1", "desc1"]),
        per_keypoint(&["scores0"], Element::F32),
        per_keypoint(&["scores1"], Element::F32),
    ],
    outputs: &[per_keypoint(&["matches0"], Element::I64), per_keypoint(&["confidences0", "confidence0"], Element::F32)],
    explanation: "Image 0 is the robot's, 1 the goal photo. Positions are (xy - (w, h) / 2) / (max(w, h) / 2). matches0 gives \
                  the keypoint of image 1 for each of image 0, -1 for none.",
};

const fn positions(names: &'static [&'static str]) -> Port {
    Port { names, element: Element::F32, shapes: &[&[N, Side::Is(2)], &[Side::Is(1), N, Side::Is(2)]] }
}

const fn descriptors(names: &'static [&'static str]) -> Port {
    Port { names, element: Element::F32, shapes: &[&[N, Side::Is(DIMENSION)], &[Side::Is(1), N, Side::Is(DIMENSION)]] }
}

const fn per_keypoint(names: &'static [&'static str], element: Element) -> Port {
    Port { names, element, shapes: &[&[N], &[Side::Is(1), N]] }
}

const N: Side = Side::Any("N");

/// Matchers of this contract.
pub(super) const FORM: Form = Form { name: CONTRACT.name, takes: Takes::ScoresToo, read: read_per_keypoint };
