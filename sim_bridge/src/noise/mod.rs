//! Noise of the simulated robot's wheels, odometry, depth and colour. All of it is off by default, and then nothing changes by
//! a bit; all of it is drawn from the episode's seed, so that an episode has the same noise whenever it is played.

pub mod ans;
pub mod camera;
pub mod depth;
pub mod gmm;
pub mod motion;
pub mod npy;
mod pixel;
mod preset;

use std::sync::Arc;

use homing_core::{DepthImage, ImageError, Intrinsics, RgbImage, Stamp};
use serde::{Deserialize, Serialize};
use thiserror::Error;

pub use camera::{CameraError, CameraNoise};
pub use depth::{DepthNoise, Distortion, DistortionError};
pub use motion::{Command, MotionNoise};
pub use preset::{NoisePreset, UnknownNoise};

/// Noise of the odometry.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PoseNoise {
    /// It is exact.
    #[default]
    Off,
    /// Active Neural SLAM's sensor mixtures, in proportion to what was commanded, accumulated over the episode: it drifts.
    Ans,
    /// As NRNS's and SLING's code has it: the same mixtures, but the error of the heading is lost and each step begins at
    /// the true pose. So it never drifts. For comparisons with their figures alone.
    NrnsPublished,
}

/// Noise of the wheels.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ActuationNoise {
    /// The robot moves as commanded.
    #[default]
    Off,
    /// Active Neural SLAM's actuation mixtures: their error about the motion meant, in proportion to what was commanded.
    Ans,
    /// The same as published: whatever was commanded, a step is one of about 0.25 m, a turn one of about 11 degrees.
    AnsRaw,
}

/// What is noisy, and how much.
#[derive(Copy, Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct NoiseConfig {
    /// Combined with the episode's seed: another one is another trial of the same episode.
    pub seed: u64,
    /// The odometry.
    pub pose: PoseNoise,
    /// The wheels.
    pub actuation: ActuationNoise,
    /// Depth images.
    pub depth: Option<DepthNoise>,
    /// Colour images.
    pub camera: Option<CameraNoise>,
}

impl NoiseConfig {
    /// A [`NoisePreset`] by its name: `off`, `pose`, `pose-depth`, `all`, `published`, `published-depth`.
    ///
    /// # Errors
    /// [`UnknownNoise`], which lists the names.
    pub fn named(name: &str) -> Result<Self, UnknownNoise> {
        name.parse::<NoisePreset>().map(NoisePreset::config)
    }
}

/// Why an image could not be made noisy.
#[derive(Debug, Error)]
pub enum NoiseError {
    /// Colour.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// Depth.
    #[error(transparent)]
    Depth(#[from] ImageError),
}

/// The noise of one robot.
#[derive(Clone, Debug)]
pub struct Noise {
    config: NoiseConfig,
    distortion: Option<Arc<Distortion>>,
    seed: u64,
    /// Of wheels and odometry.
    pub motion: MotionNoise,
}

/// Tell apart what the images of one moment draw.
const DEPTH_SALT: u64 = 0x6465_7074_685f_7365;
const COLOUR_SALT: u64 = 0x636f_6c6f_7572_5f73;

impl Noise {
    /// As for an episode of seed 0.
    #[must_use]
    pub fn new(config: NoiseConfig) -> Self {
        let motion = MotionNoise::new(config.pose, config.actuation);
        let mut noise = Self { config, distortion: None, seed: 0, motion };
        noise.reset(0);
        noise
    }

    /// Gives depth the distortion of a real camera; used only where depth is noisy.
    pub fn set_distortion(&mut self, distortion: Arc<Distortion>) {
        self.distortion = Some(distortion);
    }

    /// An episode begins.
    pub fn reset(&mut self, episode_seed: u64) {
        self.seed = episode_seed ^ self.config.seed;
        self.motion.reset(self.seed);
    }

    /// What the camera makes of colour and depth at one moment, after a turn at some rate. It depends on the moment and
    /// not on how often somebody looked.
    ///
    /// # Errors
    /// [`NoiseError`] when an image does not survive.
    pub fn images(
        &self,
        (rgb, depth): (RgbImage, DepthImage),
        camera: &Intrinsics,
        turn_rad_s: f64,
        now: Stamp,
    ) -> Result<(RgbImage, DepthImage), NoiseError> {
        let seed = |salt: u64| pixel::mix(pixel::mix(self.seed ^ salt) ^ now.0);
        let rgb = match &self.config.camera {
            Some(noise) => camera::expose(&rgb, noise, camera, turn_rad_s, seed(COLOUR_SALT))?,
            None => rgb,
        };
        let depth = match &self.config.depth {
            Some(noise) => depth::redwood(&depth, noise, self.distortion.as_deref(), seed(DEPTH_SALT))?,
            None => depth,
        };
        Ok((rgb, depth))
    }
}
