//! Who may command the robot, and which commands are taken.

use core::time::Duration;
use std::collections::VecDeque;

use homing_core::{Motion, MotionCommand, Stamp};
use thiserror::Error;

use crate::limits::VelocityLimits;

/// What the gate lets through.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct GateConfig {
    /// Bounds of velocity commands.
    pub limits: VelocityLimits,
    /// Longest straight motion one command may ask for, metres either way.
    pub distance_m_max: f64,
    /// Largest turn one command may ask for, radians either way.
    pub angle_rad_max: f64,
    /// Longest time to live a command may claim: a longer one would never expire.
    pub time_to_live_max: Duration,
    /// How far a stamp may lie ahead of the robot's clock.
    pub stamp_ahead_max: Duration,
    /// A commander that is silent for this long loses the lease.
    pub lease: Duration,
}

impl GateConfig {
    /// The defaults: 2 m, one full turn, 10 s to live, 50 ms ahead, a lease of 1 s.
    #[must_use]
    pub fn new(limits: VelocityLimits) -> Self {
        Self {
            limits,
            distance_m_max: 2.0,
            angle_rad_max: core::f64::consts::TAU,
            time_to_live_max: Duration::from_secs(10),
            stamp_ahead_max: Duration::from_millis(50),
            lease: Duration::from_secs(1),
        }
    }
}

/// The gate's answer to a command.
#[derive(Clone, Debug, PartialEq)]
pub enum Verdict {
    /// Taken: act on it.
    Accepted,
    /// It was taken before: acknowledge it again, do not act on it.
    Duplicate,
    /// Not taken.
    Refused(Refusal),
}

/// Why a command was not taken.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum Refusal {
    /// NaN or infinite.
    #[error("refused: {motion:?} is not finite")]
    NotFinite {
        /// What was asked.
        motion: Motion,
    },
    /// Beyond what the body is held to.
    #[error("refused: {quantity} = {value} is beyond {bound} either way")]
    OutOfBounds {
        /// Which number, with its unit.
        quantity: &'static str,
        /// Its value.
        value: f64,
        /// The largest magnitude allowed.
        bound: f64,
    },
    /// It claims to stay valid for too long.
    #[error("refused: a time to live of {claimed:?} is longer than {longest:?}")]
    LivesTooLong {
        /// The command's.
        claimed: Duration,
        /// The longest allowed.
        longest: Duration,
    },
    /// It came too late to be acted on.
    #[error("refused: expired {late:?} ago; is the link slow, or the observation it answers old?")]
    Expired {
        /// Time since it expired.
        late: Duration,
    },
    /// Its stamp lies ahead of the robot's clock.
    #[error("refused: stamped {ahead:?} ahead of the robot's clock; use the stamp of the observation it answers")]
    FromTheFuture {
        /// By how much.
        ahead: Duration,
    },
    /// Sent under a lease that has been taken over.
    #[error(
        "refused: epoch {found} is past, the lease is at {current}; an operator gave the robot to another commander"
    )]
    PastEpoch {
        /// The command's.
        found: u64,
        /// The gate's.
        current: u64,
    },
    /// The holder claims an epoch it was not granted.
    #[error("refused: epoch {found} was not granted, the lease is at {granted}")]
    EpochNotGranted {
        /// The command's.
        found: u64,
        /// The lease's.
        granted: u64,
    },
    /// Another commander drives.
    #[error("refused: session {holder} holds the lease for another {left:?}")]
    LeaseHeld {
        /// Its session.
        holder: u64,
        /// Until the lease lapses, if the holder stays silent.
        left: Duration,
    },
    /// Older than a command already taken from this session.
    #[error("refused: sequence {found} is not above {last}, the last one taken")]
    OldSequence {
        /// The command's.
        found: u64,
        /// The last one taken.
        last: u64,
    },
    /// A distance or an angle cannot be driven without odometry.
    #[error("refused: no odometry newer than {age_max:?}, and {motion:?} needs it")]
    NoOdometry {
        /// What was asked.
        motion: Motion,
        /// The oldest that will do.
        age_max: Duration,
    },
}

