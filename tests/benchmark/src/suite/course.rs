//! Where an episode takes place: in this process, or elsewhere behind the same seam.

use std::sync::Arc;

use homing_perception::AnyEstimator;
use homing_sim::arena::Arena;
use homing_sim::episode::Episode;

use super::rows::Row;
use crate::cause::{Moment, Watch};
use crate::clip::Clip;
use crate::episode::{EpisodeRun, StepRecord, run_episode};
use crate::{RunError, Trial};

/// Runs episodes of one row.
pub trait Course: Send {
    /// Runs one episode to its end. The onlooker is shown every step, in order.
    ///
    /// # Errors
    /// [`RunError`] when a part cannot be set up or fails.
    fn run(&mut self, arena: &Arc<Arena>, episode: &Episode, onlooker: &mut Onlooker) -> Result<EpisodeRun, RunError>;
}

/// Lays the course for a row.
pub type LayCourse<'a> = &'a (dyn Fn(&Row) -> Result<Box<dyn Course>, RunError> + Sync);

/// Sees an episode and knows the truth.
#[derive(Debug)]
pub struct Onlooker {
    pub(super) arena: Arc<Arena>,
    pub(super) episode: Episode,
    pub(super) watch: Watch,
    pub(super) clip: Option<Clip>,
}

impl Onlooker {
    /// A step of which only this is known.
    pub fn see(&mut self, moment: &Moment<'_>) {
        self.watch.see(&self.arena, &self.episode, moment);
    }

    /// A step of which everything is known.
    pub fn see_all(&mut self, record: &StepRecord<'_>) {
        self.see(&record.moment());
        if let Some(clip) = &mut self.clip {
            clip.see(record);
        }
    }
}

/// In this process, as fast as the machine goes.
pub struct InProcess {
    estimator: AnyEstimator,
    trial: Trial,
}

impl InProcess {
    /// Opens a row's models.
    ///
    /// # Errors
    /// [`RunError::Perception`] when they cannot be run.
    pub fn new(row: &Row) -> Result<Self, RunError> {
        Ok(Self { estimator: AnyEstimator::open(row.perception, &row.features)?, trial: row.trial.clone() })
    }
}

impl Course for InProcess {
    fn run(&mut self, arena: &Arc<Arena>, episode: &Episode, onlooker: &mut Onlooker) -> Result<EpisodeRun, RunError> {
        self.trial.planner.body.radius_m = arena.size().radius_m;
        run_episode(arena, episode, &mut self.estimator, &self.trial, &mut |record| onlooker.see_all(record))
    }
}
