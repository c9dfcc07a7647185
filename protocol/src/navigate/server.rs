//! The planner's end of the action.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use hiroz::action::messages::{
    CancelGoalServiceResponse, CancelService, FeedbackMessage, GetResultResponse, GoalService, ResultService,
    SendGoalResponse, StatusMessage,
};
use hiroz::action::{GoalId, ZAction};
use hiroz::pubsub::ZPub;
use hiroz::{Builder, ServiceTypeInfo};
use tokio::sync::{Semaphore, mpsc, watch};
use tokio::task::JoinHandle;

use super::{ACTION, Mission, MissionId, MissionReport, NavigateError, Outcome, Progress, transport};
use crate::convert::ToDomain;
use crate::interfaces::homing_msgs::action::NavigateToImage;
use crate::interfaces::homing_msgs::{NavigateToImageFeedback, NavigateToImageResult};
use crate::session::Session;

/// ROS 2 goal status codes (action_msgs/msg/GoalStatus).
const SUCCEEDED: i8 = 4;
const CANCELED: i8 = 5;
const ABORTED: i8 = 6;

/// The planner's end.
pub struct NavigateServer {
    missions: mpsc::Receiver<Mission>,
    shared: Arc<Shared>,
    feedback:
        ZPub<FeedbackMessage<NavigateToImage>, <FeedbackMessage<NavigateToImage> as hiroz::msg::ZMessage>::Serdes>,
    _status: ZPub<StatusMessage, <StatusMessage as hiroz::msg::ZMessage>::Serdes>,
    tasks: Vec<JoinHandle<()>>,
}

#[derive(Default)]
struct Shared {
    current: Mutex<Option<Current>>,
    // Ended goals whose results may still be asked for, newest last.
    ended: Mutex<Vec<(GoalId, End)>>,
}

struct Current {
    id: GoalId,
    end: watch::Sender<Option<End>>,
}

