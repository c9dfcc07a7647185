//! What `protocol` promises of the network, over real sessions: a router and a client in one process.
#![expect(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test may fail by panicking")]

use std::collections::{BTreeMap, BTreeSet};
use std::process::Command;
use std::time::{Duration, Instant};

use homing_core::{
    DepthImage, Intrinsics, Mode, Motion, MotionCommand, MotionOutcome, MotionResult, PlanarPose, Stamp,
};
use homing_privileged::{EPISODE_SUMMARY, GROUND_TRUTH, ResetError};
use homing_protocol::convert::{EncodedPhoto, depth_message, to_depth};
use homing_protocol::interfaces::homing_msgs;
use homing_protocol::navigate::{
    Mission, MissionId, MissionReport, NavigateClient, NavigateError, NavigateServer, Outcome, Progress,
};
use homing_protocol::topics::{self, Message};
use homing_protocol::{Link, Publisher, ReceiveError, Session, SessionConfig, SessionError, Subscription};
use homing_protocol::{ToDomain, ToMessage};
use homing_tests::{free_port, python, repository};

/// Nothing on one host takes longer unless it is broken.
const LIMIT: Duration = Duration::from_secs(20);

fn endpoint(port: u16) -> Vec<String> {
    vec![format!("tcp/127.0.0.1:{port}")]
}

fn config(node: &str, link: Link) -> SessionConfig {
    SessionConfig { connect_timeout: Duration::from_secs(5), ..SessionConfig::new(node, link) }
}

/// A body's session and one that connects to it.
fn pair(shared_memory: bool) -> (Session, Session) {
    let port = free_port();
    let body = SessionConfig { shared_memory, ..config("body", Link::Listen(endpoint(port))) };
    let other = SessionConfig { shared_memory, ..config("other", Link::Connect(endpoint(port))) };
    (Session::open(&body).unwrap(), Session::open(&other).unwrap())
}

