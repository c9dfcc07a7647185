//! Distances and angles are driven to within a centimetre and half a degree, and what is in the way ends them.
#![expect(clippy::unwrap_used, reason = "tests")]

mod plant;

use std::collections::VecDeque;
use std::time::Duration;

use homing_core::{Motion, MotionCommand, MotionResult, PlanarPose, Stamp};
use homing_safety::{Event, OrderCause, Passage, Supervisor, Verdict};
use plant::{Plant, TICK, config, ms};

fn command(sequence: u64, stamp: Stamp, motion: Motion) -> MotionCommand {
    MotionCommand { session: 1, epoch: 0, sequence, stamp, time_to_live: Duration::from_millis(500), motion }
}

/// Drives one motion to its end with odometry that is `delay_ticks` old; the result, the pose long after, the farthest x
/// and yaw on the way, and how long it took.
struct Run {
    result: MotionResult,
    rest: PlanarPose,
    farthest_m: f64,
    farthest_rad: f64,
    took: Duration,
}

fn run(motion: Motion, lag_s: f64, delay_ticks: usize, wall_x_m: f64) -> Run {
    let mut plant = Plant { wall_x_m, ..Plant::new(lag_s) };
    let mut supervisor = Supervisor::new(config());
    let mut late = VecDeque::new();
    let mut now = ms(1000);
    let (mut result, mut took) = (None, Duration::ZERO);
    let (mut farthest_m, mut farthest_rad) = (0.0_f64, 0.0_f64);
    let mut yaw_rad = 0.0;
    for tick in 0..1000 {
        late.push_back((plant.odometry(now), plant.scan(now)));
        if late.len() > delay_ticks {
            let (odometry, scan) = late.pop_front().unwrap();
            supervisor.sense(now, &odometry, Some(&scan));
        }
        if tick == delay_ticks {
            assert_eq!(supervisor.command(now, &command(1, now, motion)), Verdict::Accepted);
        }
        let order = supervisor.tick(now);
        let before = plant.pose.yaw_rad;
        plant.drive(&order, TICK);
        yaw_rad += homing_core::wrap_angle(plant.pose.yaw_rad - before);
        (farthest_m, farthest_rad) = (farthest_m.max(plant.pose.x_m.abs()), farthest_rad.max(yaw_rad.abs()));
        for event in supervisor.take_events() {
            if let Event::Finished(r) = event {
                assert!(result.replace(r).is_none(), "a motion ends once");
                took = now.since(ms(1000));
            }
        }
        now = now.after(TICK);
    }
    Run { result: result.unwrap(), rest: plant.pose, farthest_m, farthest_rad, took }
}

#[test]
fn distances_end_within_a_centimetre() {
    for (lag_s, delay_ticks) in [(0.0, 0), (0.05, 0), (0.05, 2), (0.08, 3)] {
        for distance_m in [0.25, -0.25, 0.05, 0.004, 1.0, 2.0] {
            let run = run(Motion::Forward { distance_m }, lag_s, delay_ticks, f64::INFINITY);
            let context = format!("{distance_m} m, lag {lag_s} s, odometry {delay_ticks} ticks late");
            assert!(!run.result.outcome.blocked, "{context}");
            assert!((run.rest.x_m - distance_m).abs() < 0.01, "{context}: at {}", run.rest.x_m);
            assert!(run.farthest_m < distance_m.abs() + 0.01, "{context}: overshoot to {}", run.farthest_m);
            assert!((run.result.outcome.moved.x_m - run.rest.x_m).abs() < 0.002, "{context}: {:?}", run.result);
        }
    }
}

