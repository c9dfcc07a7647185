//! An episode as an operator gives it: a photo, and what comes back.

use std::io::Cursor;
use std::sync::Arc;
use std::time::Duration;

use homing_core::NavigationState;
use homing_privileged::{GROUND_TRUTH, GroundTruth};
use homing_protocol::convert::EncodedPhoto;
use homing_protocol::interfaces::homing_msgs;
use homing_protocol::navigate::{MissionReport, NavigateClient, NavigateGoal};
use homing_protocol::{Session, Subscription, ToDomain, topics};
use homing_sim::{Arena, BodySize, Episode, EpisodeSpec, SceneRef, episode};
use image::{ImageBuffer, ImageFormat, Rgb};

use crate::processes::LIMIT;

/// Names the photo of every mission, as the benchmark does.
pub const GOAL_ID: u64 = 1;

/// A generated flat, and the benchmark's episode in it.
pub fn flat(seed: u64) -> (Arc<Arena>, Episode) {
    let arena = Arc::new(Arena::load(&SceneRef::Flat { seed }, BodySize::default()).unwrap());
    let episode = episode::draw(&arena, seed, &EpisodeSpec::default()).unwrap();
    (arena, episode)
}

/// The photo of an episode's goal, as a PNG file.
pub fn photo(arena: &Arena, episode: &Episode) -> EncodedPhoto {
    let rgb = episode.camera.photo(arena, episode.goal).unwrap();
    let picture = ImageBuffer::<Rgb<u8>, _>::from_raw(rgb.width(), rgb.height(), rgb.data().to_vec()).unwrap();
    let mut file = Cursor::new(Vec::new());
    picture.write_to(&mut file, ImageFormat::Png).unwrap();
    EncodedPhoto { id: GOAL_ID, file: file.into_inner(), intrinsics: episode.camera.intrinsics().unwrap() }
}

/// What an operator hears of a mission.
pub struct Mission {
    goal: NavigateGoal,
    states: Subscription<homing_msgs::NavigationState>,
    truths: Subscription<homing_msgs::GroundTruth>,
}

impl Mission {
    /// Gives the photo to the planner.
    pub async fn begin(session: &Session, photo: &EncodedPhoto) -> Self {
        let states = session.subscribe(&topics::NAVIGATION_STATE, 2000).unwrap();
        let truths = session.subscribe(&GROUND_TRUTH, 2000).unwrap();
        let client = NavigateClient::connect(session, LIMIT).await.unwrap();
        let goal = client.send(photo).await.unwrap();
        Self { goal, states, truths }
    }

    /// The planner's next state.
    pub async fn state(&self) -> NavigationState {
        let received = tokio::time::timeout(LIMIT, self.states.recv()).await.expect("the planner goes on");
        received.unwrap().message.to_domain().unwrap()
    }

    /// The first state that is wanted, among so many.
    pub async fn state_where(&self, n_max: usize, wanted: impl Fn(&NavigationState) -> bool) -> NavigationState {
        let mut last = None;
        for _ in 0..n_max {
            let state = self.state().await;
            if wanted(&state) {
                return state;
            }
            last = Some(state);
        }
        panic!("{n_max} states, none as wanted; the last: {last:?}");
    }

    /// The newest truth.
    pub async fn truth(&self) -> GroundTruth {
        let received = tokio::time::timeout(LIMIT, self.truths.recv()).await.expect("the simulator goes on");
        let first = received.unwrap();
        self.truths.try_latest().map_or(first, Result::unwrap).message.to_domain().unwrap()
    }

    /// Waits for the end: the planner's report, all its states not yet taken, and the truth after the last motion.
    pub async fn end(self, limit: Duration) -> (MissionReport, Vec<NavigationState>, GroundTruth) {
        let Self { goal, states, truths } = self;
        let report = goal.result(limit).await.unwrap();
        // What was sent before the report may arrive after it.
        tokio::time::sleep(Duration::from_millis(300)).await;
        let mut heard = Vec::new();
        while let Some(state) = states.try_recv() {
            heard.push(state.unwrap().message.to_domain().unwrap());
        }
        assert_eq!(states.counts().displaced, 0, "states were lost");
        let truth = truths.try_latest().expect("the simulator tells the truth").unwrap();
        (report, heard, truth.message.to_domain().unwrap())
    }

    /// Tells the planner to leave it.
    pub async fn cancel(&self) {
        self.goal.cancel().await.unwrap();
    }
}
