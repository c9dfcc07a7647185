//! What attention matchers have in common: normalised positions and descriptors in, matches out, fewer keypoints where
//! memory runs short.

use homing_core::{FeatureMatch, Features, Matcher};

use super::MatcherConfig;
use crate::PerceptionError;
use crate::onnx::contract::FoundPort;
use crate::onnx::error::ModelError;
use crate::onnx::network::{Input, Network, Output, refuse};
use crate::onnx::session::Provider;

/// Fewer keypoints than this are not worth a match: the next step is another provider.
const KEYPOINTS_MIN: usize = 256;

/// Whether the model also takes the keypoints' scores.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(in crate::onnx) enum Takes {
    /// kpts0, kpts1, desc0, desc1.
    PositionsAndDescriptors,
    /// And scores0, scores1.
    ScoresToo,
}

/// Makes (query, goal, confidence) of the outputs, given the number of query keypoints.
type Read = fn(&[Output<'_>], usize) -> Result<Vec<(i64, i64, f32)>, String>;

/// What tells the matchers of one contract from those of another.
#[derive(Copy, Clone, Debug)]
pub(super) struct Form {
    /// The contract's name.
    pub name: &'static str,
    pub takes: Takes,
    pub read: Read,
}

/// A network that matches two sets of features.
pub(super) struct GlueMatcher {
    network: Box<dyn Network>,
    form: Form,
    config: MatcherConfig,
    /// Below the configured number while memory is short.
    keypoints_max: usize,
}

impl Matcher for GlueMatcher {
    type Error = PerceptionError;

    fn name(&self) -> &str {
        self.form.name
    }

    fn match_features(&mut self, query: &Features, goal: &Features) -> Result<Vec<FeatureMatch>, PerceptionError> {
        if query.keypoints.is_empty() || goal.keypoints.is_empty() {
            return Ok(Vec::new());
        }
        check(&*self.network, query, goal)?;
        loop {
            let sides = (Side::of(query, self.keypoints_max), Side::of(goal, self.keypoints_max));
            let (n_query, n_goal) = (sides.0.n, sides.1.n);
            let mut matches = Ok(Vec::new());
            let given = inputs(&sides.0, &sides.1, self.form.takes, self.network.inputs());
            let ran = self.network.run(&given, &mut |outputs| {
                matches = (self.form.read)(outputs, n_query);
            });
            match ran {
                Ok(()) => {
                    let pairs = matches.map_err(|found| refuse(&*self.network, "one confidence per match", found))?;
                    return Ok(self.kept(pairs, n_query, n_goal)?);
                }
                Err(fault @ ModelError::Contract { .. }) => return Err(fault.into()),
                Err(fault) => self.give_way(fault, n_query.max(n_goal))?,
            }
        }
    }
}

impl GlueMatcher {
    pub fn new(network: Box<dyn Network>, form: Form, config: MatcherConfig) -> Self {
        Self { network, form, config, keypoints_max: config.keypoints_max }
    }

    /// After a fault: half of the keypoints, then all of them on the CPU, then half again, then the fault itself.
    fn give_way(&mut self, fault: ModelError, n: usize) -> Result<(), ModelError> {
        let fewer = n.min(self.keypoints_max) / 2;
        if fewer >= KEYPOINTS_MIN {
            tracing::error!("DEGRADED: {fault}; from now on at most {fewer} keypoints are matched");
            self.keypoints_max = fewer;
            return Ok(());
        }
        let lost = self.network.provider();
        if lost == Provider::Cpu || !self.network.fall_back_to_cpu()? {
            return Err(fault);
        }
        self.keypoints_max = self.config.keypoints_max;
        tracing::error!("DEGRADED: {fault}; {} is given up, the matcher goes on on the CPU", lost.name());
        Ok(())
    }

    /// Each keypoint at most once, surest first; in the order of the query's keypoints.
    fn kept(
        &self,
        mut pairs: Vec<(i64, i64, f32)>,
        n_query: usize,
        n_goal: usize,
    ) -> Result<Vec<FeatureMatch>, ModelError> {
        // Also drops a NaN.
        pairs.retain(|&(_, _, confidence)| confidence >= self.config.confidence_min);
        pairs.sort_by(|a, b| b.2.total_cmp(&a.2).then(a.0.cmp(&b.0)).then(a.1.cmp(&b.1)));
        let (mut of_query, mut of_goal) = (vec![false; n_query], vec![false; n_goal]);
        let mut matches = Vec::with_capacity(pairs.len());
        for (query, goal, confidence) in pairs {
            let index = |i: i64, n: usize| usize::try_from(i).ok().filter(|&i| i < n);
            let (Some(q), Some(g)) = (index(query, n_query), index(goal, n_goal)) else {
                let found = format!("match ({query}, {goal}) between {n_query} and {n_goal}");
                return Err(refuse(&*self.network, "indices of keypoints", found));
            };
            if !of_query[q] && !of_goal[g] {
                (of_query[q], of_goal[g]) = (true, true);
                matches.push(FeatureMatch { query: q, goal: g, confidence: confidence.min(1.0) });
            }
        }
        matches.sort_by_key(|m| m.query);
        Ok(matches)
    }
}

/// Refuses descriptors that are not whole, or not of the length that the network takes.
pub(in crate::onnx) fn check(network: &dyn Network, query: &Features, goal: &Features) -> Result<(), PerceptionError> {
    for features in [query, goal] {
        let (keypoints, found) = (features.keypoints.len(), features.descriptors.len());
        let expected = keypoints * features.dimension;
        if expected != found {
            return Err(PerceptionError::Features { keypoints, expected, found });
        }
    }
    let wanted = network.inputs().get(2).and_then(|port| port.shape.last().copied().flatten());
    if query.dimension != goal.dimension || wanted.is_some_and(|n| n != query.dimension) {
        let goal = if query.dimension == goal.dimension { wanted.unwrap_or_default() } else { goal.dimension };
        return Err(PerceptionError::Dimension { query: query.dimension, goal });
    }
    Ok(())
}

/// One image's part of the input.
pub(in crate::onnx) struct Side<'a> {
    n: usize,
    dimension: usize,
    positions: Vec<f32>,
    descriptors: &'a [f32],
    scores: Vec<f32>,
}

impl<'a> Side<'a> {
    /// Positions become (xy - (w, h) / 2) / (max(w, h) / 2).
    pub fn of(features: &'a Features, keypoints_max: usize) -> Self {
        let n = features.keypoints.len().min(keypoints_max);
        let kept = &features.keypoints[..n];
        let (width, height) = (features.image_size_px.0 as f32, features.image_size_px.1 as f32);
        let half = 0.5 * width.max(height).max(1.0);
        let normalised = |k: &homing_core::Keypoint| [(k.x_px - 0.5 * width) / half, (k.y_px - 0.5 * height) / half];
        Self {
            n,
            dimension: features.dimension,
            positions: kept.iter().flat_map(normalised).collect(),
            descriptors: &features.descriptors[..n * features.dimension],
            scores: kept.iter().map(|k| k.score).collect(),
        }
    }
}

/// In the order of the contract; models exported without a batch get none.
pub(in crate::onnx) fn inputs<'a>(
    query: &'a Side<'_>,
    goal: &'a Side<'_>,
    takes: Takes,
    ports: &[FoundPort],
) -> Vec<Input<'a>> {
    let positions = |s: &'a Side<'_>| Input { shape: vec![1, s.n, 2], data: &s.positions };
    let descriptors = |s: &'a Side<'_>| Input { shape: vec![1, s.n, s.dimension], data: s.descriptors };
    let scores = |s: &'a Side<'_>| Input { shape: vec![1, s.n], data: &s.scores };
    let mut inputs = vec![positions(query), positions(goal), descriptors(query), descriptors(goal)];
    if takes == Takes::ScoresToo {
        inputs.extend([scores(query), scores(goal)]);
    }
    for (input, port) in inputs.iter_mut().zip(ports) {
        if port.shape.len() + 1 == input.shape.len() {
            input.shape.remove(0);
        }
    }
    inputs
}

