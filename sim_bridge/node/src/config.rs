//! The process's TOML file.

use std::path::PathBuf;

use homing_protocol::process::SessionSettings;
use homing_sim::body::Sliding;
use homing_sim::{BodySize, NoiseConfig, NoisePreset, SceneRef, SimConfig, Viewpoint};
use serde::Deserialize;

/// `sim.toml`.
#[derive(Clone, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// Network: the body listens.
    pub session: SessionSettings,
    /// How time passes.
    pub pace: Pace,
    /// An episode file (JSON); it names its scene. Without one, the scene below and an episode drawn from its seed.
    pub episode: Option<PathBuf>,
    /// Seed of a generated flat.
    pub seed: u64,
    /// A glTF scene instead of a generated flat.
    pub glb: Option<PathBuf>,
    /// Radius of the robot, metres.
    pub radius_m: f64,
    /// What is noisy, by name.
    pub noise: NoisePreset,
    /// Combined with the episode's seed: another trial of the same episode.
    pub noise_seed: u64,
    /// A table of 80 x 80 x 5 factors (.npy) by which noisy depth is distorted, as Redwood's.
    pub depth_distortion: Option<PathBuf>,
    /// What happens at an obstacle.
    pub sliding: Sliding,
    /// Frames per second in real time.
    pub frame_rate_hz: f64,
}

/// How time passes.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Pace {
    /// One action, one observation: the same whatever the load.
    #[default]
    Lockstep,
    /// By the wall clock.
    RealTime,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            session: SessionSettings::default(),
            pace: Pace::default(),
            episode: None,
            seed: 0,
            glb: None,
            radius_m: BodySize::default().radius_m,
            noise: NoisePreset::default(),
            noise_seed: 0,
            depth_distortion: None,
            sliding: Sliding::default(),
            frame_rate_hz: 10.0,
        }
    }
}

impl Config {
    /// The scene, when no episode names it.
    pub fn scene(&self) -> SceneRef {
        match &self.glb {
            Some(path) => SceneRef::Glb { path: path.clone() },
            None => SceneRef::Flat { seed: self.seed },
        }
    }

    /// How large the robot is.
    pub fn body(&self) -> BodySize {
        BodySize { radius_m: self.radius_m, ..BodySize::default() }
    }

    /// The robot.
    pub fn robot(&self) -> SimConfig {
        let noise = NoiseConfig { seed: self.noise_seed, ..self.noise.config() };
        SimConfig { sliding: self.sliding, noise, ..SimConfig::default() }
    }

    /// The camera that takes goal photos of drawn episodes.
    pub fn camera(&self) -> Viewpoint {
        Viewpoint::default()
    }
}
