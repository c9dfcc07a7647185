//! From matches to a sighting: lift, pose, gates; the bearing where depth is missing.

use std::collections::BTreeSet;

use homing_core::{FeatureMatch, Features, Intrinsics, Sighting, Transform, UnseenReason};
use nalgebra::{Matrix6, Unit, Vector3, Vector6};
use rand::Rng;

use crate::PerceptionError;
use crate::config::{PerceptionConfig, PoseSolver};
use crate::essential::{EssentialConfig, RayPair, bearing};
use crate::guided::{Scene, guided_matches, similarity};
use crate::pnp::{
    CameraPose, Correspondence, EPNP_GATE_PX, PoseEstimate, RansacConfig, Upright, covariance, epnp_ransac,
    gravity_ransac, lo_ransac, refine, sling_heading,
};
use crate::seen_frame::SeenFrame;
use crate::synthesis::{Thumbnail, agreement};

/// Radius of the search around a prediction, in units of the inlier gate: the first pose may be off by more than the
/// noise of a keypoint.
const GUIDED_WINDOW: f64 = 1.5;

/// Everything known about the two images.
pub(crate) struct Views<'a> {
    pub frame: &'a SeenFrame,
    pub goal: &'a Features,
    pub goal_camera: &'a Intrinsics,
    pub photo: &'a Thumbnail,
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
    if views.frame.features.keypoints.len().min(views.goal.keypoints.len()) < n_min {
        return Ok(unseen(UnseenReason::NoTexture));
    }
    let matches = distinct(views, matches.iter().map(|m| (m.query, m.goal)));
    if matches.len() < n_min {
        return Ok(unseen(UnseenReason::TooFewMatches));
    }
    let (pairs, correspondences) = views.correspondences(&matches, config);
    let found = match config.solver {
        PoseSolver::LoRansac | PoseSolver::Gravity => proven_pose(views, pairs.clone(), correspondences, config, rng),
        PoseSolver::EpnpRansac => published_pose(views, &pairs, &correspondences, config)?,
        PoseSolver::SlingHeading => published_pose(views, &pairs, &correspondences, config)?.map(placed_by_sling),
    };
    if let Some(found) = found {
        return Ok(found);
    }
    // Depth is missing where it matters: fewer than half of the matches could be lifted.
    if 2 * pairs.len() < matches.len()
        && let Some(found) = found_bearing(views, &matches, config)?
    {
        return Ok(found);
    }
    Ok(unseen(UnseenReason::NoConsensus))
}

/// The goal's direction from rays alone, `None` unless it passes the gates.
fn found_bearing(
    views: &Views<'_>,
    pairs: &[(usize, usize)],
    config: &PerceptionConfig,
) -> Result<Option<Found>, PerceptionError> {
    let rays: Vec<RayPair> = pairs
        .iter()
        .map(|&(q, g)| RayPair {
            query: ray(&views.frame.camera, &views.frame.features.keypoints[q]),
            goal: views.goal_ray(g),
        })
        .collect();
    let sd_px = config.keypoint_sd_px;
    let essential = EssentialConfig {
        gate_rad: config.gates.error_rad_max,
        confidence: config.confidence,
        iterations_max: five_point_samples(config),
        ray_sd_rad: sd_px * (views.frame.camera.fx().powi(-2) + views.goal_camera.fx().powi(-2)).sqrt(),
    };
    let Some(estimate) = bearing(&rays, &essential)? else { return Ok(None) };
    let n_inliers = estimate.inliers.len();
    let enough = n_inliers >= config.gates.n_bearing_min
        && n_inliers as f64 >= config.gates.bearing_share_min * pairs.len() as f64;
    Ok(enough.then(|| Found {
        sighting: Sighting::Bearing {
            bearing_rad: estimate.bearing_rad,
            bearing_sd_rad: estimate.bearing_sd_rad,
            heading_rad: estimate.heading_rad,
            n_inliers,
        },
        verified: estimate.inliers.iter().map(|&i| pairs[i]).collect(),
    }))
}

/// Samples that find the essential matrix if the smallest share of interest agrees with it. OpenCV's own stopping rule
/// ends earlier where more do; a five-point sample costs some hundred times a three-point one.
fn five_point_samples(config: &PerceptionConfig) -> usize {
    let all_inliers = config.gates.bearing_share_min.powi(5).clamp(1e-6, 0.99);
    let needed = nalgebra::ComplexField::ln(1.0 - config.confidence) / nalgebra::ComplexField::ln_1p(-all_inliers);
    (needed.ceil() as usize).clamp(1, config.iterations_max)
}