#[test]
fn turns_end_within_half_a_degree() {
    for (lag_s, delay_ticks) in [(0.0, 0), (0.05, 0), (0.05, 2), (0.08, 3)] {
        for angle_deg in [15.0_f64, -15.0, 30.0, 1.0, 90.0, 180.0, -270.0, 360.0] {
            let run = run(Motion::Turn { angle_rad: angle_deg.to_radians() }, lag_s, delay_ticks, f64::INFINITY);
            let context = format!("{angle_deg} deg, lag {lag_s} s, odometry {delay_ticks} ticks late");
            let error_deg = homing_core::wrap_angle(run.rest.yaw_rad - angle_deg.to_radians()).to_degrees();
            assert!(!run.result.outcome.blocked, "{context}");
            assert!(error_deg.abs() < 0.5, "{context}: {error_deg} deg off");
            assert!(run.farthest_rad.to_degrees() < angle_deg.abs() + 0.5, "{context}: overshoot");
        }
    }
}

#[test]
fn a_step_of_the_planner_takes_about_a_second() {
    let forward = run(Motion::Forward { distance_m: 0.25 }, 0.05, 1, f64::INFINITY).took;
    let turn = run(Motion::Turn { angle_rad: 15.0_f64.to_radians() }, 0.05, 1, f64::INFINITY).took;
    assert!(forward < Duration::from_millis(1600), "{forward:?}");
    assert!(turn < Duration::from_millis(1200), "{turn:?}");
}

#[test]
fn a_wall_ends_a_distance_before_it_is_touched() {
    let run = run(Motion::Forward { distance_m: 2.0 }, 0.05, 2, 1.0);
    assert!(run.result.outcome.blocked);
    let gap_m = 1.0 - 0.18 - run.farthest_m;
    assert!((0.05..0.2).contains(&gap_m), "stopped {gap_m} m before the wall");
}

#[test]
fn an_invisible_wall_ends_a_distance_by_lack_of_progress() {
    let mut plant = Plant { wall_x_m: 0.5, ..Plant::new(0.05) };
    let open = Plant::new(0.0);
    let mut supervisor = Supervisor::new(config());
    let (mut now, mut ended) = (ms(1000), None);
    supervisor.sense(now, &plant.odometry(now), Some(&open.scan(now)));
    assert_eq!(supervisor.command(now, &command(1, now, Motion::Forward { distance_m: 1.0 })), Verdict::Accepted);
    while ended.is_none() && now < ms(9000) {
        supervisor.sense(now, &plant.odometry(now), Some(&open.scan(now)));
        plant.drive(&supervisor.tick(now), TICK);
        ended = supervisor.take_events().pop();
        now = now.after(TICK);
    }
    let Some(Event::Finished(result)) = ended else { unreachable!("{ended:?}") };
    assert!(result.outcome.blocked && (result.outcome.moved.x_m - 0.32).abs() < 0.01, "{result:?}");
    assert!(now < ms(3500), "gave up at {now:?}");
}

#[test]
fn a_motion_without_odometry_is_refused_and_one_that_loses_it_stands_still() {
    let plant = Plant::new(0.0);
    let mut supervisor = Supervisor::new(config());
    let forward = command(1, ms(1000), Motion::Forward { distance_m: 0.5 });
    assert!(matches!(supervisor.command(ms(1000), &forward), Verdict::Refused(_)));
    supervisor.sense(ms(1000), &plant.odometry(ms(1000)), Some(&plant.scan(ms(1000))));
    assert_eq!(supervisor.command(ms(1000), &forward), Verdict::Accepted, "what was refused used up no sequence");
    let mut causes = Vec::new();
    let mut blocked = None;
    for t in (1000..4000).step_by(20) {
        let order = supervisor.tick(ms(t));
        if t > 1300 {
            assert_eq!((order.linear_m_s, order.angular_rad_s), (0.0, 0.0));
        }
        causes.push(order.cause);
        if let Some(Event::Finished(result)) = supervisor.take_events().pop() {
            blocked = Some(result.outcome.blocked);
        }
    }
    assert!(causes.contains(&OrderCause::NoOdometry));
    assert_eq!(blocked, Some(true));
}

