//! SLING's two switches (section 3.4): from goal discovery to last-mile navigation, and back. One file per kind.

mod fused;
mod learned;
mod sling;

use homing_core::{Mode, PlanarPose};

use crate::hypothesis::Hypothesis;

/// What the switches look at.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub enum SwitchKind {
    /// Our own: a hypothesis fused of all estimates, by its support and distance.
    #[default]
    Fused,
    /// SLING's as published: one estimate, by its matches and distance. Nothing is fused: each estimate that is driven to
    /// takes the place of the last.
    Sling,
    /// SLING's with NRNS's MLP for the way in (SLING table 2, rows 3 and 4): by the likeness of image and photo. The pose is
    /// that of the same estimate, and the way back is SLING's.
    Learned {
        /// Last-mile navigation begins above this probability.
        probability_min: f32,
    },
}

impl SwitchKind {
    /// With NRNS's threshold.
    pub const LEARNED: Self = Self::Learned { probability_min: 0.55 };
}

/// Whether there is a way back from last-mile navigation to goal discovery.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub enum Recovery {
    /// There is.
    #[default]
    On,
    /// One-sided flow of control (SLING table 2, "w/o Recovery"): once driving to a goal the robot goes there, or as near as
    /// a way leads, and stops.
    Off,
}

/// When a goal estimate is worth driving to.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct SwitchConfig {
    /// What is looked at.
    pub kind: SwitchKind,
    /// Whether there is a way back.
    pub recovery: Recovery,
    /// SLING's n_th: matches that must count (see [`crate::Evidence`]), in one estimate or summed over estimates that agree.
    /// [`SwitchKind::Sling`] counts all matches of one estimate that agree on its pose, and asks for more than this.
    pub n_inliers_min: usize,
    /// SLING's d_th: a goal predicted farther away than this is not driven to, metres.
    pub distance_max_m: f64,
    /// Unless this multiple of `n_inliers_min` stands behind it, in at least two estimates.
    pub far_factor: f64,
    /// Steps without a sighting after which the goal is searched for again.
    pub unseen_steps_max: u64,
    /// A place that no way leads to is tried again after this many steps.
    pub parked_steps: u64,
}

impl Default for SwitchConfig {
    fn default() -> Self {
        Self {
            kind: SwitchKind::default(),
            recovery: Recovery::default(),
            n_inliers_min: 15,
            distance_max_m: 4.0,
            far_factor: 2.0,
            unseen_steps_max: 150,
            parked_steps: 40,
        }
    }
}

/// What the switches say.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Drive to the hypothesis.
    Exploit,
    /// Search on; why.
    Explore(&'static str),
}

/// What one estimate says, for the kinds that look at no more.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) struct Look {
    /// The pose found; `None` if the optimisation failed.
    pub pose: Option<LookPose>,
    /// Probability that the image was taken within a step's reach of the photo; `None` without a learned switch.
    pub probability: Option<f32>,
}

/// A pose found in one image.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) struct LookPose {
    /// Matches that agree on it.
    pub n_inliers: usize,
    /// From where the image was taken, along the floor, metres.
    pub distance_m: f64,
}

/// What there is to decide on.
#[derive(Copy, Clone, Debug)]
pub(crate) struct Outlook<'a> {
    /// What is believed best.
    pub hypothesis: Option<&'a Hypothesis>,
    /// What came at this step, if anything did.
    pub look: Option<&'a Look>,
    /// Where the robot is.
    pub pose: &'a PlanarPose,
    /// The step.
    pub step: u64,
}

impl SwitchConfig {
    /// Explore to exploit.
    #[must_use]
    pub(crate) fn enter(&self, outlook: &Outlook<'_>) -> Verdict {
        match (self.kind, outlook.look) {
            (SwitchKind::Fused, _) => fused::enter(self, outlook),
            (_, None) => Verdict::Explore("no estimate came"),
            (SwitchKind::Sling, Some(look)) => sling::enter(self, look),
            (SwitchKind::Learned { probability_min }, Some(look)) => learned::enter(self, probability_min, look),
        }
    }

    /// Exploit to explore.
    #[must_use]
    pub(crate) fn stay(&self, outlook: &Outlook<'_>) -> Verdict {
        match (self.recovery, self.kind, outlook.look) {
            (Recovery::Off, ..) if outlook.hypothesis.is_some() => Verdict::Exploit,
            (Recovery::On, SwitchKind::Sling | SwitchKind::Learned { .. }, Some(look)) => sling::stay(self, look),
            (Recovery::On, SwitchKind::Fused, _) => fused::stay(self, outlook),
            (Recovery::On, _, None) if outlook.hypothesis.is_some() => Verdict::Exploit,
            _ => Verdict::Explore("the goal was lost"),
        }
    }

    /// Whether the pose of one estimate, heard in `mode`, takes the hypothesis's place: the rule of the kinds that fuse
    /// nothing.
    #[must_use]
    pub(crate) fn takes(&self, mode: Mode, look: &Look) -> Verdict {
        match (mode, self.kind) {
            (Mode::Explore, SwitchKind::Learned { probability_min }) => learned::enter(self, probability_min, look),
            (Mode::Explore, _) => sling::enter(self, look),
            _ => sling::stay(self, look),
        }
    }
}