/// How often each answer was given since the gate was made.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub struct GateCounters {
    /// Commands taken.
    pub accepted: u64,
    /// Commands sent again.
    pub duplicate: u64,
    /// Not finite.
    pub not_finite: u64,
    /// Out of bounds, or living too long.
    pub out_of_bounds: u64,
    /// Expired.
    pub expired: u64,
    /// Stamped ahead of the clock.
    pub from_the_future: u64,
    /// Past or not granted epoch.
    pub wrong_epoch: u64,
    /// Another session held the lease.
    pub lease_held: u64,
    /// Repeated out of turn, or reordered.
    pub old_sequence: u64,
    /// Needed odometry that was not there.
    pub no_odometry: u64,
}

/// The right to command the robot.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct Lease {
    /// Who has it.
    pub session: u64,
    /// Under which epoch its commands must be sent.
    pub epoch: u64,
    /// When it lapses if the holder stays silent.
    pub expires: Stamp,
}

/// Lets one commander at a time through, and each of its commands once.
///
/// The first session whose command is valid takes the lease and keeps it while it is heard. Others are refused until it
/// lapses, or until an operator calls [`CommandGate::take_over`], which raises the epoch and so shuts the previous holder
/// out for good: its commands carry a past epoch.
#[derive(Clone, Debug)]
pub struct CommandGate {
    config: GateConfig,
    epoch: u64,
    lease: Option<Lease>,
    last_sequences: VecDeque<(u64, u64)>,
    counters: GateCounters,
}

// Sessions whose last sequence is remembered. A command of a forgotten session still has to be unexpired.
const SESSIONS_REMEMBERED: usize = 64;

impl CommandGate {
    /// No lease is held, the epoch is 0.
    #[must_use]
    pub fn new(config: GateConfig) -> Self {
        Self {
            config,
            epoch: 0,
            lease: None,
            last_sequences: VecDeque::with_capacity(SESSIONS_REMEMBERED),
            counters: GateCounters::default(),
        }
    }

    /// Judges a command that arrived at `now`, which must never decrease. Only [`Verdict::Accepted`] may move the robot.
    pub fn offer(&mut self, now: Stamp, command: &MotionCommand) -> Verdict {
        if self.is_repeat(command) {
            // A repeat in time shows that the holder lives; a recorded one must not keep the lease for it.
            if self.lease_at(now).is_some_and(|l| l.session == command.session) && self.check_time(now, command).is_ok()
            {
                self.keep(now);
            }
            self.counters.duplicate += 1;
            return Verdict::Duplicate;
        }
        match self.check(now, command) {
            Ok(()) => {
                self.grant(now, command);
                self.counters.accepted += 1;
                Verdict::Accepted
            }
            Err(refusal) => self.refuse(refusal),
        }
    }

    /// Counts a refusal found elsewhere in the body as one of the gate's own.
    pub fn refuse(&mut self, refusal: Refusal) -> Verdict {
        self.counters.count(&refusal);
        Verdict::Refused(refusal)
    }

    /// True if this is the command last taken from its session.
    #[must_use]
    pub fn is_repeat(&self, command: &MotionCommand) -> bool {
        self.last_sequence(command.session) == Some(command.sequence)
    }

    /// The lease, unless it has lapsed.
    #[must_use]
    pub fn lease_at(&self, now: Stamp) -> Option<Lease> {
        self.lease.filter(|lease| now < lease.expires)
    }

    /// The epoch below which no command is taken. Never decreases.
    #[must_use]
    pub fn epoch(&self) -> u64 {
        self.epoch
    }

    /// Lets the holder keep the lease from `now` on: while a motion it ordered is under way it has nothing to say.
    pub fn keep(&mut self, now: Stamp) {
        if self.lease_at(now).is_some()
            && let Some(lease) = &mut self.lease
        {
            lease.expires = lease.expires.max(now.after(self.config.lease));
        }
    }

    /// An operator gives the robot to `session`, whoever held it. Returns the epoch its commands must carry.
    pub fn take_over(&mut self, now: Stamp, session: u64) -> u64 {
        self.epoch = self.epoch.saturating_add(1);
        self.lease = Some(Lease { session, epoch: self.epoch, expires: now.after(self.config.lease) });
        self.epoch
    }

    /// The holder leaves: the next commander need not wait for the lease to lapse. No effect for anybody else.
    pub fn release(&mut self, session: u64) {
        self.lease = self.lease.filter(|lease| lease.session != session);
    }

    /// What was answered so far.
    #[must_use]
    pub fn counters(&self) -> GateCounters {
        self.counters
    }

    fn check(&self, now: Stamp, command: &MotionCommand) -> Result<(), Refusal> {
        self.check_bounds(command)?;
        self.check_time(now, command)?;
        self.check_lease(now, command)?;
        self.check_sequence(command)
    }

