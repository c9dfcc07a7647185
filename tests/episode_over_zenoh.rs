//! The network changes nothing: an episode in one process and the same episode through four real processes make the same
//! decisions, bit for bit, and come to the same score.
#![expect(clippy::unwrap_used, reason = "a test may fail by panicking")]

use std::sync::Arc;
use std::time::Duration;

use homing_benchmark::{EpisodeRun, Trial, run_episode};
use homing_core::{Action, NavigationState};
use homing_perception::onnx::FeatureChoice;
use homing_perception::{AnyEstimator, PerceptionConfig};
use homing_privileged::GroundTruth;
use homing_protocol::navigate::{MissionReport, Outcome};
use homing_sim::{Arena, Ending, Episode, Finish, Score};
use homing_tests::mission::{Mission, flat, photo};
use homing_tests::processes::System;
use homing_tests::repository;

/// Takes about sixty steps, through discovery, approach and turning to the goal's heading.
const SEED: u64 = 1001;
const STEPS_MIN: usize = 40;

#[tokio::test(flavor = "multi_thread")]
async fn an_episode_over_zenoh_is_the_episode_in_process() {
    let (arena, episode) = flat(SEED);
    let (here, states_here) = tokio::task::block_in_place(|| in_process(&arena, &episode));
    let (report, states_there, truth) = over_zenoh(&arena, &episode).await;

    assert!(states_here.len() >= STEPS_MIN, "{} steps show little", states_here.len());
    for (a, b) in states_here.iter().zip(&states_there) {
        assert_eq!(written(a), written(b));
    }
    assert_eq!(states_here.len(), states_there.len());
    assert!(states_here.iter().any(|s| s.action == Action::TurnLeft));
    assert!(states_here.iter().any(|s| s.goal.is_some()), "the goal was never seen: perception's part is not compared");
    let (here_score, there) = (Score::strict(&here.finish), score(&arena, &episode, &truth));
    assert_eq!(format!("{here_score:?}"), format!("{there:?}"));
    assert!(here_score.success, "{}: choose an episode that succeeds", here.reason);
    assert_eq!((report.outcome, report.message), (Outcome::Arrived, here.reason));
    assert_eq!(report.steps, states_there.last().unwrap().step);
    assert!(truth.done);
}

fn in_process(arena: &Arc<Arena>, episode: &Episode) -> (EpisodeRun, Vec<NavigationState>) {
    let mut states = Vec::new();
    let models = repository().join("nodes/perception/models");
    let features = FeatureChoice::listed("homing", None, &models).unwrap();
    let mut estimator = AnyEstimator::open(PerceptionConfig::default(), &features).unwrap();
    let run = run_episode(arena, episode, &mut estimator, &Trial::default(), &mut |record| {
        states.push(record.state.clone());
    });
    (run.unwrap(), states)
}

async fn over_zenoh(arena: &Arena, episode: &Episode) -> (MissionReport, Vec<NavigationState>, GroundTruth) {
    let system = System::new();
    let everybody = system.everybody(episode, "");
    let session = system.session();
    let mission = Mission::begin(&session, &photo(arena, episode)).await;
    let end = mission.end(Duration::from_secs(150)).await;
    assert!(!everybody.planner.said().contains("WARN"), "something was lost or late: {}", everybody.planner.said());
    session.close();
    end
}

/// All digits, so that equality is equality of bits.
fn written(state: &NavigationState) -> String {
    format!("{state:?}")
}

/// The score as an operator with the truth makes it.
fn score(arena: &Arena, episode: &Episode, truth: &GroundTruth) -> Score {
    let ending = Ending {
        stopped: truth.done,
        steps: truth.steps,
        last_mile_steps: 0,
        path_length_m: truth.path_length_m,
        collisions: truth.collisions,
        pose: truth.pose,
    };
    Score::strict(&Finish::new(arena, episode, &ending))
}
