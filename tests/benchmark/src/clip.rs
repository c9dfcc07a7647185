//! A short recording of how an episode was lost: its last steps, and those with the goal in view, for the viewer.

use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use homing_core::{GoalEstimate, GoalPhoto, NavigationState, OccupancyGrid, Odometry, PlanarPose, RgbdFrame};
use homing_monitor::{Recorder, RecorderConfig, RecorderError, Update};
use homing_sim::arena::Arena;
use homing_sim::episode::{Episode, in_odom};
use thiserror::Error;

use crate::RunError;
use crate::cause::{Cause, is_in_view};
use crate::episode::StepRecord;
use crate::record::EpisodeRecord;
use crate::tables::clip_path;

/// Last steps kept.
const LAST_STEPS: usize = 40;
/// Steps kept with the goal in view, the first ones.
const VIEW_STEPS: usize = 20;
/// Longest time to write a clip.
const WRITE_MAX: Duration = Duration::from_secs(60);

/// Why a clip is missing.
#[derive(Debug, Error)]
pub enum ClipError {
    /// Its folder cannot be made.
    #[error("cannot make the folder {}: {source}", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The recording cannot be begun.
    #[error(transparent)]
    Recorder(#[from] RecorderError),
    /// The recording is not whole.
    #[error("the clip {} is incomplete: {reason}", path.display())]
    Incomplete {
        /// The file.
        path: PathBuf,
        /// Why.
        reason: String,
    },
}

/// The folder of a report, below which its clips go: see [`clip_path`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ClipFolder(pub PathBuf);

#[derive(Debug)]
struct Step {
    frame: Arc<RgbdFrame>,
    odometry: Odometry,
    estimate: GoalEstimate,
    state: NavigationState,
    map: Arc<OccupancyGrid>,
    pose_truth: PlanarPose,
}

/// The steps of one episode that would be shown if it failed.
#[derive(Debug)]
pub struct Clip {
    arena: Arc<Arena>,
    episode: Episode,
    photo: GoalPhoto,
    goal_odom: Option<PlanarPose>,
    in_view: Vec<Step>,
    last: VecDeque<Step>,
}

impl Clip {
    /// Before the first step.
    ///
    /// # Errors
    /// [`RunError::Camera`] for a goal camera that cannot be.
    pub fn begin(arena: &Arc<Arena>, episode: &Episode) -> Result<Self, RunError> {
        let rgb = Arc::new(episode.camera.photo(arena, episode.goal)?);
        let photo = GoalPhoto { id: 1, rgb, intrinsics: episode.camera.intrinsics()? };
        Ok(Self {
            arena: Arc::clone(arena),
            episode: episode.clone(),
            photo,
            goal_odom: None,
            in_view: Vec::new(),
            last: VecDeque::new(),
        })
    }

    /// Takes in one step.
    pub fn see(&mut self, record: &StepRecord<'_>) {
        self.goal_odom = Some(record.goal_odom_truth);
        let step = Step {
            frame: Arc::new(record.observation.frame.clone()),
            odometry: record.observation.odometry,
            estimate: record.estimate.clone(),
            state: record.state.clone(),
            map: Arc::new(record.map.clone()),
            pose_truth: record.pose_truth,
        };
        self.last.push_back(step);
        if self.last.len() > LAST_STEPS
            && let Some(step) = self.last.pop_front()
            && self.in_view.len() < VIEW_STEPS
            && is_in_view(&self.arena, &self.episode, step.pose_truth)
        {
            self.in_view.push(step);
        }
    }

    /// Writes the recording of a failed episode.
    ///
    /// # Errors
    /// [`ClipError`] when the file cannot be written whole.
    pub fn write(self, folder: &ClipFolder, record: &EpisodeRecord, cause: Cause) -> Result<PathBuf, ClipError> {
        let path = folder.0.join(clip_path(record));
        if let Some(parent) = path.parent() {
            std::fs::create_dir_all(parent).map_err(|source| ClipError::Folder { path: parent.to_owned(), source })?;
        }
        let recorder = Recorder::new(RecorderConfig {
            recording: Some(path.clone()),
            // Steps are written as fast as they can be: none is thinned out.
            image_rate_hz_max: 1e9,
            jpeg_quality: 60,
            robot_radius_m: self.arena.size().radius_m,
            ..RecorderConfig::default()
        })?;
        let mut offered = 0;
        let mut offer = |update: Update| {
            recorder.offer(update);
            offered += 1;
            // The queue is bounded and lets go of what is old: wait for it rather than lose a step.
            let deadline = Instant::now() + WRITE_MAX;
            while recorder.status().shown < offered && Instant::now() < deadline {
                std::thread::sleep(Duration::from_micros(200));
            }
        };
        offer(self.photo.into());
        if let Some(goal) = self.goal_odom {
            offer(Update::TruthGoal(goal));
        }
        for step in self.in_view.into_iter().chain(self.last) {
            let stamp = step.frame.stamp;
            offer(step.odometry.into());
            offer(Update::TruthPose { stamp, pose: in_odom(&self.arena, self.episode.start, step.pose_truth) });
            offer(step.frame.into());
            offer(step.estimate.into());
            offer(Update::Map(step.map));
            offer(step.state.into());
        }
        let words = format!("# {}\n\n{}: {}", cause.words(), record.scene, record.reason);
        offer(Update::Verdict(words));
        let status = recorder.finish(WRITE_MAX);
        match status.error() {
            None if status.complete => Ok(path),
            error => {
                Err(ClipError::Incomplete { path, reason: error.unwrap_or("the recorder did not keep up").to_owned() })
            }
        }
    }
}
