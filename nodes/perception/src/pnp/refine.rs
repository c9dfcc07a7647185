//! Maximum-likelihood refinement of a pose on many correspondences, and how sure the result is.
//!
//! The residual is the two-vector between predicted and seen ray in the tangent plane of the seen one. Its covariance
//! follows from the noise of both keypoints and of the depth: depth noise moves the prediction along one direction only,
//! the more, the further apart the two cameras are.

use nalgebra::{Matrix6, Vector6};

use super::scorer::tangent_basis;
use super::{CameraPose, Correspondence};

/// Cauchy's constant for 95 % efficiency on Gaussian noise, in standard deviations.
const CAUCHY: f64 = 2.385;

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
    let mut information = Information::default();
    let mut squared = 0.0;
    for &i in inliers {
        let l = linearise(pose, &correspondences[i])?;
        information.add(&l, 1.0);
        squared += l.squared();
    }
    let inverse = information.matrix().cholesky()?.inverse();
    let covariance = inverse * (squared / degrees).max(1.0);
    covariance.iter().all(|x| x.is_finite()).then(|| 0.5 * (covariance + covariance.transpose()))
}

/// Hessian, gradient and cost of the Cauchy loss.
fn normal_equations(
    pose: &CameraPose,
    correspondences: &[Correspondence],
    inliers: &[usize],
) -> (Matrix6<f64>, Vector6<f64>, f64) {
    let (mut information, mut gradient, mut cost) = (Information::default(), Vector6::zeros(), 0.0);
    // The cost is a sum of ln(1 + x): one logarithm for as many factors as cannot overflow.
    let mut product = 1.0;
    for &i in inliers {
        // A point at the camera's centre has no direction: it costs as much as one far outside.
        let Some(l) = linearise(pose, &correspondences[i]) else {
            cost += 100.0;
            continue;
        };
        let squared = l.squared() / (CAUCHY * CAUCHY);
        let weight = 1.0 / (1.0 + squared);
        information.add(&l, weight);
        gradient += (l.whitened[0] * l.residual[0] + l.whitened[1] * l.residual[1]) * weight;
        product *= 1.0 + squared;
        if product > 1e100 {
            cost += nalgebra::ComplexField::ln(product);
            product = 1.0;
        }
    }
    (information.matrix(), gradient, cost + nalgebra::ComplexField::ln(product))
}

/// One correspondence at one pose.
struct Linearised {
    /// In the tangent plane of the seen ray, radians.
    residual: [f64; 2],
    /// Derivatives of the residual by position (m) and rotation vector (rad), and the same times the inverse noise.
    rows: [Vector6<f64>; 2],
    whitened: [Vector6<f64>; 2],
    /// Inverse covariance of the residual: entries (0, 0), (0, 1), (1, 1), 1/rad^2.
    inverse_noise: [f64; 3],
}

impl Linearised {
    /// Squared residual in units of its standard deviation.
    fn squared(&self) -> f64 {
        let ([a, b], [n00, n01, n11]) = (self.residual, self.inverse_noise);
        a * a * n00 + 2.0 * a * b * n01 + b * b * n11
    }
}

/// The lower triangle of a sum of J^T N J.
#[derive(Default)]
struct Information([[f64; 6]; 6]);

impl Information {
    fn add(&mut self, l: &Linearised, weight: f64) {
        for (row, whitened) in l.rows.iter().zip(&l.whitened) {
            for i in 0..6 {
                let scaled = weight * row[i];
                for j in 0..=i {
                    self.0[i][j] += scaled * whitened[j];
                }
            }
        }
    }

    fn matrix(&self) -> Matrix6<f64> {
        Matrix6::from_fn(|i, j| self.0[i.max(j)][i.min(j)])
    }
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
    let axes = [tangent.row(0).transpose(), tangent.row(1).transpose()];
    let residual = [axes[0].dot(&u), axes[1].dot(&u)];
    // d(residual) / d(point), robot's camera axes: the part of the point's motion across the line of sight, over its
    // distance.
    let by_point = [0, 1].map(|k| pose.r.tr_mul(&((axes[k] - u * residual[k]) / distance)));
    // r' = r exp(-step): to first order q moves by r (offset x step).
    let rows = by_point.map(|g| {
        let turn = g.cross(&offset);
        Vector6::new(-g.x, -g.y, -g.z, turn.x, turn.y, turn.z)
    });
    let point = &correspondence.point.coords;
    let depth = point * (correspondence.depth_sd_m / point.z);
    let along = by_point.map(|g| g.dot(&depth));
    let across = correspondence.direction_sd_rad * point.norm() / distance;
    let isotropic = correspondence.ray_sd_rad * correspondence.ray_sd_rad + across * across;
    // The inverse of isotropic I + along along^T.
    let total = isotropic * (isotropic + along[0] * along[0] + along[1] * along[1]);
    if total.is_nan() || total <= 0.0 {
        return None;
    }
    let inverse_noise = [
        (isotropic + along[1] * along[1]) / total,
        -along[0] * along[1] / total,
        (isotropic + along[0] * along[0]) / total,
    ];
    let [n00, n01, n11] = inverse_noise;
    let whitened = [rows[0] * n00 + rows[1] * n01, rows[0] * n01 + rows[1] * n11];
    Some(Linearised { residual, rows, whitened, inverse_noise })
}
