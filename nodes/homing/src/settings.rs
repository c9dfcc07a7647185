//! The TOML files that `homing` writes for the processes it starts: only what differs from their defaults.

use std::path::{Path, PathBuf};

use homing_perception::onnx::registry::FOLDER;
use homing_perception::onnx::{ChoiceError, FeatureChoice};
use serde::Serialize;

#[derive(Serialize)]
pub struct Network {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub listen: Option<Vec<String>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub connect: Option<Vec<String>>,
    /// Processes start side by side: give the body time to come up.
    pub connect_timeout_s: u64,
}

impl Network {
    pub fn listen(endpoint: &str) -> Self {
        Self { listen: Some(vec![endpoint.to_owned()]), connect: None, connect_timeout_s: 30 }
    }

    pub fn connect(endpoint: &str) -> Self {
        Self { listen: None, connect: Some(vec![endpoint.to_owned()]), connect_timeout_s: 30 }
    }
}

#[derive(Serialize)]
pub struct SimFile {
    pub pace: &'static str,
    pub noise: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radius_m: Option<f64>,
    pub episode: PathBuf,
    pub session: Network,
}

#[derive(Serialize)]
pub struct PerceptionFile {
    pub features: FeaturesTable,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub matcher: Option<MatcherTable>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pose: Option<PoseTable>,
    pub session: Network,
}

/// `[features]` of perception.
#[derive(Serialize)]
pub struct FeaturesTable {
    pub extractor: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub switch: Option<&'static str>,
}

/// `[pose]` of perception.
#[derive(Serialize)]
pub struct PoseTable {
    pub solver: &'static str,
}

/// `[matcher]` of perception.
#[derive(Serialize)]
pub struct MatcherTable {
    pub method: String,
}

/// Which features perception uses.
#[derive(Clone, Debug, clap::Args)]
pub struct FeatureArgs {
    /// What finds keypoints: sift, or the name of a model (`homing models` lists them; "homing" is homing-extractor).
    #[arg(long, default_value = "homing", value_name = "NAME")]
    pub extractor: String,
    /// What pairs them: mutual-nearest, dual-softmax, or the name of a model; not given: what goes with the extractor.
    #[arg(long, value_name = "NAME")]
    pub matcher: Option<String>,
}

impl FeatureArgs {
    /// Are there such features? Known before any process is started.
    pub fn check(&self) -> Result<(), ChoiceError> {
        FeatureChoice::listed(&self.extractor, self.matcher.as_deref(), Path::new(FOLDER)).map(|_| ())
    }
}

impl PerceptionFile {
    pub fn new(features: &FeatureArgs, session: Network) -> Self {
        Self {
            features: FeaturesTable { extractor: features.extractor.clone(), switch: None },
            matcher: features.matcher.clone().map(|method| MatcherTable { method }),
            pose: None,
            session,
        }
    }
}

#[derive(Serialize)]
pub struct PlannerFile {
    pub policy: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub switches: Option<SwitchesTable>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub body: Option<BodyTable>,
    pub session: Network,
    pub pace: PlannerPace,
}

/// `[body]` of a planner.
#[derive(Serialize)]
pub struct BodyTable {
    pub radius_m: f64,
}

/// `[switches]` of a planner.
#[derive(Serialize)]
pub struct SwitchesTable {
    pub kind: &'static str,
    pub recovery: &'static str,
}

#[derive(Serialize)]
pub struct PlannerPace {
    pub answer_ms_max: u64,
}

#[derive(Serialize)]
pub struct MonitorFile {
    pub recording: PathBuf,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub viewer: Option<PathBuf>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub picture: Option<PathBuf>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub truth: Option<PathBuf>,
    pub session: Network,
}

#[derive(Serialize)]
pub struct RobotFile {
    pub recording: PathBuf,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rig: Option<PathBuf>,
    pub frames: Vec<u32>,
    pub answers: &'static str,
    pub session: Network,
}

#[derive(Serialize)]
pub struct TruthFile {
    pub goal: [f64; 3],
    pub shortest_path: Vec<[f64; 2]>,
}
