//! What an operator who knows the truth makes of an episode's end.

use std::time::Duration;

use homing_privileged::{GROUND_TRUTH, GroundTruth};
use homing_protocol::convert::ToDomain;
use homing_protocol::interfaces::homing_msgs;
use homing_protocol::{Session, Subscription};
use homing_sim::{Arena, Ending, Episode, Finish, Score};

/// Hears the truth and scores the end.
pub struct Scorer {
    truths: Subscription<homing_msgs::GroundTruth>,
    last: Option<GroundTruth>,
}

/// The truth of the last step comes after the step's result, once the body has looked again.
const LAST_TRUTH_MAX: Duration = Duration::from_secs(5);
/// Who gave up says nothing that marks an end: a pause does.
const PAUSE: Duration = Duration::from_millis(300);

impl Scorer {
    /// Begins to listen.
    pub fn open(session: &Session) -> anyhow::Result<Self> {
        Ok(Self { truths: session.subscribe(&GROUND_TRUTH, 64)?, last: None })
    }

    /// Waits for the truth that belongs to the mission's end.
    pub async fn hear_the_end(&mut self, arrived: bool) {
        let limit = if arrived { LAST_TRUTH_MAX } else { PAUSE };
        let began = tokio::time::Instant::now();
        while began.elapsed() < limit {
            self.listen();
            if self.last.as_ref().is_some_and(|truth| truth.done) {
                return;
            }
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
        if arrived {
            tracing::warn!(
                "the body did not confirm within {LAST_TRUTH_MAX:?} that it stands; the score is that of the step before"
            );
        }
    }

    pub fn listen(&mut self) {
        while let Some(received) = self.truths.try_recv() {
            match received.map_err(anyhow::Error::from).and_then(|r| Ok(r.message.to_domain()?)) {
                Ok(truth) => self.last = Some(truth),
                Err(cause) => tracing::warn!("ignored: {cause:#}"),
            }
        }
    }

    /// How the robot ended; `None` if nothing was heard of it.
    pub fn ending(&self, last_mile_steps: u64) -> Option<Ending> {
        self.last.map(|truth| Ending {
            stopped: truth.done,
            steps: truth.steps,
            last_mile_steps,
            path_length_m: truth.path_length_m,
            collisions: truth.collisions,
            pose: truth.pose,
        })
    }

    /// The strict score.
    pub fn score(&self, arena: &Arena, episode: &Episode) -> Option<Score> {
        self.ending(0).map(|ending| Score::strict(&Finish::new(arena, episode, &ending)))
    }
}
