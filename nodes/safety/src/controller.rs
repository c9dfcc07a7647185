//! From a distance or an angle to velocities: the motion really made is measured by odometry.

use core::time::Duration;
use std::collections::VecDeque;

use homing_core::{Base, Motion, MotionOutcome, Odom, Odometry, Stamp, Transform, wrap_angle};

use crate::limits::{Velocity, VelocityLimits};

/// How distances and angles are driven.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct ControllerConfig {
    /// Cruising speed, m/s.
    pub linear_m_s: f64,
    /// Turning speed, rad/s.
    pub angular_rad_s: f64,
    /// Braking the profile counts on, m/s^2.
    pub linear_m_s2: f64,
    /// Braking of a turn the profile counts on, rad/s^2.
    pub angular_rad_s2: f64,
    /// Time constant with which the wheels follow an order.
    pub lag: Duration,
    /// A straight motion ends this close to its length, metres.
    pub tolerance_m: f64,
    /// A turn ends this close to its angle, radians.
    pub tolerance_rad: f64,
    /// Slowest straight speed before the end: slower, a real base would stick, m/s.
    pub creep_m_s: f64,
    /// Slowest turn before the end, rad/s.
    pub creep_rad_s: f64,
    /// Without progress for this long the motion is blocked.
    pub stall: Duration,
    /// Turning speed per radian of heading lost while driving straight, 1/s.
    pub heading_gain: f64,
}

impl ControllerConfig {
    /// Cruises at four fifths of the limits, so that the ramps can follow the profile; wheels that lag 60 ms.
    #[must_use]
    pub fn new(limits: &VelocityLimits) -> Self {
        Self {
            linear_m_s: 0.8 * limits.linear_m_s_max(),
            angular_rad_s: 0.8 * limits.angular_rad_s_max(),
            linear_m_s2: 0.8 * limits.linear_m_s2_max(),
            angular_rad_s2: 0.8 * limits.angular_rad_s2_max(),
            lag: Duration::from_millis(60),
            tolerance_m: 0.003,
            tolerance_rad: 0.003,
            creep_m_s: 0.02_f64.min(limits.linear_m_s_max()),
            creep_rad_s: 0.04_f64.min(limits.angular_rad_s_max()),
            stall: Duration::from_millis(800),
            heading_gain: 2.0,
        }
    }
}

/// What the controller wants at one tick.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Control {
    /// Drive like this until the next tick.
    Drive(Velocity),
    /// The motion is over and the body stands.
    Finished(MotionOutcome),
}

/// Drives one distance or one angle.
#[derive(Clone, Debug)]
pub struct MotionController {
    config: ControllerConfig,
    course: Course,
    start: Transform<Odom, Base>,
    latest: Odometry,
    turned_rad: f64,
    orders: VecDeque<Held>,
    best: f64,
    best_at: Stamp,
    deadline: Stamp,
    phase: Phase,
}

#[derive(Copy, Clone, Debug)]
enum Course {
    Forward { distance_m: f64 },
    Turn { angle_rad: f64 },
}

// An order and the time it held.
#[derive(Copy, Clone, Debug)]
struct Held {
    from: Stamp,
    to: Stamp,
    order: Velocity,
}

#[derive(Copy, Clone, Debug)]
enum Phase {
    Driving,
    Settling { since: Stamp, blocked: bool },
}

// Time between two ticks that the profile allows for.
const TICK: Duration = Duration::from_millis(40);
// Orders remembered: at 50 Hz more than a second of them.
const ORDERS_MAX: usize = 64;
// Standing still, by odometry; and how long to wait for it.
const STILL_M_S: f64 = 0.01;
const STILL_RAD_S: f64 = 0.02;
const SETTLE_MAX: Duration = Duration::from_millis(400);
// Progress smaller than these is none: encoders jitter.
const PROGRESS_M: f64 = 0.005;
const PROGRESS_RAD: f64 = 0.01;
// A pose that moves further than this between two readings, on top of twice the cruising speed, was not driven.
const JUMP_M: f64 = 0.2;
const JUMP_RAD: f64 = 0.5;

