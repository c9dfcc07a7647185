//! Points in time on the robot's clock.

use core::time::Duration;

/// When something was measured: nanoseconds on the robot's clock. The origin is the robot's own; never compare stamps
/// of two robots.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Stamp(pub u64);

/// A stamp this much before the last one is not late: the clock was set back.
const RESTART: Duration = Duration::from_millis(500);

impl Stamp {
    /// True if the robot's clock began anew after `last`, by a restart or a reset: stamps and odometry kept from before are
    /// worthless then. Messages that only overtook each other are nearer together.
    #[must_use]
    pub fn began_anew_after(self, last: Stamp) -> bool {
        last.since(self) > RESTART
    }

    /// From whole seconds and nanoseconds, as ROS messages carry them. Saturates instead of wrapping.
    #[must_use]
    pub fn from_parts(seconds: u32, nanoseconds: u32) -> Self {
        Self(u64::from(seconds) * 1_000_000_000 + u64::from(nanoseconds))
    }

    /// Seconds and nanoseconds, as ROS messages carry them. Saturates in the year 2106.
    #[must_use]
    pub fn to_parts(self) -> (u32, u32) {
        let seconds = u32::try_from(self.0 / 1_000_000_000).unwrap_or(u32::MAX);
        (seconds, (self.0 % 1_000_000_000) as u32)
    }

    /// Time since `earlier`; zero if `earlier` is later.
    #[must_use]
    pub fn since(self, earlier: Stamp) -> Duration {
        Duration::from_nanos(self.0.saturating_sub(earlier.0))
    }

    /// This stamp moved forward. Saturates.
    #[must_use]
    pub fn after(self, by: Duration) -> Stamp {
        Stamp(self.0.saturating_add(u64::try_from(by.as_nanos()).unwrap_or(u64::MAX)))
    }

    /// Seconds since the clock's origin, for display and plots.
    #[must_use]
    pub fn seconds(self) -> f64 {
        self.0 as f64 * 1e-9
    }
}
