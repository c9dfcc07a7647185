//! The learned way in of NRNS (Hahn et al. 2021), SLING's baseline: an MLP holds image and photo for neighbours.

use super::{Look, Recovery, SwitchConfig, Verdict, sling};

/// Explore to exploit: the probability is above the threshold. The pose is PnP's, whatever its matches; an image without one
/// gives nothing to drive to. With recovery a pose that SLING's way back would refuse at once is not driven to.
pub(super) fn enter(config: &SwitchConfig, probability_min: f32, look: &Look) -> Verdict {
    match (look.probability, look.pose, config.recovery) {
        (None, ..) => Verdict::Explore("perception has no learned switch"),
        (Some(p), ..) if p <= probability_min || p.is_nan() => Verdict::Explore("the photo's place looks different"),
        (Some(_), Some(_), Recovery::Off) => Verdict::Exploit,
        _ => sling::stay(config, look),
    }
}

#[cfg(test)]
mod tests {
    use homing_core::{Mode, PlanarPose};

    use super::super::{Look, LookPose, Outlook, Recovery, SwitchConfig, SwitchKind, Verdict};

    fn look(probability: Option<f32>, pose: Option<(usize, f64)>) -> Look {
        Look { pose: pose.map(|(n_inliers, distance_m)| LookPose { n_inliers, distance_m }), probability }
    }

    fn says(recovery: Recovery, probability: Option<f32>, pose: Option<(usize, f64)>) -> bool {
        let config = SwitchConfig { kind: SwitchKind::LEARNED, recovery, ..SwitchConfig::default() };
        let (look, pose) = (look(probability, pose), PlanarPose::default());
        let outlook = Outlook { hypothesis: None, look: Some(&look), pose: &pose, step: 1 };
        assert_eq!(config.enter(&outlook), config.takes(Mode::Explore, &look));
        config.enter(&outlook) == Verdict::Exploit
    }

    #[test]
    fn likeness_decides_the_way_in_whatever_the_matches() {
        for recovery in [Recovery::On, Recovery::Off] {
            assert!(says(recovery, Some(0.56), Some((7, 3.9))));
            assert!(!says(recovery, Some(0.55), Some((99, 1.0))));
            assert!(!says(recovery, Some(f32::NAN), Some((99, 1.0))));
            assert!(!says(recovery, None, Some((99, 1.0))));
            assert!(!says(recovery, Some(0.99), None));
        }
    }

    #[test]
    fn a_far_prediction_is_driven_to_only_where_there_is_no_way_back() {
        assert!(!says(Recovery::On, Some(0.9), Some((99, 4.1))));
        assert!(says(Recovery::Off, Some(0.9), Some((99, 4.1))));
    }

    #[test]
    fn likeness_does_not_count_on_the_way_back() {
        let config = SwitchConfig { kind: SwitchKind::LEARNED, ..SwitchConfig::default() };
        assert_eq!(config.takes(Mode::Exploit, &look(Some(0.0), Some((7, 3.9)))), Verdict::Exploit);
        assert!(matches!(config.takes(Mode::Align, &look(Some(1.0), None)), Verdict::Explore(_)));
    }
}
