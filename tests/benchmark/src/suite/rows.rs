//! The rows of the tables: what is tried, by name.

use homing_perception::PerceptionConfig;
use homing_perception::onnx::{ExtractorChoice, FeatureChoice, MatcherChoice};

use crate::{GoalPose, LastMile, Policy, RunError, Trial};

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
    serde_json::json!({
        "extractor": features.extractor.name(),
        "extractor_sha256": extractor,
        "matcher": features.matcher.name(),
        "matcher_sha256": matcher,
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

/// Every row, headlines first. `own` are our features, `sift` the traditional ones.
///
/// # Errors
/// None today: rows are fixed.
pub fn rows(own: &FeatureChoice, sift: &FeatureChoice) -> Result<Vec<Row>, RunError> {
    let perception = PerceptionConfig { threads: Some(1), ..PerceptionConfig::default() };
    let row = |name, what, headline, trial| Row { name, what, features: own.clone(), perception, trial, headline };
    let base = Trial::default();
    let with = |policy| Trial { policy, ..base.clone() };
    let (yes, no) = (Headline::Yes, Headline::No);
    let (oracle_pose, teleport) = (GoalPose::Oracle, LastMile::Teleported);
    Ok(vec![
        row("frontier", "ours: Frontier, own features, geometric switches", yes, base.clone()),
        row("oracle-gd", "ours with Oracle-GD", yes, with(Policy::Oracle)),
        row("straight", "ours with Straight-GD", no, with(Policy::Straight)),
        row("random", "ours with random goals", no, with(Policy::RandomGoal)),
        Row { features: sift.clone(), ..row("sift", "without neural features", no, base.clone()) },
        row("oracle-lm-pose", "with Oracle-LM-Pose", no, Trial { goal_pose: oracle_pose, ..base.clone() }),
        row("oracle-lp", "with Oracle-LP", no, Trial { last_mile: teleport, ..base.clone() }),
        row(
            "oracle-lm-pose-lp",
            "with Oracle-LM-Pose and Oracle-LP",
            no,
            Trial { goal_pose: oracle_pose, last_mile: teleport, ..base.clone() },
        ),
    ])
}
