//! The vocabulary every part of Homing speaks, and the seams between the parts.
//!
//! Values: frames and transforms, stamps, cameras and images, odometry, scans, actions, goal estimates, the occupancy grid.
//! Seams: [`FeatureExtractor`], [`Matcher`], [`GoalDiscovery`], [`RobotBridge`]. No I/O, no async, no serialisation, no
//! clock and no randomness live here.
//!
//! Frames follow REP-105 and axes REP-103: `base_link` is x forward, y left, z up; a camera's optical frame is x right,
//! y down, z forward. Lengths are metres, angles radians, times nanoseconds of the robot's clock. The centre of the
//! top-left pixel is (0, 0).

pub mod action;
pub mod camera;
pub mod discovery;
pub mod estimate;
pub mod features;
pub mod frames;
pub mod grid;
pub mod image;
pub mod navigation;
pub mod observation;
pub mod odometry;
pub mod robot;
pub mod stamp;
pub mod transform;

pub use action::{Action, Motion, MotionCommand, MotionOutcome, MotionResult};
pub use camera::{Intrinsics, IntrinsicsError};
pub use discovery::{BearingHint, Directive, DiscoveryView, GoalDiscovery};
pub use estimate::{GoalEstimate, MatchedPoint, Sighting, StageTimes, UnseenReason};
pub use features::{FeatureExtractor, FeatureMatch, Features, Keypoint, Matcher};
pub use frames::{Base, Camera, Frame, Goal, Odom};
pub use grid::{Cell, GridGeometry, OccupancyGrid};
pub use image::{DepthImage, ImageError, RgbImage};
pub use navigation::{GoalHypothesis, Mode, NavigationState};
pub use observation::{FrameSizeError, GoalPhoto, LaserScan, Observation, RgbdFrame};
pub use odometry::{Odometry, OdometryBuffer};
pub use robot::{BridgeError, Capabilities, Resettable, RobotBridge};
pub use stamp::Stamp;
pub use transform::{PlanarPose, Transform, wrap_angle};
