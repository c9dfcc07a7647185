//! Registration of a goal against everything seen so far: the frame at hand, and the memory of frames before.

use std::time::Duration;

use homing_core::{GoalEstimate, GoalPhoto, RgbdFrame, Sighting, Stamp};

use crate::estimator::no_goal;
use crate::memory::{KeyframeMemory, MemoryConfig};
use crate::onnx::FeatureChoice;
use crate::{PerceptionConfig, PerceptionError, ResilientEstimator};

/// Without a goal, frames closer together than this are not looked at.
const IDLE_PERIOD: Duration = Duration::from_millis(500);

/// An estimator with a memory. Every estimate carries the stamp of the image it was made from, however long ago, so that
/// whoever keeps odometry can apply it where that image was taken, and fuse it by its covariance.
pub struct Registration {
    estimator: ResilientEstimator,
    memory: KeyframeMemory,
    last: Option<Stamp>,
}

impl Registration {
    /// Opens the features that are chosen.
    ///
    /// # Errors
    /// [`PerceptionError::Setting`] for a setting out of range, or as [`ResilientEstimator::open`].
    pub fn open(
        config: PerceptionConfig,
        memory: MemoryConfig,
        choice: &FeatureChoice,
    ) -> Result<Self, PerceptionError> {
        memory.check()?;
        Ok(Self::new(ResilientEstimator::open(config, choice)?, memory))
    }

    /// With an estimator opened before.
    #[must_use]
    pub fn new(estimator: ResilientEstimator, memory: MemoryConfig) -> Self {
        Self { estimator, memory: KeyframeMemory::new(memory), last: None }
    }

    /// What is remembered.
    #[must_use]
    pub fn memory(&self) -> &KeyframeMemory {
        &self.memory
    }

    /// Takes a photo to look for, and looks for it among what was seen before: retrieval first, geometry second. Gives the
    /// poses found, oldest first. The last frame is left to [`Self::look`].
    ///
    /// # Errors
    /// As [`ResilientEstimator::set_goal`]; the last goal then stays.
    pub fn set_goal(&mut self, photo: GoalPhoto) -> Result<Vec<GoalEstimate>, PerceptionError> {
        self.keeping_memory_true(|this| this.estimator.set_goal(photo))?;
        let Some(goal) = self.estimator.estimator().goal_features() else { return Ok(Vec::new()) };
        let mut candidates = self.memory.candidates(goal);
        candidates.retain(|stamp| Some(*stamp) != self.last);
        let mut found = Vec::new();
        for stamp in candidates {
            let Some(frame) = self.memory.at(stamp) else { continue };
            // A model that fails here fails again at the next frame, where SIFT takes over.
            match self.estimator.register(frame) {
                Ok(estimate) => found.extend(matches!(estimate.sighting, Sighting::Pose { .. }).then_some(estimate)),
                Err(fault) => tracing::warn!("the memory was not searched to its end: {fault}"),
            }
        }
        found.sort_by_key(|estimate| estimate.stamp);
        if !self.memory.is_empty() {
            tracing::info!("seen before: the goal in {} of {} keyframes", found.len(), self.memory.len());
        }
        Ok(found)
    }

    /// Where the goal is, seen from this frame; and remembers it. Without a goal it remembers alone.
    ///
    /// # Errors
    /// As [`ResilientEstimator::estimate`].
    pub fn look(&mut self, frame: &RgbdFrame) -> Result<GoalEstimate, PerceptionError> {
        if self.last.is_some_and(|last| frame.stamp.began_anew_after(last)) {
            // What was seen before has no place in the odometry any more.
            self.memory.clear();
            self.last = None;
        }
        if self.estimator.estimator().goal().is_none() {
            if self.last.is_none_or(|last| frame.stamp.since(last) >= IDLE_PERIOD) {
                let seen = self.keeping_memory_true(|this| this.estimator.look(frame))?;
                self.memory.remember(&seen);
                self.last = Some(frame.stamp);
            }
            return Ok(no_goal(frame.stamp));
        }
        let (estimate, seen) = self.keeping_memory_true(|this| this.estimator.estimate_and_keep(frame))?;
        self.memory.remember(&seen);
        self.last = Some(frame.stamp);
        Ok(estimate)
    }

    /// Where other features take over, what was remembered with the old ones is of no use.
    fn keeping_memory_true<T>(
        &mut self,
        work: impl FnOnce(&mut Self) -> Result<T, PerceptionError>,
    ) -> Result<T, PerceptionError> {
        let before = self.estimator.degraded().is_some();
        let result = work(self);
        if self.estimator.degraded().is_some() != before {
            self.memory.clear();
        }
        result
    }
}
