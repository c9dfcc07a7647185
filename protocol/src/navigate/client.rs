//! The operator's end of the action.

use std::sync::Arc;
use std::time::{Duration, Instant};

use hiroz::Builder;
use hiroz::action::client::{GoalHandle, ZActionClient, goal_state::Active};
use homing_core::Mode;
use tokio::sync::mpsc;

use super::{ACTION, MissionReport, NavigateError, Outcome, Progress, transport};
use crate::convert::{EncodedPhoto, ToMessage};
use crate::interfaces::homing_msgs::action::NavigateToImage;
use crate::interfaces::homing_msgs::{NavigateToImageFeedback, NavigateToImageGoal, NavigateToImageResult};
use crate::session::Session;

/// A question that fails sooner than this was not waited for: nobody is there to answer.
const QUICK: Duration = Duration::from_millis(500);
/// After so many of those in a row the planner is gone.
const REFUSALS_MAX: u32 = 6;

/// The operator's end.
pub struct NavigateClient {
    client: Arc<ZActionClient<NavigateToImage>>,
}

/// A mission that was accepted.
pub struct NavigateGoal {
    client: Arc<ZActionClient<NavigateToImage>>,
    handle: GoalHandle<NavigateToImage, Active>,
    feedback: Option<mpsc::UnboundedReceiver<NavigateToImageFeedback>>,
}

impl NavigateClient {
    /// Waits until a planner announces the action.
    ///
    /// # Errors
    /// [`NavigateError::NoPlanner`] when none does in time.
    pub async fn connect(session: &Session, timeout: Duration) -> Result<Self, NavigateError> {
        let client = session.node().create_action_client::<NavigateToImage>(ACTION).build().map_err(transport)?;
        if !client.wait_for_server(timeout).await {
            return Err(NavigateError::NoPlanner(timeout));
        }
        Ok(Self { client: Arc::new(client) })
    }

    /// Sends the photo.
    ///
    /// # Errors
    /// [`NavigateError::Refused`] when the planner does not want it.
    pub async fn send(&self, photo: &EncodedPhoto) -> Result<NavigateGoal, NavigateError> {
        let goal = NavigateToImageGoal { photo: photo.to_message() };
        let mut handle = self.client.send_goal(goal).await.map_err(|cause| {
            tracing::debug!(%cause, "goal not accepted");
            NavigateError::Refused
        })?;
        let feedback = handle.feedback();
        Ok(NavigateGoal { client: Arc::clone(&self.client), handle, feedback })
    }
}

impl NavigateGoal {
    /// The next news, or `None` when there will be none. Cancel-safe.
    pub async fn progress(&mut self) -> Option<Progress> {
        const MODES: [Mode; 6] = [Mode::Idle, Mode::Explore, Mode::Exploit, Mode::Align, Mode::Arrived, Mode::Failed];
        let feedback = self.feedback.as_mut()?.recv().await?;
        Some(Progress {
            step: feedback.step,
            mode: MODES.get(usize::from(feedback.mode)).copied().unwrap_or(Mode::Idle),
            goal_distance_m: feedback.goal_known.then_some(feedback.goal_distance_m),
            reason: feedback.reason,
        })
    }

    /// Asks the planner to leave the mission.
    ///
    /// # Errors
    /// [`NavigateError::Transport`] when the planner does not answer.
    pub async fn cancel(&self) -> Result<(), NavigateError> {
        match self.handle.cancel().await.map_err(transport)?.return_code {
            0 => Ok(()),
            code => Err(transport(format!("the planner does not drive to this photo (code {code})"))),
        }
    }

    /// Waits for the end; can be awaited beside [`NavigateGoal::progress`].
    ///
    /// # Errors
    /// [`NavigateError::Transport`] when the planner is gone or the time is over.
    pub fn result(&self, timeout: Duration) -> impl Future<Output = Result<MissionReport, NavigateError>> + use<> {
        let (client, id) = (Arc::clone(&self.client), self.handle.id());
        async move {
            let asked = Instant::now();
            let mut refusals = 0;
            // A question lives for seconds, a mission for minutes: it is asked again until it is answered.
            loop {
                let began = Instant::now();
                match client.get_result(id).await {
                    Ok(result) => return Ok(report(&result)),
                    Err(cause) => {
                        refusals = if began.elapsed() < QUICK { refusals + 1 } else { 0 };
                        if refusals >= REFUSALS_MAX || asked.elapsed() > timeout {
                            return Err(transport(format!("the planner gives no result: {cause}")));
                        }
                    }
                }
                tokio::time::sleep(QUICK / 2).await;
            }
        }
    }
}

fn report(result: &NavigateToImageResult) -> MissionReport {
    MissionReport {
        outcome: match result.outcome {
            0 => Outcome::Arrived,
            2 => Outcome::Cancelled,
            _ => Outcome::Failed,
        },
        steps: result.steps,
        path_length_m: result.path_length_m,
        message: result.message.clone(),
    }
}