#[test]
fn a_repeat_is_answered_again_and_does_not_move() {
    let mut plant = Plant::new(0.0);
    let mut supervisor = Supervisor::new(config());
    let forward = command(1, ms(1000), Motion::Forward { distance_m: 0.25 });
    let mut results = Vec::new();
    for t in (1000..4000).step_by(20) {
        supervisor.sense(ms(t), &plant.odometry(ms(t)), Some(&plant.scan(ms(t))));
        let verdict = supervisor.command(ms(t), &forward);
        assert_eq!(verdict, if t == 1000 { Verdict::Accepted } else { Verdict::Duplicate });
        plant.drive(&supervisor.tick(ms(t)), TICK);
        results.extend(supervisor.take_events());
    }
    assert!((plant.pose.x_m - 0.25).abs() < 0.01);
    assert!(results.len() > 10, "each repeat after the end is acknowledged");
    assert!(results.iter().all(|event| *event == results[0]));
}

#[test]
fn teleop_moves_only_a_robot_that_nobody_holds() {
    let plant = Plant::new(0.0);
    let mut supervisor = Supervisor::new(config());
    supervisor.sense(ms(1000), &plant.odometry(ms(1000)), Some(&plant.scan(ms(1000))));
    assert_eq!(supervisor.teleop(ms(1000), 9.0, 0.0), Verdict::Accepted);
    let _ = supervisor.tick(ms(1000));
    let order = supervisor.tick(ms(1020));
    assert!(order.linear_m_s > 0.0 && order.cause == OrderCause::Teleop && order.commander.is_none());
    assert!(order.valid_until <= ms(1200));
    assert_eq!(supervisor.tick(ms(1200)).linear_m_s, 0.0, "for 200 ms at a time");
    assert!(matches!(supervisor.teleop(ms(1210), f64::NAN, 0.0), Verdict::Refused(_)));

    let stop = command(1, ms(1300), Motion::Stop { done: false });
    assert_eq!(supervisor.command(ms(1300), &stop), Verdict::Accepted);
    assert!(matches!(supervisor.teleop(ms(1310), 0.2, 0.0), Verdict::Refused(_)));
    assert_eq!(supervisor.teleop(ms(2400), 0.2, 0.0), Verdict::Accepted, "the lease lapsed");
}

#[test]
fn take_over_and_halt_stop_what_is_under_way() {
    let plant = Plant::new(0.0);
    let mut supervisor = Supervisor::new(config());
    let velocity = Motion::Velocity { linear_m_s: 0.4, angular_rad_s: 0.0 };
    let go = |supervisor: &mut Supervisor, sequence, t: u64| {
        supervisor.sense(ms(t), &plant.odometry(ms(t)), Some(&plant.scan(ms(t))));
        let verdict = supervisor.command(ms(t), &command(sequence, ms(t), velocity));
        let _ = supervisor.tick(ms(t));
        (verdict, supervisor.tick(ms(t + 20)).linear_m_s)
    };
    assert!(go(&mut supervisor, 1, 1000).1 > 0.0);
    supervisor.halt(ms(1030));
    assert_eq!(supervisor.tick(ms(1040)).linear_m_s, 0.0);
    assert!(go(&mut supervisor, 2, 1100).1 > 0.0);
    let epoch = supervisor.take_over(ms(1130), 99);
    assert_eq!(supervisor.tick(ms(1140)).linear_m_s, 0.0);
    assert!(matches!(go(&mut supervisor, 3, 1150), (Verdict::Refused(_), v) if v == 0.0));
    assert!(supervisor.take_events().contains(&Event::TakenOver { session: 99, epoch }));
    assert_eq!(supervisor.lease().map(|lease| lease.session), Some(99));
}

