//! The process's TOML file.

use homing_perception::memory::MemoryConfig;
use homing_perception::onnx::{ChoiceError, FeatureChoice};
use homing_perception::{PerceptionConfig, PoseSolver};
use homing_protocol::process::SessionSettings;
use serde::Deserialize;

use crate::features::{FeatureSettings, MatcherSettings, RuntimeSettings, choice};

/// `perception.toml`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// Network.
    pub session: SessionSettings,
    /// What finds keypoints.
    pub features: FeatureSettings,
    /// What pairs them.
    pub matcher: MatcherSettings,
    /// Where models run.
    pub runtime: RuntimeSettings,
    /// When a goal counts as seen.
    pub gates: GateSettings,
    /// From matches to a pose.
    pub pose: PoseSettings,
    /// What was seen before.
    pub memory: MemorySettings,
    /// Threads OpenCV may use; 0 leaves its own choice.
    pub threads: u16,
}

/// `[gates]`.
#[derive(Clone, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GateSettings {
    /// Fewest verified matches of a sighting.
    pub n_inliers_min: usize,
    /// Largest angular error of a verified match, degrees.
    pub error_deg_max: f64,
    /// Smallest share of the photo's patches that the frame, drawn from the pose, must look like.
    pub patch_share_min: f64,
}

/// `[pose]`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PoseSettings {
    /// Which solver.
    pub solver: SolverName,
    /// How far the robot's camera looks down, degrees; absent if not known. For `gravity`.
    pub camera_down_deg: Option<f64>,
    /// The same of the camera that takes the photos.
    pub goal_down_deg: Option<f64>,
}

/// `[memory]`.
#[derive(Clone, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MemorySettings {
    /// Most keyframes remembered, about 1 MB each; 0 remembers nothing.
    pub keyframes_max: usize,
    /// Keyframes examined when a new goal is given.
    pub candidates_max: usize,
}

/// The solvers' names in the file.
#[derive(Copy, Clone, Debug, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SolverName {
    /// Three points.
    #[default]
    LoRansac,
    /// Two points and up.
    Gravity,
    /// The papers' method.
    EpnpRansac,
    /// The same with SLING's heading formula.
    SlingHeading,
}

impl From<SolverName> for PoseSolver {
    fn from(name: SolverName) -> Self {
        match name {
            SolverName::LoRansac => Self::LoRansac,
            SolverName::Gravity => Self::Gravity,
            SolverName::EpnpRansac => Self::EpnpRansac,
            SolverName::SlingHeading => Self::SlingHeading,
        }
    }
}

impl Default for MemorySettings {
    fn default() -> Self {
        let MemoryConfig { keyframes_max, candidates_max, .. } = MemoryConfig::default();
        Self { keyframes_max, candidates_max }
    }
}

impl Default for GateSettings {
    fn default() -> Self {
        let gates = PerceptionConfig::default().gates;
        Self {
            n_inliers_min: gates.n_inliers_min,
            error_deg_max: gates.error_rad_max.to_degrees(),
            patch_share_min: gates.patch_share_min,
        }
    }
}

impl Config {
    /// As the library's configuration.
    pub fn perception(&self) -> PerceptionConfig {
        let mut config = PerceptionConfig::default();
        config.sift.keypoints_max = self.features.keypoints_max.unwrap_or(config.sift.keypoints_max);
        config.ratio_max = self.matcher.ratio_max;
        config.gates.n_inliers_min = self.gates.n_inliers_min;
        config.gates.patch_share_min = self.gates.patch_share_min;
        // An untouched default keeps its bits: degrees would move the last one.
        if self.gates.error_deg_max != config.gates.error_rad_max.to_degrees() {
            config.gates.error_rad_max = self.gates.error_deg_max.to_radians();
        }
        config.solver = self.pose.solver.into();
        config.camera_down_rad = self.pose.camera_down_deg.map(f64::to_radians);
        config.goal_down_rad = self.pose.goal_down_deg.map(f64::to_radians);
        config.threads = (self.threads > 0).then_some(self.threads);
        config
    }

    /// The memory's configuration.
    pub fn memory(&self) -> MemoryConfig {
        let MemorySettings { keyframes_max, candidates_max } = self.memory;
        MemoryConfig { keyframes_max, candidates_max, ..MemoryConfig::default() }
    }

    /// The features it names.
    pub fn choice(&self) -> Result<FeatureChoice, ChoiceError> {
        choice(&self.features, &self.matcher, &self.runtime)
    }
}
