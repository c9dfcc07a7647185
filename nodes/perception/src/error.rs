//! What can go wrong inside perception: faults of a library or of what was asked, never of what an image shows.

use homing_core::IntrinsicsError;
use thiserror::Error;

/// A fault of perception.
#[derive(Debug, Error)]
pub enum PerceptionError {
    /// OpenCV refused a call.
    #[error("OpenCV failed to {what}: {source}")]
    OpenCv {
        /// What was being done.
        what: &'static str,
        /// OpenCV's own words.
        source: opencv::Error,
    },
    /// Two descriptor sets do not belong together.
    #[error("descriptors of length {query} and {goal} cannot be matched: use one extractor for both images")]
    Dimension {
        /// Length of the query's descriptors.
        query: usize,
        /// Length of the goal's descriptors.
        goal: usize,
    },
    /// Keypoints and descriptors of one image disagree.
    #[error("{keypoints} keypoints need {expected} descriptor values, there are {found}")]
    Features {
        /// Keypoints.
        keypoints: usize,
        /// Values needed.
        expected: usize,
        /// Values given.
        found: usize,
    },
    /// The photo and its camera disagree.
    #[error(
        "the goal photo is {photo_width}x{photo_height} pixels, its intrinsics are for {width}x{height}: resize one of them"
    )]
    PhotoSize {
        /// Columns of the photo.
        photo_width: u32,
        /// Rows of the photo.
        photo_height: u32,
        /// Columns the intrinsics are for.
        width: u32,
        /// Rows the intrinsics are for.
        height: u32,
    },
    /// A setting is outside its range.
    #[error("{name} = {value} is outside {range}")]
    Setting {
        /// The setting.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What is allowed.
        range: &'static str,
    },
    /// Numbers that belong to no camera.
    #[error(transparent)]
    Intrinsics(#[from] IntrinsicsError),
    /// A model cannot be used, or failed.
    #[error(transparent)]
    Model(#[from] crate::onnx::ModelError),
    /// A choice of models that cannot work.
    #[error(transparent)]
    Choice(#[from] crate::onnx::ChoiceError),
    /// ONNX Runtime cannot be used.
    #[error(transparent)]
    Runtime(#[from] crate::RuntimeError),
    /// An extractor or matcher failed.
    #[error("{name} failed: {source}")]
    Stage {
        /// The extractor's or matcher's name.
        name: String,
        /// Its own error.
        source: Box<dyn core::error::Error + Send + Sync>,
    },
}

impl PerceptionError {
    /// For `map_err` on OpenCV's calls.
    pub(crate) fn opencv(what: &'static str) -> impl Fn(opencv::Error) -> Self {
        move |source| Self::OpenCv { what, source }
    }
}
