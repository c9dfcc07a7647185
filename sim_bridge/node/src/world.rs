//! The simulator with the episode it plays.

use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, bail};
use homing_core::{PlanarPose, Resettable, RobotBridge};
use homing_privileged::GroundTruth;
use homing_sim::noise::Distortion;
use homing_sim::{Arena, Episode, EpisodeSpec, Simulator, episode};

use crate::config::Config;

/// A robot in a scene, at the start of an episode.
pub struct World {
    pub simulator: Simulator,
    pub collisions: u64,
    pub done: bool,
    start: PlanarPose,
}

impl World {
    pub fn open(config: &Config) -> anyhow::Result<Self> {
        let given = config.episode.as_deref().map(read_episode).transpose()?;
        let scene = given.as_ref().map_or_else(|| config.scene(), |e| e.scene.clone());
        let arena = Arc::new(Arena::load(&scene, config.body())?);
        let episode = match given {
            Some(episode) => episode,
            None => {
                let spec = EpisodeSpec { camera: config.camera(), ..EpisodeSpec::default() };
                episode::draw(&arena, config.seed, &spec)?
            }
        };
        let mut simulator = Simulator::new(arena, config.robot()).context("the simulator's camera")?;
        if let Some(path) = &config.depth_distortion {
            simulator.set_depth_distortion(Arc::new(read_distortion(path)?));
        }
        let mut world = Self { simulator, collisions: 0, done: false, start: PlanarPose::default() };
        world.reset(&episode)?;
        Ok(world)
    }

    pub fn reset(&mut self, episode: &Episode) -> anyhow::Result<()> {
        self.simulator.reset(episode)?;
        (self.collisions, self.done) = (0, false);
        self.start = self.simulator.pose_truth();
        Ok(())
    }

    /// Resets to an episode given as JSON.
    pub fn reset_to(&mut self, json: &str) -> anyhow::Result<()> {
        self.reset(&serde_json::from_str(json).context("the episode is not valid JSON")?)
    }

    /// `steps` counts what the driver calls a step.
    pub fn truth(&self, steps: u64) -> GroundTruth {
        GroundTruth {
            stamp: self.simulator.now(),
            pose: self.simulator.pose_truth(),
            start: self.start,
            path_length_m: self.simulator.path_length_m_truth(),
            steps,
            collisions: self.collisions,
            done: self.done,
        }
    }

    /// Announces itself in the log.
    pub fn describe(&self) {
        let body = self.simulator.capabilities();
        let triangles: usize = self.simulator.arena().scene().meshes.iter().map(|m| m.triangles.len()).sum();
        tracing::info!(name = body.name, triangles, "the body is ready");
    }
}

fn read_distortion(path: &Path) -> anyhow::Result<Distortion> {
    let of = || format!("the depth distortion {}", path.display());
    let bytes = std::fs::read(path).with_context(of)?;
    Distortion::from_npy(&bytes).with_context(of)
}

fn read_episode(path: &Path) -> anyhow::Result<Episode> {
    let text = std::fs::read_to_string(path).with_context(|| format!("cannot read the episode {}", path.display()))?;
    if text.trim().is_empty() {
        bail!("the episode {} is empty", path.display());
    }
    serde_json::from_str(&text).with_context(|| format!("{} is not an episode", path.display()))
}
