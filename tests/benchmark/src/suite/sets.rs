//! The sets of episodes: NRNS's folds on generated flats, and real layouts with their own episodes.

use homing_sim::arena::{Arena, BodySize, SceneRef};
use homing_sim::episode::{self, Episode, EpisodeSpec, Level, Shape};

use crate::RunError;

/// An episode that can be had when it is needed.
#[derive(Clone, Debug, PartialEq)]
pub struct EpisodeRef {
    /// Where it takes place.
    pub scene: SceneRef,
    /// The robot that the scene is made ready for.
    pub body: BodySize,
    /// Names it within its set.
    pub id: String,
    /// By the length of its shortest path.
    pub level: Level,
    /// Where it comes from.
    pub source: EpisodeSource,
}

/// Where an episode comes from.
#[derive(Clone, Debug, PartialEq)]
pub enum EpisodeSource {
    /// Drawn in the scene from a seed.
    Drawn {
        /// The seed.
        seed: u64,
        /// What is wanted.
        spec: EpisodeSpec,
    },
    /// Read from a file.
    Given(Box<Episode>),
}

impl EpisodeRef {
    /// The episode itself.
    ///
    /// # Errors
    /// [`RunError::Draw`] when the scene offers none.
    pub fn episode(&self, arena: &Arena) -> Result<Episode, RunError> {
        match &self.source {
            EpisodeSource::Drawn { seed, spec } => Ok(episode::draw(arena, *seed, spec)?),
            EpisodeSource::Given(episode) => Ok((**episode).clone()),
        }
    }
}

/// The test flats, by seed: none was ever used to train or to tune.
pub const TEST_FLATS: core::ops::Range<u64> = 300_100..300_114;

/// The first `n` episodes of a fold on the test flats, in turn from each.
#[must_use]
pub fn flats(shape: Shape, level: Level, n: usize) -> Vec<EpisodeRef> {
    let (min_m, max_m) = level.range_m();
    let spec = EpisodeSpec { min_m, max_m, shape: Some(shape), ..EpisodeSpec::default() };
    let n_flats = TEST_FLATS.end - TEST_FLATS.start;
    (0..n as u64)
        .map(|k| {
            let flat = TEST_FLATS.start + k % n_flats;
            // Seeds of different levels and rounds do not meet.
            let seed = 1_000_000 * (1 + level as u64) + 1_000 * (k / n_flats) + flat % 1_000;
            EpisodeRef {
                scene: SceneRef::Flat { seed: flat },
                body: BodySize::default(),
                id: format!("{}-{k}", level.name()),
                level,
                source: EpisodeSource::Drawn { seed, spec },
            }
        })
        .collect()
}
