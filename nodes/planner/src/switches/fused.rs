//! Our own switches: the fused hypothesis, with the evidence of all estimates that agreed.

use super::{Outlook, SwitchConfig, Verdict};
use crate::hypothesis::Hypothesis;

/// Explore to exploit: enough agreeing matches, near enough.
pub(super) fn enter(config: &SwitchConfig, outlook: &Outlook<'_>) -> Verdict {
    let Some(hypothesis) = outlook.hypothesis else { return Verdict::Explore("the goal has not been seen") };
    let n_th = config.n_inliers_min as f64;
    let distance_m = outlook.pose.distance_to(hypothesis.pose.x_m, hypothesis.pose.y_m);
    if hypothesis.support < n_th {
        Verdict::Explore("too few matches agree on a goal")
    } else if outlook.step.saturating_sub(hypothesis.last_seen_step) > config.unseen_steps_max {
        Verdict::Explore("the goal has not been seen for long")
    } else if distance_m < config.distance_max_m || is_sure(config, hypothesis) {
        Verdict::Exploit
    } else {
        Verdict::Explore("the goal seems too far away to be sure")
    }
}

/// Exploit to explore: the prediction has moved beyond d_th, or its support is gone. A goal once near enough stays while
/// a detour leads away from it, as long as nothing speaks against it.
pub(super) fn stay(config: &SwitchConfig, outlook: &Outlook<'_>) -> Verdict {
    let Some(hypothesis) = outlook.hypothesis else { return Verdict::Explore("the goal was lost") };
    let distance_m = outlook.pose.distance_to(hypothesis.pose.x_m, hypothesis.pose.y_m);
    if hypothesis.support < 0.5 * config.n_inliers_min as f64 {
        Verdict::Explore("too little speaks for the goal any more")
    } else if outlook.step.saturating_sub(hypothesis.last_seen_step) > config.unseen_steps_max {
        Verdict::Explore("the goal has not been seen for long")
    } else if distance_m > 1.5 * config.distance_max_m && !is_sure(config, hypothesis) {
        Verdict::Explore("the goal seems too far away to be sure")
    } else {
        Verdict::Exploit
    }
}

fn is_sure(config: &SwitchConfig, hypothesis: &Hypothesis) -> bool {
    hypothesis.n_fused >= 2 && hypothesis.support >= config.far_factor * config.n_inliers_min as f64
}

#[cfg(test)]
mod tests {
    use homing_core::{PlanarPose, Stamp};
    use nalgebra::Matrix3;

    use super::super::{Outlook, Recovery, SwitchConfig, Verdict};
    use crate::evidence::Evidence;
    use crate::hypothesis::{Hypothesis, Measurement};

    /// Seen at step 10 from the origin, `x_m` ahead.
    fn hypothesis(x_m: f64, support: f64, n_fused: usize) -> Hypothesis {
        let pose = PlanarPose { x_m, y_m: 0.0, yaw_rad: 0.0 };
        let evidence = Evidence { n_inliers: 1, n_off_floor: 1, n_cells: None };
        let from = PlanarPose::default();
        let (stamp, covariance) = (Stamp(0), Matrix3::identity());
        let measurement = Measurement { stamp, pose, covariance, evidence, from, range_m: x_m, turn_rad: 0.0 };
        Hypothesis { support, n_fused, ..Hypothesis::new(&measurement, 10) }
    }

    fn decide(config: SwitchConfig, hypothesis: Option<&Hypothesis>, step: u64) -> (Verdict, Verdict) {
        let pose = PlanarPose::default();
        let outlook = Outlook { hypothesis, look: None, pose: &pose, step };
        (config.enter(&outlook), config.stay(&outlook))
    }

    #[test]
    fn support_distance_and_time_decide_on_the_fused_hypothesis() {
        let config = SwitchConfig::default();
        let says = |x_m, support, n_fused, step| {
            let (enter, stay) = decide(config, Some(&hypothesis(x_m, support, n_fused)), step);
            (enter == Verdict::Exploit, stay == Verdict::Exploit)
        };
        // n_th is 15, half of it keeps a goal; d_th is 4 m, 6 m keep one, twice n_th in two estimates needs no limit.
        assert_eq!(says(3.9, 15.0, 1, 10), (true, true));
        assert_eq!(says(3.9, 14.9, 1, 10), (false, true));
        assert_eq!(says(3.9, 7.4, 1, 10), (false, false));
        assert_eq!(says(4.1, 29.9, 2, 10), (false, true));
        assert_eq!(says(6.1, 29.9, 2, 10), (false, false));
        assert_eq!(says(6.1, 30.0, 2, 10), (true, true));
        assert_eq!(says(6.1, 30.0, 1, 10), (false, false));
        assert_eq!(says(1.0, 99.0, 3, 160), (true, true));
        assert_eq!(says(1.0, 99.0, 3, 161), (false, false));
        assert!(decide(config, None, 10).0 != Verdict::Exploit && decide(config, None, 10).1 != Verdict::Exploit);
    }

    #[test]
    fn without_recovery_only_a_goal_that_is_not_there_is_left() {
        let config = SwitchConfig { recovery: Recovery::Off, ..SwitchConfig::default() };
        let (enter, stay) = decide(config, Some(&hypothesis(9.0, 1.0, 1)), 999);
        assert!(matches!(enter, Verdict::Explore(_)), "the way in is as it was");
        assert_eq!(stay, Verdict::Exploit);
        assert_eq!(decide(config, None, 0).1, Verdict::Explore("the goal was lost"));
    }
}
