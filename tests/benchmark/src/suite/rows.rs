//! The rows of the tables: what is tried, by name.

use std::path::Path;

use homing_perception::PerceptionConfig;
use homing_perception::onnx::{ChoiceError, ExtractorChoice, FeatureChoice, MatcherChoice, RunConfig, SwitchChoice};
use homing_sim::{NoisePreset, SimConfig};

use crate::ablations::{ABLATIONS, ablation};
use crate::tables::BASE;
use crate::{GoalPose, LastMile, Policy, Trial};

/// One row: a system under test.
#[derive(Clone, Debug)]
pub struct Row {
    /// Its name in results and on the command line.
    pub name: &'static str,
    /// What it is, for people.
    pub what: &'static str,
    /// What finds keypoints, and what pairs them.
    pub features: FeatureChoice,
    /// Perception's settings.
    pub perception: PerceptionConfig,
    /// Policy, planner, body and oracles.
    pub trial: Trial,
    /// A headline row is run on more episodes.
    pub headline: Headline,
}

impl Row {
    /// Every setting that decides a result, as text: it is compared and shown, not read back.
    #[must_use]
    pub fn config(&self) -> serde_json::Value {
        serde_json::json!({
            "what": self.what,
            "features": described(&self.features),
            "perception": format!("{:?}", self.perception),
            "policy": self.trial.policy,
            "planner": format!("{:?}", self.trial.planner),
            "robot": format!("{:?}", self.trial.sim),
            "goal_pose": self.trial.goal_pose,
            "last_mile": self.trial.last_mile,
        })
    }
}

/// Features by name and content, wherever their files lie.
fn described(features: &FeatureChoice) -> serde_json::Value {
    let extractor = match &features.extractor {
        ExtractorChoice::Model { file, .. } => file.sha256.as_str(),
        ExtractorChoice::Sift => "",
    };
    let matcher = match &features.matcher {
        MatcherChoice::Model { file, .. } => file.sha256.as_str(),
        MatcherChoice::MutualNearest | MatcherChoice::DualSoftmax => "",
    };
    let switch = match &features.switch {
        SwitchChoice::Model { file, .. } => file.sha256.as_str(),
        SwitchChoice::Geometry => "",
    };
    serde_json::json!({
        "extractor": features.extractor.name(),
        "extractor_sha256": extractor,
        "matcher": features.matcher.name(),
        "matcher_sha256": matcher,
        "switch_sha256": switch,
        "settings": format!("{:?} {:?}", features.extractor_config, features.matcher_config),
    })
}

/// Whether the tables stand on a row.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Headline {
    /// They do.
    Yes,
    /// It is compared with one that they stand on.
    No,
}

/// Every row, headlines first. `own` are our features; `models` is the folder of the models.
///
/// # Errors
/// [`ChoiceError`] where a model is not listed in that folder.
pub fn rows(own: &FeatureChoice, models: &Path) -> Result<Vec<Row>, ChoiceError> {
    let base = Trial::default();
    let row = |name, what, trial| Row {
        name,
        what,
        features: FeatureChoice { run: RunConfig { threads: 1, ..own.run }, ..own.clone() },
        perception: PerceptionConfig { threads: Some(1), ..PerceptionConfig::default() },
        trial,
        headline: Headline::No,
    };
    let with = |policy| Trial { policy, ..base.clone() };
    let noisy = |noise: NoisePreset| Trial { sim: SimConfig { noise: noise.config(), ..base.sim }, ..base.clone() };
    let last_mile = |goal_pose, last_mile| Trial { goal_pose, last_mile, sim: base.sim, ..base.clone() };
    let headline = |row| Row { headline: Headline::Yes, ..row };
    let mut rows = vec![
        headline(row("frontier", "ours: Frontier, own features, fused geometric switches", base.clone())),
        headline(row("oracle-gd", "goal discovery by an oracle", with(Policy::Oracle))),
        row("pose-noise", "odometry that drifts", noisy(NoisePreset::Pose)),
        row("pose-depth-noise", "odometry that drifts, noisy depth", noisy(NoisePreset::PoseDepth)),
        row("all-noise", "the same, wheels that slip, a camera that blurs", noisy(NoisePreset::All)),
        row("oracle-lp", "the last mile by teleport", last_mile(GoalPose::Estimated, LastMile::Teleported)),
        row("oracle-lm-pose", "the goal's pose by an oracle", last_mile(GoalPose::Oracle, LastMile::Driven)),
        row("oracle-lm-pose-lp", "both", last_mile(GoalPose::Oracle, LastMile::Teleported)),
    ];
    for (name, what) in ABLATIONS.into_iter().filter(|(name, _)| *name != BASE) {
        let Some(ablation) = ablation(name, models)? else { continue };
        let mut row = row(name, what, Trial { planner: ablation.planner, ..base.clone() });
        row.perception = PerceptionConfig { threads: Some(1), ..ablation.perception };
        let switch = ablation.features.switch.clone();
        if name == "sift" {
            row.features = ablation.features;
        }
        row.features.switch = switch;
        rows.push(row);
    }
    // They seldom find the goal, so each of their episodes takes all of its steps.
    rows.push(row("random", "goal discovery by places drawn at random", with(Policy::RandomGoal)));
    rows.push(row("straight", "goal discovery straight ahead", with(Policy::Straight)));
    Ok(rows)
}
