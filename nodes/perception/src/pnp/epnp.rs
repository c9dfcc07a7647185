//! The papers' variant: OpenCV's EPnP (Lepetit, Moreno-Noguer, Fua, IJCV 2009) inside its RANSAC, for comparison.

use nalgebra::{Matrix3, Vector3};
use opencv::calib3d::{self, SOLVEPNP_EPNP};
use opencv::core::{Mat, Point2d, Point3d, Vector, no_array};
use opencv::prelude::*;

use super::{CameraPose, Correspondence};
use crate::PerceptionError;

/// Iterations in the papers' code (OpenCV's default).
pub const EPNP_ITERATIONS: i32 = 100;
/// Reprojection gate in the papers' code, pixels of the goal photo (OpenCV's default).
pub const EPNP_GATE_PX: f64 = 8.0;
/// Confidence in the papers' code (OpenCV's default).
pub const EPNP_CONFIDENCE: f64 = 0.99;

/// EPnP with RANSAC on coordinates normalised by the goal camera's focal length. `None` if OpenCV finds no pose.
///
/// `gate` is the largest reprojection error on the image plane at distance one (pixels over focal length).
///
/// # Errors
/// [`PerceptionError::OpenCv`] for a fault of OpenCV.
pub fn epnp_ransac(correspondences: &[Correspondence], gate: f64) -> Result<Option<CameraPose>, PerceptionError> {
    // OpenCV's sampler needs five; rays to the side of the image plane cannot be written as a point on it.
    let usable = correspondences.iter().filter(|c| c.ray.z > 1e-3);
    let (points, pixels): (Vector<Point3d>, Vector<Point2d>) = usable
        .map(|c| (Point3d::new(c.point.x, c.point.y, c.point.z), Point2d::new(c.ray.x / c.ray.z, c.ray.y / c.ray.z)))
        .unzip();
    if points.len() < 5 {
        return Ok(None);
    }
    solve(&points, &pixels, gate).map_err(PerceptionError::opencv("solve EPnP"))
}

fn solve(points: &Vector<Point3d>, pixels: &Vector<Point2d>, gate: f64) -> opencv::Result<Option<CameraPose>> {
    let identity = Mat::eye(3, 3, f64::opencv_type())?.to_mat()?;
    let (mut rotation_vector, mut translation, mut inliers) = (Mat::default(), Mat::default(), Mat::default());
    let found = calib3d::solve_pnp_ransac(
        points,
        pixels,
        &identity,
        &no_array(),
        &mut rotation_vector,
        &mut translation,
        false,
        EPNP_ITERATIONS,
        gate as f32,
        EPNP_CONFIDENCE,
        &mut inliers,
        SOLVEPNP_EPNP,
    )?;
    if !found || inliers.empty() {
        return Ok(None);
    }
    let mut rotation = Mat::default();
    calib3d::rodrigues_def(&rotation_vector, &mut rotation)?;
    let r = Matrix3::from_row_slice(rotation.data_typed::<f64>()?);
    let t = Vector3::from_column_slice(translation.data_typed::<f64>()?);
    let pose = CameraPose::from_pnp(r, t);
    Ok(pose.is_rigid().then_some(pose))
}