/// The first pose that enough matches agree on and that the photo bears out. What repeats in a flat agrees on poses that
/// are wrong: the matches behind each of those are set aside, and the rest is searched again.
fn proven_pose(
    views: &Views<'_>,
    mut pairs: Vec<(usize, usize)>,
    mut correspondences: Vec<Correspondence>,
    config: &PerceptionConfig,
    rng: &mut impl Rng,
) -> Option<Found> {
    for _ in 0..config.hypotheses_max {
        let estimate =
            robust_pose(&correspondences, config, rng).and_then(|p| verified(p, &correspondences, config))?;
        let (pose, found) = guided_pose(views, &pairs, &estimate, config);
        let agreement = agreement(&views.frame.seen, views.photo, views.goal_camera, &pose);
        let gates = &config.gates;
        if agreement.n_patches >= gates.n_patches_min && agreement.share >= gates.patch_share_min {
            return Some(found);
        }
        // From the back, so that the indices before stay what they were; they ascend.
        for &i in estimate.inliers.iter().rev() {
            pairs.remove(i);
            correspondences.remove(i);
        }
    }
    None
}

/// Matches once more where the pose says to look, and refines on what is found.
fn guided_pose(
    views: &Views<'_>,
    pairs: &[(usize, usize)],
    first: &PoseEstimate,
    config: &PerceptionConfig,
) -> (CameraPose, Found) {
    let similarity_min = weakest_of_most(views, first.inliers.iter().map(|&i| pairs[i]));
    let points: Vec<_> =
        (0..views.frame.features.keypoints.len()).filter_map(|q| Some((q, views.frame.points[q]?))).collect();
    let goal_rays: Vec<_> = (0..views.goal.keypoints.len()).map(|g| views.goal_ray(g).into_inner()).collect();
    let scene = Scene { query: &views.frame.features, goal: views.goal, points: &points, goal_rays: &goal_rays };
    let mut best = (first.pose, found_pose(pairs, first));
    let mut pose = first.pose;
    let mut n_best = first.inliers.len();
    for _ in 0..config.guided_rounds {
        let found = guided_matches(&scene, &pose, GUIDED_WINDOW * config.gates.error_rad_max, similarity_min);
        let (pairs, correspondences) = views.correspondences(&distinct(views, found.into_iter()), config);
        let inliers = pose.inliers(&correspondences, GUIDED_WINDOW * config.gates.error_rad_max);
        pose = refine(&pose, &correspondences, &inliers, 20);
        let Some(estimate) = verified(pose, &correspondences, config) else { break };
        if estimate.inliers.len() < n_best {
            break;
        }
        n_best = estimate.inliers.len();
        best = (pose, found_pose(&pairs, &estimate));
    }
    best
}

/// Similarity that nine in ten of the verified pairs reach.
fn weakest_of_most(views: &Views<'_>, pairs: impl Iterator<Item = (usize, usize)>) -> f32 {
    let mut similarities: Vec<f32> = pairs.map(|pair| similarity(&views.frame.features, views.goal, pair)).collect();
    similarities.sort_by(f32::total_cmp);
    similarities.get(similarities.len() / 10).copied().unwrap_or(1.0)
}

/// SIFT describes one point once per orientation: such twins are one observation, not two.
fn distinct(views: &Views<'_>, pairs: impl Iterator<Item = (usize, usize)>) -> Vec<(usize, usize)> {
    let cell = |features: &Features, i: usize| {
        let k = &features.keypoints[i];
        ((2.0 * k.x_px).round() as i32, (2.0 * k.y_px).round() as i32)
    };
    let mut seen = BTreeSet::new();
    pairs.filter(|&(q, g)| seen.insert((cell(&views.frame.features, q), cell(views.goal, g)))).collect()
}

