//! Estimated against recorded relative poses.

use homing_core::{Camera, Goal, Transform};

/// The errors of one estimated relative pose.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct PairScore {
    /// Distance between estimated and true position of the goal camera, metres.
    pub translation_m: f64,
    /// Angle between estimated and true orientation, degrees, 0 to 180.
    pub rotation_deg: f64,
}

impl PairScore {
    /// Compares an estimate of the goal's pose in the camera with the truth.
    #[must_use]
    pub fn of(estimate: &Transform<Camera, Goal>, truth: &Transform<Camera, Goal>) -> Self {
        Self {
            translation_m: (estimate.translation() - truth.translation()).norm(),
            rotation_deg: estimate.rotation().angle_to(&truth.rotation()).to_degrees(),
        }
    }

    /// True if both errors are at most these, metres and degrees. An error that is not a number is not within anything.
    #[must_use]
    pub fn is_within(&self, translation_m: f64, rotation_deg: f64) -> bool {
        self.translation_m <= translation_m && self.rotation_deg <= rotation_deg
    }
}

/// The errors of many pairs.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct PairSummary {
    /// Pairs asked about.
    pub n_pairs: usize,
    /// Pairs for which a pose was estimated.
    pub n_posed: usize,
    /// Share of all pairs within 0.25 m and 10 degrees, 0 to 1.
    pub within_25cm_10deg: f64,
    /// Share of all pairs within 0.1 m and 5 degrees, 0 to 1.
    pub within_10cm_5deg: f64,
    /// Median over all pairs, a pair without a pose counting as infinitely wrong; infinite where half have none, metres.
    pub translation_m_median: f64,
    /// The same of the rotation, degrees.
    pub rotation_deg_median: f64,
}

impl PairSummary {
    /// Sums up; `None` is a pair without a pose, which counts as failed. No pairs at all give shares of 0.
    #[must_use]
    pub fn of(scores: &[Option<PairScore>]) -> Self {
        let share = |m: f64, deg: f64| {
            let within = scores.iter().flatten().filter(|score| score.is_within(m, deg)).count();
            within as f64 / scores.len().max(1) as f64
        };
        let all =
            |error: fn(&PairScore) -> f64| scores.iter().map(|s| s.as_ref().map_or(f64::INFINITY, error)).collect();
        Self {
            n_pairs: scores.len(),
            n_posed: scores.iter().flatten().count(),
            within_25cm_10deg: share(0.25, 10.0),
            within_10cm_5deg: share(0.1, 5.0),
            translation_m_median: median(all(|score| score.translation_m)),
            rotation_deg_median: median(all(|score| score.rotation_deg)),
        }
    }
}

// The middle one, or the mean of the two middle ones; infinite for none.
fn median(mut errors: Vec<f64>) -> f64 {
    errors.sort_by(f64::total_cmp);
    let middle = errors.len() / 2;
    match errors.as_slice() {
        [] => f64::INFINITY,
        sorted if sorted.len() % 2 == 1 => sorted[middle],
        sorted => 0.5 * (sorted[middle - 1] + sorted[middle]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Isometry3, Vector3};

    fn pose(x_m: f64, yaw_deg: f64) -> Transform<Camera, Goal> {
        Transform::new(Isometry3::new(Vector3::new(x_m, 0.0, 1.0), Vector3::y() * yaw_deg.to_radians()))
    }

    #[test]
    fn errors_are_what_they_say() {
        let score = PairScore::of(&pose(0.2, 170.0), &pose(0.0, -175.0));
        assert!((score.translation_m - 0.2).abs() < 1e-12);
        assert!((score.rotation_deg - 15.0).abs() < 1e-9);
        assert!(score.is_within(0.21, 15.1) && !score.is_within(0.19, 15.1) && !score.is_within(0.21, 14.9));
        assert!(!PairScore { translation_m: f64::NAN, rotation_deg: 0.0 }.is_within(1.0, 1.0));
    }

    #[test]
    fn a_pair_without_a_pose_has_failed() {
        let good = Some(PairScore { translation_m: 0.05, rotation_deg: 1.0 });
        let fair = Some(PairScore { translation_m: 0.2, rotation_deg: 4.0 });
        let summary = PairSummary::of(&[good, None, fair, good]);
        assert_eq!((summary.n_pairs, summary.n_posed), (4, 3));
        assert_eq!((summary.within_25cm_10deg, summary.within_10cm_5deg), (0.75, 0.5));
        assert!((summary.translation_m_median - 0.125).abs() < 1e-12);
        assert_eq!(PairSummary::of(&[None, good, None]).translation_m_median, f64::INFINITY);
        assert_eq!(PairSummary::of(&[]).within_10cm_5deg, 0.0);
    }
}