/// Sends until the receiver is known to the sender; leaves nothing waiting.
async fn meet<M: Message>(publisher: &Publisher<M>, subscription: &Subscription<M>, message: &M) {
    let began = Instant::now();
    while subscription.counts().arrived == 0 {
        assert!(began.elapsed() < LIMIT, "sender and receiver never met");
        publisher.publish(message).unwrap();
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    tokio::time::sleep(Duration::from_millis(100)).await;
    while subscription.try_recv().is_some() {}
}

async fn next<M: Message>(subscription: &Subscription<M>) -> Result<M, ReceiveError> {
    tokio::time::timeout(LIMIT, subscription.recv()).await.expect("a message in time").map(|r| r.message)
}

/// Waits until so many messages more than `before` arrived.
async fn arrived<M: Message>(subscription: &Subscription<M>, n: u64) {
    let began = Instant::now();
    while subscription.counts().arrived < n {
        assert!(began.elapsed() < LIMIT, "{} of {n} messages arrived", subscription.counts().arrived);
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
}

fn result(sequence: u64) -> MotionResult {
    let moved = PlanarPose { x_m: 0.25, y_m: -1e-300, yaw_rad: 0.1 };
    MotionResult { session: 7, sequence, outcome: MotionOutcome { stamp: Stamp(123_456_789), moved, blocked: true } }
}

/// 640x480 depths, no two rows alike: 1.2 MB on the wire.
fn large() -> DepthImage {
    let depths = (0..640 * 480).map(|i| 0.5 + (i as f32) * 1e-4).collect();
    DepthImage::from_metres(640, 480, depths).unwrap()
}

async fn small_and_large(shared_memory: bool) {
    let (body, other) = pair(shared_memory);
    let small = body.publisher(&topics::MOTION_RESULT).unwrap();
    let hears = other.subscribe(&topics::MOTION_RESULT, 4).unwrap();
    meet(&small, &hears, &result(0).to_message()).await;
    small.publish(&result(1).to_message()).unwrap();
    assert_eq!(next(&hears).await.unwrap().to_domain().unwrap(), result(1));

    let frames = body.publisher(&topics::CAMERA_DEPTH).unwrap();
    let sees = other.subscribe(&topics::CAMERA_DEPTH, 2).unwrap();
    let message = depth_message(Stamp(42), &large());
    meet(&frames, &sees, &message).await;
    // More frames than the pool of shared memory holds at a time.
    for n in 0..40 {
        frames.publish(&depth_message(Stamp(n), &large())).unwrap();
        let (stamp, image) = to_depth(&next(&sees).await.unwrap()).unwrap();
        assert_eq!(stamp, Stamp(n));
        assert!(image == large(), "the image arrived otherwise than it was sent");
    }
    other.close();
    body.close();
}

#[tokio::test(flavor = "multi_thread")]
async fn messages_arrive_as_they_were_sent_over_tcp() {
    small_and_large(false).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn messages_arrive_as_they_were_sent_through_shared_memory() {
    small_and_large(true).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_router_forwards_between_two_others() {
    let (body, first) = pair(true);
    let port = free_port();
    drop((body, first));
    let body = Session::open(&config("body", Link::Listen(endpoint(port)))).unwrap();
    let [first, second] =
        ["first", "second"].map(|n| Session::open(&config(n, Link::Connect(endpoint(port)))).unwrap());
    let speaks = first.publisher(&topics::MOTION_RESULT).unwrap();
    let hears = second.subscribe(&topics::MOTION_RESULT, 1).unwrap();
    meet(&speaks, &hears, &result(0).to_message()).await;
    assert!(second.has_sender(&topics::MOTION_RESULT), "the sender's announcement did not pass");
    assert!(!second.has_sender(&topics::MOTION_COMMAND));
    speaks.publish(&result(3).to_message()).unwrap();
    assert_eq!(next(&hears).await.unwrap().to_domain().unwrap(), result(3));
    [second, first, body].iter().for_each(Session::close);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_sender_that_left_is_missed() {
    let (body, other) = pair(false);
    let speaks = other.publisher(&topics::GOAL_ESTIMATE).unwrap();
    let until = |wanted: bool| {
        let body = &body;
        async move {
            let began = Instant::now();
            while body.has_sender(&topics::GOAL_ESTIMATE) != wanted {
                assert!(began.elapsed() < LIMIT, "has_sender stays {}", !wanted);
                tokio::time::sleep(Duration::from_millis(5)).await;
            }
        }
    };
    until(true).await;
    drop(speaks);
    until(false).await;
    other.close();
    body.close();
}

#[tokio::test(flavor = "multi_thread")]
async fn a_slow_reader_gets_the_newest() {
    let (body, other) = pair(false);
    let speaks = body.publisher(&topics::MOTION_RESULT).unwrap();
    let one = other.subscribe(&topics::MOTION_RESULT, 1).unwrap();
    let three = other.subscribe(&topics::MOTION_RESULT, 3).unwrap();
    meet(&speaks, &one, &result(0).to_message()).await;
    while three.try_recv().is_some() {}
    let (before_one, before_three) = (one.counts(), three.counts());
    // One at a time: what a sender drops on a busy machine is another matter.
    for n in 1..=10 {
        speaks.publish(&result(n).to_message()).unwrap();
        arrived(&one, before_one.arrived + n).await;
        arrived(&three, before_three.arrived + n).await;
    }
    assert_eq!(next(&one).await.unwrap().sequence, 10);
    assert_eq!(one.counts().displaced - before_one.displaced, 9);
    assert!(one.try_recv().is_none());
    let kept = [next(&three).await, next(&three).await, next(&three).await].map(|m| m.unwrap().sequence);
    assert_eq!(kept, [8, 9, 10]);
    assert_eq!(three.counts().displaced - before_three.displaced, 7);

    for n in 11..=13 {
        speaks.publish(&result(n).to_message()).unwrap();
        arrived(&three, before_three.arrived + n).await;
    }
    let newest = three.try_latest().unwrap().unwrap();
    assert_eq!((newest.message.sequence, newest.sequence.is_some()), (13, true));
    assert_eq!(three.counts().displaced - before_three.displaced, 9, "what was passed over is counted");
    assert!(three.try_recv().is_none());
    other.close();
    body.close();
}

#[tokio::test(flavor = "multi_thread")]
async fn malformed_bytes_are_refused_and_the_next_message_arrives() {
    let (body, other) = pair(false);
    let speaks = body.publisher(&topics::MOTION_RESULT).unwrap();
    let hears = other.subscribe(&topics::MOTION_RESULT, 1).unwrap();
    meet(&speaks, &hears, &result(0).to_message()).await;
    let header = |rest: &[u8]| [&[0, 1, 0, 0][..], rest].concat();
    let cases: [(&str, Vec<u8>); 8] = [
        ("few", Vec::new()),
        ("few", vec![0, 1, 0]),
        ("header", vec![0xff; 120]),
        ("", header(&[])),
        ("", header(&[0; 20])),
        // The length of the frame's name claims 4 GiB.
        ("", header(&[&[0; 8][..], &[0xff; 4], &[0; 80]].concat())),
        ("left over", header(&[0; 400])),
        ("", vec![0, 1, 0, 0, 1, 2, 3]),
    ];
    for (says, bytes) in cases {
        speaks.publish_bytes(bytes.clone()).unwrap();
        let refusal = next(&hears).await.expect_err("bytes that are no message");
        assert!(matches!(refusal, ReceiveError::Malformed { topic: "motion_result", .. }), "{refusal}");
        assert!(refusal.to_string().contains(says), "{refusal} does not say {says}");
        speaks.publish(&result(5).to_message()).unwrap();
        assert_eq!(next(&hears).await.unwrap().to_domain().unwrap(), result(5), "after {bytes:?}");
    }
    speaks.publish_bytes(header(&[0; 5000])).unwrap();
    assert!(matches!(next(&hears).await, Err(ReceiveError::TooLarge { bytes: 5004, bytes_max: 4096, .. })));
    other.close();
    body.close();
}

#[test]
fn a_taken_port_is_named() {
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port();
    let Err(refusal) = Session::open(&config("body", Link::Listen(endpoint(port)))) else {
        panic!("two listen on {port}");
    };
    assert!(matches!(refusal, SessionError::Listen { .. }), "{refusal}");
    assert!(refusal.to_string().contains(&format!("127.0.0.1:{port}")), "{refusal}");
}

#[test]
fn nobody_there_is_said_in_time() {
    let port = free_port();
    let config = SessionConfig {
        connect_timeout: Duration::from_millis(500),
        ..SessionConfig::new("other", Link::Connect(endpoint(port)))
    };
    let began = Instant::now();
    let Err(refusal) = Session::open(&config) else { panic!("who answers on {port}?") };
    assert!(began.elapsed() < Duration::from_secs(5), "it took {:?}", began.elapsed());
    assert!(matches!(refusal, SessionError::Connect { .. }), "{refusal}");
    assert!(refusal.to_string().contains(&port.to_string()), "{refusal}");
}

fn photo(id: u64) -> EncodedPhoto {
    let intrinsics = Intrinsics::new(640, 480, 500.0, 501.0, 319.5, 239.5).unwrap();
    EncodedPhoto { id, file: (0..60_000_u32).map(|i| (i * id as u32) as u8).collect(), intrinsics }
}

async fn asked(server: &mut NavigateServer) -> Option<Mission> {
    tokio::time::timeout(LIMIT, server.next()).await.expect("the planner was asked in time")
}

async fn started(server: &mut NavigateServer, n: u64) -> MissionId {
    match asked(server).await {
        Some(Mission::Start(id, asked_for)) if asked_for == photo(n) => id,
        other => panic!("not the photo {n}: {other:?}"),
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn missions_are_sent_followed_superseded_cancelled_and_ended() {
    let (body, other) = pair(true);
    let mut server = NavigateServer::announce(&body).unwrap();
    let client = NavigateClient::connect(&other, LIMIT).await.unwrap();

    let first = client.send(&photo(1)).await.unwrap();
    let first_id = started(&mut server, 1).await;

    // A second wish takes the first one's place.
    let mut second = client.send(&photo(2)).await.unwrap();
    let second_id = started(&mut server, 2).await;
    let superseded = first.result(LIMIT).await.unwrap();
    assert_eq!((superseded.outcome, superseded.message.as_str()), (Outcome::Cancelled, "another goal took its place"));

    let progress =
        Progress { step: 17, mode: Mode::Exploit, goal_distance_m: Some(2.5), reason: "it is there".to_owned() };
    // Feedback is sent once its reader is known, and lost before.
    let heard = loop {
        server.progress(second_id, &progress);
        if let Ok(heard) = tokio::time::timeout(Duration::from_millis(50), second.progress()).await {
            break heard;
        }
    };
    assert_eq!(heard, Some(progress));
    let report =
        MissionReport { outcome: Outcome::Arrived, steps: 20, path_length_m: 4.25, message: "done".to_owned() };
    // What the planner says of the first one's end comes late, and is not the second one's.
    server.finish(first_id, &MissionReport { outcome: Outcome::Failed, ..report.clone() });
    server.finish(second_id, &report);
    assert_eq!(second.result(LIMIT).await.unwrap(), report);

    let third = client.send(&photo(3)).await.unwrap();
    let third_id = started(&mut server, 3).await;
    third.cancel().await.unwrap();
    assert_eq!(asked(&mut server).await, Some(Mission::Cancel(third_id)));
    server.finish(third_id, &MissionReport { outcome: Outcome::Cancelled, ..report });
    assert_eq!(third.result(LIMIT).await.unwrap().outcome, Outcome::Cancelled);
    drop(server);
    other.close();
    body.close();
}

#[tokio::test(flavor = "multi_thread")]
async fn without_a_planner_or_a_simulator_that_is_said() {
    let (body, other) = pair(false);
    let limit = Duration::from_millis(300);
    let Err(refusal) = NavigateClient::connect(&other, limit).await else { panic!("who plans?") };
    assert!(matches!(refusal, NavigateError::NoPlanner(_)), "{refusal}");
    let began = Instant::now();
    let refusal = homing_privileged::reset(&other, "{}".to_owned(), limit).await.unwrap_err();
    assert!(matches!(refusal, ResetError::Service(_)), "{refusal}");
    assert!(began.elapsed() < Duration::from_secs(6), "it took {:?}", began.elapsed());
    other.close();
    body.close();
}

#[tokio::test(flavor = "multi_thread")]
async fn commands_keep_their_bits() {
    let (body, other) = pair(false);
    let speaks = other.publisher(&topics::MOTION_COMMAND).unwrap();
    let hears = body.subscribe(&topics::MOTION_COMMAND, 4).unwrap();
    let command = MotionCommand {
        session: u64::MAX,
        epoch: 3,
        sequence: 1 << 63,
        stamp: Stamp(2_147_483_647_999_999_999),
        time_to_live: Duration::from_nanos(u64::MAX),
        motion: Motion::Turn { angle_rad: -f64::MIN_POSITIVE },
    };
    meet(&speaks, &hears, &command.to_message()).await;
    speaks.publish(&command.to_message()).unwrap();
    assert_eq!(next(&hears).await.unwrap().to_domain().unwrap(), command);
    other.close();
    body.close();
}

#[test]
fn every_topic_stands_in_the_table_once() {
    let table = topics::table();
    let mut names: BTreeSet<&str> = table.iter().map(|row| row.name).collect();
    assert_eq!(names.len(), table.len(), "a name stands twice in the table");
    assert!(names.insert(GROUND_TRUTH.name) && names.insert(EPISODE_SUMMARY.name));
    for row in table {
        assert!(!row.sender.is_empty() && !row.rate.is_empty(), "{row:?}");
        assert!(!row.name.contains("privileged") && !row.name.contains("truth"), "{row:?} is for robots");
    }
}

fn hash<M: Message>() -> (String, String) {
    let name = M::type_name().replace("::msg::dds_::", "/msg/");
    (name.trim_end_matches('_').to_owned(), M::type_hash().to_rihs_string())
}

/// Another implementation reads the same .msg files and computes the same hashes: with other ones no ROS 2 peer would
/// hear us.
#[test]
fn type_hashes_are_those_of_an_independent_implementation() {
    let Some(python) = python() else { return };
    let ours = BTreeMap::from([
        hash::<homing_msgs::EpisodeSummary>(),
        hash::<homing_msgs::GoalEstimate>(),
        hash::<homing_msgs::GoalPhoto>(),
        hash::<homing_msgs::GroundTruth>(),
        hash::<homing_msgs::MotionCommand>(),
        hash::<homing_msgs::MotionLease>(),
        hash::<homing_msgs::MotionResult>(),
        hash::<homing_msgs::NavigationState>(),
    ]);
    let files = std::fs::read_dir(repository().join("protocol/msg")).unwrap().count();
    assert_eq!(ours.len(), files, "a message in protocol/msg is not compared");
    let out = Command::new(python).arg("-B").arg(repository().join("tests/interop/type_hashes.py")).output().unwrap();
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let theirs: BTreeMap<String, String> = serde_json::from_slice(&out.stdout).unwrap();
    assert_eq!(ours, theirs);
}
