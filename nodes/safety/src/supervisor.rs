//! Gate, watchdog, controller, limits and collision monitor in one: what a body's node calls.

use core::time::Duration;
use std::collections::VecDeque;

use homing_core::{
    Base, LaserScan, Motion, MotionCommand, MotionOutcome, MotionResult, Odom, Odometry, PlanarPose, Stamp, Transform,
};

use crate::collision::{CollisionMonitor, Passage};
use crate::config::SupervisorConfig;
use crate::controller::{Blocked, Control, MotionController, moved};
use crate::gate::{CommandGate, GateCounters, Lease, Refusal, Verdict};
use crate::limits::Velocity;
use crate::order::{Dropped, Event, OrderCause, VelocityOrder};
use crate::watchdog::{StreamState, Watchdog, ZeroVelocity};

/// Commands in, velocity orders out. See the crate's page for what holds at every tick.
#[derive(Clone, Debug)]
pub struct Supervisor {
    config: SupervisorConfig,
    gate: CommandGate,
    watchdog: Watchdog,
    monitor: Option<CollisionMonitor>,
    odometry: Option<Odometry>,
    activity: Activity,
    last_order: Velocity,
    last_tick: Option<Stamp>,
    last_result: Option<MotionResult>,
    clock: Stamp,
    events: VecDeque<Event>,
    dropped: Dropped,
}

#[derive(Clone, Debug)]
enum Activity {
    Idle,
    Teleop { wanted: Velocity, until: Stamp },
    Stream { id: CommandId, wanted: Velocity, blocked: Blocked },
    Bounded { id: CommandId, controller: Box<MotionController> },
    Stopping { id: CommandId, since: Stamp },
}

#[derive(Copy, Clone, Debug)]
struct CommandId {
    session: u64,
    sequence: u64,
    start: Option<Transform<Odom, Base>>,
}

#[derive(Copy, Clone, Debug)]
struct Wish {
    velocity: Velocity,
    until: Stamp,
    commander: Option<(u64, u64)>,
    cause: OrderCause,
}

const EVENTS_MAX: usize = 256;
// The longest tick that acceleration is granted for: after a pause the ramp starts over gently.
const TICK_MAX: Duration = Duration::from_millis(50);
const STAMP_AHEAD_MAX: Duration = Duration::from_millis(50);
const STOP_SETTLE_MAX: Duration = Duration::from_secs(1);

impl Supervisor {
    /// Standing, no lease, no odometry, blind.
    #[must_use]
    pub fn new(config: SupervisorConfig) -> Self {
        Self {
            gate: CommandGate::new(config.gate),
            watchdog: Watchdog::new(config.watchdog),
            monitor: config.collision.map(CollisionMonitor::new),
            odometry: None,
            activity: Activity::Idle,
            last_order: Velocity::ZERO,
            last_tick: None,
            last_result: None,
            clock: Stamp(0),
            events: VecDeque::with_capacity(EVENTS_MAX),
            dropped: Dropped::default(),
            config,
        }
    }

    /// A command arrived. Only an accepted one changes what the body does; a repeated one that has ended is answered by
    /// its [`Event::Finished`] again.
    pub fn command(&mut self, now: Stamp, command: &MotionCommand) -> Verdict {
        let now = self.advance(now);
        if self.lacks_odometry(now, command) {
            let (motion, age_max) = (command.motion, self.config.odometry_age_max);
            return self.gate.refuse(Refusal::NoOdometry { motion, age_max });
        }
        let verdict = self.gate.offer(now, command);
        match verdict {
            Verdict::Accepted => self.begin(now, command),
            Verdict::Duplicate => self.answer_again(command),
            Verdict::Refused(_) => {}
        }
        verdict
    }

