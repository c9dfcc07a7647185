//! One estimate per frame: for new frames, for frames sent again, and for the last frame when the goal changes.

use std::sync::Arc;
use std::time::Duration;

use homing_core::{GoalEstimate, GoalPhoto, RgbdFrame, Sighting, StageTimes, Stamp, UnseenReason};
use homing_perception::onnx::FeatureChoice;
use homing_perception::{FieldOfView, PerceptionConfig, PerceptionError, ResilientEstimator, decode_photo};
use homing_protocol::convert::EncodedPhoto;

/// Holds the estimator, the last frame and what was said about it.
pub struct Answerer {
    estimator: ResilientEstimator,
    goal_id: Option<u64>,
    last: Option<(RgbdFrame, GoalEstimate)>,
}

/// A stamp this much before the last one means that the robot's clock began anew.
const CLOCK_RESTART: Duration = Duration::from_millis(500);

impl Answerer {
    pub fn new(config: PerceptionConfig, choice: &FeatureChoice) -> Result<Self, PerceptionError> {
        Ok(Self { estimator: ResilientEstimator::open(config, choice)?, goal_id: None, last: None })
    }

    /// A goal photo arrived. The same one again changes nothing; a new one is looked for in the last frame at once.
    pub fn show(&mut self, photo: EncodedPhoto) -> anyhow::Result<Option<GoalEstimate>> {
        if self.goal_id == Some(photo.id) {
            return Ok(None);
        }
        let rgb = decode_photo(&photo.file, FieldOfView::Given(photo.intrinsics.hfov_rad()))?.rgb;
        let intrinsics = photo.intrinsics.resized(rgb.width(), rgb.height())?;
        self.estimator.set_goal(GoalPhoto { id: photo.id, rgb: Arc::new(rgb), intrinsics })?;
        self.goal_id = Some(photo.id);
        tracing::info!(goal = photo.id, "goal photo set");
        match self.last.take() {
            Some((frame, _)) => self.look(frame).map(Some),
            None => Ok(None),
        }
    }

    /// A new frame arrived.
    pub fn look(&mut self, frame: RgbdFrame) -> anyhow::Result<GoalEstimate> {
        let estimate = match self.goal_id {
            Some(_) => self.estimator.estimate(&frame)?,
            None => no_goal(frame.stamp),
        };
        self.last = Some((frame, estimate.clone()));
        Ok(estimate)
    }

    /// A part of a frame arrived that completes nothing: if it belongs to the last frame, the answer was lost or late, and
    /// is given again.
    pub fn again(&mut self, stamp: Stamp) -> Option<GoalEstimate> {
        let (frame, estimate) = self.last.as_ref()?;
        if frame.stamp.since(stamp) > CLOCK_RESTART {
            self.last = None;
            return None;
        }
        (frame.stamp == stamp).then(|| estimate.clone())
    }
}

fn no_goal(stamp: Stamp) -> GoalEstimate {
    GoalEstimate {
        stamp,
        goal_id: 0,
        sighting: Sighting::NotSeen { reason: UnseenReason::NoGoal },
        n_matches: 0,
        matched_points: Vec::new(),
        times: StageTimes::default(),
    }
}
