//! Perception: an RGB-D frame and a goal photo in, a goal estimate out (SLING 3.3).
//!
//! extract: keypoints and descriptors of the frame ([`sift`]); the photo's are kept from [`GoalEstimator::set_goal`]\
//! match: pairs that show the same point ([`matching`])\
//! lift: the frame's keypoints become points in metres, by its depth ([`mod@lift`], eq. 1)\
//! pose: the goal camera's pose in the robot's camera, p = -R^T t ([`pnp`], eq. 2)\
//! estimate: gates, covariance, `NotSeen | Bearing | Pose` ([`estimator`])

mod config;
mod error;
pub mod essential;
pub mod estimator;
mod guided;
pub mod lift;
mod locate;
pub mod matching;
pub mod photo;
pub mod pnp;
pub mod provider;
pub mod sift;
mod synthesis;

pub use config::{Gates, PerceptionConfig, PoseSolver};
pub use error::PerceptionError;
pub use estimator::GoalEstimator;
pub use lift::DepthModel;
pub use matching::MutualNearest;
pub use photo::{FieldOfView, Photo, PhotoError, decode_photo};
pub use provider::{RuntimeError, RuntimeReport, load_runtime, opencv_version};
pub use sift::{Sift, SiftConfig};
