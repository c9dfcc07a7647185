//! Noise by name.

use core::fmt;
use core::str::FromStr;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::{ActuationNoise, CameraNoise, DepthNoise, NoiseConfig, PoseNoise};

/// A name that no noise has.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("no noise is called {name:?}; there are {}", NoisePreset::ALL.map(NoisePreset::name).join(", "))]
pub struct UnknownNoise {
    /// The name asked for.
    pub name: String,
}

/// Kinds of noise that have a name.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum NoisePreset {
    /// None.
    #[default]
    Off,
    /// Odometry that drifts, by Active Neural SLAM's sensor mixtures.
    Pose,
    /// The same, and depth by the Redwood model.
    PoseDepth,
    /// The same, and wheels that slip and a camera that blurs.
    All,
    /// What SLING's table calls pose noise: it does not drift (see [`PoseNoise::NrnsPublished`]).
    Published,
    /// What SLING's table calls pose and depth noise.
    PublishedDepth,
}

impl NoisePreset {
    /// All of them.
    pub const ALL: [Self; 6] =
        [Self::Off, Self::Pose, Self::PoseDepth, Self::All, Self::Published, Self::PublishedDepth];

    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Off => "off",
            Self::Pose => "pose",
            Self::PoseDepth => "pose-depth",
            Self::All => "all",
            Self::Published => "published",
            Self::PublishedDepth => "published-depth",
        }
    }

    /// What it stands for, with the seed 0.
    #[must_use]
    pub fn config(self) -> NoiseConfig {
        let off = NoiseConfig::default();
        let pose = NoiseConfig { pose: PoseNoise::Ans, ..off };
        let pose_depth = NoiseConfig { depth: Some(DepthNoise::default()), ..pose };
        let published = NoiseConfig { pose: PoseNoise::NrnsPublished, ..off };
        match self {
            Self::Off => off,
            Self::Pose => pose,
            Self::PoseDepth => pose_depth,
            Self::All => {
                NoiseConfig { actuation: ActuationNoise::Ans, camera: Some(CameraNoise::default()), ..pose_depth }
            }
            Self::Published => published,
            Self::PublishedDepth => NoiseConfig { depth: Some(DepthNoise::PUBLISHED), ..published },
        }
    }
}

impl fmt::Display for NoisePreset {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for NoisePreset {
    type Err = UnknownNoise;

    fn from_str(name: &str) -> Result<Self, UnknownNoise> {
        let found = Self::ALL.into_iter().find(|preset| preset.name() == name);
        found.ok_or_else(|| UnknownNoise { name: name.to_owned() })
    }
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test may fail by panicking")]
mod tests {
    use super::*;

    #[test]
    fn every_preset_has_one_name_in_code_and_in_files() {
        for preset in NoisePreset::ALL {
            assert_eq!(preset.name().parse(), Ok(preset));
            assert_eq!(serde_json::to_string(&preset).unwrap(), format!("\"{preset}\""));
            assert_eq!(NoiseConfig::named(preset.name()), Ok(preset.config()));
        }
        assert_eq!(NoisePreset::default().config(), NoiseConfig::default());
    }

    #[test]
    fn an_unknown_name_is_answered_with_the_known_ones() {
        let refusal = NoiseConfig::named("loud").unwrap_err().to_string();
        assert!(refusal.contains("\"loud\""), "{refusal}");
        for preset in NoisePreset::ALL {
            assert!(refusal.contains(preset.name()), "{refusal} lacks {preset}");
        }
    }

    #[test]
    fn a_configuration_survives_json_and_an_unknown_key_does_not() {
        for preset in NoisePreset::ALL {
            let json = serde_json::to_string(&preset.config()).unwrap();
            assert_eq!(serde_json::from_str::<NoiseConfig>(&json).unwrap(), preset.config());
        }
        assert_eq!(serde_json::from_str::<NoiseConfig>("{}").unwrap(), NoiseConfig::default());
        for wrong in [r#"{"posse":"ans"}"#, r#"{"pose":"gps"}"#, r#"{"depth":{"multiplyer":2}}"#] {
            assert!(serde_json::from_str::<NoiseConfig>(wrong).is_err(), "{wrong} was taken");
        }
    }
}
