//! The goal's direction without depth: the essential matrix binds the two views up to the distance between them.
//!
//! OpenCV's five-point RANSAC (Nister, PAMI 2004) finds it; the refinement and the gates work on the angle between a ray
//! and the plane it should lie in, so that wide and narrow cameras are treated alike.

use nalgebra::{Matrix3, Matrix5, Unit, Vector3, Vector5};
use opencv::calib3d;
use opencv::core::{Mat, Point2d, Vector, no_array};
use opencv::prelude::*;

use crate::PerceptionError;
use crate::pnp::CameraPose;

/// A pair of rays that show the same point: in the robot's camera, and in the goal camera.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct RayPair {
    /// Unit ray in the robot's camera.
    pub query: Unit<Vector3<f64>>,
    /// Unit ray in the goal camera.
    pub goal: Unit<Vector3<f64>>,
}

/// Direction of the goal camera and its rotation, without distance.
#[derive(Clone, Debug, PartialEq)]
pub struct BearingEstimate {
    /// Pose of the goal camera in the robot's camera; its position is of length 1, only the direction means anything.
    pub pose: CameraPose,
    /// Direction of the goal camera's position, left positive, radians about the camera's down axis.
    pub bearing_rad: f64,
    /// One standard deviation, radians, at most pi: large where the views differ by a rotation alone.
    pub bearing_sd_rad: f64,
    /// Heading of the goal camera relative to this one, left positive, radians.
    pub heading_rad: f64,
    /// Indices of the pairs that agree.
    pub inliers: Vec<usize>,
}

/// Settings of [`bearing`].
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct EssentialConfig {
    /// Largest angle between a ray and its epipolar plane, radians.
    pub gate_rad: f64,
    /// Probability of finding the essential matrix if there is one.
    pub confidence: f64,
    /// Most samples drawn.
    pub iterations_max: usize,
    /// One standard deviation of a ray's direction, radians.
    pub ray_sd_rad: f64,
}

/// Gauss-Newton steps of the refinement.
const STEPS: usize = 10;

/// The goal's direction from ray pairs alone. `None` if no essential matrix explains at least six of them.
///
/// # Errors
/// [`PerceptionError::OpenCv`] for a fault of OpenCV.
pub fn bearing(pairs: &[RayPair], config: &EssentialConfig) -> Result<Option<BearingEstimate>, PerceptionError> {
    // Rays to the side of the image plane cannot be written as a point on it; a pinhole camera has none.
    if pairs.len() < 6 || pairs.iter().any(|pair| pair.query.z < 1e-3 || pair.goal.z < 1e-3) {
        return Ok(None);
    }
    let first = five_point(pairs, config).map_err(PerceptionError::opencv("find the essential matrix"))?;
    let Some(mut pose) = first else { return Ok(None) };
    for _ in 0..2 {
        let inliers = agreeing(&pose, pairs, config.gate_rad);
        pose = refined(&pose, pairs, &inliers);
    }
    let inliers = agreeing(&pose, pairs, config.gate_rad);
    if inliers.len() < 6 {
        return Ok(None);
    }
    Ok(Some(with_certainty(pose, pairs, inliers, config.ray_sd_rad)))
}

/// Direction of a vector of the camera frame about the camera's down axis, left positive, radians.
#[must_use]
pub fn bearing_of(direction: &Vector3<f64>) -> f64 {
    nalgebra::RealField::atan2(-direction.x, direction.z)
}

fn five_point(pairs: &[RayPair], config: &EssentialConfig) -> opencv::Result<Option<CameraPose>> {
    let on_plane = |ray: &Vector3<f64>| Point2d::new(ray.x / ray.z, ray.y / ray.z);
    let query: Vector<Point2d> = pairs.iter().map(|pair| on_plane(&pair.query)).collect();
    let goal: Vector<Point2d> = pairs.iter().map(|pair| on_plane(&pair.goal)).collect();
    let identity = Mat::eye(3, 3, f64::opencv_type())?.to_mat()?;
    let essential = calib3d::find_essential_mat(
        &query,
        &goal,
        &identity,
        calib3d::RANSAC,
        config.confidence,
        config.gate_rad,
        i32::try_from(config.iterations_max).unwrap_or(i32::MAX),
        &mut no_array(),
    )?;
    if essential.rows() != 3 || essential.cols() != 3 {
        return Ok(None);
    }
    let (mut rotation, mut translation) = (Mat::default(), Mat::default());
    calib3d::recover_pose_estimated_def(&essential, &query, &goal, &identity, &mut rotation, &mut translation)?;
    let r = Matrix3::from_row_slice(rotation.data_typed::<f64>()?);
    let t = Vector3::from_column_slice(translation.data_typed::<f64>()?);
    let pose = CameraPose::from_pnp(r, t);
    Ok((pose.is_rigid() && (pose.p.norm() - 1.0).abs() < 1e-3).then_some(pose))
}

/// Pairs that lie on their epipolar plane and in front of both cameras.
fn agreeing(pose: &CameraPose, pairs: &[RayPair], gate_rad: f64) -> Vec<usize> {
    let agrees = |pair: &RayPair| residual(pose, pair).abs() < gate_rad && in_front(pose, pair, gate_rad);
    (0..pairs.len()).filter(|&i| agrees(&pairs[i])).collect()
}

