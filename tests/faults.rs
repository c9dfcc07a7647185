//! What goes wrong around the processes, and what they make of it: a clear message, the right exit code, nothing lost.
#![expect(clippy::unwrap_used, reason = "a test may fail by panicking")]

use std::net::TcpListener;
use std::time::Instant;

use homing_core::{Action, Mode, Motion, NavigationState};
use homing_protocol::{Session, ToDomain, topics};
use homing_tests::mission::{Mission, flat, photo};
use homing_tests::processes::{LIMIT, Process, System};
use nix::sys::signal::Signal;

/// The five processes, and what their configuration must hold besides.
const PROCESSES: [(&str, &str); 5] = [
    ("homing-sim", ""),
    ("homing-perception", ""),
    ("homing-planner", ""),
    ("homing-robot", "recording = \"nowhere\""),
    ("homing-monitor", ""),
];

/// The exit code for a configuration that cannot be used.
const CONFIG: Option<i32> = Some(78);
const FAILURE: Option<i32> = Some(1);
const SUCCESS: Option<i32> = Some(0);

const ALONE: &str = "perception is not running";

/// Expects an end with this code and these words.
fn ends_saying(mut process: Process, code: Option<i32>, words: &[&str]) {
    let status = process.ends();
    let said = process.said();
    assert_eq!(status.code(), code, "{said}");
    for word in words {
        assert!(said.contains(word), "'{word}' is not in what it said: {said}");
    }
    assert!(!said.contains("panicked"), "{said}");
}

#[test]
fn a_misspelt_key_is_named() {
    let system = System::new();
    for (binary, needs) in PROCESSES {
        ends_saying(system.start(binary, &format!("{needs}\nsede = 7\n")), CONFIG, &["sede", "unknown field", ".toml"]);
        let session = format!("{needs}\n[session]\nconect = [\"tcp/127.0.0.1:1\"]\n");
        ends_saying(system.start(binary, &session), CONFIG, &["conect", "unknown field"]);
        ends_saying(system.start(binary, "not toml at all"), CONFIG, &[".toml"]);
    }
    ends_saying(system.start("homing-robot", ""), CONFIG, &["missing field", "recording"]);
    ends_saying(system.start("homing-planner", "policy = \"straigth\""), CONFIG, &["straigth", "frontier"]);
    ends_saying(system.start("homing-sim", "pace = \"real-time\""), CONFIG, &["real-time", "real_time"]);
    ends_saying(system.start("homing-perception", "[gates]\nn_inliers = 9"), CONFIG, &["n_inliers"]);
}

#[test]
fn a_value_that_cannot_work_is_named() {
    let system = System::new();
    ends_saying(system.start("homing-planner", "[map]\nside_m = -1.0"), CONFIG, &["ERROR", "map_side_m", "-1"]);
    ends_saying(
        system.start("homing-perception", "[features]\nkeypoints_max = 1"),
        CONFIG,
        &["keypoints_max", "8..=20000"],
    );
}

#[test]
fn a_process_leaves_with_whoever_started_it() {
    let system = System::new();
    let listen = format!("[session]\nlisten = [\"{}\"]\n", system.endpoint());
    let (mut body, stdin) = system.follower("homing-sim", &listen);
    body.says("the body is ready");
    drop(stdin);
    ends_saying(body, SUCCESS, &["whoever started this process is gone"]);
}

#[test]
fn a_taken_port_is_named() {
    let system = System::new();
    let _taken = TcpListener::bind(("127.0.0.1", system.port())).unwrap();
    ends_saying(system.body(""), FAILURE, &["ERROR", &format!("127.0.0.1:{}", system.port()), "another robot"]);
}

#[test]
fn nobody_to_connect_to() {
    let system = System::new();
    for binary in ["homing-perception", "homing-planner", "homing-monitor"] {
        let config = format!("[session]\nconnect_timeout_s = 1\nconnect = [\"{}\"]\n", system.endpoint());
        let began = Instant::now();
        ends_saying(
            system.start(binary, &config),
            FAILURE,
            &["ERROR", "no robot answers", &format!("127.0.0.1:{}", system.port()), "Start the robot"],
        );
        assert!(began.elapsed().as_secs() < 20, "{binary} took {:?} to give up after 1 s", began.elapsed());
    }
}

#[test]
fn what_is_to_be_played_is_missing_or_is_nothing() {
    let system = System::new();
    let empty = system.file("empty.json", "");
    let cut = system.file("cut.json", "{\"scene\": {\"kind\": \"flat\"");
    let text = system.file("text.glb", "this is no scene");
    ends_saying(system.body("glb = \"/nowhere/house.glb\""), FAILURE, &["ERROR", "/nowhere/house.glb"]);
    ends_saying(system.body(&format!("glb = {text:?}")), FAILURE, &["ERROR", "text.glb"]);
    ends_saying(system.body("episode = \"/nowhere/e.json\""), FAILURE, &["ERROR", "/nowhere/e.json", "cannot read"]);
    ends_saying(system.body(&format!("episode = {empty:?}")), FAILURE, &["ERROR", "empty.json", "is empty"]);
    ends_saying(system.body(&format!("episode = {cut:?}")), FAILURE, &["ERROR", "cut.json", "not an episode"]);
    let listen = format!("recording = \"/nowhere/film\"\n[session]\nlisten = [\"{}\"]\n", system.endpoint());
    ends_saying(system.start("homing-robot", &listen), FAILURE, &["ERROR", "/nowhere/film", "no such folder"]);
}

