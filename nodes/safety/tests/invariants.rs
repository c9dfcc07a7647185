//! What must hold at every tick, over thousands of lost, late, doubled and reordered commands from three senders at once.
//!
//! The checks keep their own books from what was delivered, and never ask the supervisor what it believes.
#![expect(clippy::unwrap_used, clippy::expect_used, reason = "tests")]

mod plant;

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use homing_core::{Motion, MotionCommand, Stamp};
use homing_safety::{Event, GateCounters, Supervisor, VelocityOrder, Verdict};
use plant::{Plant, TICK, config, ms};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const T_STOP: Duration = Duration::from_millis(300);
const LEASE: Duration = Duration::from_secs(1);

/// A link that drops, delays, doubles and so reorders. Keyed by arrival, so that delivery is in order of arrival.
#[derive(Default)]
struct Link {
    under_way: BTreeMap<(Stamp, u64), MotionCommand>,
    sent: u64,
}

impl Link {
    fn send(&mut self, rng: &mut impl Rng, now: Stamp, command: MotionCommand, quality: Quality) {
        let copies = match rng.random_range(0..100) {
            p if p < quality.loss_percent => 0,
            p if p < quality.loss_percent + 10 => 2,
            _ => 1,
        };
        for _ in 0..copies {
            let delay = Duration::from_millis(rng.random_range(0..=quality.delay_ms_max));
            self.sent += 1;
            self.under_way.insert((now.after(delay), self.sent), command);
        }
    }

    fn arrived(&mut self, now: Stamp) -> Vec<MotionCommand> {
        let later = self.under_way.split_off(&(Stamp(now.0 + 1), 0));
        std::mem::replace(&mut self.under_way, later).into_values().collect()
    }
}

#[derive(Copy, Clone)]
struct Quality {
    loss_percent: u32,
    delay_ms_max: u64,
}

/// A commander that streams for a while, falls silent (the loss that must stop the robot), and comes back.
struct Commander {
    session: u64,
    epoch: u64,
    sequence: u64,
    speaks_until: Stamp,
    silent_until: Stamp,
    history: Vec<MotionCommand>,
}

impl Commander {
    fn new(session: u64) -> Self {
        Self { session, epoch: 0, sequence: 0, speaks_until: ms(0), silent_until: ms(0), history: Vec::new() }
    }

    /// What it sends at this tick, and whether a silence has just begun.
    fn speak(&mut self, rng: &mut impl Rng, now: Stamp) -> (Option<MotionCommand>, bool) {
        if now < self.silent_until {
            return (None, false);
        }
        if now >= self.speaks_until {
            self.silent_until = now.after(Duration::from_millis(rng.random_range(310..1500)));
            self.speaks_until = self.silent_until.after(Duration::from_millis(rng.random_range(50..1500)));
            return (None, true);
        }
        // A recorded command now and then: it must not act.
        if !self.history.is_empty() && rng.random_range(0..100) < 3 {
            let old = self.history[rng.random_range(0..self.history.len())];
            return (Some(old), false);
        }
        self.sequence += rng.random_range(1..3);
        let command = MotionCommand {
            session: self.session,
            epoch: self.epoch,
            sequence: self.sequence,
            stamp: Stamp(now.0.saturating_sub(rng.random_range(0..120_000_000))),
            time_to_live: Duration::from_millis(rng.random_range(100..600)),
            motion: motion(rng),
        };
        self.history.push(command);
        (Some(command), false)
    }
}

fn motion(rng: &mut impl Rng) -> Motion {
    let wild = [f64::NAN, f64::INFINITY, -1e9, 0.51, -0.0, 1e-300];
    // More forwards than backwards, so that walls are met.
    let mut number = |least: f64, most: f64| match rng.random_range(0..100) {
        0..4 => wild[rng.random_range(0..wild.len())],
        _ => rng.random_range(least..=most),
    };
    let (a, b) = (number(-0.2, 0.5), number(-1.0, 1.0));
    match rng.random_range(0..100) {
        0..90 => Motion::Velocity { linear_m_s: a, angular_rad_s: b },
        90..94 => Motion::Forward { distance_m: a },
        94..98 => Motion::Turn { angle_rad: b },
        _ => Motion::Stop { done: false },
    }
}

