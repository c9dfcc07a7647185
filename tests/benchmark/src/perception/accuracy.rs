//! How often and how well the goal's pose is found, by class of pair.

use homing_sim::views::OVERLAP_MIN;
use serde::{Deserialize, Serialize};

use super::findings::{Finding, PoseError};
use super::pairs::{IN_VIEW_OVERLAP_MIN, PairFacts};
use super::statistics::{Share, area_under_curve};

/// Greatest yaw difference of the headline's pairs, degrees.
pub const HEADLINE_TURN_DEG: f64 = 60.0;
/// Thresholds of the areas under the curve, degrees.
pub const AUC_DEG: [f64; 3] = [5.0, 10.0, 20.0];

/// How near a pose must be to count: metres and degrees.
#[derive(Copy, Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tolerance {
    /// Metres.
    pub position_m: f64,
    /// Degrees.
    pub rotation_deg: f64,
}

/// The tolerances of every table.
pub const TOLERANCES: [Tolerance; 3] = [
    Tolerance { position_m: 0.25, rotation_deg: 10.0 },
    Tolerance { position_m: 0.1, rotation_deg: 5.0 },
    Tolerance { position_m: 0.1, rotation_deg: 2.0 },
];

impl Tolerance {
    /// Whether a finding is a pose within it.
    #[must_use]
    pub fn holds(&self, finding: &Finding) -> bool {
        finding.error().is_some_and(|e| e.position_m <= self.position_m && e.rotation_deg <= self.rotation_deg)
    }

    /// For tables.
    #[must_use]
    pub fn words(&self) -> String {
        format!("{} m / {} deg", self.position_m, self.rotation_deg)
    }
}

/// A class of pairs.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Class {
    /// Sharing at least [`IN_VIEW_OVERLAP_MIN`], turned by at most [`HEADLINE_TURN_DEG`].
    Headline,
    /// Every pair.
    All,
    /// Overlap from the first to below the second.
    Overlap(f64, f64),
    /// Turned by the first to below the second, degrees.
    Turn(f64, f64),
    /// Same light and furniture, or changed.
    State {
        /// Which.
        same: bool,
    },
    /// Recorded so many frames apart.
    Apart(u32),
}

/// Bounds of the classes of overlap; the first is the least a pair shares.
const OVERLAPS: [f64; 5] = [OVERLAP_MIN, 0.3, 0.5, 0.7, 1.01];
/// Bounds of the classes of turn, degrees.
const TURNS_DEG: [f64; 5] = [0.0, 15.0, 30.0, 60.0, 180.1];

impl Class {
    /// By overlap.
    #[must_use]
    pub fn by_overlap() -> Vec<Self> {
        OVERLAPS.windows(2).map(|w| Self::Overlap(w[0], w[1])).collect()
    }

    /// By turn.
    #[must_use]
    pub fn by_turn() -> Vec<Self> {
        TURNS_DEG.windows(2).map(|w| Self::Turn(w[0], w[1])).collect()
    }

    /// Whether a pair belongs to it.
    #[must_use]
    pub fn holds(&self, facts: &PairFacts) -> bool {
        let turned = |low: f64, high: f64| facts.turn_deg.is_some_and(|deg| (low..high).contains(&deg));
        match *self {
            Self::Headline => {
                facts.overlap >= IN_VIEW_OVERLAP_MIN && facts.turn_deg.is_some_and(|d| d <= HEADLINE_TURN_DEG)
            }
            Self::All => true,
            Self::Overlap(low, high) => (low..high).contains(&facts.overlap),
            Self::Turn(low, high) => turned(low, high),
            Self::State { same } => facts.same_state == same,
            Self::Apart(frames) => facts.frames_apart == Some(frames),
        }
    }

    /// For tables.
    #[must_use]
    pub fn words(&self) -> String {
        match *self {
            Self::Headline => {
                format!("overlap >= {IN_VIEW_OVERLAP_MIN}, turned <= {HEADLINE_TURN_DEG} deg")
            }
            Self::All => "all pairs".to_owned(),
            Self::Overlap(low, high) if high > 1.0 => format!("overlap {low} and more"),
            Self::Overlap(low, high) => format!("overlap {low} to {high}"),
            Self::Turn(low, high) if high > 180.0 => format!("turned {low} deg and more"),
            Self::Turn(low, high) => format!("turned {low} to {high} deg"),
            Self::State { same: true } => "same light and furniture".to_owned(),
            Self::State { same: false } => "light and furniture changed".to_owned(),
            Self::Apart(frames) => format!("{frames} frames apart"),
        }
    }
}