/// A body in lockstep and a planner, with a mission begun.
struct Drive {
    mission: Mission,
    planner: Process,
    body: Process,
    session: Session,
    system: System,
}

impl Drive {
    /// `with` is started between body and planner.
    async fn begin(seed: u64, with: impl FnOnce(&System) -> Option<Process>) -> (Self, Option<Process>) {
        let (arena, episode) = flat(seed);
        let system = System::new();
        let file = system.file("episode.json", serde_json::to_string(&episode).unwrap());
        let mut body = system.body(&format!("episode = {file:?}"));
        body.says("the body is ready");
        let other = with(&system);
        let mut planner = system.node("homing-planner", "[pace]\nanswer_ms_max = 1000\n");
        planner.says("planner is ready");
        let session = system.session();
        let mission = Mission::begin(&session, &photo(&arena, &episode)).await;
        (Self { mission, planner, body, session, system }, other)
    }

    /// Ctrl-C in mid-episode: every process leaves in order, the planner first.
    async fn leave(mut self) {
        let commands = self.session.subscribe(&topics::MOTION_COMMAND, 1).unwrap();
        tokio::time::timeout(LIMIT, commands.recv()).await.unwrap().unwrap();
        for process in [&mut self.planner, &mut self.body] {
            process.signal(Signal::SIGINT);
            assert_eq!(process.ends().code(), SUCCESS, "{}", process.said());
            assert!(!process.said().contains("ERROR") && !process.said().contains("panicked"), "{}", process.said());
        }
        let last = commands.try_latest().unwrap().unwrap().message.to_domain().unwrap();
        assert_eq!(last.motion, Motion::Stop { done: false }, "the planner left without a last word");
        self.session.close();
    }
}

fn perception(system: &System) -> Process {
    let mut perception = system.node("homing-perception", "");
    perception.says("perception is ready");
    perception
}

fn alone(state: &NavigationState) -> bool {
    state.reason.contains(ALONE)
}

#[tokio::test(flavor = "multi_thread")]
async fn without_perception_the_planner_explores_and_says_so() {
    let (drive, _) = Drive::begin(1005, |_| None).await;
    let first = drive.mission.state_where(5, alone).await;
    assert_eq!((first.mode, first.goal.is_some()), (Mode::Explore, false));
    let mut last = first.clone();
    // A whole look around comes first.
    for _ in 0..50 {
        let state = drive.mission.state().await;
        assert!(alone(&state) && state.mode == Mode::Explore && state.action != Action::Hold, "{state:?}");
        assert_eq!(state.step, last.step + 1, "a step was taken twice, or not at all");
        last = state;
    }
    let way_m = first.pose.distance_to(last.pose.x_m, last.pose.y_m);
    assert!(way_m > 0.2, "it explored {way_m} m in 50 steps");
    // The goal photo is still offered to a perception that starts late.
    let late = perception(&drive.system);
    let state = drive.mission.state_where(200, |s| !alone(s)).await;
    assert_ne!(state.mode, Mode::Failed);
    drop(late);
    drive.leave().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn perception_dies_comes_back_hangs_and_goes_on() {
    let (mut drive, first) = Drive::begin(1005, |system| Some(perception(system))).await;
    let mission = &drive.mission;
    let before = mission.state_where(8, |s| s.step == 5).await;
    assert!(!alone(&before), "perception was never there: {before:?}");

    let first = first.unwrap();
    first.signal(Signal::SIGKILL);
    let without = mission.state_where(10, alone).await;
    assert!(without.step <= before.step + 5, "its death was noticed at step {}", without.step);
    drop(first);

    let second = perception(&drive.system);
    let back = mission.state_where(300, |s| !alone(s)).await;
    let seen = mission.state_where(400, |s| s.goal.as_ref().is_some_and(|g| g.last_seen >= back.stamp)).await;
    assert!(seen.goal.unwrap().n_fused > 0);

    second.signal(Signal::SIGSTOP);
    let hung = mission.state().await;
    let later = mission.state_where(20, |s| s.step >= hung.step + 8).await;
    let remembered = later.goal.map(|g| g.last_seen);
    assert!(remembered.is_none_or(|at| at <= hung.stamp), "an estimate came from a process that hangs");
    assert!(drive.planner.said().contains("now=Late"), "{}", drive.planner.said());
    second.signal(Signal::SIGCONT);
    drive.planner.says_times("now=InTime", 2);
    mission.state_where(200, |s| s.goal.as_ref().is_some_and(|g| g.last_seen > later.stamp)).await;

    second.signal(Signal::SIGTERM);
    let mut second = second;
    assert_eq!(second.ends().code(), SUCCESS, "{}", second.said());
    drive.leave().await;
}
