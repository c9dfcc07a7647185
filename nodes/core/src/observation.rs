//! What the robot's sensors deliver, and the photo it is shown.

use std::sync::Arc;

use thiserror::Error;

use crate::camera::Intrinsics;
use crate::image::{DepthImage, RgbImage};
use crate::odometry::Odometry;
use crate::stamp::Stamp;

/// One colour image with the depth registered to it.
#[derive(Clone, Debug, PartialEq)]
pub struct RgbdFrame {
    /// When the images were taken.
    pub stamp: Stamp,
    /// Colour.
    pub rgb: Arc<RgbImage>,
    /// Depth along the optical axis, same size as `rgb`.
    pub depth: Arc<DepthImage>,
    /// The camera both were taken with.
    pub intrinsics: Intrinsics,
}

/// Colour, depth and intrinsics that do not belong together.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("sizes disagree: colour {}x{}, depth {}x{}, intrinsics {}x{}", rgb.0, rgb.1, depth.0, depth.1, intrinsics.0, intrinsics.1)]
pub struct FrameSizeError {
    rgb: (u32, u32),
    depth: (u32, u32),
    intrinsics: (u32, u32),
}

impl RgbdFrame {
    /// Checked construction.
    ///
    /// # Errors
    /// [`FrameSizeError`] unless colour, depth and intrinsics have one size.
    pub fn new(
        stamp: Stamp,
        rgb: Arc<RgbImage>,
        depth: Arc<DepthImage>,
        intrinsics: Intrinsics,
    ) -> Result<Self, FrameSizeError> {
        let sizes =
            [(rgb.width(), rgb.height()), (depth.width(), depth.height()), (intrinsics.width(), intrinsics.height())];
        if sizes[0] != sizes[1] || sizes[1] != sizes[2] {
            return Err(FrameSizeError { rgb: sizes[0], depth: sizes[1], intrinsics: sizes[2] });
        }
        Ok(Self { stamp, rgb, depth, intrinsics })
    }
}

/// The photo to drive to.
#[derive(Clone, Debug, PartialEq)]
pub struct GoalPhoto {
    /// Names the photo: an estimate says which goal it speaks of.
    pub id: u64,
    /// The photo.
    pub rgb: Arc<RgbImage>,
    /// The camera that took it; need not be the robot's.
    pub intrinsics: Intrinsics,
}

/// A planar laser scan in the base frame, counter-clockwise.
#[derive(Clone, Debug, PartialEq)]
pub struct LaserScan {
    /// When it was taken.
    pub stamp: Stamp,
    /// Direction of the first ray, radians from the x axis of the base.
    pub angle_min_rad: f64,
    /// From one ray to the next, radians.
    pub angle_increment_rad: f64,
    /// Shorter returns are invalid, metres.
    pub range_min_m: f64,
    /// Longer returns are "nothing there", metres.
    pub range_max_m: f64,
    /// Metres along each ray; infinity where nothing was hit.
    pub ranges_m: Vec<f32>,
}

/// Everything a robot sees at one moment.
#[derive(Clone, Debug, PartialEq)]
pub struct Observation {
    /// Colour and depth.
    pub frame: RgbdFrame,
    /// Where the robot believes it is.
    pub odometry: Odometry,
    /// Range scan, if the robot has a scanner.
    pub scan: Option<LaserScan>,
}