type End = (i8, NavigateToImageResult);

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl NavigateServer {
    /// Ended goals remembered for late result requests.
    const ENDED_MAX: usize = 16;
    /// Questions for a result that may wait side by side.
    const WAITING_MAX: usize = 32;
    /// Nobody waits longer for an answer: zenoh ends a query after 10 s, and clients ask again.
    const QUESTION_MAX: Duration = Duration::from_secs(10);

    /// Announces the action. Needs a multi-threaded tokio runtime.
    ///
    /// # Errors
    /// [`NavigateError::Transport`] when a service cannot be declared.
    pub fn announce(session: &Session) -> Result<Self, NavigateError> {
        let node = session.node();
        let name = |part: &str| format!("{ACTION}/_action/{part}");
        let mut goals = node
            .create_service_impl::<GoalService<NavigateToImage>>(
                &name("send_goal"),
                Some(NavigateToImage::send_goal_type_info()),
            )
            .build()
            .map_err(transport)?;
        let mut results = node
            .create_service_impl::<ResultService<NavigateToImage>>(
                &name("get_result"),
                Some(NavigateToImage::get_result_type_info()),
            )
            .build()
            .map_err(transport)?;
        let mut cancels = node
            .create_service_impl::<CancelService<NavigateToImage>>(
                &name("cancel_goal"),
                Some(CancelService::<NavigateToImage>::service_type_info()),
            )
            .build()
            .map_err(transport)?;
        let feedback = node
            .create_pub_impl::<FeedbackMessage<NavigateToImage>>(
                &name("feedback"),
                Some(NavigateToImage::feedback_type_info()),
            )
            .build()
            .map_err(transport)?;
        let status = node
            .create_pub_impl::<StatusMessage>(&name("status"), Some(NavigateToImage::status_type_info()))
            .build()
            .map_err(transport)?;

        let shared = Arc::new(Shared::default());
        let (sender, missions) = mpsc::channel(8);
        let mut tasks = Vec::new();

        let (state, to_planner) = (Arc::clone(&shared), sender.clone());
        tasks.push(tokio::spawn(async move {
            loop {
                let Ok(request) = goals.async_take_request().await else {
                    tokio::time::sleep(Duration::from_millis(20)).await;
                    continue;
                };
                let (request, reply) = request.into_parts();
                let accepted = match (request.goal.photo.to_domain(), to_planner.try_reserve()) {
                    (Ok(photo), Ok(place)) => {
                        // Known before the planner hears of it: it may end the mission at once.
                        state.begin(request.goal_id);
                        place.send(Mission::Start(MissionId(request.goal_id), photo));
                        true
                    }
                    (Err(cause), _) => {
                        tracing::warn!(%cause, "goal refused");
                        false
                    }
                    (_, Err(_)) => {
                        tracing::warn!("goal refused: too many goals at once");
                        false
                    }
                };
                let answer = SendGoalResponse { accepted, stamp_sec: 0, stamp_nanosec: 0 };
                if let Err(cause) = reply.reply(&answer).await {
                    tracing::warn!(%cause, "goal answer not sent");
                }
            }
        }));

        let state = Arc::clone(&shared);
        let waiting = Arc::new(Semaphore::new(Self::WAITING_MAX));
        tasks.push(tokio::spawn(async move {
            loop {
                let Ok(request) = results.async_take_request().await else {
                    tokio::time::sleep(Duration::from_millis(20)).await;
                    continue;
                };
                let (request, reply) = request.into_parts();
                let Ok(place) = Arc::clone(&waiting).try_acquire_owned() else {
                    tracing::warn!("a question for a result was dropped: too many wait already");
                    continue;
                };
                let state = Arc::clone(&state);
                // Waits without holding up anybody else, and not longer than whoever asked.
                tokio::spawn(async move {
                    let _place = place;
                    let end = tokio::time::timeout(Self::QUESTION_MAX, state.end_of(request.goal_id));
                    let Ok((status, result)) = end.await else { return };
                    if let Err(cause) = reply.reply(&GetResultResponse { status, result }).await {
                        tracing::debug!(%cause, "result answer not sent");
                    }
                });
            }
        }));

        let state = Arc::clone(&shared);
        tasks.push(tokio::spawn(async move {
            loop {
                let Ok(request) = cancels.async_take_request().await else {
                    tokio::time::sleep(Duration::from_millis(20)).await;
                    continue;
                };
                let (request, reply) = request.into_parts();
                let id = request.goal_info.goal_id;
                let known = lock(&state.current).as_ref().is_some_and(|c| c.id == id);
                // Return codes of action_msgs/srv/CancelGoal: 0 accepted, 2 unknown goal.
                let return_code = if known && sender.try_send(Mission::Cancel(MissionId(id))).is_ok() { 0 } else { 2 };
                let goals_canceling = if return_code == 0 { vec![request.goal_info] } else { Vec::new() };
                if let Err(cause) = reply.reply(&CancelGoalServiceResponse { return_code, goals_canceling }).await {
                    tracing::debug!(%cause, "cancel answer not sent");
                }
            }
        }));
        Ok(Self { missions, shared, feedback, _status: status, tasks })
    }

    /// Waits until something is asked. Cancel-safe.
    pub async fn next(&mut self) -> Option<Mission> {
        self.missions.recv().await
    }

    /// Tells clients where the mission stands. Lost feedback is no loss.
    pub fn progress(&self, MissionId(goal_id): MissionId, progress: &Progress) {
        let feedback = NavigateToImageFeedback {
            step: progress.step,
            mode: progress.mode as u8,
            goal_known: progress.goal_distance_m.is_some(),
            goal_distance_m: progress.goal_distance_m.unwrap_or_default(),
            reason: progress.reason.clone(),
        };
        if let Err(cause) = self.feedback.publish(&FeedbackMessage { goal_id, feedback }) {
            tracing::debug!(%cause, "feedback not sent");
        }
    }

    /// Ends a mission. One that another goal has replaced has ended already.
    pub fn finish(&self, MissionId(goal_id): MissionId, report: &MissionReport) {
        let (status, outcome) = match report.outcome {
            Outcome::Arrived => (SUCCEEDED, 0),
            Outcome::Failed => (ABORTED, 1),
            Outcome::Cancelled => (CANCELED, 2),
        };
        let result = NavigateToImageResult {
            outcome,
            steps: report.steps,
            path_length_m: report.path_length_m,
            message: report.message.clone(),
        };
        self.shared.end(goal_id, (status, result));
    }
}

impl Drop for NavigateServer {
    fn drop(&mut self) {
        self.tasks.iter().for_each(JoinHandle::abort);
    }
}

impl Shared {
    fn begin(&self, id: GoalId) {
        let superseded = NavigateToImageResult {
            outcome: 2,
            message: "another goal took its place".to_owned(),
            ..Default::default()
        };
        let previous = lock(&self.current).replace(Current { id, end: watch::Sender::new(None) });
        if let Some(previous) = previous {
            self.settle(previous, (ABORTED, superseded));
        }
    }

    fn end(&self, id: GoalId, end: End) {
        let current = lock(&self.current).take_if(|c| c.id == id);
        if let Some(current) = current {
            self.settle(current, end);
        }
    }

    fn settle(&self, current: Current, end: End) {
        let mut ended = lock(&self.ended);
        if ended.len() == NavigateServer::ENDED_MAX {
            ended.remove(0);
        }
        ended.push((current.id, end.clone()));
        drop(ended);
        current.end.send_replace(Some(end));
    }

    async fn end_of(&self, id: GoalId) -> End {
        let unknown =
            (0, NavigateToImageResult { outcome: 1, message: "unknown goal".to_owned(), ..Default::default() });
        let Some(mut watch) = lock(&self.current).as_ref().filter(|c| c.id == id).map(|c| c.end.subscribe()) else {
            return lock(&self.ended)
                .iter()
                .rev()
                .find(|(ended, _)| *ended == id)
                .map_or(unknown, |(_, end)| end.clone());
        };
        match watch.wait_for(Option::is_some).await {
            Ok(end) => end.clone().unwrap_or(unknown),
            Err(_) => unknown,
        }
    }
}
