//! The step: one RGB-D frame and the goal photo in, one goal estimate out.

use std::time::{Duration, Instant};

use homing_core::{
    FeatureExtractor, Features, GoalEstimate, GoalPhoto, MatchedPoint, Matcher, RgbImage, RgbdFrame, Sighting,
    StageTimes, Stamp, UnseenReason,
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::locate::{Found, Views, locate};
use crate::onnx::LearnedSwitch;
use crate::seen_frame::SeenFrame;
use crate::synthesis::Thumbnail;
use crate::{MutualNearest, PerceptionConfig, PerceptionError, Sift};

/// Verified matches handed on for people to look at.
const MATCHED_POINTS_MAX: usize = 300;

/// Perception with a goal: holds the photo's features so that each frame costs one extraction.
pub struct GoalEstimator<E = Sift, M = MutualNearest> {
    config: PerceptionConfig,
    extractor: E,
    matcher: M,
    switch: Option<LearnedSwitch>,
    goal: Option<Goal>,
}

struct Goal {
    photo: GoalPhoto,
    features: Features,
    thumbnail: Thumbnail,
}

impl GoalEstimator {
    /// SIFT and mutual nearest neighbours.
    ///
    /// # Errors
    /// [`PerceptionError::Setting`] for a setting out of range, [`PerceptionError::OpenCv`] if OpenCV refuses.
    pub fn new(config: PerceptionConfig) -> Result<Self, PerceptionError> {
        config.check()?;
        Self::with_parts(config, Sift::new(config.sift)?, MutualNearest { ratio_max: config.ratio_max })
    }
}

impl<E: FeatureExtractor, M: Matcher> GoalEstimator<E, M> {
    /// With any extractor and matcher.
    ///
    /// # Errors
    /// [`PerceptionError::Setting`] for a setting out of range, [`PerceptionError::OpenCv`] if OpenCV refuses.
    pub fn with_parts(config: PerceptionConfig, extractor: E, matcher: M) -> Result<Self, PerceptionError> {
        config.check()?;
        if let Some(threads) = config.threads {
            opencv::core::set_num_threads(i32::from(threads)).map_err(PerceptionError::opencv("set its threads"))?;
        }
        Ok(Self { config, extractor, matcher, switch: None, goal: None })
    }

    /// The same with a learned switch, whose probability goes with every estimate.
    #[must_use]
    pub fn with_switch(self, switch: Option<LearnedSwitch>) -> Self {
        Self { switch, ..self }
    }

    /// Takes a photo to look for, replacing the last. A photo without texture is accepted and never seen.
    ///
    /// # Errors
    /// [`PerceptionError::PhotoSize`] if photo and intrinsics disagree, or a fault of the extractor; the last goal then
    /// stays.
    pub fn set_goal(&mut self, photo: GoalPhoto) -> Result<(), PerceptionError> {
        let (size, camera) = ((photo.rgb.width(), photo.rgb.height()), &photo.intrinsics);
        if size != (camera.width(), camera.height()) {
            return Err(PerceptionError::PhotoSize {
                photo_width: size.0,
                photo_height: size.1,
                width: camera.width(),
                height: camera.height(),
            });
        }
        let features = self.extract(&photo.rgb)?;
        tracing::debug!(goal = photo.id, keypoints = features.keypoints.len(), "goal photo taken");
        let thumbnail = Thumbnail::of(&photo.rgb);
        self.goal = Some(Goal { photo, features, thumbnail });
        Ok(())
    }

    /// Forgets the goal.
    pub fn clear_goal(&mut self) {
        self.goal = None;
    }

    /// The photo looked for.
    #[must_use]
    pub fn goal(&self) -> Option<&GoalPhoto> {
        self.goal.as_ref().map(|goal| &goal.photo)
    }

    /// Keypoints of the photo looked for.
    #[must_use]
    pub fn goal_features(&self) -> Option<&Features> {
        self.goal.as_ref().map(|goal| &goal.features)
    }

    /// Where the goal is, seen from this frame (SLING 3.3): [`Self::look`], then [`Self::register`]. The same frame and goal give the same estimate.
    ///
    /// # Errors
    /// Faults of the extractor, the matcher or OpenCV; never what the image shows.
    pub fn estimate(&mut self, frame: &RgbdFrame) -> Result<GoalEstimate, PerceptionError> {
        if self.goal.is_none() {
            return Ok(no_goal(frame.stamp));
        }
        self.estimate_and_keep(frame).map(|(estimate, _)| estimate)
    }

    /// The same, and what to remember of the frame.
    ///
    /// # Errors
    /// As [`Self::estimate`].
    pub fn estimate_and_keep(&mut self, frame: &RgbdFrame) -> Result<(GoalEstimate, SeenFrame), PerceptionError> {
        let mut extract = Duration::ZERO;
        let seen = timed(&mut extract, || self.look(frame))?;
        let mut estimate = self.register(&seen)?;
        estimate.times.extract = extract;
        Ok((estimate, seen))
    }

    /// The first half of [`Self::estimate`], which needs no goal: keypoints, and their points in metres.
    ///
    /// # Errors
    /// Faults of the extractor; never what the image shows.
    pub fn look(&mut self, frame: &RgbdFrame) -> Result<SeenFrame, PerceptionError> {
        let features = self.extract(&frame.rgb)?;
        Ok(SeenFrame::new(frame, features, &self.config.depth))
    }

    /// The second half: where the goal is, seen from a frame looked at now or long ago.
    ///
    /// # Errors
    /// Faults of the matcher or OpenCV; never what the image shows.
    pub fn register(&mut self, frame: &SeenFrame) -> Result<GoalEstimate, PerceptionError> {
        let mut times = StageTimes::default();
        let Some(goal) = &self.goal else { return Ok(no_goal(frame.stamp)) };
        let query = &frame.features;
        let matches = timed(&mut times.matching, || self.matcher.match_features(query, &goal.features))
            .map_err(|source| stage(self.matcher.name(), source))?;
        let switch_probability = match &mut self.switch {
            Some(switch) => switch.probability(query, &goal.features).map_err(|source| stage("switch", source))?,
            None => None,
        };
        let views = Views { frame, goal: &goal.features, goal_camera: &goal.photo.intrinsics, photo: &goal.thumbnail };
        let mut rng = ChaCha8Rng::seed_from_u64(self.config.seed ^ frame.stamp.0);
        let Found { sighting, verified } = timed(&mut times.pose, || locate(&views, &matches, &self.config, &mut rng))?;
        let matched_points = verified.iter().take(MATCHED_POINTS_MAX).map(|&(q, g)| MatchedPoint {
            query_px: (query.keypoints[q].x_px, query.keypoints[q].y_px),
            goal_px: (goal.features.keypoints[g].x_px, goal.features.keypoints[g].y_px),
        });
        Ok(GoalEstimate {
            stamp: frame.stamp,
            goal_id: goal.photo.id,
            sighting,
            switch_probability,
            n_matches: matches.len(),
            matched_points: matched_points.collect(),
            times,
        })
    }

    fn extract(&mut self, image: &RgbImage) -> Result<Features, PerceptionError> {
        self.extractor.extract(image).map_err(|source| stage(self.extractor.name(), source))
    }
}

fn stage(name: &str, source: impl core::error::Error + Send + Sync + 'static) -> PerceptionError {
    PerceptionError::Stage { name: name.to_owned(), source: Box::new(source) }
}

/// The answer where there is no goal to look for.
pub(crate) fn no_goal(stamp: Stamp) -> GoalEstimate {
    GoalEstimate {
        stamp,
        goal_id: 0,
        sighting: Sighting::NotSeen { reason: UnseenReason::NoGoal },
        switch_probability: None,
        n_matches: 0,
        matched_points: Vec::new(),
        times: StageTimes::default(),
    }
}

/// The clock is read for reporting alone: no result depends on it.
fn timed<T>(into: &mut Duration, work: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let result = work();
    *into = start.elapsed();
    result
}