/// Angle by which the two rays miss meeting, to first order (Sampson's distance on the sphere), radians.
fn residual(pose: &CameraPose, pair: &RayPair) -> f64 {
    let goal = pose.r.tr_mul(pair.goal.as_ref());
    let (across_goal, across_query) = (pose.p.cross(&goal), pair.query.cross(&pose.p));
    let scale = (across_goal.norm_squared() + across_query.norm_squared()).sqrt();
    if scale < 1e-9 { 0.0 } else { pair.query.dot(&across_goal) / scale }
}

/// True if both distances to the point are positive, or the rays so nearly parallel that it is far away.
fn in_front(pose: &CameraPose, pair: &RayPair, gate_rad: f64) -> bool {
    let goal = pose.r.tr_mul(pair.goal.as_ref());
    let cosine = pair.query.dot(&goal);
    let (along_query, along_goal) = (pair.query.dot(&pose.p), goal.dot(&pose.p));
    let sine_squared = 1.0 - cosine * cosine;
    if sine_squared < gate_rad * gate_rad {
        return cosine > 0.0;
    }
    along_query - cosine * along_goal > 0.0 && cosine * along_query - along_goal > 0.0
}

/// Rotation vector and two directions across the baseline: the five degrees of freedom.
fn moved(pose: &CameraPose, step: &Vector5<f64>) -> CameraPose {
    let (first, second) = across(&pose.p);
    let turned = pose.moved(&Vector3::zeros(), &step.fixed_rows::<3>(0).into());
    CameraPose { p: (pose.p + first * step[3] + second * step[4]).normalize(), ..turned }
}

fn across(p: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let first = p.cross(&Vector3::ith(p.iamin(), 1.0)).normalize();
    (first, p.cross(&first))
}

/// Normal equations of the residuals: Hessian, gradient and sum of squares.
fn normal_equations(pose: &CameraPose, pairs: &[RayPair], inliers: &[usize]) -> (Matrix5<f64>, Vector5<f64>, f64) {
    const H: f64 = 1e-6;
    let nudged: [(CameraPose, CameraPose); 5] = core::array::from_fn(|k| {
        let step = Vector5::ith(k, H);
        (moved(pose, &step), moved(pose, &-step))
    });
    let (mut hessian, mut gradient, mut squares) = (Matrix5::zeros(), Vector5::zeros(), 0.0);
    for &i in inliers {
        let r = residual(pose, &pairs[i]);
        let slope =
            |(up, down): &(CameraPose, CameraPose)| (residual(up, &pairs[i]) - residual(down, &pairs[i])) / (2.0 * H);
        let j = Vector5::from_iterator(nudged.iter().map(slope));
        hessian += j * j.transpose();
        gradient += j * r;
        squares += r * r;
    }
    (hessian, gradient, squares)
}

/// Gauss-Newton as long as the sum of squares falls.
fn refined(pose: &CameraPose, pairs: &[RayPair], inliers: &[usize]) -> CameraPose {
    let mut best = *pose;
    let (mut hessian, mut gradient, mut squares) = normal_equations(&best, pairs, inliers);
    for _ in 0..STEPS {
        let damped = hessian + Matrix5::from_diagonal_element(1e-9 + 1e-6 * hessian.trace());
        let Some(step) = damped.cholesky().map(|c| c.solve(&-gradient)) else { break };
        let next_pose = moved(&best, &step);
        let next = normal_equations(&next_pose, pairs, inliers);
        if next.2 >= squares || next.2.is_nan() {
            break;
        }
        best = next_pose;
        (hessian, gradient, squares) = next;
    }
    best
}

fn with_certainty(pose: CameraPose, pairs: &[RayPair], inliers: Vec<usize>, ray_sd_rad: f64) -> BearingEstimate {
    let (hessian, _, squares) = normal_equations(&pose, pairs, &inliers);
    let variance = (squares / (inliers.len() as f64 - 5.0).max(1.0)).max(ray_sd_rad * ray_sd_rad);
    // How the bearing turns with the two directions across the baseline.
    let (first, second) = across(&pose.p);
    let flat = (pose.p.x * pose.p.x + pose.p.z * pose.p.z).max(1e-12);
    let turn = |d: &Vector3<f64>| (pose.p.x * d.z - pose.p.z * d.x) / flat;
    let gradient = Vector5::new(0.0, 0.0, 0.0, turn(&first), turn(&second));
    let spread = hessian.cholesky().map_or(f64::INFINITY, |c| gradient.dot(&c.solve(&gradient)) * variance);
    let bearing_sd_rad = spread.sqrt().min(core::f64::consts::PI);
    BearingEstimate {
        bearing_rad: bearing_of(&pose.p),
        bearing_sd_rad: if bearing_sd_rad.is_finite() { bearing_sd_rad } else { core::f64::consts::PI },
        heading_rad: bearing_of(&pose.r.transpose().column(2).into()),
        pose,
        inliers,
    }
}
