//! Straight: ahead until something is in the way, then one turn to the right (SLING 3.2 and its released code).

use homing_core::{Action, Directive, DiscoveryView, GoalDiscovery};

/// A forward that moved less than this was blocked, metres.
const MOVED_MIN_M: f64 = 0.10;

/// SLING's simplest policy, and the one its tables call Straight.
#[derive(Clone, Debug, Default)]
pub struct Straight {
    drove: bool,
}

impl Straight {
    /// A new episode's policy.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }
}

impl GoalDiscovery for Straight {
    fn name(&self) -> &'static str {
        "straight"
    }

    fn reset(&mut self) {
        self.drove = false;
    }

    fn next(&mut self, view: &DiscoveryView<'_>) -> Directive {
        let moved_m = view.last_motion.map_or(f64::INFINITY, |m| m.moved.distance_to(0.0, 0.0));
        let blocked = self.drove && moved_m < MOVED_MIN_M;
        self.drove = !blocked;
        Directive::Act(if blocked { Action::TurnRight } else { Action::Forward })
    }
}
