//! Maximum-likelihood refinement of a pose on many correspondences, and how sure the result is.
//!
//! The residual is the two-vector between predicted and seen ray in the tangent plane of the seen one. Its covariance
//! follows from the noise of both keypoints and of the depth: depth noise moves the prediction along one direction only,
//! the more, the further apart the two cameras are.

use nalgebra::{Matrix2, Matrix2x3, Matrix2x6, Matrix6, Vector2, Vector6};

use super::{CameraPose, Correspondence};

/// Cauchy's constant for 95 % efficiency on Gaussian noise, in standard deviations.
const CAUCHY: f64 = 2.385;

/// One correspondence at one pose.
struct Linearised {
    residual: Vector2<f64>,
    jacobian: Matrix2x6<f64>,
    information: Matrix2<f64>,
}

/// Levenberg-Marquardt on the Cauchy loss over `inliers` (indices into `correspondences`), at most `steps` steps.
///
/// Returns the best pose met: never one of higher cost than `pose`. Fewer than three inliers leave it as it is.
#[must_use]
pub fn refine(pose: &CameraPose, correspondences: &[Correspondence], inliers: &[usize], steps: usize) -> CameraPose {
    if inliers.len() < 3 {
        return *pose;
    }
    let mut best = *pose;
    let (mut hessian, mut gradient, mut cost) = normal_equations(&best, correspondences, inliers);
    let mut damping = 1e-4;
    for _ in 0..steps {
        let mut damped = hessian;
        for i in 0..6 {
            damped[(i, i)] += damping * hessian[(i, i)] + 1e-12;
        }
        let Some(step) = damped.cholesky().map(|c| c.solve(&-gradient)) else { break };
        let moved = best.moved(&step.fixed_rows::<3>(0).into(), &step.fixed_rows::<3>(3).into());
        let next = normal_equations(&moved, correspondences, inliers);
        // A NaN compares false and is refused like a worse cost.
        if next.2 < cost {
            let gain = (cost - next.2) / cost;
            best = moved;
            (hessian, gradient, cost) = next;
            damping = (0.1 * damping).max(1e-9);
            if gain < 1e-7 {
                break;
            }
        } else {
            damping *= 10.0;
        }
    }
    best
}

/// Covariance of position (m) and rotation vector (rad) in the robot's camera axes: the inverse information of the
/// inliers, widened where they scatter more than their stated noise, never narrowed. `None` if the pose is undetermined.
#[must_use]
pub fn covariance(pose: &CameraPose, correspondences: &[Correspondence], inliers: &[usize]) -> Option<Matrix6<f64>> {
    let degrees = 2.0 * inliers.len() as f64 - 6.0;
    if degrees <= 0.0 {
        return None;
    }
    let mut information = Matrix6::zeros();
    let mut squared = 0.0;
    for &i in inliers {
        let l = linearise(pose, &correspondences[i])?;
        information += l.jacobian.transpose() * l.information * l.jacobian;
        squared += l.residual.dot(&(l.information * l.residual));
    }
    let inverse = information.cholesky()?.inverse();
    let covariance = inverse * (squared / degrees).max(1.0);
    covariance.iter().all(|x| x.is_finite()).then(|| 0.5 * (covariance + covariance.transpose()))
}

fn normal_equations(
    pose: &CameraPose,
    correspondences: &[Correspondence],
    inliers: &[usize],
) -> (Matrix6<f64>, Vector6<f64>, f64) {
    let (mut hessian, mut gradient, mut cost) = (Matrix6::zeros(), Vector6::zeros(), 0.0);
    for &i in inliers {
        // A point at the camera's centre has no direction: it costs as much as one far outside.
        let Some(l) = linearise(pose, &correspondences[i]) else {
            cost += 100.0;
            continue;
        };
        let squared = l.residual.dot(&(l.information * l.residual)) / (CAUCHY * CAUCHY);
        let weighted = l.jacobian.transpose() * l.information / (1.0 + squared);
        hessian += weighted * l.jacobian;
        gradient += weighted * l.residual;
        cost += nalgebra::ComplexField::ln_1p(squared);
    }
    (hessian, gradient, cost)
}

fn linearise(pose: &CameraPose, correspondence: &Correspondence) -> Option<Linearised> {
    let offset = correspondence.point.coords - pose.p;
    let q = pose.r * offset;
    let distance = q.norm();
    if distance < 1e-6 {
        return None;
    }
    let u = q / distance;
    let tangent = tangent_basis(correspondence.ray.as_ref());
    // d(residual) / d(point): the part of the point's motion across the line of sight, over its distance.
    let onto_sight = (tangent - (tangent * u) * u.transpose()) * pose.r / distance;
    let mut jacobian = Matrix2x6::zeros();
    jacobian.fixed_columns_mut::<3>(0).copy_from(&-onto_sight);
    // r' = r exp(-step): to first order q moves by r (offset x step).
    jacobian.fixed_columns_mut::<3>(3).copy_from(&(onto_sight * offset.cross_matrix()));
    let sight = correspondence.point.coords / correspondence.point.z;
    let along = onto_sight * sight * correspondence.depth_sd_m;
    let across = correspondence.direction_sd_rad * correspondence.point.coords.norm() / distance;
    let isotropic = correspondence.ray_sd_rad.powi(2) + across * across;
    let noise = Matrix2::from_diagonal_element(isotropic) + along * along.transpose();
    Some(Linearised { residual: tangent * u, jacobian, information: noise.try_inverse()? })
}

/// Two orthonormal rows that span the plane across a ray.
fn tangent_basis(ray: &nalgebra::Vector3<f64>) -> Matrix2x3<f64> {
    let axis = nalgebra::Vector3::ith(ray.iamin(), 1.0);
    let first = ray.cross(&axis).normalize();
    let second = ray.cross(&first);
    Matrix2x3::from_rows(&[first.transpose(), second.transpose()])
}