impl Views<'_> {
    /// Unit ray of a goal keypoint, goal camera frame.
    pub(crate) fn goal_ray(&self, g: usize) -> Unit<Vector3<f64>> {
        ray(self.goal_camera, &self.goal.keypoints[g])
    }

    /// The pairs whose query keypoint has a trusted depth, and what they mean.
    fn correspondences(
        &self,
        pairs: &[(usize, usize)],
        config: &PerceptionConfig,
    ) -> (Vec<(usize, usize)>, Vec<Correspondence>) {
        pairs.iter().filter_map(|&pair| Some((pair, self.correspondence(pair, config)?))).unzip()
    }

    fn correspondence(&self, (q, g): (usize, usize), config: &PerceptionConfig) -> Option<Correspondence> {
        let point = (*self.frame.points.get(q)?)?;
        Some(Correspondence {
            point,
            depth_sd_m: config.depth.sd(point.z),
            direction_sd_rad: config.keypoint_sd_px / self.frame.camera.fx(),
            ray: self.goal_ray(g),
            ray_sd_rad: config.keypoint_sd_px / self.goal_camera.fx(),
        })
    }
}

fn ray(camera: &Intrinsics, keypoint: &homing_core::Keypoint) -> Unit<Vector3<f64>> {
    Unit::new_unchecked(camera.ray(f64::from(keypoint.x_px), f64::from(keypoint.y_px)))
}

/// OpenCV's EPnP + RANSAC as SLING's code calls it, `None` unless it passes the gates.
fn published_pose(
    views: &Views<'_>,
    pairs: &[(usize, usize)],
    correspondences: &[Correspondence],
    config: &PerceptionConfig,
) -> Result<Option<Found>, PerceptionError> {
    let pose = epnp_ransac(correspondences, EPNP_GATE_PX / views.goal_camera.fx())?;
    let estimate = pose.and_then(|pose| verified(pose, correspondences, config));
    Ok(estimate.map(|estimate| found_pose(pairs, &estimate)))
}

/// The same finding with the goal where SLING's heading formula puts it.
fn placed_by_sling(found: Found) -> Found {
    let Sighting::Pose { t_camera_goal, covariance, n_inliers, rms_rad } = found.sighting else { return found };
    let r = t_camera_goal.rotation().to_rotation_matrix().into_inner();
    let place = sling_heading(&CameraPose { r: r.transpose(), p: t_camera_goal.translation() });
    let t_camera_goal = Transform::from_rotation(&r, place.position_m());
    Found { sighting: Sighting::Pose { t_camera_goal, covariance, n_inliers, rms_rad }, ..found }
}

/// Pose from 2D-3D correspondences (SLING eq. 2).
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
    let upright = match (config.solver, config.camera_down_rad, config.goal_down_rad) {
        (PoseSolver::Gravity, Some(camera), Some(goal)) => Upright::from_tilts(camera, goal),
        _ => None,
    };
    let consensus = match &upright {
        Some(upright) => gravity_ransac(correspondences, upright, &ransac, rng),
        None => lo_ransac(correspondences, &ransac, rng),
    };
    let consensus = consensus.inspect_err(|reason| tracing::debug!(%reason, "no pose")).ok()?;
    Some(refine(&consensus.pose, correspondences, &consensus.inliers, 20))
}

/// The pose with its support and certainty, if it explains enough of the correspondences.
fn verified(pose: CameraPose, correspondences: &[Correspondence], config: &PerceptionConfig) -> Option<PoseEstimate> {
    let inliers = pose.inliers(correspondences, config.gates.error_rad_max);
    let enough = inliers.len() >= config.gates.n_inliers_min
        && inliers.len() as f64 >= config.gates.inlier_share_min * correspondences.len() as f64;
    if !enough {
        return None;
    }
    let squared: f64 = inliers.iter().map(|&i| pose.squared_error(&correspondences[i])).sum();
    let rms_rad = (squared / inliers.len() as f64).sqrt();
    let covariance =
        covariance(&pose, correspondences, &inliers)? + calibration_floor(correspondences, &inliers, config);
    Some(PoseEstimate { pose, covariance, inliers, rms_rad })
}

/// What no number of matches averages out: an error of the intrinsics or of the depth's scale shifts all points alike.
fn calibration_floor(correspondences: &[Correspondence], inliers: &[usize], config: &PerceptionConfig) -> Matrix6<f64> {
    let mean_m = inliers.iter().map(|&i| correspondences[i].point.coords.norm()).sum::<f64>() / inliers.len() as f64;
    let turn = config.calibration_sd * config.calibration_sd;
    let shift = turn * mean_m * mean_m;
    Matrix6::from_diagonal(&Vector6::new(shift, shift, shift, turn, turn, turn))
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
