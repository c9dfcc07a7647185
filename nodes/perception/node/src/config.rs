//! The process's TOML file.

use homing_perception::PerceptionConfig;
use homing_perception::onnx::{ChoiceError, FeatureChoice};
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
}

impl Default for GateSettings {
    fn default() -> Self {
        let gates = PerceptionConfig::default().gates;
        Self { n_inliers_min: gates.n_inliers_min, error_deg_max: gates.error_rad_max.to_degrees() }
    }
}

impl Config {
    /// As the library's configuration.
    pub fn perception(&self) -> PerceptionConfig {
        let mut config = PerceptionConfig::default();
        config.sift.keypoints_max = self.features.keypoints_max;
        config.ratio_max = self.matcher.ratio_max;
        config.gates.n_inliers_min = self.gates.n_inliers_min;
        // An untouched default keeps its bits: degrees would move the last one.
        if self.gates.error_deg_max != config.gates.error_rad_max.to_degrees() {
            config.gates.error_rad_max = self.gates.error_deg_max.to_radians();
        }
        config.threads = (self.threads > 0).then_some(self.threads);
        config
    }

    /// The features it names.
    pub fn choice(&self) -> Result<FeatureChoice, ChoiceError> {
        choice(&self.features, &self.matcher, &self.runtime)
    }
}
