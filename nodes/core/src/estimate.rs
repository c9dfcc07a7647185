//! What perception says about the goal.

use core::time::Duration;

use nalgebra::Matrix6;

use crate::frames::{Camera, Goal};
use crate::stamp::Stamp;
use crate::transform::Transform;

/// Where the goal is, seen from one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct GoalEstimate {
    /// Stamp of the image it was made from: look odometry up there.
    pub stamp: Stamp,
    /// Which goal photo it speaks of.
    pub goal_id: u64,
    /// The finding.
    pub sighting: Sighting,
    /// Probability, 0 to 1, that this image was taken within a step's reach of the photo, by a switch learned for that (NRNS);
    /// `None` where perception has none, or either image has no keypoints.
    pub switch_probability: Option<f32>,
    /// Keypoint matches before geometric verification.
    pub n_matches: usize,
    /// Verified matches (at most a few hundred), for people to look at.
    pub matched_points: Vec<MatchedPoint>,
    /// Where the time went.
    pub times: StageTimes,
}

/// The finding itself.
#[derive(Clone, Debug, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "one exists per frame; a box would cost more than the bytes")]
pub enum Sighting {
    /// The goal is not in this frame, as far as can be told.
    NotSeen {
        /// Why not.
        reason: UnseenReason,
    },
    /// Its direction is known, its distance is not (too few valid depths).
    Bearing {
        /// Direction of the goal camera's position, left positive, radians about the camera's down axis.
        bearing_rad: f64,
        /// One standard deviation, radians.
        bearing_sd_rad: f64,
        /// Heading of the goal camera relative to this camera, left positive, radians.
        heading_rad: f64,
        /// Matches that agree.
        n_inliers: usize,
    },
    /// Its full pose is known.
    Pose {
        /// Pose of the goal camera in the robot's camera. Its translation is `p = -R^T t` of the PnP result, not `t`.
        t_camera_goal: Transform<Camera, Goal>,
        /// Covariance of position (m, first three) and rotation vector (rad), both in camera axes.
        covariance: Matrix6<f64>,
        /// Matches that agree.
        n_inliers: usize,
        /// Root mean square angular error of the inliers, radians.
        rms_rad: f64,
    },
}

/// Why a goal was not seen.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum UnseenReason {
    /// Fewer matches than the switch's threshold.
    TooFewMatches,
    /// No pose explains enough matches (SLING: the optimisation failed).
    NoConsensus,
    /// The frame or the photo has next to no texture.
    NoTexture,
    /// No goal photo has been given yet.
    NoGoal,
}

/// One verified correspondence, pixels.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct MatchedPoint {
    /// In the robot's image (x, y).
    pub query_px: (f32, f32),
    /// In the goal photo (x, y).
    pub goal_px: (f32, f32),
}

/// Time spent per stage of perception.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub struct StageTimes {
    /// Keypoints and descriptors.
    pub extract: Duration,
    /// Matching.
    pub matching: Duration,
    /// Lifting, pose, covariance.
    pub pose: Duration,
}
