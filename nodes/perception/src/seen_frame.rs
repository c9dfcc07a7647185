//! What perception keeps of a frame: enough to register a goal against it at any later time, and no images.

use homing_core::{Features, Intrinsics, RgbdFrame, Stamp};
use nalgebra::Point3;

use crate::lift::{DepthModel, lift};
use crate::synthesis::Seen;

/// A frame that was looked at.
#[derive(Clone, Debug)]
pub struct SeenFrame {
    /// Stamp of the image.
    pub stamp: Stamp,
    /// The camera that took it.
    pub camera: Intrinsics,
    /// Its keypoints.
    pub features: Features,
    /// For each keypoint its point in the camera frame, metres, if the depth there can be trusted.
    pub points: Vec<Option<Point3<f64>>>,
    pub(crate) seen: Seen,
}

impl SeenFrame {
    /// Lifts the features of a frame by its depth (SLING eq. 1).
    #[must_use]
    pub fn new(frame: &RgbdFrame, features: Features, depth: &DepthModel) -> Self {
        let points = features.keypoints.iter().map(|k| lift(k, &frame.depth, &frame.intrinsics, depth)).collect();
        Self { stamp: frame.stamp, camera: frame.intrinsics, features, points, seen: Seen::of(frame) }
    }
}
