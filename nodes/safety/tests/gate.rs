//! Which commands the gate takes, and from whom.
#![expect(clippy::unwrap_used, reason = "tests")]

use core::time::Duration;

use homing_core::{Motion, MotionCommand, Stamp};
use homing_safety::{CommandGate, GateConfig, Refusal, VelocityLimits, Verdict};

fn ms(t: u64) -> Stamp {
    Stamp(t * 1_000_000)
}

fn gate() -> CommandGate {
    CommandGate::new(GateConfig::new(VelocityLimits::new(0.5, 1.0, 1.0, 2.0).unwrap()))
}

fn command(session: u64, sequence: u64, stamp_ms: u64) -> MotionCommand {
    MotionCommand {
        session,
        epoch: 0,
        sequence,
        stamp: ms(stamp_ms),
        time_to_live: Duration::from_millis(300),
        motion: Motion::Velocity { linear_m_s: 0.3, angular_rad_s: 0.0 },
    }
}

fn refusal(verdict: Verdict) -> Refusal {
    match verdict {
        Verdict::Refused(refusal) => refusal,
        other => unreachable!("expected a refusal, got {other:?}"),
    }
}

#[test]
fn takes_each_command_once() {
    let mut gate = gate();
    assert_eq!(gate.offer(ms(1000), &command(7, 4, 990)), Verdict::Accepted);
    assert_eq!(gate.offer(ms(1010), &command(7, 4, 990)), Verdict::Duplicate);
    assert_eq!(refusal(gate.offer(ms(1020), &command(7, 3, 1010))), Refusal::OldSequence { found: 3, last: 4 });
    assert_eq!(gate.offer(ms(1030), &command(7, 9, 1020)), Verdict::Accepted);
    // Sent again long after it expired, it is still acknowledged: the sender waits for that.
    assert_eq!(gate.offer(ms(9000), &command(7, 9, 1020)), Verdict::Duplicate);
    let counters = gate.counters();
    assert_eq!((counters.accepted, counters.duplicate, counters.old_sequence, counters.refused()), (2, 2, 1, 1));
}

#[test]
fn refuses_what_is_late_or_early() {
    let mut gate = gate();
    let late = refusal(gate.offer(ms(1300), &command(7, 1, 1000)));
    assert_eq!(late, Refusal::Expired { late: Duration::ZERO });
    let early = refusal(gate.offer(ms(1000), &command(7, 1, 1051)));
    assert_eq!(early, Refusal::FromTheFuture { ahead: Duration::from_millis(51) });
    assert_eq!(gate.offer(ms(1000), &command(7, 1, 1050)), Verdict::Accepted);
    let immortal = MotionCommand { time_to_live: Duration::MAX, ..command(7, 2, 1000) };
    assert!(matches!(refusal(gate.offer(ms(1000), &immortal)), Refusal::LivesTooLong { .. }));
}

#[test]
fn refuses_what_is_not_a_bounded_number() {
    let mut gate = gate();
    let with = |motion| MotionCommand { motion, ..command(7, 1, 1000) };
    for (motion, quantity) in [
        (Motion::Velocity { linear_m_s: -0.51, angular_rad_s: 0.0 }, "linear_m_s"),
        (Motion::Velocity { linear_m_s: 0.0, angular_rad_s: 1.1 }, "angular_rad_s"),
        (Motion::Forward { distance_m: 2.1 }, "distance_m"),
        (Motion::Turn { angle_rad: -6.3 }, "angle_rad"),
    ] {
        match refusal(gate.offer(ms(1000), &with(motion))) {
            Refusal::OutOfBounds { quantity: found, .. } => assert_eq!(found, quantity),
            other => unreachable!("{other:?}"),
        }
    }
    for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let verdict = gate.offer(ms(1000), &with(Motion::Forward { distance_m: value }));
        assert!(matches!(refusal(verdict), Refusal::NotFinite { .. }));
    }
    // What was refused took neither lease nor sequence.
    assert_eq!(gate.lease_at(ms(1000)), None);
    assert_eq!(gate.offer(ms(1000), &command(8, 1, 1000)), Verdict::Accepted);
}

#[test]
fn one_commander_at_a_time() {
    let mut gate = gate();
    assert_eq!(gate.offer(ms(1000), &command(1, 1, 1000)), Verdict::Accepted);
    let held = refusal(gate.offer(ms(1400), &command(2, 1, 1400)));
    assert_eq!(held, Refusal::LeaseHeld { holder: 1, left: Duration::from_millis(600) });
    assert_eq!(gate.offer(ms(2000), &command(2, 2, 2000)), Verdict::Accepted, "the lease lapsed after 1 s of silence");
    assert!(matches!(refusal(gate.offer(ms(2010), &command(1, 2, 2010))), Refusal::LeaseHeld { holder: 2, .. }));
    gate.release(1);
    assert!(gate.lease_at(ms(2020)).is_some(), "only the holder can release");
    gate.release(2);
    assert_eq!(gate.offer(ms(2030), &command(1, 3, 2030)), Verdict::Accepted);
    // The sequence of a session outlives its lease.
    assert!(matches!(refusal(gate.offer(ms(2040), &command(1, 2, 2040))), Refusal::OldSequence { last: 3, .. }));
}

#[test]
fn repeats_in_time_keep_the_lease_and_recorded_ones_do_not() {
    let mut gate = gate();
    assert_eq!(gate.offer(ms(1000), &command(1, 1, 1000)), Verdict::Accepted);
    assert_eq!(gate.offer(ms(1250), &command(1, 1, 1000)), Verdict::Duplicate);
    assert_eq!(gate.lease_at(ms(2000)).unwrap().expires, ms(2250));
    assert_eq!(gate.offer(ms(1900), &command(1, 1, 1000)), Verdict::Duplicate);
    assert_eq!(gate.lease_at(ms(2250)), None);
}

#[test]
fn only_an_operator_takes_over() {
    let mut gate = gate();
    assert_eq!(gate.offer(ms(1000), &command(1, 1, 1000)), Verdict::Accepted);
    let claim = MotionCommand { epoch: 5, ..command(2, 1, 1100) };
    assert!(matches!(refusal(gate.offer(ms(1100), &claim)), Refusal::LeaseHeld { holder: 1, .. }));
    let own_claim = MotionCommand { epoch: 5, ..command(1, 2, 1100) };
    assert_eq!(refusal(gate.offer(ms(1100), &own_claim)), Refusal::EpochNotGranted { found: 5, granted: 0 });

    let epoch = gate.take_over(ms(1200), 2);
    assert_eq!(epoch, 1);
    assert_eq!(refusal(gate.offer(ms(1210), &command(1, 3, 1210))), Refusal::PastEpoch { found: 0, current: 1 });
    let taken = MotionCommand { epoch, ..command(2, 2, 1220) };
    assert_eq!(gate.offer(ms(1220), &taken), Verdict::Accepted);
    // Even when the new holder is gone, the old one stays out until it learns the new epoch.
    assert!(matches!(refusal(gate.offer(ms(9000), &command(1, 4, 9000))), Refusal::PastEpoch { .. }));
    assert_eq!(gate.epoch(), 1);
}

#[test]
fn memory_of_sessions_is_bounded() {
    let mut gate = gate();
    for session in 0..10_000 {
        let t = 1000 + session * 1000;
        assert_eq!(gate.offer(ms(t), &command(session, 1, t)), Verdict::Accepted);
    }
    let t = 1000 + 10_000 * 1000;
    assert_eq!(gate.offer(ms(t), &command(9_999, 1, t)), Verdict::Duplicate);
}