    /// A bare velocity arrived (ROS `cmd_vel`), m/s and rad/s. Taken only while nobody holds the lease, held to the
    /// limits, and acted on for [`SupervisorConfig::teleop`].
    pub fn teleop(&mut self, now: Stamp, linear_m_s: f64, angular_rad_s: f64) -> Verdict {
        let now = self.advance(now);
        if let Some(lease) = self.gate.lease_at(now) {
            return self.gate.refuse(Refusal::LeaseHeld { holder: lease.session, left: lease.expires.since(now) });
        }
        let Some(wanted) = self.config.gate.limits.clamp(Velocity { linear_m_s, angular_rad_s }) else {
            return self.gate.refuse(Refusal::NotFinite { motion: Motion::Velocity { linear_m_s, angular_rad_s } });
        };
        self.end_activity(now, Blocked::No);
        self.activity = Activity::Teleop { wanted, until: now.after(self.config.teleop) };
        Verdict::Accepted
    }

    /// Odometry and scan arrived. What is not finite, out of order or stamped ahead of the clock is dropped and counted.
    pub fn sense(&mut self, now: Stamp, odometry: &Odometry, scan: Option<&LaserScan>) {
        let now = self.advance(now);
        let finite =
            odometry.t_odom_base.is_finite() && odometry.linear_m_s.is_finite() && odometry.angular_rad_s.is_finite();
        let in_order = self.odometry.is_none_or(|last| last.stamp <= odometry.stamp);
        if finite && in_order && odometry.stamp <= now.after(STAMP_AHEAD_MAX) {
            self.odometry = Some(*odometry);
        } else {
            self.dropped.odometry += 1;
        }
        if let (Some(scan), Some(monitor)) = (scan, &mut self.monitor) {
            monitor.sense(now, scan);
            self.dropped.scans = monitor.malformed();
        }
    }

    /// What the motors are to do from now on. Call it at 20 Hz or faster, whatever else happens.
    pub fn tick(&mut self, now: Stamp) -> VelocityOrder {
        let now = self.advance(now);
        let dt = self.last_tick.replace(now).map_or(Duration::ZERO, |last| now.since(last)).min(TICK_MAX);
        let wish = self.wish(now);
        let (velocity, passage) = self.shape(now, dt, wish.velocity);
        self.note_blocked(passage);
        self.last_order = velocity;
        let cause = if passage == Passage::Free { wish.cause } else { OrderCause::Guarded(passage) };
        VelocityOrder {
            linear_m_s: velocity.linear_m_s,
            angular_rad_s: velocity.angular_rad_s,
            valid_until: wish.until.min(now.after(self.config.order)),
            commander: wish.commander,
            cause,
        }
    }

    /// Stands still now, whatever was commanded: the body's own stop.
    pub fn halt(&mut self, now: Stamp) {
        let now = self.advance(now);
        self.end_activity(now, Blocked::Yes);
        self.last_order = Velocity::ZERO;
    }

    /// An operator gives the robot to `session`; what was under way ends. Returns the epoch its commands must carry.
    pub fn take_over(&mut self, now: Stamp, session: u64) -> u64 {
        let now = self.advance(now);
        self.end_activity(now, Blocked::No);
        let epoch = self.gate.take_over(now, session);
        self.push(Event::TakenOver { session, epoch });
        epoch
    }

    /// The commander of `session` leaves: its motion ends and the lease is free. No effect if it does not hold the lease.
    pub fn release(&mut self, now: Stamp, session: u64) {
        let now = self.advance(now);
        if self.gate.lease_at(now).is_some_and(|lease| lease.session == session) {
            self.end_activity(now, Blocked::No);
            self.gate.release(session);
        }
    }

    /// What happened since this was last called, oldest first.
    pub fn take_events(&mut self) -> Vec<Event> {
        self.events.drain(..).collect()
    }

    /// Who may command, and until when.
    #[must_use]
    pub fn lease(&self) -> Option<Lease> {
        self.gate.lease_at(self.clock)
    }

    /// The epoch below which no command is taken.
    #[must_use]
    pub fn epoch(&self) -> u64 {
        self.gate.epoch()
    }

    /// How commands were answered so far.
    #[must_use]
    pub fn counters(&self) -> GateCounters {
        self.gate.counters()
    }