impl MotionController {
    /// Begins a distance or an angle from where odometry says the body is; `None` for any other motion.
    #[must_use]
    pub fn begin(config: ControllerConfig, now: Stamp, odometry: &Odometry, motion: Motion) -> Option<Self> {
        let (course, nominal_s) = match motion {
            Motion::Forward { distance_m } => {
                (Course::Forward { distance_m }, distance_m.abs() / config.linear_m_s.max(1e-3))
            }
            Motion::Turn { angle_rad } => {
                (Course::Turn { angle_rad }, angle_rad.abs() / config.angular_rad_s.max(1e-3))
            }
            Motion::Velocity { .. } | Motion::Stop { .. } => return None,
        };
        // Slow zones may stretch a motion fourfold; beyond that it is given up, so that every motion ends.
        let longest = Duration::try_from_secs_f64(3.0 + 4.0 * nominal_s).unwrap_or(Duration::from_secs(3));
        Some(Self {
            config,
            course,
            start: odometry.t_odom_base,
            latest: *odometry,
            turned_rad: 0.0,
            orders: VecDeque::with_capacity(ORDERS_MAX),
            best: 0.0,
            best_at: now,
            deadline: now.after(longest),
            phase: Phase::Driving,
        })
    }

    /// The wish for this tick. `odometry` is the newest reading, `None` where it is too old to act on: stand still then.
    /// `held` is the order that held since the last tick, after limits and collision monitor.
    pub fn step(&mut self, now: Stamp, odometry: Option<&Odometry>, held: Velocity) -> Control {
        self.remember(now, held);
        let jumped = odometry.is_some_and(|reading| self.track(reading));
        if let Phase::Driving = self.phase {
            let remaining = self.remaining();
            self.note_progress(now);
            let stalled = now.since(self.best_at) > self.config.stall || now >= self.deadline;
            if remaining <= self.tolerance() {
                self.phase = Phase::Settling { since: now, blocked: false };
            } else if jumped || stalled {
                self.phase = Phase::Settling { since: now, blocked: true };
            } else if odometry.is_some() {
                return Control::Drive(self.profile(remaining - self.on_its_way()));
            }
        }
        match self.phase {
            Phase::Settling { since, blocked } if self.is_still() || now.since(since) >= SETTLE_MAX => {
                Control::Finished(self.outcome(now, blocked))
            }
            _ => Control::Drive(Velocity::ZERO),
        }
    }

    /// What was done so far, should something else end the motion now.
    #[must_use]
    pub fn cut_short(&self, now: Stamp, blocked: Blocked) -> MotionOutcome {
        self.outcome(now, blocked == Blocked::Yes)
    }

    fn outcome(&self, stamp: Stamp, blocked: bool) -> MotionOutcome {
        MotionOutcome { stamp, moved: moved(&self.start, &self.latest.t_odom_base), blocked }
    }

    // Follows odometry; true if the pose jumped.
    fn track(&mut self, reading: &Odometry) -> bool {
        let dt_s = reading.stamp.since(self.latest.stamp).as_secs_f64();
        let moved = moved(&self.latest.t_odom_base, &reading.t_odom_base);
        let jumped = moved.distance_to(0.0, 0.0) > JUMP_M + 2.0 * self.config.linear_m_s * dt_s
            || moved.yaw_rad.abs() > JUMP_RAD + 2.0 * self.config.angular_rad_s * dt_s;
        self.turned_rad += moved.yaw_rad;
        self.latest = *reading;
        jumped
    }

    // Metres or radians still to go; negative beyond the end.
    fn remaining(&self) -> f64 {
        match self.course {
            Course::Forward { distance_m } => distance_m.abs() - self.progress(),
            Course::Turn { angle_rad } => angle_rad.abs() - self.progress(),
        }
    }

    // Metres or radians made in the wanted direction.
    fn progress(&self) -> f64 {
        match self.course {
            Course::Forward { distance_m } => moved(&self.start, &self.latest.t_odom_base).x_m * distance_m.signum(),
            Course::Turn { angle_rad } => self.turned_rad * angle_rad.signum(),
        }
    }

