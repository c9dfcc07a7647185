//! SLING's two switches (section 3.4): from goal discovery to last-mile navigation, and back.

use homing_core::PlanarPose;

use crate::hypothesis::Hypothesis;

/// When a goal estimate is worth driving to.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct SwitchConfig {
    /// SLING's n_th: matches that must count (see [`crate::Evidence`]), in one estimate or summed over estimates that agree.
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
        Self { n_inliers_min: 15, distance_max_m: 4.0, far_factor: 2.0, unseen_steps_max: 150, parked_steps: 40 }
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

impl SwitchConfig {
    /// Explore to exploit: enough agreeing matches, near enough.
    #[must_use]
    pub(crate) fn enter(&self, hypothesis: Option<&Hypothesis>, pose: &PlanarPose, step: u64) -> Verdict {
        let Some(hypothesis) = hypothesis else { return Verdict::Explore("the goal has not been seen") };
        let n_th = self.n_inliers_min as f64;
        let distance_m = pose.distance_to(hypothesis.pose.x_m, hypothesis.pose.y_m);
        if hypothesis.support < n_th {
            Verdict::Explore("too few matches agree on a goal")
        } else if step.saturating_sub(hypothesis.last_seen_step) > self.unseen_steps_max {
            Verdict::Explore("the goal has not been seen for long")
        } else if distance_m < self.distance_max_m || self.is_sure(hypothesis) {
            Verdict::Exploit
        } else {
            Verdict::Explore("the goal seems too far away to be sure")
        }
    }

    /// Exploit to explore: the prediction has moved beyond d_th, or its support is gone. A goal once near enough stays while
    /// a detour leads away from it, as long as nothing speaks against it.
    #[must_use]
    pub(crate) fn stay(&self, hypothesis: Option<&Hypothesis>, pose: &PlanarPose, step: u64) -> Verdict {
        let Some(hypothesis) = hypothesis else { return Verdict::Explore("the goal was lost") };
        let distance_m = pose.distance_to(hypothesis.pose.x_m, hypothesis.pose.y_m);
        if hypothesis.support < 0.5 * self.n_inliers_min as f64 {
            Verdict::Explore("too little speaks for the goal any more")
        } else if step.saturating_sub(hypothesis.last_seen_step) > self.unseen_steps_max {
            Verdict::Explore("the goal has not been seen for long")
        } else if distance_m > 1.5 * self.distance_max_m && !self.is_sure(hypothesis) {
            Verdict::Explore("the goal seems too far away to be sure")
        } else {
            Verdict::Exploit
        }
    }

    fn is_sure(&self, hypothesis: &Hypothesis) -> bool {
        hypothesis.n_fused >= 2 && hypothesis.support >= self.far_factor * self.n_inliers_min as f64
    }
}
