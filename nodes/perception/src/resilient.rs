//! Perception that goes on with less: when a model fails in flight and nothing is left to run it on, SIFT takes over.

use homing_core::{GoalEstimate, GoalPhoto, RgbdFrame};

use crate::onnx::{AnyExtractor, AnyMatcher, FeatureChoice, Parts};
use crate::{GoalEstimator, MutualNearest, PerceptionConfig, PerceptionError, SeenFrame, Sift};

/// An estimator with whatever features a configuration chose.
pub type AnyEstimator = GoalEstimator<AnyExtractor, AnyMatcher>;

impl AnyEstimator {
    /// Opens what is chosen. A model that fails in flight is an error: for measurements, where nothing may be replaced by
    /// something else in silence.
    ///
    /// # Errors
    /// As [`FeatureChoice::open`] and [`GoalEstimator::with_parts`].
    pub fn open(config: PerceptionConfig, choice: &FeatureChoice) -> Result<Self, PerceptionError> {
        config.check()?;
        let Parts { extractor, matcher } = choice.open(&config)?;
        Ok(Self::with_parts(config, extractor, matcher)?.with_switch(choice.open_switch()?))
    }
}

/// An estimator that a lost provider does not stop.
///
/// The models themselves give way first: a matcher to fewer keypoints, then both to the CPU. What fails after that fails for
/// good: this one says DEGRADED in the log and goes on with SIFT and mutual nearest neighbours, the goal's features found
/// anew, and without a learned switch, which belongs to the model's features.
pub struct ResilientEstimator {
    estimator: AnyEstimator,
    config: PerceptionConfig,
    degraded: Option<String>,
}

impl ResilientEstimator {
    /// Opens what is chosen.
    ///
    /// # Errors
    /// As [`FeatureChoice::open`] and [`GoalEstimator::with_parts`]: at the start nothing is replaced by something else.
    pub fn open(config: PerceptionConfig, choice: &FeatureChoice) -> Result<Self, PerceptionError> {
        Ok(Self { estimator: AnyEstimator::open(config, choice)?, config, degraded: None })
    }

    /// With parts opened before.
    ///
    /// # Errors
    /// As [`GoalEstimator::with_parts`].
    pub fn with_parts(config: PerceptionConfig, parts: Parts) -> Result<Self, PerceptionError> {
        let estimator = GoalEstimator::with_parts(config, parts.extractor, parts.matcher)?;
        Ok(Self { estimator, config, degraded: None })
    }

    /// Why SIFT had to take over, if it had to.
    #[must_use]
    pub fn degraded(&self) -> Option<&str> {
        self.degraded.as_deref()
    }

    /// The estimator in use.
    #[must_use]
    pub fn estimator(&self) -> &AnyEstimator {
        &self.estimator
    }

    /// See [`GoalEstimator::set_goal`].
    ///
    /// # Errors
    /// [`PerceptionError::PhotoSize`] if photo and intrinsics disagree, or a fault of SIFT.
    pub fn set_goal(&mut self, photo: GoalPhoto) -> Result<(), PerceptionError> {
        match self.estimator.set_goal(photo.clone()) {
            Err(fault) if self.gives_way_to(&fault) => {
                self.degrade(&fault, None)?;
                self.estimator.set_goal(photo)
            }
            done => done,
        }
    }

    /// See [`GoalEstimator::estimate`].
    ///
    /// # Errors
    /// Faults of SIFT or OpenCV; never those of a model.
    pub fn estimate(&mut self, frame: &RgbdFrame) -> Result<GoalEstimate, PerceptionError> {
        self.resiliently(|estimator| estimator.estimate(frame))
    }

    /// The same, and what to remember of the frame.
    ///
    /// # Errors
    /// As [`Self::estimate`].
    pub fn estimate_and_keep(&mut self, frame: &RgbdFrame) -> Result<(GoalEstimate, SeenFrame), PerceptionError> {
        self.resiliently(|estimator| estimator.estimate_and_keep(frame))
    }

    /// See [`GoalEstimator::look`].
    ///
    /// # Errors
    /// As [`Self::estimate`].
    pub fn look(&mut self, frame: &RgbdFrame) -> Result<SeenFrame, PerceptionError> {
        self.resiliently(|estimator| estimator.look(frame))
    }

    /// See [`GoalEstimator::register`]. SIFT cannot take over here: the frame's features are those of the model.
    ///
    /// # Errors
    /// Faults of the matcher or OpenCV.
    pub fn register(&mut self, frame: &SeenFrame) -> Result<GoalEstimate, PerceptionError> {
        self.estimator.register(frame)
    }

    fn resiliently<T>(
        &mut self,
        work: impl Fn(&mut AnyEstimator) -> Result<T, PerceptionError>,
    ) -> Result<T, PerceptionError> {
        match work(&mut self.estimator) {
            Err(fault) if self.gives_way_to(&fault) => {
                self.degrade(&fault, self.estimator.goal().cloned())?;
                work(&mut self.estimator)
            }
            done => done,
        }
    }

    fn gives_way_to(&self, fault: &PerceptionError) -> bool {
        self.degraded.is_none() && matches!(fault, PerceptionError::Stage { .. })
    }

    fn degrade(&mut self, fault: &PerceptionError, goal: Option<GoalPhoto>) -> Result<(), PerceptionError> {
        tracing::error!("DEGRADED: {fault}; perception goes on with SIFT until it is started again");
        self.degraded = Some(fault.to_string());
        let sift: AnyExtractor = Box::new(Sift::new(self.config.sift)?);
        let nearest: AnyMatcher = Box::new(MutualNearest { ratio_max: self.config.ratio_max });
        self.estimator = GoalEstimator::with_parts(self.config, sift, nearest)?;
        match goal {
            Some(photo) => self.estimator.set_goal(photo),
            None => Ok(()),
        }
    }
}
