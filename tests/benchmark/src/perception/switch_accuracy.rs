//! How often one estimate decides rightly between exploring and driving to the goal (SLING 3.4).

use homing_planner::SwitchConfig;
use serde::{Deserialize, Serialize};

use super::findings::{Finding, FoundPose};
use super::pairs::PairFacts;
use super::statistics::Share;
use crate::cause::{RIGHT_M, RIGHT_RAD};

/// Accuracy of both of SLING's switches on single estimates.
///
/// A pair has the goal in view if the two views share at least 0.3 and lie nearer than d_th; it has not if they share less
/// than 0.1, lie farther apart, or are of two flats. What is in between is half in view, and is not counted: either answer
/// is right. Explore to exploit: a pose with at least n_th inliers, nearer than d_th. Exploit to explore: no pose, or one
/// farther than d_th. Each is right if it exploits where the goal is in view, and explores where it is not. SLING's paper
/// gives 92.0 % and 84.1 % over 6,500 pairs of its own, whose composition it does not tell; here half of the pairs have
/// the goal in view, and of the other half one part is of the same flat and one of another.
#[derive(Copy, Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SwitchAccuracy {
    /// n_th: fewest inliers.
    pub n_inliers_min: usize,
    /// d_th, metres.
    pub distance_m_max: f64,
    /// From exploring to driving to the goal.
    pub explore_to_exploit: Decisions,
    /// And back.
    pub exploit_to_explore: Decisions,
}

/// Decisions of one switch.
#[derive(Copy, Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Decisions {
    /// Right decisions of all.
    pub right: Share,
    /// Of the pairs with the goal in view: exploited.
    pub in_view: Share,
    /// Of the pairs without: explored.
    pub not_in_view: Share,
    /// Of what was exploited with the goal in view: the pose was a wrong place, off by more than 1 m or 30 degrees.
    pub wrong_place: Share,
    /// Of what was exploited without the goal in view: the pose was right all the same, by the little that is shared.
    pub right_place_unseen: Share,
}

impl SwitchAccuracy {
    /// Of the findings for all pairs.
    #[must_use]
    pub fn of(pairs: &[PairFacts], findings: &[Finding]) -> Self {
        let config = SwitchConfig::default();
        let (n_th, d_th) = (config.n_inliers_min, config.distance_max_m);
        let decided: Vec<(bool, &Finding)> =
            pairs.iter().zip(findings).filter_map(|(p, f)| Some((p.goal_in_view()?, f))).collect();
        Self {
            n_inliers_min: n_th,
            distance_m_max: d_th,
            explore_to_exploit: Decisions::of(&decided, |p| p.n_inliers >= n_th && p.distance_m < d_th),
            exploit_to_explore: Decisions::of(&decided, |p| p.distance_m < d_th),
        }
    }
}

impl Decisions {
    fn of(decided: &[(bool, &Finding)], drives_to: impl Fn(&FoundPose) -> bool) -> Self {
        let exploits = |f: &Finding| f.pose().is_some_and(&drives_to);
        let with = |view: bool| decided.iter().filter(move |(in_view, _)| *in_view == view).map(|(_, f)| *f);
        Self {
            right: Share::of(decided, |(in_view, f)| exploits(f) == *in_view),
            in_view: Share::of(with(true), |f| exploits(f)),
            not_in_view: Share::of(with(false), |f| !exploits(f)),
            wrong_place: Share::of(with(true).filter(|f| exploits(f)), |f| !is_right(f)),
            right_place_unseen: Share::of(with(false).filter(|f| exploits(f)), |f| is_right(f)),
        }
    }
}

fn is_right(finding: &Finding) -> bool {
    finding.error().is_some_and(|e| e.position_m <= RIGHT_M && e.rotation_deg <= RIGHT_RAD.to_degrees())
}

#[cfg(test)]
mod tests {
    use super::super::findings::PoseError;
    use super::*;

    #[test]
    fn a_switch_is_right_where_it_exploits_what_is_in_view() {
        let facts = PairFacts::seen;
        let pose = |n_inliers, distance_m, position_m: Option<f64>| {
            let error = position_m.map(|position_m| PoseError { position_m, rotation_deg: 1.0, direction_deg: 1.0 });
            Finding::Pose(FoundPose { n_inliers, distance_m, error })
        };
        let (view, half, none) = (facts(0.5, Some(2.0)), facts(0.2, Some(2.0)), facts(0.0, None));
        let cases = [
            (view, pose(30, 2.0, Some(0.1))),                   // right, right
            (view, pose(10, 2.0, Some(0.1))),                   // too few to begin with, enough to go on
            (view, pose(30, 3.5, Some(1.5))),                   // exploits, and drives to a wrong place
            (view, pose(30, 4.5, Some(2.5))),                   // too far for both
            (view, Finding::Bearing),                           // no pose for both
            (half, Finding::NotSeen),                           // not counted
            (none, pose(30, 2.0, None)),                        // wrong, wrong
            (none, pose(8, 2.0, None)),                         // right, wrong
            (none, Finding::NotSeen),                           // right, right
            (facts(0.05, Some(1.0)), pose(20, 1.0, Some(0.1))), // counts as wrong, though the place is right
        ];
        let (pairs, findings): (Vec<_>, Vec<_>) = cases.into_iter().unzip();
        let s = SwitchAccuracy::of(&pairs, &findings);
        let counts = |share: Share| (share.n_hits, share.n);
        let enter = s.explore_to_exploit;
        assert_eq!(counts(enter.right), (4, 9));
        assert_eq!((counts(enter.in_view), counts(enter.not_in_view)), ((2, 5), (2, 4)));
        assert_eq!((counts(enter.wrong_place), counts(enter.right_place_unseen)), ((1, 2), (1, 2)));
        assert_eq!(counts(s.exploit_to_explore.right), (4, 9));
        assert_eq!(counts(s.exploit_to_explore.in_view), (3, 5));
    }
}