/// Outputs (matches m x 2, confidences m).
pub(super) fn read_pairs(outputs: &[Output<'_>], _n_query: usize) -> Result<Vec<(i64, i64, f32)>, String> {
    let [matches, scores] = outputs else { return Err(format!("{} outputs", outputs.len())) };
    let (pairs, scores) = (matches.integers().as_chunks::<2>().0, scores.floats());
    if pairs.len() != scores.len() {
        return Err(format!("{} matches and {} confidences", pairs.len(), scores.len()));
    }
    Ok(pairs.iter().zip(scores).map(|(&[q, g], &s)| (q, g, s)).collect())
}

/// Outputs (goal keypoint per query keypoint or -1, confidences), both 1 x n.
pub(super) fn read_per_keypoint(outputs: &[Output<'_>], n_query: usize) -> Result<Vec<(i64, i64, f32)>, String> {
    let [matches, scores] = outputs else { return Err(format!("{} outputs", outputs.len())) };
    let (goals, scores) = (matches.integers(), scores.floats());
    if goals.len() != n_query || scores.len() != n_query {
        return Err(format!("{} matches and {} confidences for {n_query} keypoints", goals.len(), scores.len()));
    }
    let pairs = goals.iter().zip(scores).enumerate();
    Ok(pairs.filter(|(_, (g, _))| **g >= 0).map(|(q, (&g, &s))| (q as i64, g, s)).collect())
}
