//! Silence stops the robot.
//!
//! A velocity acts only while its stream lives: until the command expires, and for no longer than the time-out after it
//! was accepted. A stream that falls silent in motion trips the watchdog.
//!
//! Re-arming, as simple as it can be: after a trip the velocities of the stream are received but not acted on until they
//! have come without a gap longer than the time-out for [`WatchdogConfig::rearm`]. A command that is bounded by itself
//! (a distance, an angle, a stop) re-arms at once: it shows that the commander knows the robot stands. A stream that ends
//! with zero velocity, or with a stop, is no silence.

use core::time::Duration;

use homing_core::Stamp;

/// Times of the watchdog.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct WatchdogConfig {
    /// A velocity acts for no longer than this after it was accepted.
    pub timeout: Duration,
    /// How long a stream must be healthy before it acts again after a trip.
    pub rearm: Duration,
}

impl Default for WatchdogConfig {
    /// 200 ms leaves 100 ms of the promised 300 ms for a late tick; 1 s of healthy stream before moving again.
    fn default() -> Self {
        Self { timeout: Duration::from_millis(200), rearm: Duration::from_secs(1) }
    }
}

/// What the watchdog says of the stream of velocities.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum StreamState {
    /// No velocity is to act.
    Idle,
    /// The newest velocity may act until this moment, exclusive.
    Alive {
        /// End of the newest command's validity.
        until: Stamp,
    },
    /// The stream fell silent in motion: stand still.
    Silent,
    /// The stream is back but not yet trusted: stand still.
    Rearming,
}

/// Watches one stream of velocity commands.
#[derive(Clone, Debug)]
pub struct Watchdog {
    config: WatchdogConfig,
    newest: Option<Feed>,
    tripped: bool,
    healthy_since: Stamp,
}

#[derive(Copy, Clone, Debug)]
struct Feed {
    at: Stamp,
    until: Stamp,
    moving: bool,
}

impl Watchdog {
    /// Armed, and no stream yet.
    #[must_use]
    pub fn new(config: WatchdogConfig) -> Self {
        Self { config, newest: None, tripped: false, healthy_since: Stamp(0) }
    }

    /// A velocity command was accepted: it is valid until `expires`, and `moving` unless it asks for zero.
    pub fn feed(&mut self, now: Stamp, expires: Stamp, velocity_is_zero: ZeroVelocity) {
        let _ = self.state(now);
        let gap = self.newest.is_none_or(|feed| now.since(feed.at) > self.config.timeout);
        if gap {
            self.healthy_since = now;
        }
        let until = expires.min(now.after(self.config.timeout));
        self.newest = Some(Feed { at: now, until, moving: velocity_is_zero == ZeroVelocity::No });
        if self.tripped && now.since(self.healthy_since) >= self.config.rearm {
            self.tripped = false;
        }
    }

    /// The stream ended on purpose, or the commander sent something that ends by itself.
    pub fn rest(&mut self) {
        self.newest = None;
        self.tripped = false;
    }

    /// What the stream is worth now. Trips when a moving stream has run out.
    pub fn state(&mut self, now: Stamp) -> StreamState {
        match self.newest {
            None if self.tripped => StreamState::Silent,
            None => StreamState::Idle,
            Some(feed) if now >= feed.until => {
                if feed.moving {
                    self.tripped = true;
                }
                if self.tripped { StreamState::Silent } else { StreamState::Idle }
            }
            Some(_) if self.tripped => StreamState::Rearming,
            Some(feed) => StreamState::Alive { until: feed.until },
        }
    }
}

/// Whether a command asks to stand still: such a stream may fall silent without a trip.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum ZeroVelocity {
    /// It asks for zero.
    Yes,
    /// It asks to move.
    No,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ms(t: u64) -> Stamp {
        Stamp(t * 1_000_000)
    }

    #[test]
    fn silence_stops_within_the_timeout() {
        let mut dog = Watchdog::new(WatchdogConfig::default());
        dog.feed(ms(1000), ms(9000), ZeroVelocity::No);
        assert_eq!(dog.state(ms(1199)), StreamState::Alive { until: ms(1200) });
        assert_eq!(dog.state(ms(1200)), StreamState::Silent);
    }

    #[test]
    fn expiry_comes_before_the_timeout() {
        let mut dog = Watchdog::new(WatchdogConfig::default());
        dog.feed(ms(1000), ms(1050), ZeroVelocity::No);
        assert_eq!(dog.state(ms(1049)), StreamState::Alive { until: ms(1050) });
        assert_eq!(dog.state(ms(1050)), StreamState::Silent);
    }

    #[test]
    fn rearms_after_a_second_without_gaps() {
        let mut dog = Watchdog::new(WatchdogConfig::default());
        dog.feed(ms(0), ms(9000), ZeroVelocity::No);
        assert_eq!(dog.state(ms(500)), StreamState::Silent);
        for t in (600..1600).step_by(100) {
            dog.feed(ms(t), ms(9000), ZeroVelocity::No);
            assert_eq!(dog.state(ms(t)), StreamState::Rearming, "at {t} ms");
        }
        dog.feed(ms(1600), ms(9000), ZeroVelocity::No);
        assert_eq!(dog.state(ms(1600)), StreamState::Alive { until: ms(1800) });
    }

    #[test]
    fn a_gap_while_rearming_starts_over() {
        let mut dog = Watchdog::new(WatchdogConfig::default());
        dog.feed(ms(0), ms(9000), ZeroVelocity::No);
        for t in [600, 700, 1000, 1100, 1200, 1650] {
            dog.feed(ms(t), ms(9000), ZeroVelocity::No);
            assert_eq!(dog.state(ms(t)), StreamState::Rearming, "at {t} ms");
        }
    }

    #[test]
    fn a_stream_that_ends_at_zero_is_no_silence() {
        let mut dog = Watchdog::new(WatchdogConfig::default());
        dog.feed(ms(0), ms(9000), ZeroVelocity::Yes);
        assert_eq!(dog.state(ms(700)), StreamState::Idle);
        dog.feed(ms(800), ms(9000), ZeroVelocity::No);
        assert_eq!(dog.state(ms(800)), StreamState::Alive { until: ms(1000) });
        dog.rest();
        assert_eq!(dog.state(ms(5000)), StreamState::Idle);
    }
}
