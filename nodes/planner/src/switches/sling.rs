//! SLING's switches as published (section 3.4): one estimate decides.

use super::{Look, SwitchConfig, Verdict};

/// Explore to exploit: n > n_th, and the goal nearer than d_th, or the way back would be taken at once.
pub(super) fn enter(config: &SwitchConfig, look: &Look) -> Verdict {
    match look.pose {
        Some(pose) if pose.n_inliers <= config.n_inliers_min => Verdict::Explore("too few matches agree on a goal"),
        _ => stay(config, look),
    }
}

/// Exploit to explore: the optimisation fails, or its distance is not below d_th.
pub(super) fn stay(config: &SwitchConfig, look: &Look) -> Verdict {
    match look.pose {
        None => Verdict::Explore("no pose explains what is seen"),
        Some(pose) if pose.distance_m < config.distance_max_m => Verdict::Exploit,
        Some(_) => Verdict::Explore("the goal seems too far away to be sure"),
    }
}

#[cfg(test)]
mod tests {
    use homing_core::{Mode, PlanarPose};

    use super::super::{Look, LookPose, Outlook, Recovery, SwitchConfig, SwitchKind, Verdict};

    fn seen(n_inliers: usize, distance_m: f64) -> Look {
        Look { pose: Some(LookPose { n_inliers, distance_m }), probability: None }
    }

    const FAILED: Look = Look { pose: None, probability: None };

    fn sling() -> SwitchConfig {
        SwitchConfig { kind: SwitchKind::Sling, ..SwitchConfig::default() }
    }

    #[test]
    fn one_estimate_decides_by_its_matches_and_its_distance() {
        let config = sling();
        let says = |look: &Look| {
            let exploits = |mode| config.takes(mode, look) == Verdict::Exploit;
            (exploits(Mode::Explore), exploits(Mode::Exploit))
        };
        // "Triggered if n > n_th": 15 are not more than 15. On the way back matches do not count.
        assert_eq!(says(&seen(16, 3.9)), (true, true));
        assert_eq!(says(&seen(15, 3.9)), (false, true));
        assert_eq!(says(&seen(16, 4.0)), (false, false));
        assert_eq!(says(&FAILED), (false, false));
    }

    #[test]
    fn a_step_without_an_estimate_changes_nothing() {
        let (config, pose) = (sling(), PlanarPose::default());
        let outlook = Outlook { hypothesis: None, look: None, pose: &pose, step: 3 };
        assert_eq!(config.enter(&outlook), Verdict::Explore("no estimate came"));
        assert_eq!(config.stay(&outlook), Verdict::Explore("the goal was lost"));
    }

    #[test]
    fn the_way_back_is_the_recovery() {
        let pose = PlanarPose::default();
        let failed = Outlook { hypothesis: None, look: Some(&FAILED), pose: &pose, step: 3 };
        assert_eq!(sling().stay(&failed), Verdict::Explore("no pose explains what is seen"));
        let one_sided = SwitchConfig { recovery: Recovery::Off, ..sling() };
        // Nothing to drive to is no way back: nothing was entered.
        assert_eq!(one_sided.stay(&failed), Verdict::Explore("the goal was lost"));
        assert_eq!(one_sided.takes(Mode::Exploit, &seen(7, 9.0)), sling().takes(Mode::Exploit, &seen(7, 9.0)));
    }
}
