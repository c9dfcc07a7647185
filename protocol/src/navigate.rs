//! The action `navigate_to_image`: drive to where a photo was taken.
//!
//! The server stands on plain services, because a pending result request must not hold up a cancellation. A new goal
//! takes the place of the one under way: the newest wish of the operator counts.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use hiroz::action::client::{GoalHandle, ZActionClient, goal_state::Active};
use hiroz::action::messages::{
    CancelGoalServiceResponse, CancelService, FeedbackMessage, GetResultResponse, GoalService, ResultService,
    SendGoalResponse, StatusMessage,
};
use hiroz::action::{GoalId, ZAction};
use hiroz::pubsub::ZPub;
use hiroz::{Builder, ServiceTypeInfo};
use homing_core::Mode;
use thiserror::Error;
use tokio::sync::{Semaphore, mpsc, watch};
use tokio::task::JoinHandle;

use crate::convert::{EncodedPhoto, ToDomain, ToMessage};
use crate::interfaces::homing_msgs::action::NavigateToImage;
use crate::interfaces::homing_msgs::{NavigateToImageFeedback, NavigateToImageGoal, NavigateToImageResult};
use crate::session::Session;

/// Name below the robot's namespace.
pub const ACTION: &str = "navigate_to_image";

/// A question that fails sooner than this was not waited for: nobody is there to answer.
const QUICK: Duration = Duration::from_millis(500);
/// After so many of those in a row the planner is gone.
const REFUSALS_MAX: u32 = 6;

/// ROS 2 goal status codes (action_msgs/msg/GoalStatus).
const SUCCEEDED: i8 = 4;
const CANCELED: i8 = 5;
const ABORTED: i8 = 6;

/// Which of the operator's wishes is meant: a goal may end while the next one is already on its way.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct MissionId(GoalId);

/// What the planner is asked.
#[derive(Clone, Debug, PartialEq)]
pub enum Mission {
    /// Drive to this photo.
    Start(MissionId, EncodedPhoto),
    /// Leave it.
    Cancel(MissionId),
}

/// How a mission ended, in the planner's own judgement.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The planner declares the goal reached.
    Arrived,
    /// It gave up.
    Failed,
    /// It was told to.
    Cancelled,
}

/// The end of a mission.
#[derive(Clone, Debug, PartialEq)]
pub struct MissionReport {
    /// How it ended.
    pub outcome: Outcome,
    /// Steps taken.
    pub steps: u64,
    /// Way driven by odometry, metres.
    pub path_length_m: f64,
    /// One line for people.
    pub message: String,
}

/// Where a mission stands.
#[derive(Clone, Debug, PartialEq)]
pub struct Progress {
    /// Steps taken.
    pub step: u64,
    /// Phase, as [`Mode`]'s place in homing_msgs/NavigationState.
    pub mode: Mode,
    /// Straight-line distance to the goal estimate, metres.
    pub goal_distance_m: Option<f64>,
    /// One line for people.
    pub reason: String,
}

/// Why an action endpoint failed.
#[derive(Debug, Error)]
pub enum NavigateError {
    /// hiroz or zenoh refused.
    #[error("action {ACTION}: {0}")]
    Transport(String),
    /// Nobody plans.
    #[error("no planner answers on {ACTION} within {0:?}: start one first")]
    NoPlanner(Duration),
    /// The planner does not want the photo.
    #[error("the planner refused the photo")]
    Refused,
}

fn transport(cause: impl std::fmt::Display) -> NavigateError {
    NavigateError::Transport(cause.to_string())
}

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
