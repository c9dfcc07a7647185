//! Bodies that are not simulators: a recorded sequence of RGB-D images, and what is to be known of a ROS 2 robot.
//!
//! - [`Recording`] reads a folder of colour, depth and poses, [`ReplayBody`] plays it as a robot that cannot be driven.
//! - [`DepthRig`] registers depth to colour where the two come from cameras side by side.
//! - [`PairScore`] measures estimated against recorded relative poses.
//! - [`Ros2Base`] turns a camera_info and a static transform into [`homing_core::Capabilities`].

pub mod depth_rig;
pub mod replay;
pub mod ros2_base;

pub use depth_rig::{DepthCamera, DepthRig, DepthRigError};
pub use replay::{Layout, PairScore, PairSummary, Recording, RecordingError, ReplayBody, World, level_camera};
pub use ros2_base::{CameraInfo, Ros2Base, Ros2BaseError};
