//! From matches to a sighting: lift, pose, gates; the bearing where depth is missing.

use std::collections::BTreeSet;

use homing_core::{DepthImage, FeatureMatch, Features, Intrinsics, Sighting, UnseenReason};
use nalgebra::{Point3, Unit, Vector3};
use rand::Rng;

use crate::PerceptionError;
use crate::config::{PerceptionConfig, PoseSolver};
use crate::lift::lift;
use crate::pnp::{
    CameraPose, Correspondence, EPNP_GATE_PX, PoseEstimate, RansacConfig, covariance, epnp_ransac, lo_ransac, refine,
};

/// Everything known about the two images.
pub(crate) struct Views<'a> {
    pub query: &'a Features,
    pub goal: &'a Features,
    pub depth: &'a DepthImage,
    pub camera: &'a Intrinsics,
    pub goal_camera: &'a Intrinsics,
}

/// A sighting and the (query, goal) keypoints that support it.
pub(crate) struct Found {
    pub sighting: Sighting,
    pub verified: Vec<(usize, usize)>,
}

/// The finding for one frame, given its matches.
pub(crate) fn locate(
    views: &Views<'_>,
    matches: &[FeatureMatch],
    config: &PerceptionConfig,
    rng: &mut impl Rng,
) -> Result<Found, PerceptionError> {
    let n_min = config.gates.n_inliers_min;
    if views.query.keypoints.len().min(views.goal.keypoints.len()) < n_min {
        return Ok(unseen(UnseenReason::NoTexture));
    }
    let matches = distinct(views, matches);
    if matches.len() < n_min {
        return Ok(unseen(UnseenReason::TooFewMatches));
    }
    let (pairs, correspondences): (Vec<_>, Vec<_>) =
        matches.iter().filter_map(|&pair| Some((pair, views.correspondence(pair, config)?))).unzip();
    if let Some(estimate) = solve(views, &correspondences, config, rng)? {
        return Ok(found_pose(&pairs, &estimate));
    }
    Ok(unseen(UnseenReason::NoConsensus))
}

/// SIFT describes one point once per orientation: such twins are one observation, not two.
fn distinct(views: &Views<'_>, matches: &[FeatureMatch]) -> Vec<(usize, usize)> {
    let cell = |features: &Features, i: usize| {
        let k = &features.keypoints[i];
        ((2.0 * k.x_px).round() as i32, (2.0 * k.y_px).round() as i32)
    };
    let mut seen = BTreeSet::new();
    let pairs = matches.iter().map(|m| (m.query, m.goal));
    pairs.filter(|&(q, g)| seen.insert((cell(views.query, q), cell(views.goal, g)))).collect()
}

impl Views<'_> {
    /// Unit ray of a goal keypoint, goal camera frame.
    pub(crate) fn goal_ray(&self, g: usize) -> Unit<Vector3<f64>> {
        ray(self.goal_camera, &self.goal.keypoints[g])
    }

    /// Point of a query keypoint, camera frame, if its depth can be trusted.
    pub(crate) fn point(&self, q: usize, config: &PerceptionConfig) -> Option<Point3<f64>> {
        lift(&self.query.keypoints[q], self.depth, self.camera, &config.depth)
    }

    fn correspondence(&self, (q, g): (usize, usize), config: &PerceptionConfig) -> Option<Correspondence> {
        let point = self.point(q, config)?;
        Some(Correspondence {
            point,
            depth_sd_m: config.depth.sd(point.z),
            direction_sd_rad: config.keypoint_sd_px / self.camera.fx(),
            ray: self.goal_ray(g),
            ray_sd_rad: config.keypoint_sd_px / self.goal_camera.fx(),
        })
    }
}

fn ray(camera: &Intrinsics, keypoint: &homing_core::Keypoint) -> Unit<Vector3<f64>> {
    Unit::new_unchecked(camera.ray(f64::from(keypoint.x_px), f64::from(keypoint.y_px)))
}

/// Pose from 2D-3D correspondences (SLING eq. 2), `None` unless it passes the gates.
fn solve(
    views: &Views<'_>,
    correspondences: &[Correspondence],
    config: &PerceptionConfig,
    rng: &mut impl Rng,
) -> Result<Option<PoseEstimate>, PerceptionError> {
    let gate_rad = config.gates.error_rad_max;
    let pose = match config.solver {
        PoseSolver::LoRansac => robust_pose(correspondences, config, rng),
        PoseSolver::EpnpRansac => epnp_ransac(correspondences, EPNP_GATE_PX / views.goal_camera.fx())?,
    };
    Ok(pose.and_then(|pose| verified(pose, correspondences, config, gate_rad)))
}

fn robust_pose(
    correspondences: &[Correspondence],
    config: &PerceptionConfig,
    rng: &mut impl Rng,
) -> Option<CameraPose> {
    let ransac = RansacConfig {
        gate_rad: config.gates.error_rad_max,
        n_inliers_min: config.gates.n_inliers_min,
        confidence: config.confidence,
        iterations_max: config.iterations_max,
    };
    let consensus = lo_ransac(correspondences, &ransac, rng)?;
    Some(refine(&consensus.pose, correspondences, &consensus.inliers, 20))
}

/// The pose with its support and certainty, if it explains enough of the correspondences.
fn verified(
    pose: CameraPose,
    correspondences: &[Correspondence],
    config: &PerceptionConfig,
    gate_rad: f64,
) -> Option<PoseEstimate> {
    let inliers = pose.inliers(correspondences, gate_rad);
    let enough = inliers.len() >= config.gates.n_inliers_min
        && inliers.len() as f64 >= config.gates.inlier_share_min * correspondences.len() as f64;
    if !enough {
        return None;
    }
    let squared: f64 = inliers.iter().map(|&i| pose.squared_error(&correspondences[i])).sum();
    let rms_rad = (squared / inliers.len() as f64).sqrt();
    let covariance = covariance(&pose, correspondences, &inliers)?;
    Some(PoseEstimate { pose, covariance, inliers, rms_rad })
}

fn found_pose(pairs: &[(usize, usize)], estimate: &PoseEstimate) -> Found {
    Found {
        sighting: Sighting::Pose {
            t_camera_goal: estimate.pose.t_camera_goal(),
            covariance: estimate.covariance,
            n_inliers: estimate.inliers.len(),
            rms_rad: estimate.rms_rad,
        },
        verified: estimate.inliers.iter().map(|&i| pairs[i]).collect(),
    }
}

fn unseen(reason: UnseenReason) -> Found {
    Found { sighting: Sighting::NotSeen { reason }, verified: Vec::new() }
}