/// The checks' own books.
#[derive(Default)]
struct Books {
    accepted: BTreeMap<(u64, u64), (Stamp, MotionCommand)>,
    ended: BTreeSet<(u64, u64)>,
    last_sequence: BTreeMap<u64, u64>,
    holder: Option<(u64, Stamp)>,
    epoch: u64,
    teleop: Option<Stamp>,
    slowest_stop: Duration,
}

impl Books {
    fn judge(&mut self, now: Stamp, command: &MotionCommand, verdict: &Verdict) {
        match verdict {
            Verdict::Accepted => {
                let key = (command.session, command.sequence);
                let last = self.last_sequence.insert(command.session, command.sequence);
                assert!(last.is_none_or(|last| command.sequence > last), "I3: sequence {command:?} after {last:?}");
                assert!(now < command.stamp.after(command.time_to_live), "I3: expired {command:?}");
                assert!(command.motion.is_finite(), "I4: {command:?}");
                assert!(command.epoch >= self.epoch, "I2: epoch fell to {}", command.epoch);
                self.epoch = command.epoch;
                if let Some((holder, heard)) = self.holder {
                    let free = holder == command.session || now.since(heard) >= LEASE;
                    assert!(free, "I2: {} acts while {holder} holds the lease", command.session);
                }
                self.holder = Some((command.session, now));
                self.teleop = None;
                self.accepted.insert(key, (now, *command));
            }
            Verdict::Duplicate => {
                assert!(self.accepted.contains_key(&(command.session, command.sequence)), "duplicate of nothing");
            }
            Verdict::Refused(_) => {}
        }
    }

    fn check(&mut self, now: Stamp, order: &VelocityOrder, before: &VelocityOrder) {
        let (v, w) = (order.linear_m_s, order.angular_rad_s);
        assert!(v.is_finite() && w.is_finite() && v.abs() <= 0.5 && w.abs() <= 1.5, "I4: {order:?}");
        let moving = v != 0.0 || w != 0.0;
        if !moving {
            return;
        }
        assert!(order.valid_until > now, "a void order moves nothing: {order:?}");
        assert!(v.abs() - before.linear_m_s.abs() <= 0.0501, "I4: accelerates from {before:?} to {order:?}");
        let Some(commander) = order.commander else {
            let since = self.teleop.expect("I1: moves for nobody");
            assert!(now.since(since) < Duration::from_millis(200), "teleop for longer than 200 ms");
            return;
        };
        let (accepted_at, command) = self.accepted[&commander];
        assert_eq!(self.last_sequence[&commander.0], commander.1, "I3: an older command acts");
        assert_eq!(self.holder.unwrap().0, commander.0, "I2: who acts does not hold the lease");
        assert!(!self.ended.contains(&commander), "acts after its end");
        if let Motion::Velocity { .. } = command.motion {
            let silent = order.valid_until.since(accepted_at);
            assert!(silent <= T_STOP, "I1: moves {silent:?} after the last valid command");
            assert!(now < command.stamp.after(command.time_to_live), "I3: acts after its expiry");
            self.slowest_stop = self.slowest_stop.max(silent);
        } else {
            assert!(now.since(accepted_at) < Duration::from_secs(12), "a bounded motion ends");
            self.holder = Some((commander.0, now));
        }
    }
}

