//! Recorded RGB-D sequences.
//!
//! Frames keep the number they were recorded under (the number in the file name), at 30 frames a second.

mod body;
mod decode;
mod error;
mod open3d;
mod pose;
mod recording;
mod score;
mod seven_scenes;

pub use body::{ReplayBody, level_camera};
pub use error::RecordingError;
pub use recording::{Layout, Recording, World};
pub use score::{PairScore, PairSummary};
