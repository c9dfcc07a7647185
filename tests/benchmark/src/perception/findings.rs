//! What a configuration says about a pair, and how far it is off.

use homing_core::{Camera, Goal, GoalEstimate, Sighting, Transform};
use serde::{Deserialize, Serialize};

/// What was found for one pair.
#[derive(Copy, Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "sighting", rename_all = "snake_case")]
pub enum Finding {
    /// Nothing.
    NotSeen,
    /// A direction; no pose.
    Bearing,
    /// A pose.
    Pose(FoundPose),
}

/// A pose, and how far it is off.
#[derive(Copy, Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FoundPose {
    /// Matches that agree.
    pub n_inliers: usize,
    /// Between the cameras by the estimate, metres. With level cameras at one height SLING's rho.
    pub distance_m: f64,
    /// How far it is off; `None` where the photo is of another flat.
    #[serde(flatten)]
    pub error: Option<PoseError>,
}

/// How far a pose is off.
#[derive(Copy, Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseError {
    /// Between estimated and true position, metres.
    pub position_m: f64,
    /// Between estimated and true orientation, degrees.
    pub rotation_deg: f64,
    /// Between the directions to estimated and true position, degrees; 0 where both cameras stand on one spot.
    pub direction_deg: f64,
}

impl PoseError {
    /// Of an estimate against the truth.
    #[must_use]
    pub fn of(estimate: &Transform<Camera, Goal>, truth: &Transform<Camera, Goal>) -> Self {
        let (found, true_m) = (estimate.translation(), truth.translation());
        let direction_deg = if true_m.norm() < 1e-6 { 0.0 } else { found.angle(&true_m).to_degrees() };
        Self {
            position_m: (found - true_m).norm(),
            rotation_deg: estimate.rotation().angle_to(&truth.rotation()).to_degrees(),
            direction_deg,
        }
    }
}

impl Finding {
    /// From an estimate.
    #[must_use]
    pub fn of(estimate: &GoalEstimate, truth: Option<&Transform<Camera, Goal>>) -> Self {
        match &estimate.sighting {
            Sighting::NotSeen { .. } => Self::NotSeen,
            Sighting::Bearing { .. } => Self::Bearing,
            Sighting::Pose { t_camera_goal, n_inliers, .. } => Self::Pose(FoundPose {
                n_inliers: *n_inliers,
                distance_m: t_camera_goal.translation().norm(),
                error: truth.map(|truth| PoseError::of(t_camera_goal, truth)),
            }),
        }
    }

    /// The pose, if there is one.
    #[must_use]
    pub fn pose(&self) -> Option<&FoundPose> {
        if let Self::Pose(pose) = self { Some(pose) } else { None }
    }

    /// How far the pose is off; `None` without a pose.
    #[must_use]
    pub fn error(&self) -> Option<PoseError> {
        self.pose().and_then(|pose| pose.error)
    }
}