#[test]
fn a_blind_scanner_stops_a_stream_and_says_so() {
    let plant = Plant::new(0.0);
    let mut supervisor = Supervisor::new(config());
    let velocity = Motion::Velocity { linear_m_s: 0.4, angular_rad_s: 0.5 };
    supervisor.sense(ms(1000), &plant.odometry(ms(1000)), None);
    assert_eq!(supervisor.command(ms(1000), &command(1, ms(1000), velocity)), Verdict::Accepted);
    let _ = supervisor.tick(ms(1000));
    let order = supervisor.tick(ms(1020));
    assert_eq!((order.linear_m_s, order.cause), (0.0, OrderCause::Guarded(Passage::Blind)));
    assert!(order.angular_rad_s > 0.0, "turning in place stays allowed");
    let _ = supervisor.tick(ms(1220));
    let blocked = supervisor.take_events().iter().any(|e| matches!(e, Event::Finished(r) if r.outcome.blocked));
    assert!(blocked);
}

#[test]
fn a_clock_that_steps_back_brings_nothing_to_life() {
    let plant = Plant::new(0.0);
    let mut supervisor = Supervisor::new(config());
    supervisor.sense(ms(5000), &plant.odometry(ms(5000)), Some(&plant.scan(ms(5000))));
    let velocity = Motion::Velocity { linear_m_s: 0.4, angular_rad_s: 0.0 };
    assert_eq!(supervisor.command(ms(5000), &command(1, ms(5000), velocity)), Verdict::Accepted);
    assert_eq!(supervisor.tick(ms(5300)).linear_m_s, 0.0);
    assert!(matches!(supervisor.command(ms(4000), &command(2, ms(4000), velocity)), Verdict::Refused(_)));
    assert_eq!(supervisor.tick(ms(4000)).linear_m_s, 0.0);
    assert_eq!(supervisor.tick(ms(4020)).linear_m_s, 0.0);
}

#[test]
fn odometry_and_scans_from_the_future_do_not_stay_fresh() {
    let plant = Plant::new(0.0);
    let mut supervisor = Supervisor::new(config());
    supervisor.sense(ms(1000), &plant.odometry(ms(99_000)), Some(&plant.scan(ms(99_000))));
    let mut broken = plant.odometry(ms(1000));
    broken.linear_m_s = f64::NAN;
    supervisor.sense(ms(1000), &broken, None);
    assert_eq!((supervisor.dropped().odometry, supervisor.dropped().scans), (2, 1));
    let forward = command(1, ms(1000), Motion::Forward { distance_m: 0.5 });
    assert!(matches!(supervisor.command(ms(1000), &forward), Verdict::Refused(_)));
}

#[test]
fn the_slow_zone_slows_and_does_not_creep() {
    let mut plant = Plant { wall_x_m: 1.0, ..Plant::new(0.05) };
    let mut supervisor = Supervisor::new(config());
    let mut speeds = Vec::new();
    for t in (1000..7000).step_by(20) {
        supervisor.sense(ms(t), &plant.odometry(ms(t)), Some(&plant.scan(ms(t))));
        let motion = Motion::Velocity { linear_m_s: 0.5, angular_rad_s: 0.0 };
        assert_eq!(supervisor.command(ms(t), &command(t, ms(t), motion)), Verdict::Accepted);
        let order = supervisor.tick(ms(t));
        plant.drive(&order, TICK);
        speeds.push((plant.pose.x_m, order.linear_m_s));
    }
    let rest_m = 1.0 - 0.18 - plant.pose.x_m;
    assert!((0.08..0.13).contains(&rest_m), "stands {rest_m} m before the wall");
    // Hull 0.27 m from the wall: half of the slow zone is left, less the 2 cm of margin.
    let half = speeds.iter().find(|(x_m, _)| 1.0 - 0.18 - x_m < 0.27).unwrap().1;
    assert!((half - 0.25).abs() < 0.04, "half the speed half way: {half}");
    let last = speeds.iter().rposition(|&(_, v)| v > 0.0).unwrap();
    assert!(last < 200, "stands after {} s", last as f64 * 0.02);
}
