//! Configurations, opened: features once per frame, a pose per pair.

use std::sync::{Arc, Mutex, PoisonError};

use homing_core::{FeatureExtractor, Features, GoalEstimate, GoalPhoto, RgbImage};
use homing_perception::onnx::{AnyExtractor, AnyMatcher, FeatureChoice, Parts};
use homing_perception::{GoalEstimator, PerceptionConfig, PerceptionError};

use super::findings::Finding;
use super::measure::Measured;
use super::pairs::Unit;
use crate::RunError;

/// One configuration to measure.
#[derive(Clone, Debug)]
pub struct Setup {
    /// For tables and plots.
    pub name: String,
    /// What finds keypoints, and what pairs them.
    pub features: FeatureChoice,
    /// Everything else.
    pub perception: PerceptionConfig,
}

/// The configurations, opened.
pub(super) struct Workbench {
    pub(super) probes: Vec<Probe>,
}

impl Workbench {
    /// `threads` for each model and for OpenCV.
    pub(super) fn open(setups: &[Setup], threads: u16) -> Result<Self, RunError> {
        let mut probes: Vec<Probe> = Vec::with_capacity(setups.len());
        for (i, setup) in setups.iter().enumerate() {
            let same = setups[..i].iter().position(|earlier| setup.extracts_like(earlier));
            probes.push(Probe::open(setup, threads, same)?);
        }
        Ok(Self { probes })
    }

    pub(super) fn measure(&mut self, unit: &Unit) -> Result<Measured, RunError> {
        let mut features: Vec<Vec<Arc<Features>>> = Vec::with_capacity(self.probes.len());
        for probe in &mut self.probes {
            let own = match probe.same_features_as {
                Some(earlier) => features[earlier].clone(),
                None => unit.frames.iter().map(|f| probe.extract(&f.frame.rgb)).collect::<Result<_, _>>()?,
            };
            features.push(own);
        }
        let per_probe = self.probes.iter_mut().zip(&features);
        let findings = per_probe.map(|(probe, features)| probe.findings(unit, features)).collect::<Result<_, _>>()?;
        Ok(Measured { pairs: unit.pairs.iter().map(|p| p.facts).collect(), findings })
    }
}

impl Setup {
    fn extracts_like(&self, other: &Self) -> bool {
        self.features.extractor == other.features.extractor
            && self.features.extractor_config == other.features.extractor_config
            && self.perception.sift == other.perception.sift
    }
}

/// One configuration, opened.
pub(super) struct Probe {
    extractor: AnyExtractor,
    handed: Handed,
    estimator: GoalEstimator<Handed, AnyMatcher>,
    same_features_as: Option<usize>,
}

impl Probe {
    fn open(setup: &Setup, threads: u16, same_features_as: Option<usize>) -> Result<Self, PerceptionError> {
        let perception = PerceptionConfig { threads: Some(threads), ..setup.perception };
        let mut features = setup.features.clone();
        features.run.threads = threads;
        let Parts { extractor, matcher } = features.open(&perception)?;
        let handed = Handed::default();
        let estimator = GoalEstimator::with_parts(perception, handed.clone(), matcher)?;
        Ok(Self { extractor, handed, estimator, same_features_as })
    }

    pub(super) fn extract(&mut self, image: &RgbImage) -> Result<Arc<Features>, PerceptionError> {
        Ok(Arc::new(self.extractor.extract(image)?))
    }

    /// A finding for each pair, in their order. Pairs are taken by photo, so that each photo is shown once.
    fn findings(&mut self, unit: &Unit, features: &[Arc<Features>]) -> Result<Vec<Finding>, PerceptionError> {
        let mut order: Vec<usize> = (0..unit.pairs.len()).collect();
        order.sort_by_key(|&i| unit.pairs[i].goal);
        let mut findings = vec![Finding::NotSeen; unit.pairs.len()];
        let mut shown = None;
        for i in order {
            let pair = &unit.pairs[i];
            if shown != Some(pair.goal) {
                self.show(unit, pair.goal, &features[pair.goal])?;
                shown = Some(pair.goal);
            }
            let estimate = self.estimate(unit, pair.query, &features[pair.query])?;
            findings[i] = Finding::of(&estimate, unit.truth(pair).as_ref());
        }
        Ok(findings)
    }

    pub(super) fn show(&mut self, unit: &Unit, goal: usize, found: &Arc<Features>) -> Result<(), PerceptionError> {
        let frame = &unit.frames[goal].frame;
        self.handed.hand(found);
        let photo = GoalPhoto { id: goal as u64, rgb: Arc::clone(&frame.rgb), intrinsics: frame.intrinsics };
        self.estimator.set_goal(photo)
    }

    pub(super) fn estimate(
        &mut self,
        unit: &Unit,
        query: usize,
        found: &Arc<Features>,
    ) -> Result<GoalEstimate, PerceptionError> {
        self.handed.hand(found);
        self.estimator.estimate(&unit.frames[query].frame)
    }
}

/// Gives the features it was handed: an image is looked at once, however many pairs it is in.
#[derive(Clone, Default)]
struct Handed(Arc<Mutex<Arc<Features>>>);

impl Handed {
    fn hand(&self, features: &Arc<Features>) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Arc::clone(features);
    }
}

impl FeatureExtractor for Handed {
    type Error = PerceptionError;

    fn name(&self) -> &str {
        "features found before"
    }

    fn extract(&mut self, _: &RgbImage) -> Result<Features, PerceptionError> {
        Ok(Features::clone(&self.0.lock().unwrap_or_else(PoisonError::into_inner)))
    }
}