    fn remember(&mut self, now: Stamp, order: Velocity) {
        let from = self.orders.back().map_or(now, |held| held.to);
        if self.orders.len() == ORDERS_MAX {
            self.orders.pop_front();
        }
        self.orders.push_back(Held { from, to: now, order });
    }

    // Progress that is sure to come though odometry does not show it yet. For wheels that lag by T the way made from the
    // reading's stamp until they stand is T times the speed then, plus all that was ordered since (integrate
    // T dv/dt = order - v). Braking only when odometry asks for it overshoots by the speed times the delay: 1.7 cm at
    // 0.4 m/s with odometry 60 ms late and wheels that lag 80 ms.
    fn on_its_way(&self) -> f64 {
        let along = |v: Velocity| match self.course {
            Course::Forward { distance_m } => v.linear_m_s * distance_m.signum(),
            Course::Turn { angle_rad } => v.angular_rad_s * angle_rad.signum(),
        };
        let Odometry { stamp, linear_m_s, angular_rad_s, .. } = self.latest;
        let coasting = along(Velocity { linear_m_s, angular_rad_s }) * self.config.lag.as_secs_f64();
        let since = |held: &Held| along(held.order) * held.to.since(held.from.max(stamp)).as_secs_f64();
        coasting + self.orders.iter().map(since).sum::<f64>()
    }

    fn note_progress(&mut self, now: Stamp) {
        let least = match self.course {
            Course::Forward { .. } => PROGRESS_M,
            Course::Turn { .. } => PROGRESS_RAD,
        };
        if self.progress() >= self.best + least {
            self.best = self.progress();
            self.best_at = now;
        }
    }

    fn tolerance(&self) -> f64 {
        match self.course {
            Course::Forward { .. } => self.config.tolerance_m,
            Course::Turn { .. } => self.config.tolerance_rad,
        }
    }

    fn is_still(&self) -> bool {
        self.latest.linear_m_s.abs() < STILL_M_S && self.latest.angular_rad_s.abs() < STILL_RAD_S
    }

    // The velocity that ends `remaining` metres or radians from now, zero if they are all but made.
    fn profile(&self, remaining: f64) -> Velocity {
        // Well within the tolerance, so that what odometry then shows is within it, too.
        if remaining <= 0.3 * self.tolerance() {
            return Velocity::ZERO;
        }
        let c = &self.config;
        match self.course {
            Course::Forward { distance_m } => {
                let speed = braking_speed(remaining, c.linear_m_s2).clamp(c.creep_m_s, c.linear_m_s);
                let lost_rad = wrap_angle(self.turned_rad);
                let hold = (-c.heading_gain * lost_rad).clamp(-0.5 * c.angular_rad_s, 0.5 * c.angular_rad_s);
                Velocity { linear_m_s: speed * distance_m.signum(), angular_rad_s: hold }
            }
            Course::Turn { angle_rad } => {
                let speed = braking_speed(remaining, c.angular_rad_s2).clamp(c.creep_rad_s, c.angular_rad_s);
                Velocity { linear_m_s: 0.0, angular_rad_s: speed * angle_rad.signum() }
            }
        }
    }
}

/// Whether something was in the way.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Blocked {
    /// An obstacle or the safety gate cut the motion short.
    Yes,
    /// Another command, or the end of its validity, ended it.
    No,
}

/// Motion from one pose of the base to another, in the first.
pub(crate) fn moved(from: &Transform<Odom, Base>, to: &Transform<Odom, Base>) -> homing_core::PlanarPose {
    (from.inverse() * *to).planar()
}

// The speed v from which `remaining` is just enough to go on for one tick T and then brake with a:
// v T + v^2 / (2 a) = remaining. Near the end it falls off as remaining / T.
fn braking_speed(remaining: f64, braking: f64) -> f64 {
    let t = TICK.as_secs_f64();
    braking * ((t * t + 2.0 * remaining.max(0.0) / braking).sqrt() - t)
}
