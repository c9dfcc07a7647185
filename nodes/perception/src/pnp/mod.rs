//! Perspective-n-Point: the goal camera's pose from points the robot's camera measured and rays of the goal photo
//! (SLING eq. 2), with angular errors throughout, so that one gate fits every focal length and field of view.

mod epnp;
mod heading;
mod local;
mod p3p;
mod ransac;
mod refine;
mod scorer;
mod up2p;

use homing_core::{Camera, Goal, Transform};
use nalgebra::{Matrix3, Matrix6, Point3, Rotation3, Unit, Vector3};

pub use epnp::{EPNP_CONFIDENCE, EPNP_GATE_PX, EPNP_ITERATIONS, epnp_ransac};
pub use heading::{SlingHeading, sling_heading};
pub use p3p::p3p;
pub use ransac::{Consensus, NoPose, RansacConfig, gravity_ransac, lo_ransac};
pub use refine::{covariance, refine};
pub use up2p::{Upright, up2p};

/// A point the robot's camera measured, and the ray along which the goal camera sees it.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Correspondence {
    /// The point, camera frame, metres (SLING eq. 1).
    pub point: Point3<f64>,
    /// One standard deviation of its depth, metres.
    pub depth_sd_m: f64,
    /// One standard deviation of its direction in the robot's camera, radians.
    pub direction_sd_rad: f64,
    /// Unit ray in the goal camera.
    pub ray: Unit<Vector3<f64>>,
    /// One standard deviation of that ray's direction, radians.
    pub ray_sd_rad: f64,
}

/// One standard deviation of a ray's direction, radians, from that of a pixel over the focal length: towards the image's
/// border a pixel spans a smaller angle, by the cosine squared along the radius and by the cosine across it. This is the
/// geometric mean of the two.
#[must_use]
pub fn ray_sd_rad(ray: &Unit<Vector3<f64>>, sd_over_focal: f64) -> f64 {
    let cosine = ray.z.clamp(0.0, 1.0);
    sd_over_focal * cosine * cosine.sqrt()
}

/// Pose of the goal camera in the robot's camera, in the form that scores fastest: a point P of the robot's camera is
/// `r * (P - p)` in the goal camera.
///
/// PnP's (R, t) maps the robot's camera to the goal's, so t is the ROBOT's origin seen from the goal. The goal's
/// position seen by the robot is p = -R^T t; using t instead keeps the distance and turns the direction by the angle
/// between the two cameras.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct CameraPose {
    /// Rotation from the robot's camera axes to the goal camera's axes.
    pub r: Matrix3<f64>,
    /// Goal camera's position in the robot's camera, metres.
    pub p: Vector3<f64>,
}

impl CameraPose {
    /// From PnP's rotation and translation, which map points of the robot's camera to the goal camera.
    #[must_use]
    pub fn from_pnp(r: Matrix3<f64>, t: Vector3<f64>) -> Self {
        Self { r, p: -(r.transpose() * t) }
    }

    /// The point in the goal camera, metres.
    #[must_use]
    pub fn to_goal(&self, point: &Point3<f64>) -> Vector3<f64> {
        self.r * (point.coords - self.p)
    }

    /// Squared chord between the predicted and the seen ray: the squared angle where it is small, 4 behind the camera.
    #[must_use]
    pub fn squared_error(&self, correspondence: &Correspondence) -> f64 {
        let q = self.to_goal(&correspondence.point);
        let norm = q.norm();
        if norm > 0.0 { (q / norm - correspondence.ray.as_ref()).norm_squared() } else { 4.0 }
    }

    /// Indices of the correspondences whose angular error is below the gate (radians).
    #[must_use]
    pub fn inliers(&self, correspondences: &[Correspondence], gate_rad: f64) -> Vec<usize> {
        let gate = gate_rad * gate_rad;
        (0..correspondences.len()).filter(|&i| self.squared_error(&correspondences[i]) < gate).collect()
    }

    /// As a transform between named frames, its rotation projected to SO(3).
    #[must_use]
    pub fn t_camera_goal(&self) -> Transform<Camera, Goal> {
        Transform::from_rotation(&self.r.transpose(), self.p)
    }

    /// True if finite, and `r` is a rotation to within a thousandth.
    #[must_use]
    pub fn is_rigid(&self) -> bool {
        let off = self.r.transpose() * self.r - Matrix3::identity();
        self.p.iter().all(|x| x.is_finite()) && off.norm() < 1e-3 && self.r.determinant() > 0.0
    }

    /// Moved by a small step: position (metres) and rotation vector (radians), both in the robot's camera axes.
    #[must_use]
    pub fn moved(&self, step_m: &Vector3<f64>, step_rad: &Vector3<f64>) -> Self {
        Self { r: self.r * Rotation3::new(-step_rad).matrix(), p: self.p + step_m }
    }
}

/// A pose with what supports it.
#[derive(Clone, Debug, PartialEq)]
pub struct PoseEstimate {
    /// The pose.
    pub pose: CameraPose,
    /// Covariance of position (m) and rotation vector (rad), both in the robot's camera axes.
    pub covariance: Matrix6<f64>,
    /// Indices of the correspondences that agree.
    pub inliers: Vec<usize>,
    /// Root mean square angular error of the inliers, radians.
    pub rms_rad: f64,
}