    fn check_bounds(&self, command: &MotionCommand) -> Result<(), Refusal> {
        let motion = command.motion;
        if !motion.is_finite() {
            return Err(Refusal::NotFinite { motion });
        }
        let within = |quantity, value: f64, bound: f64| {
            // The wire may round the bound itself by one part in a million (32-bit floats).
            let ok = value.abs() <= bound * (1.0 + 1e-6);
            if ok { Ok(()) } else { Err(Refusal::OutOfBounds { quantity, value, bound }) }
        };
        match motion {
            Motion::Velocity { linear_m_s, angular_rad_s } => {
                within("linear_m_s", linear_m_s, self.config.limits.linear_m_s_max())?;
                within("angular_rad_s", angular_rad_s, self.config.limits.angular_rad_s_max())?;
            }
            Motion::Forward { distance_m } => within("distance_m", distance_m, self.config.distance_m_max)?,
            Motion::Turn { angle_rad } => within("angle_rad", angle_rad, self.config.angle_rad_max)?,
            Motion::Stop { .. } => {}
        }
        let (claimed, longest) = (command.time_to_live, self.config.time_to_live_max);
        if claimed > longest { Err(Refusal::LivesTooLong { claimed, longest }) } else { Ok(()) }
    }

    fn check_time(&self, now: Stamp, command: &MotionCommand) -> Result<(), Refusal> {
        let ahead = command.stamp.since(now);
        if ahead > self.config.stamp_ahead_max {
            return Err(Refusal::FromTheFuture { ahead });
        }
        let expires = command.stamp.after(command.time_to_live);
        if now >= expires { Err(Refusal::Expired { late: now.since(expires) }) } else { Ok(()) }
    }

    fn check_lease(&self, now: Stamp, command: &MotionCommand) -> Result<(), Refusal> {
        if command.epoch < self.epoch {
            return Err(Refusal::PastEpoch { found: command.epoch, current: self.epoch });
        }
        match self.lease_at(now) {
            Some(lease) if lease.session != command.session => {
                Err(Refusal::LeaseHeld { holder: lease.session, left: lease.expires.since(now) })
            }
            Some(lease) if lease.epoch != command.epoch => {
                Err(Refusal::EpochNotGranted { found: command.epoch, granted: lease.epoch })
            }
            _ => Ok(()),
        }
    }

    fn check_sequence(&self, command: &MotionCommand) -> Result<(), Refusal> {
        match self.last_sequence(command.session) {
            Some(last) if command.sequence <= last => Err(Refusal::OldSequence { found: command.sequence, last }),
            _ => Ok(()),
        }
    }

    fn grant(&mut self, now: Stamp, command: &MotionCommand) {
        self.epoch = command.epoch;
        self.lease =
            Some(Lease { session: command.session, epoch: command.epoch, expires: now.after(self.config.lease) });
        self.last_sequences.retain(|&(session, _)| session != command.session);
        if self.last_sequences.len() == SESSIONS_REMEMBERED {
            self.last_sequences.pop_front();
        }
        self.last_sequences.push_back((command.session, command.sequence));
    }

    fn last_sequence(&self, session: u64) -> Option<u64> {
        self.last_sequences.iter().find(|&&(s, _)| s == session).map(|&(_, sequence)| sequence)
    }
}

impl GateCounters {
    /// All refusals together.
    #[must_use]
    pub fn refused(&self) -> u64 {
        self.not_finite
            + self.out_of_bounds
            + self.expired
            + self.from_the_future
            + self.wrong_epoch
            + self.lease_held
            + self.old_sequence
            + self.no_odometry
    }

    fn count(&mut self, refusal: &Refusal) {
        let counter = match refusal {
            Refusal::NotFinite { .. } => &mut self.not_finite,
            Refusal::OutOfBounds { .. } | Refusal::LivesTooLong { .. } => &mut self.out_of_bounds,
            Refusal::Expired { .. } => &mut self.expired,
            Refusal::FromTheFuture { .. } => &mut self.from_the_future,
            Refusal::PastEpoch { .. } | Refusal::EpochNotGranted { .. } => &mut self.wrong_epoch,
            Refusal::LeaseHeld { .. } => &mut self.lease_held,
            Refusal::OldSequence { .. } => &mut self.old_sequence,
            Refusal::NoOdometry { .. } => &mut self.no_odometry,
        };
        *counter += 1;
    }
}
