//! One place where the goal may be: a Gaussian over (x, y, yaw) of the base at the goal, and how far it is to be believed.

use homing_core::{GoalHypothesis, PlanarPose, Stamp, wrap_angle};

use crate::evidence::Evidence;
use nalgebra::{Matrix3, Vector3};

/// A view is a new one if the body moved or turned this much since the last.
const NEW_VIEW_M: f64 = 0.05;
const NEW_VIEW_RAD: f64 = 0.09;
/// What a view that is not new counts for.
const STALE_VIEW: f64 = 0.2;
/// Misses from places nearer than this are one miss, metres.
const SAME_PLACE_M: f64 = 0.2;
/// A place that was seen so often, on so long a way towards it (metres), is known by a crowd of matches alone.
const APPROACHED_VIEWS: usize = 5;
const APPROACHED_M: f64 = 1.0;
const CROWD: usize = 100;
/// Share of the old support that a new view replaces: what is seen now, from nearer, says more than what was seen often.
const LEAK: f64 = 0.1;

/// A measured goal pose in the odometry frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Measurement {
    /// Stamp of the image.
    pub stamp: Stamp,
    /// Pose of the base at which the camera coincides with the goal camera, odometry frame.
    pub pose: PlanarPose,
    /// Covariance of (x, y, yaw), m and rad.
    pub covariance: Matrix3<f64>,
    /// What stands behind it.
    pub evidence: Evidence,
    /// Pose of the base when the image was taken, odometry frame.
    pub from: PlanarPose,
    /// Distance from the robot when the image was taken, metres.
    pub range_m: f64,
    /// Difference between the robot's heading then and the goal's, radians, not negative.
    pub turn_rad: f64,
}

/// A goal hypothesis with its history.
#[derive(Clone, Debug, PartialEq)]
pub struct Hypothesis {
    /// Mean.
    pub pose: PlanarPose,
    /// Covariance of (x, y, yaw).
    pub covariance: Matrix3<f64>,
    /// Estimates fused.
    pub n_fused: usize,
    /// Sum of inliers of what agreed, less what spoke against it.
    pub support: f64,
    /// Most inliers of one estimate.
    pub n_inliers_best: usize,
    /// Stamp of the newest agreeing estimate.
    pub last_seen: Stamp,
    /// Step of the newest agreeing estimate.
    pub last_seen_step: u64,
    /// Smallest distance at which an estimate agreed, metres.
    pub nearest_m: f64,
    /// Largest distance at which an estimate agreed, metres.
    pub farthest_m: f64,
    /// Largest difference of heading at which an estimate agreed, radians.
    pub widest_rad: f64,
    /// Where the robot was at the newest agreeing estimate.
    pub seen_from: PlanarPose,
    /// Views in a row that were all but the photo's own and did not show it.
    pub n_misses: u32,
    /// Views in a row that were no worse than those that showed it, and did not.
    pub n_missed: u32,
    /// Where the robot was at the newest of these.
    pub missed_from: Option<PlanarPose>,
    /// Not to be driven to before this step: no way led there.
    pub parked_until: u64,
}

impl Hypothesis {
    /// From a first measurement.
    pub fn new(measurement: &Measurement, step: u64) -> Self {
        Self {
            pose: measurement.pose,
            covariance: measurement.covariance,
            n_fused: 1,
            support: measurement.evidence.n_inliers as f64,
            n_inliers_best: measurement.evidence.n_inliers,
            last_seen: measurement.stamp,
            last_seen_step: step,
            nearest_m: measurement.range_m,
            farthest_m: measurement.range_m,
            widest_rad: measurement.turn_rad,
            seen_from: measurement.from,
            n_misses: 0,
            n_missed: 0,
            missed_from: None,
            parked_until: 0,
        }
    }

    /// Squared Mahalanobis distance of a measurement; infinite if the covariances are degenerate.
    pub fn distance_square(&self, measurement: &Measurement) -> f64 {
        let innovation = difference(&measurement.pose, &self.pose);
        (self.covariance + measurement.covariance)
            .try_inverse()
            .map_or(f64::INFINITY, |inverse| (innovation.transpose() * inverse * innovation).x)
    }

