//! Waiting until the processes of a system have found each other.

use std::time::Duration;

use anyhow::bail;
use homing_protocol::session::{Link, SessionConfig, SessionError};
use homing_protocol::{Session, topics};

use crate::fleet::Fleet;

/// Joins the network as soon as the body listens.
pub async fn join(endpoint: &str, fleet: &mut Fleet) -> anyhow::Result<Session> {
    let mut config = SessionConfig::new("homing", Link::Connect(vec![endpoint.to_owned()]));
    config.connect_timeout = Duration::from_secs(2);
    for _ in 0..15 {
        fail_on_loss(fleet)?;
        match tokio::task::block_in_place(|| Session::open(&config)) {
            Ok(session) => {
                // Somebody answers: is it our body?
                tokio::time::sleep(Duration::from_millis(300)).await;
                fail_on_loss(fleet)?;
                return Ok(session);
            }
            // Waiting does not make it an address.
            Err(cause @ SessionError::Endpoint { .. }) => return Err(cause.into()),
            Err(cause) => tracing::debug!(%cause, "not yet"),
        }
    }
    bail!("the body does not listen on {} after 30 s", endpoint)
}

/// Waits until body, perception and planner have announced what they send.
pub async fn all_ready(session: &Session, fleet: &mut Fleet) -> anyhow::Result<()> {
    for _ in 0..300 {
        fail_on_loss(fleet)?;
        if session.has_sender(&topics::CAMERA_COLOR)
            && session.has_sender(&topics::GOAL_ESTIMATE)
            && session.has_sender(&topics::MOTION_COMMAND)
        {
            return Ok(());
        }
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
    bail!("not all processes came up within 30 s; their logs are in the run's folder")
}

/// Fails if a process ended.
pub fn fail_on_loss(fleet: &mut Fleet) -> anyhow::Result<()> {
    match fleet.loss() {
        Some(loss) => bail!("{} ended at once ({}):\n{}", loss.name, loss.status, loss.last_words),
        None => Ok(()),
    }
}
