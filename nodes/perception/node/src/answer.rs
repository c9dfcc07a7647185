//! One estimate per frame: for new frames, for frames sent again, and for all that was seen when the goal changes.

use std::sync::Arc;

use homing_core::{GoalEstimate, GoalPhoto, RgbdFrame, Stamp};
use homing_perception::memory::MemoryConfig;
use homing_perception::onnx::FeatureChoice;
use homing_perception::{FieldOfView, PerceptionConfig, PerceptionError, Registration, decode_photo};
use homing_protocol::convert::EncodedPhoto;

/// Holds the registration, the last frame and what was said about it.
pub struct Answerer {
    registration: Registration,
    goal_id: Option<u64>,
    last: Option<(RgbdFrame, GoalEstimate)>,
}

impl Answerer {
    pub fn new(
        config: PerceptionConfig,
        memory: MemoryConfig,
        choice: &FeatureChoice,
    ) -> Result<Self, PerceptionError> {
        Ok(Self { registration: Registration::open(config, memory, choice)?, goal_id: None, last: None })
    }

    /// A goal photo arrived. The same one again changes nothing; a new one is looked for in what was seen before and in the
    /// last frame at once, whose answer comes last.
    pub fn show(&mut self, photo: EncodedPhoto) -> anyhow::Result<Vec<GoalEstimate>> {
        if self.goal_id == Some(photo.id) {
            return Ok(Vec::new());
        }
        let rgb = decode_photo(&photo.file, FieldOfView::Given(photo.intrinsics.hfov_rad()))?.rgb;
        let intrinsics = photo.intrinsics.resized(rgb.width(), rgb.height())?;
        let mut answers = self.registration.set_goal(GoalPhoto { id: photo.id, rgb: Arc::new(rgb), intrinsics })?;
        self.goal_id = Some(photo.id);
        tracing::info!(goal = photo.id, "goal photo set");
        if let Some((frame, _)) = self.last.take() {
            answers.push(self.look(frame)?);
        }
        Ok(answers)
    }

    /// A new frame arrived.
    pub fn look(&mut self, frame: RgbdFrame) -> anyhow::Result<GoalEstimate> {
        let estimate = self.registration.look(&frame)?;
        self.last = Some((frame, estimate.clone()));
        Ok(estimate)
    }

    /// A part of a frame arrived that completes nothing: if it belongs to the last frame, the answer was lost or late, and
    /// is given again.
    pub fn again(&mut self, stamp: Stamp) -> Option<GoalEstimate> {
        let (frame, estimate) = self.last.as_ref()?;
        if stamp.began_anew_after(frame.stamp) {
            self.last = None;
            return None;
        }
        (frame.stamp == stamp).then(|| estimate.clone())
    }
}
