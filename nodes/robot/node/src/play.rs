//! Plays frames: the next one when perception has answered this one.

use std::time::{Duration, Instant};

use anyhow::bail;
use homing_core::{BridgeError, GoalEstimate, Observation, RobotBridge, Sighting, UnseenReason};
use homing_protocol::convert::ToDomain;
use homing_protocol::interfaces::homing_msgs;
use homing_protocol::{BodyPublishers, Session, Subscription, topics};
use homing_robot::replay::ReplayBody;

use crate::config::Answers;

/// A frame is sent again after so long without an answer: perception may have joined late.
const AGAIN: Duration = Duration::from_secs(1);
/// Answers waiting to be read: a new goal brings one for every keyframe that shows it, and none may push out the frame's own.
const ANSWERS_MAX: usize = 128;
/// A frame without an answer for so long ends the replay.
const ANSWER_MAX: Duration = Duration::from_secs(60);

pub async fn run(session: &Session, mut body: ReplayBody, answers: Answers) -> anyhow::Result<()> {
    let out = BodyPublishers::announce(session, body.capabilities().t_base_camera)?;
    let estimates = session.subscribe(&topics::GOAL_ESTIMATE, ANSWERS_MAX)?;
    tracing::info!(name = body.capabilities().name, frames = body.recording().len(), "the recording is ready");
    for n in 1.. {
        let observation = match body.observe() {
            Ok(observation) => observation,
            Err(BridgeError::Exhausted { .. }) => break,
            Err(cause) => return Err(cause.into()),
        };
        let goal = (answers == Answers::GoalPerFrame).then_some(n);
        answered(&out, &estimates, &observation, goal).await?;
    }
    Ok(())
}

async fn answered(
    out: &BodyPublishers,
    estimates: &Subscription<homing_msgs::GoalEstimate>,
    observation: &Observation,
    goal: Option<u64>,
) -> anyhow::Result<()> {
    let began = Instant::now();
    while began.elapsed() < ANSWER_MAX {
        out.observation(observation)?;
        let sent = tokio::time::Instant::now();
        while let Ok(estimate) = tokio::time::timeout_at(sent + AGAIN, estimates.recv()).await {
            match estimate.map_err(anyhow::Error::from).and_then(|e| Ok(e.message.to_domain()?)) {
                Ok(estimate) if closes(&estimate, observation, goal) => return Ok(()),
                Ok(_) => {}
                Err(cause) => tracing::warn!("ignored: {cause:#}"),
            }
        }
    }
    bail!(
        "no answer to the frame at {:.3} s within {ANSWER_MAX:?}: is perception running, and has it a goal?",
        observation.frame.stamp.seconds()
    )
}

fn closes(estimate: &GoalEstimate, observation: &Observation, goal: Option<u64>) -> bool {
    let no_goal = matches!(estimate.sighting, Sighting::NotSeen { reason: UnseenReason::NoGoal });
    // Answers are dropped where a link is slow. The next goal is given only once the answer about this one was heard by
    // whoever gives it; until then the frame stays, and is answered again.
    estimate.stamp == observation.frame.stamp && !no_goal && goal.is_none_or(|id| id < estimate.goal_id)
}