/// Accuracy of one configuration on one class.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Accuracy {
    /// Which pairs.
    pub class: String,
    /// How many.
    pub n: usize,
    /// Pairs with a pose, right or wrong.
    pub n_poses: usize,
    /// Pairs with a direction alone; they count as failed.
    pub n_bearings: usize,
    /// Areas under the curve at [`AUC_DEG`], of the greater of rotation and direction error.
    pub auc: [f64; 3],
    /// Shares within [`TOLERANCES`].
    pub within: [Share; 3],
    /// Median position error of all pairs, those without a pose infinitely wrong: `None` where half have none. Metres.
    pub position_m_median: Option<f64>,
    /// The same of the rotation, degrees.
    pub rotation_deg_median: Option<f64>,
}

/// SuperGlue's pose error: the greater of rotation and direction error, degrees; infinite without a pose. Depth tells
/// the sign of the direction, so opposite directions are 180 degrees apart, where SuperGlue counts 0.
#[must_use]
pub fn angular_error_deg(finding: &Finding) -> f64 {
    finding.error().map_or(f64::INFINITY, |e| e.rotation_deg.max(e.direction_deg))
}

impl Accuracy {
    /// Of the findings for a class of pairs.
    #[must_use]
    pub fn of(class: &Class, findings: &[Finding]) -> Self {
        let errors: Vec<f64> = findings.iter().map(angular_error_deg).collect();
        let count = |keep: fn(&Finding) -> bool| findings.iter().filter(|f| keep(f)).count();
        let typical = |of: fn(&PoseError) -> f64| {
            let all = findings.iter().map(|f| f.error().as_ref().map_or(f64::INFINITY, of)).collect();
            crate::report::median(all).filter(|m| m.is_finite())
        };
        Self {
            class: class.words(),
            n: findings.len(),
            n_poses: count(|f| f.pose().is_some()),
            n_bearings: count(|f| *f == Finding::Bearing),
            auc: AUC_DEG.map(|deg| area_under_curve(&errors, deg)),
            within: TOLERANCES.map(|t| Share::of(findings, |f| t.holds(f))),
            position_m_median: typical(|e| e.position_m),
            rotation_deg_median: typical(|e| e.rotation_deg),
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Vector3};

    use super::super::findings::FoundPose;
    use super::*;

    fn pose(position_m: f64, rotation_deg: f64, direction_deg: f64) -> Finding {
        let error = Some(PoseError { position_m, rotation_deg, direction_deg });
        Finding::Pose(FoundPose { n_inliers: 20, distance_m: 1.0, error })
    }

    #[test]
    fn whatever_is_no_pose_has_failed() {
        let findings = [pose(0.05, 1.0, 3.0), pose(0.2, 1.0, 0.5), Finding::Bearing, Finding::NotSeen];
        let a = Accuracy::of(&Class::All, &findings);
        assert_eq!((a.n, a.n_poses, a.n_bearings), (4, 2, 1));
        assert_eq!(a.within.map(|s| s.n_hits), [2, 1, 1]);
        // Errors 1 and 3 of 4, up to 5: half of the area worked out in `statistics`.
        assert!((a.auc[0] - 0.375).abs() < 1e-12);
        assert_eq!(a.position_m_median, None);
        let a = Accuracy::of(&Class::All, &findings[..3]);
        assert_eq!((a.position_m_median, a.rotation_deg_median), (Some(0.2), Some(1.0)));
    }

    #[test]
    fn the_errors_of_a_pose_are_what_they_say() {
        let at = |x_m: f64, yaw_deg: f64| {
            homing_core::Transform::new(Isometry3::new(
                Vector3::new(x_m, 0.0, 2.0),
                Vector3::y() * yaw_deg.to_radians(),
            ))
        };
        let error = PoseError::of(&at(2.0, 175.0), &at(0.0, -170.0));
        assert!((error.position_m - 2.0).abs() < 1e-12);
        assert!((error.rotation_deg - 15.0).abs() < 1e-9);
        assert!((error.direction_deg - 45.0).abs() < 1e-9);
        let here = homing_core::Transform::new(Isometry3::identity());
        assert_eq!(PoseError::of(&at(1.0, 0.0), &here).direction_deg, 0.0, "no direction leads to where one stands");
    }

    #[test]
    fn every_pair_has_one_class_of_each_kind() {
        let facts = |overlap, turn_deg| PairFacts {
            kind: super::super::pairs::PairKind::Seen,
            cluster: 0,
            query: 0,
            goal: 1,
            overlap,
            turn_deg: Some(turn_deg),
            distance_m: Some(1.0),
            same_state: true,
            frames_apart: None,
        };
        for (overlap, turn_deg) in [(0.1, 0.0), (0.3, 15.0), (0.69, 60.0), (1.0, 180.0)] {
            let pair = facts(overlap, turn_deg);
            assert_eq!(Class::by_overlap().iter().filter(|c| c.holds(&pair)).count(), 1);
            assert_eq!(Class::by_turn().iter().filter(|c| c.holds(&pair)).count(), 1);
        }
        assert!(Class::Headline.holds(&facts(0.3, 60.0)));
        assert!(!Class::Headline.holds(&facts(0.29, 10.0)) && !Class::Headline.holds(&facts(0.5, 60.1)));
    }
}
