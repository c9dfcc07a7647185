//! Other people's implementations of zenoh and of ROS 2's messages read the running system, and drive it.
#![expect(clippy::unwrap_used, reason = "a test may fail by panicking")]

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;
use std::sync::{Arc, Mutex};

use homing_protocol::convert::{ToDomain, to_rgb};
use homing_protocol::{Session, topics};
use homing_tests::mission::{Mission, flat, photo};
use homing_tests::processes::System;
use homing_tests::{python, repository};
use nix::sys::signal::Signal;
use serde_json::Value;

/// Runs the client to its end, and gives what it printed.
fn client(python: &Path, system: &System, what: &str) -> Value {
    let script = repository().join("tests/interop/client.py");
    let out = Command::new(python).arg("-B").arg(script).args([&system.endpoint(), what]).output().unwrap();
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    serde_json::from_slice(&out.stdout).unwrap()
}

/// What was sent, by stamp in nanoseconds: the sum of an image's bytes, an estimate's number of matches.
type Heard = Arc<Mutex<BTreeMap<u64, u64>>>;

fn hear_images(session: &Session) -> Heard {
    let images = session.subscribe(&topics::CAMERA_COLOR, 4).unwrap();
    let heard = Heard::default();
    let sink = Arc::clone(&heard);
    tokio::spawn(async move {
        loop {
            let (stamp, image) = to_rgb(&images.recv().await.unwrap().message).unwrap();
            sink.lock().unwrap().insert(stamp.0, image.data().iter().map(|b| u64::from(*b)).sum());
        }
    });
    heard
}

fn hear_estimates(session: &Session) -> Heard {
    let estimates = session.subscribe(&topics::GOAL_ESTIMATE, 16).unwrap();
    let heard = Heard::default();
    let sink = Arc::clone(&heard);
    tokio::spawn(async move {
        loop {
            let estimate = estimates.recv().await.unwrap().message.to_domain().unwrap();
            sink.lock().unwrap().insert(estimate.stamp.0, estimate.n_matches as u64);
        }
    });
    heard
}

#[tokio::test(flavor = "multi_thread")]
async fn a_python_client_reads_the_system_and_drives_the_robot() {
    let Some(python) = python() else { return };
    let (arena, episode) = flat(1005);
    let system = System::new();
    let mut everybody = system.everybody(&episode, "pace = \"real_time\"");
    let session = system.session();
    let (images, estimates) = (hear_images(&session), hear_estimates(&session));
    let mission = Mission::begin(&session, &photo(&arena, &episode)).await;

    let read = tokio::task::block_in_place(|| client(&python, &system, "read"));
    let number = |key: &str| read[key].as_u64().unwrap();
    assert_eq!(read["image_frame"], "camera_optical_frame");
    assert_eq!(read["image_encoding"], "rgb8");
    assert_eq!(read["image_size"], serde_json::json!([640, 480, 1920, 640 * 480 * 3]));
    assert_eq!(read["odometry_frames"], serde_json::json!(["odom", "base_link"]));
    assert!((read["odometry_norm"].as_f64().unwrap() - 1.0).abs() < 1e-9);
    assert_eq!(read["attachment_lengths"], serde_json::json!([33]));
    // What it read of one moment is what we read of it.
    assert_eq!(images.lock().unwrap().get(&number("image_stamp_ns")), Some(&number("image_sum")));
    assert_eq!(estimates.lock().unwrap().get(&number("estimate_stamp_ns")), Some(&number("estimate_n_matches")));
    assert!(number("estimate_n_matches") > 0 && number("estimate_kind") <= 2);

    // No planner, no lease: the client's word counts.
    drop(mission);
    everybody.planner.signal(Signal::SIGTERM);
    assert_eq!(everybody.planner.ends().code(), Some(0));
    let driven = tokio::task::block_in_place(|| client(&python, &system, "drive"));
    assert!(driven["turned_rad"].as_f64().unwrap() >= 0.6, "{driven}");
    assert_eq!(driven["turning_after_silence_rad_s"], 0.0, "{driven}");
    assert_eq!(driven["crept_rad"], 0.0, "{driven}");
    session.close();
}