/// One seed: three senders, 40 silences. The number of silences, the longest time an order held after the command it acts
/// on, and how the commands were answered.
fn simulate(seed: u64) -> (u64, Duration, GateCounters) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let quality = Quality { loss_percent: rng.random_range(0..40), delay_ms_max: rng.random_range(0..400) };
    let mut supervisor = Supervisor::new(config());
    let mut plant = Plant { wall_x_m: rng.random_range(0.3..1.5), ..Plant::new(0.05) };
    let mut commanders = [Commander::new(1), Commander::new(2)];
    let (mut link, mut books) = (Link::default(), Books::default());
    let mut order = supervisor.tick(ms(1000));
    let (mut losses, mut now) = (0, ms(1000));
    while losses < 40 {
        // Ticks come late, too.
        now = now.after(TICK + Duration::from_millis(if rng.random_range(0..20) == 0 { 40 } else { 0 }));
        for commander in &mut commanders {
            let (command, fell_silent) = commander.speak(&mut rng, now);
            losses += u64::from(fell_silent);
            if let Some(command) = command {
                link.send(&mut rng, now, command, quality);
            }
        }
        for command in link.arrived(now) {
            let verdict = supervisor.command(now, &command);
            books.judge(now, &command, &verdict);
        }
        if rng.random_range(0..10) == 0 {
            let verdict = supervisor.teleop(now, rng.random_range(-1.0..1.0), rng.random_range(-9.0..9.0));
            if verdict == Verdict::Accepted {
                books.teleop = Some(now);
            }
        }
        if rng.random_range(0..3000) == 0 {
            let next = &mut commanders[rng.random_range(0..2_usize)];
            next.epoch = supervisor.take_over(now, next.session);
            books.epoch = next.epoch;
            books.holder = Some((next.session, now));
        }
        if rng.random_range(0..10) > 0 {
            supervisor.sense(now, &plant.odometry(now), Some(&plant.scan(now)));
        }
        let before = order;
        order = supervisor.tick(now);
        for event in supervisor.take_events() {
            if let Event::Finished(result) = event {
                books.ended.insert((result.session, result.sequence));
            }
        }
        books.check(now, &order, &before);
        plant.drive(&order, TICK);
    }
    assert!(!plant.touched, "drove into the wall at {} m", plant.wall_x_m);
    (losses, books.slowest_stop, supervisor.counters())
}

#[test]
fn invariants_hold_over_many_seeds() {
    let (mut losses, mut slowest) = (0, Duration::ZERO);
    let mut answers = [0_u64; 8];
    for seed in 0..500 {
        let run = std::panic::catch_unwind(|| simulate(seed));
        let (l, s, c) = run.unwrap_or_else(|cause| {
            eprintln!("seed {seed}");
            std::panic::resume_unwind(cause)
        });
        losses += l;
        slowest = slowest.max(s);
        let kinds = [
            c.accepted,
            c.duplicate,
            c.not_finite,
            c.out_of_bounds,
            c.expired,
            c.wrong_epoch,
            c.lease_held,
            c.old_sequence,
        ];
        for (total, count) in answers.iter_mut().zip(kinds) {
            *total += count;
        }
    }
    println!(
        "{losses} silences, orders held {} ms after their command at most, answers {answers:?}",
        slowest.as_millis()
    );
    assert!(answers.iter().all(|&count| count > 100), "every kind of answer was given: {answers:?}");
    assert!(losses >= 20_000);
}

/// I5: after a silence in motion the robot moves again only once the stream was healthy for a second.
#[test]
fn a_silent_stream_must_be_healthy_before_it_moves_again() {
    let plant = Plant::new(0.0);
    let mut supervisor = Supervisor::new(config());
    let mut sequence = 0;
    let mut speed_at = |t: u64, speaks: bool| {
        supervisor.sense(ms(t), &plant.odometry(ms(t)), Some(&plant.scan(ms(t))));
        if speaks {
            sequence += 1;
            let motion = Motion::Velocity { linear_m_s: 0.3, angular_rad_s: 0.0 };
            let time_to_live = Duration::from_millis(300);
            let command = MotionCommand { session: 1, epoch: 0, sequence, stamp: ms(t), time_to_live, motion };
            assert_eq!(supervisor.command(ms(t), &command), Verdict::Accepted);
        }
        supervisor.tick(ms(t)).linear_m_s
    };
    for t in (1000..2000).step_by(20) {
        let _ = speed_at(t, true);
    }
    assert!(speed_at(2000, false) > 0.29);
    assert_eq!(speed_at(2180, false), 0.0);
    for t in (2400..3400).step_by(20) {
        assert_eq!(speed_at(t, true), 0.0, "still re-arming at {t} ms");
    }
    let _ = speed_at(3400, true);
    assert!(speed_at(3420, true) > 0.0);
}
