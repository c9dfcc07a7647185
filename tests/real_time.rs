//! A body in real time: who may move it, and that silence and the end of its process stop it.
#![expect(clippy::unwrap_used, clippy::expect_used, reason = "a test may fail by panicking")]

use std::time::{Duration, Instant};

use homing_core::{Motion, MotionCommand, Odometry, Stamp};
use homing_protocol::convert::Lease;
use homing_protocol::interfaces::{geometry_msgs, homing_msgs, nav_msgs};
use homing_protocol::{Publisher, Session, Subscription, ToDomain, ToMessage, topics};
use homing_tests::mission::{Mission, flat, photo};
use homing_tests::processes::{LIMIT, Process, System};
use nix::sys::signal::Signal;

/// Commands are sent this often.
const PERIOD: Duration = Duration::from_millis(40);
/// Silence stops the robot within this time.
const SILENCE_MAX: Duration = Duration::from_millis(300);

/// A body in real time, and everything an operator says to it and hears of it.
struct Robot {
    velocity: Publisher<geometry_msgs::TwistStamped>,
    command: Publisher<homing_msgs::MotionCommand>,
    odometry: Subscription<nav_msgs::Odometry>,
    leases: Subscription<homing_msgs::MotionLease>,
    sequence: u64,
    body: Process,
    session: Session,
    _system: System,
}

impl Robot {
    async fn start() -> Self {
        let system = System::new();
        // Few frames: these tests look at commands and odometry.
        let mut body = system.body("pace = \"real_time\"\nseed = 11\nframe_rate_hz = 1.0");
        body.says("the body is ready");
        let session = system.session();
        let robot = Self {
            velocity: session.publisher(&topics::CMD_VEL).unwrap(),
            command: session.publisher(&topics::MOTION_COMMAND).unwrap(),
            odometry: session.subscribe(&topics::ODOM, 1000).unwrap(),
            leases: session.subscribe(&topics::MOTION_LEASE, 100).unwrap(),
            sequence: 0,
            body,
            session,
            _system: system,
        };
        assert!(is_still(&robot.next().await), "the body starts standing");
        robot
    }

    /// The next odometry message.
    async fn next(&self) -> Odometry {
        let received = tokio::time::timeout(LIMIT, self.odometry.recv()).await.expect("odometry goes on");
        received.unwrap().message.to_domain().unwrap()
    }

    /// The newest odometry message.
    async fn newest(&self) -> Odometry {
        let next = self.next().await;
        self.odometry.try_latest().map_or(next, |o| o.unwrap().message.to_domain().unwrap())
    }

    async fn lease_where(&self, wanted: impl Fn(&Lease) -> bool) -> Lease {
        let began = Instant::now();
        loop {
            let received = tokio::time::timeout(LIMIT, self.leases.recv()).await.expect("the lease is told");
            let lease = received.unwrap().message.to_domain().unwrap();
            if wanted(&lease) {
                return lease;
            }
            assert!(began.elapsed() < LIMIT, "{lease:?}");
        }
    }

    fn teleop(&self, angular_rad_s: f64) {
        let mut message = geometry_msgs::TwistStamped::default();
        message.twist.angular.z = angular_rad_s;
        self.velocity.publish(&message).unwrap();
    }

    /// As a planner of this session.
    fn stream(&mut self, session: u64, stamp: Stamp, angular_rad_s: f64) {
        self.sequence += 1;
        let command = MotionCommand {
            session,
            epoch: 0,
            sequence: self.sequence,
            stamp,
            time_to_live: Duration::from_secs(1),
            motion: Motion::Velocity { linear_m_s: 0.0, angular_rad_s },
        };
        self.command.publish(&command.to_message()).unwrap();
    }

    /// Sends bare velocities until the robot turns as told. Gives the newest odometry before the last of them.
    async fn teleop_until(&self, turns: impl Fn(&Odometry) -> bool) -> Odometry {
        let began = Instant::now();
        loop {
            assert!(began.elapsed() < LIMIT, "the robot does not turn");
            let before = self.newest().await;
            self.teleop(0.5);
            if turns(&before) {
                return before;
            }
            tokio::time::sleep(PERIOD).await;
        }
    }
}

fn is_still(odometry: &Odometry) -> bool {
    odometry.linear_m_s == 0.0 && odometry.angular_rad_s == 0.0
}

fn turns_left(odometry: &Odometry) -> bool {
    odometry.angular_rad_s > 0.3
}