    /// What was dropped so far.
    #[must_use]
    pub fn dropped(&self) -> Dropped {
        self.dropped
    }

    // The clock never runs backwards, whatever the caller says: a step back would bring expired commands to life.
    fn advance(&mut self, now: Stamp) -> Stamp {
        self.clock = self.clock.max(now);
        self.clock
    }

    fn fresh_odometry(&self, now: Stamp) -> Option<Odometry> {
        self.odometry.filter(|reading| now.since(reading.stamp) <= self.config.odometry_age_max)
    }

    fn lacks_odometry(&self, now: Stamp, command: &MotionCommand) -> bool {
        let needs_it = matches!(command.motion, Motion::Forward { .. } | Motion::Turn { .. });
        needs_it && !self.gate.is_repeat(command) && self.fresh_odometry(now).is_none()
    }

    fn begin(&mut self, now: Stamp, command: &MotionCommand) {
        self.end_activity(now, Blocked::No);
        let start = self.odometry.map(|reading| reading.t_odom_base);
        let id = CommandId { session: command.session, sequence: command.sequence, start };
        if let Motion::Velocity { linear_m_s, angular_rad_s } = command.motion {
            let wanted = Velocity { linear_m_s, angular_rad_s };
            let zero = if wanted.is_zero() { ZeroVelocity::Yes } else { ZeroVelocity::No };
            self.watchdog.feed(now, command.stamp.after(command.time_to_live), zero);
            self.activity = Activity::Stream { id, wanted, blocked: Blocked::No };
            return;
        }
        self.watchdog.rest();
        let controller = self
            .odometry
            .and_then(|reading| MotionController::begin(self.config.controller, now, &reading, command.motion));
        self.activity = match controller {
            Some(controller) => Activity::Bounded { id, controller: Box::new(controller) },
            None => Activity::Stopping { id, since: now },
        };
    }

    fn answer_again(&mut self, command: &MotionCommand) {
        let ended = |r: &MotionResult| (r.session, r.sequence) == (command.session, command.sequence);
        if let Some(result) = self.last_result.filter(ended) {
            self.push(Event::Finished(result));
        }
    }

    fn wish(&mut self, now: Stamp) -> Wish {
        let idle = Wish { velocity: Velocity::ZERO, until: Stamp(u64::MAX), commander: None, cause: OrderCause::Idle };
        // Taken out for the time of the decision; put back if it goes on.
        match core::mem::replace(&mut self.activity, Activity::Idle) {
            Activity::Idle => idle,
            Activity::Teleop { until, .. } if now >= until => idle,
            Activity::Teleop { wanted, until } => {
                self.activity = Activity::Teleop { wanted, until };
                Wish { velocity: wanted, until, cause: OrderCause::Teleop, ..idle }
            }
            Activity::Stream { id, wanted, blocked } => self.wish_of_stream(now, id, wanted, blocked).unwrap_or(idle),
            Activity::Bounded { id, controller } => self.wish_of_bounded(now, id, controller).unwrap_or(idle),
            Activity::Stopping { id, since } => {
                self.gate.keep(now);
                let still =
                    self.fresh_odometry(now).is_some_and(|o| o.linear_m_s.abs() < 0.01 && o.angular_rad_s.abs() < 0.02);
                if still || now.since(since) >= STOP_SETTLE_MAX {
                    self.finish(now, id, Blocked::No);
                } else {
                    self.activity = Activity::Stopping { id, since };
                }
                Wish { commander: Some((id.session, id.sequence)), cause: OrderCause::Stop, ..idle }
            }
        }
    }

    fn wish_of_stream(&mut self, now: Stamp, id: CommandId, wanted: Velocity, blocked: Blocked) -> Option<Wish> {
        let (velocity, until, cause) = match self.watchdog.state(now) {
            StreamState::Alive { until } => (wanted, until, OrderCause::Commanded),
            StreamState::Rearming => (Velocity::ZERO, Stamp(u64::MAX), OrderCause::Rearming),
            state @ (StreamState::Silent | StreamState::Idle) => {
                self.finish(now, id, blocked);
                if state == StreamState::Silent {
                    self.push(Event::Silenced { session: id.session });
                }
                return None;
            }
        };
        self.activity = Activity::Stream { id, wanted, blocked };
        Some(Wish { velocity, until, commander: Some((id.session, id.sequence)), cause })
    }