    /// Fuses a measurement in information form: informations add, the mean is their weighted mean. Another look from where
    /// the last one was made shows the same matches with the same errors, so it counts for little.
    pub fn fuse(&mut self, measurement: &Measurement, step: u64) {
        let moved_m = self.seen_from.distance_to(measurement.from.x_m, measurement.from.y_m);
        let turned_rad = wrap_angle(self.seen_from.yaw_rad - measurement.from.yaw_rad).abs();
        let novelty = if moved_m > NEW_VIEW_M || turned_rad > NEW_VIEW_RAD { 1.0 } else { STALE_VIEW };
        let (Some(own), Some(other)) = (self.covariance.try_inverse(), measurement.covariance.try_inverse()) else {
            return;
        };
        let other = other * novelty;
        let Some(covariance) = (own + other).try_inverse() else { return };
        let correction = covariance * other * difference(&measurement.pose, &self.pose);
        self.covariance = symmetric(&covariance);
        self.shift(&correction);
        self.n_fused += 1;
        self.support = self.support * (1.0 - LEAK * novelty) + novelty * measurement.evidence.n_inliers as f64;
        self.seen_from = measurement.from;
        self.n_inliers_best = self.n_inliers_best.max(measurement.evidence.n_inliers);
        self.last_seen = self.last_seen.max(measurement.stamp);
        self.last_seen_step = step;
        self.nearest_m = self.nearest_m.min(measurement.range_m);
        self.farthest_m = self.farthest_m.max(measurement.range_m);
        self.widest_rad = self.widest_rad.max(measurement.turn_rad);
        (self.n_misses, self.n_missed, self.missed_from) = (0, 0, None);
    }

    /// Whether an agreeing measurement speaks for it though its matches crowd in a small part of the image. At the end of a bare
    /// corridor even the photo's own view binds little of it; what repeats by chance does not stay with a place through an
    /// approach.
    pub fn is_borne_out_by(&self, measurement: &Measurement) -> bool {
        self.n_fused >= APPROACHED_VIEWS
            && self.farthest_m > measurement.range_m + APPROACHED_M
            && measurement.evidence.n_off_floor >= CROWD
    }

    /// Whether `pose` is where the hypothesis was seen or missed last: turning there shows the same things again, and what was
    /// not recognised once will not be, however often it is looked at.
    pub fn was_looked_at_from(&self, pose: &PlanarPose) -> bool {
        let from = self.missed_from.unwrap_or(self.seen_from);
        from.distance_to(pose.x_m, pose.y_m) < SAME_PLACE_M
    }

    /// Fuses one scalar: `innovation` with variance `variance`, seen through the row `jacobian` over (x, y, yaw).
    /// Returns false, and changes nothing, if it lies beyond three standard deviations.
    pub fn fuse_scalar(&mut self, jacobian: &Vector3<f64>, innovation: f64, variance: f64) -> bool {
        let gain = self.covariance * jacobian;
        let spread = jacobian.dot(&gain) + variance;
        if !(spread > 0.0 && innovation * innovation <= 9.0 * spread) {
            return false;
        }
        self.shift(&(gain * (innovation / spread)));
        self.covariance = symmetric(&(self.covariance - gain * gain.transpose() / spread));
        true
    }

    /// Odometry drifts between the robot and the place: the older the sighting, the less sure.
    pub fn drift(&mut self, position_variance: f64, yaw_variance: f64) {
        self.covariance[(0, 0)] += position_variance;
        self.covariance[(1, 1)] += position_variance;
        self.covariance[(2, 2)] += yaw_variance;
    }

    /// For people and recordings.
    pub fn report(&self) -> GoalHypothesis {
        GoalHypothesis {
            pose: self.pose,
            covariance: self.covariance,
            n_fused: self.n_fused,
            last_seen: self.last_seen,
        }
    }

    fn shift(&mut self, by: &Vector3<f64>) {
        self.pose.x_m += by.x;
        self.pose.y_m += by.y;
        self.pose.yaw_rad = wrap_angle(self.pose.yaw_rad + by.z);
    }
}

/// `a - b` with the yaw wrapped.
fn difference(a: &PlanarPose, b: &PlanarPose) -> Vector3<f64> {
    Vector3::new(a.x_m - b.x_m, a.y_m - b.y_m, wrap_angle(a.yaw_rad - b.yaw_rad))
}

fn symmetric(m: &Matrix3<f64>) -> Matrix3<f64> {
    (m + m.transpose()) * 0.5
}
