//! A goal seen long ago is not lost: the robot drives to one photo, then is shown another of a place it passed on the way.
#![expect(clippy::unwrap_used, reason = "a test may fail by panicking")]

use std::time::Duration;

use homing_core::Mode;
use homing_protocol::navigate::Outcome;
use homing_sim::Episode;
use homing_tests::mission::{Mission, flat, photo};
use homing_tests::processes::System;

/// Takes about sixty steps, and ends out of sight of where it began.
const SEED: u64 = 1001;

#[tokio::test(flavor = "multi_thread")]
async fn a_photo_of_a_place_that_was_passed_is_driven_to_without_a_search() {
    let (arena, episode) = flat(SEED);
    let system = System::new();
    let everybody = system.everybody(&episode, "");
    let session = system.session();
    let first = Mission::begin(&session, &photo(&arena, &episode)).await;
    let (report, _, _) = first.end(Duration::from_secs(150)).await;
    assert_eq!(report.outcome, Outcome::Arrived, "{}", report.message);

    // The view from the start: seen with the first frame, and the origin of the odometry.
    let mut back = photo(&arena, &Episode { goal: episode.start, ..episode.clone() });
    back.id = 2;
    let second = Mission::begin(&session, &back).await;
    let state = second.state().await;
    let goal = state.goal.clone().unwrap().pose;
    assert!(goal.distance_to(0.0, 0.0) < 0.3 && goal.yaw_rad.abs() < 0.1, "{goal:?}");
    assert_eq!(state.mode, Mode::Exploit, "{}", state.reason);
    assert!(everybody.perception.said().contains("seen before: the goal in"), "{}", everybody.perception.said());
    let (report, _, truth) = second.end(Duration::from_secs(150)).await;
    assert_eq!(report.outcome, Outcome::Arrived, "{}", report.message);
    let start = episode.start;
    assert!(truth.pose.distance_to(start.x_m, start.y_m) < 0.5, "{:?}", truth.pose);
    session.close();
}