#[tokio::test(flavor = "multi_thread")]
async fn without_a_lease_velocities_drive_and_silence_stops() {
    let robot = Robot::start().await;
    let lease = robot.lease_where(|_| true).await;
    assert_eq!(lease.holder, None);
    for _ in 0..3 {
        let last = robot.teleop_until(turns_left).await;
        let stopped = loop {
            let odometry = robot.next().await;
            if is_still(&odometry) {
                break odometry;
            }
        };
        let took = stopped.stamp.since(last.stamp);
        println!("stopped {took:?} after the last word");
        assert!(took <= SILENCE_MAX, "the robot went on for {took:?} on its own clock");
        for _ in 0..10 {
            let after = robot.next().await;
            assert_eq!(after.t_odom_base, stopped.t_odom_base, "it crept on");
        }
    }
    robot.session.close();
}

#[tokio::test(flavor = "multi_thread")]
async fn who_holds_the_lease_drives_alone() {
    const PLANNER: u64 = 77;
    let mut robot = Robot::start().await;
    let mut held = 0;
    let began = Instant::now();
    while held < 25 {
        assert!(began.elapsed() < LIMIT, "the holder does not get through: {}", robot.body.said());
        let newest = robot.newest().await;
        assert!(newest.angular_rad_s >= 0.0, "a bare velocity turned the robot against the holder's will");
        held += u32::from(turns_left(&newest));
        robot.stream(PLANNER, newest.stamp, 0.4);
        if held > 0 {
            robot.teleop(-0.5);
        }
        tokio::time::sleep(PERIOD).await;
    }
    let lease = robot.lease_where(|l| l.refused > 0).await;
    assert_eq!(lease.holder.map(|(session, _)| session), Some(PLANNER));
    assert!(lease.accepted > 0);
    assert!(lease.last_refusal.contains("77 holds the lease"), "{}", lease.last_refusal);
    assert!(robot.body.said().contains("77 holds the lease"), "the refusal is not in the log");
    // A holder that falls silent loses it, and the teleoperator's word counts again.
    robot.lease_where(|l| l.holder.is_none()).await;
    robot.teleop_until(turns_left).await;
    robot.session.close();
}

#[tokio::test(flavor = "multi_thread")]
async fn expired_and_malformed_commands_do_not_move_it() {
    let mut robot = Robot::start().await;
    // The robot's clock must be past the time to live.
    let newest = loop {
        let newest = robot.newest().await;
        if newest.stamp > Stamp(1_200_000_000) {
            break newest;
        }
    };
    for _ in 0..10 {
        robot.stream(1, Stamp(0), 0.5);
        robot.stream(1, newest.stamp.after(Duration::from_secs(3600)), 0.5);
        robot.stream(1, robot.newest().await.stamp, f64::NAN);
        robot.teleop(f64::INFINITY);
        robot.velocity.publish_bytes(vec![1, 2, 3]).unwrap();
        robot.command.publish_bytes(vec![0; 64]).unwrap();
        tokio::time::sleep(PERIOD).await;
        assert!(is_still(&robot.newest().await));
    }
    let lease = robot.lease_where(|l| l.refused >= 10).await;
    assert_eq!((lease.holder, lease.accepted), (None, 0));
    // And it listens still.
    robot.teleop_until(turns_left).await;
    robot.session.close();
}

/// Frames come faster than perception can answer them: the planner takes the newest one that is answered.
#[tokio::test(flavor = "multi_thread")]
async fn a_perception_slower_than_the_camera_holds_nobody_up() {
    const STEPS: u64 = 12;
    let (arena, episode) = flat(1005);
    let system = System::new();
    let everybody = system.everybody(&episode, "pace = \"real_time\"\nframe_rate_hz = 30.0");
    let session = system.session();
    let mission = Mission::begin(&session, &photo(&arena, &episode)).await;
    let began = Instant::now();
    let state = mission.state_where(100, |s| s.step == STEPS).await;
    assert!(began.elapsed() < LIMIT, "{STEPS} steps took {:?}", began.elapsed());
    assert!(!state.reason.contains("not running"), "{state:?}");
    assert!(!everybody.planner.said().contains("WARN"), "{}", everybody.planner.said());
    session.close();
}

#[tokio::test(flavor = "multi_thread")]
async fn terminated_in_motion_it_stands_before_it_leaves() {
    let mut robot = Robot::start().await;
    robot.teleop_until(turns_left).await;
    robot.teleop(0.5);
    robot.body.signal(Signal::SIGTERM);
    let status = robot.body.ends();
    assert_eq!(status.code(), Some(0), "{}", robot.body.said());
    let mut last = robot.newest().await;
    while let Ok(Ok(more)) = tokio::time::timeout(Duration::from_millis(300), robot.odometry.recv()).await {
        last = more.message.to_domain().unwrap();
    }
    assert!(is_still(&last), "its last word was {last:?}");
    robot.session.close();
}