    fn wish_of_bounded(&mut self, now: Stamp, id: CommandId, mut controller: Box<MotionController>) -> Option<Wish> {
        self.gate.keep(now);
        let odometry = self.fresh_odometry(now);
        let velocity = match controller.step(now, odometry.as_ref(), self.last_order) {
            Control::Drive(velocity) => velocity,
            Control::Finished(outcome) => {
                self.report(id, outcome);
                return None;
            }
        };
        self.activity = Activity::Bounded { id, controller };
        let cause = if odometry.is_some() { OrderCause::Commanded } else { OrderCause::NoOdometry };
        Some(Wish { velocity, until: Stamp(u64::MAX), commander: Some((id.session, id.sequence)), cause })
    }

    // Asks the monitor what part of the wish is safe, and ramps towards that within the limits; a monitor that slows down
    // is obeyed at once. While ramping the path differs from the wish's, so what comes out is asked about again. To stand
    // still no ramp is kept: braking is the body's own, and as hard as it can.
    fn shape(&self, now: Stamp, dt: Duration, wanted: Velocity) -> (Velocity, Passage) {
        let limits = &self.config.gate.limits;
        let wanted = limits.clamp(wanted).unwrap_or(Velocity::ZERO);
        if wanted.is_zero() {
            return (Velocity::ZERO, Passage::Free);
        }
        let Some(monitor) = &self.monitor else {
            return (limits.approach(self.last_order, wanted, dt), Passage::Free);
        };
        let (allowed, passage) = monitor.limit(now, wanted);
        let mut ramped = limits.approach(self.last_order, allowed, dt);
        if passage != Passage::Free {
            ramped.linear_m_s = ramped.linear_m_s.clamp(-allowed.linear_m_s.abs(), allowed.linear_m_s.abs());
        }
        match monitor.limit(now, ramped) {
            (stopped, again @ (Passage::Stopped { .. } | Passage::Blind)) => (stopped, again),
            _ => (ramped, passage),
        }
    }

    fn note_blocked(&mut self, passage: Passage) {
        if let Activity::Stream { blocked, .. } = &mut self.activity
            && matches!(passage, Passage::Stopped { .. } | Passage::Blind)
        {
            *blocked = Blocked::Yes;
        }
    }

    fn end_activity(&mut self, now: Stamp, why: Blocked) {
        match core::mem::replace(&mut self.activity, Activity::Idle) {
            Activity::Idle | Activity::Teleop { .. } => {}
            Activity::Stream { id, blocked: Blocked::Yes, .. } => self.finish(now, id, Blocked::Yes),
            Activity::Stream { id, .. } | Activity::Stopping { id, .. } => self.finish(now, id, why),
            Activity::Bounded { id, controller } => self.report(id, controller.cut_short(now, why)),
        }
    }

    fn finish(&mut self, now: Stamp, id: CommandId, blocked: Blocked) {
        let moved = match (id.start, self.odometry) {
            (Some(start), Some(reading)) => moved(&start, &reading.t_odom_base),
            _ => PlanarPose::default(),
        };
        self.report(id, MotionOutcome { stamp: now, moved, blocked: blocked == Blocked::Yes });
    }

    fn report(&mut self, id: CommandId, outcome: MotionOutcome) {
        let result = MotionResult { session: id.session, sequence: id.sequence, outcome };
        self.last_result = Some(result);
        self.push(Event::Finished(result));
    }

    fn push(&mut self, event: Event) {
        if self.events.len() == EVENTS_MAX {
            self.events.pop_front();
            self.dropped.events += 1;
        }
        self.events.push_back(event);
    }
}
