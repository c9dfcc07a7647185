//! Perception: an RGB-D frame and a goal photo in, a goal estimate out (SLING 3.3).
//!
//! extract: keypoints and descriptors of the frame ([`sift`], or a model: [`onnx`]); the photo's are kept from [`GoalEstimator::set_goal`]\
//! match: pairs that show the same point ([`matching`], [`dual_softmax`], or a model)\
//! lift: the frame's keypoints become points in metres, by its depth ([`mod@lift`], eq. 1)\
//! pose: the goal camera's pose in the robot's camera, p = -R^T t ([`pnp`], eq. 2)\
//! estimate: gates, covariance, `NotSeen | Bearing | Pose` ([`estimator`])

mod config;
pub mod dual_softmax;
mod error;
pub mod essential;
pub mod estimator;
mod guided;
pub mod lift;
mod locate;
pub mod matching;
pub mod memory;
pub mod onnx;
pub mod photo;
pub mod pnp;
pub mod provider;
pub mod registration;
mod resilient;
mod seen_frame;
pub mod sift;
mod synthesis;

pub use config::{Gates, PerceptionConfig, PoseSolver};
pub use dual_softmax::DualSoftmax;
pub use error::PerceptionError;
pub use estimator::GoalEstimator;
pub use lift::DepthModel;
pub use matching::MutualNearest;
pub use photo::{FieldOfView, Photo, PhotoError, decode_photo};
pub use provider::{Runtime, RuntimeError, RuntimeReport, find_runtime, load_runtime, opencv_version};
pub use registration::Registration;
pub use resilient::{AnyEstimator, ResilientEstimator};
pub use seen_frame::SeenFrame;
pub use sift::{Sift, SiftConfig};
