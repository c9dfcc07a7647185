//! The process's TOML file.

use std::path::PathBuf;

use homing_protocol::process::SessionSettings;
use homing_sim::{SceneRef, Viewpoint};
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

    /// The camera that takes goal photos of drawn episodes.
    pub fn camera(&self) -> Viewpoint {
        Viewpoint::default()
    }
}
