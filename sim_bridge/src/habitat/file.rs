//! Habitat's episode files: JSON, plain or compressed by gzip.

use std::collections::BTreeMap;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

use flate2::Compression;
use flate2::read::MultiGzDecoder;
use flate2::write::GzEncoder;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use thiserror::Error;

use super::instance::{self, Instance};
use super::raw::{EpisodeId, Own, RawEpisode, RawGoal};

/// Largest text read, bytes: a published set is at most a tenth of it.
const TEXT_BYTES_MAX: u64 = 1 << 29;

/// Why a file holds no episodes.
#[derive(Debug, Error)]
pub enum HabitatError {
    /// The file cannot be read, or its compressed data are broken or end too early.
    #[error("cannot read the episodes in {}: {source}", path.display())]
    Read {
        /// Which file.
        path: PathBuf,
        /// Why not.
        source: std::io::Error,
    },
    /// The file cannot be written.
    #[error("cannot write episodes to {}: {source}", path.display())]
    Write {
        /// Which file.
        path: PathBuf,
        /// Why not.
        source: std::io::Error,
    },
    /// More text than any published set has.
    #[error("{} unpacks to more than {TEXT_BYTES_MAX} bytes: no set of episodes is so large", path.display())]
    TooLarge {
        /// Which file.
        path: PathBuf,
    },
    /// Not JSON.
    #[error("{} is not JSON: {source}", path.display())]
    NotJson {
        /// Which file.
        path: PathBuf,
        /// What the parser found.
        source: serde_json::Error,
    },
    /// JSON of another kind or version.
    #[error("{} is no file of ImageNav, NRNS or InstanceImageNav v3 episodes: {what}", path.display())]
    NotEpisodes {
        /// Which file.
        path: PathBuf,
        /// What is missing or strange.
        what: String,
    },
    /// One episode lacks something.
    #[error("episode {index} (from 0) of {} cannot be used: {what}", path.display())]
    Episode {
        /// Which file.
        path: PathBuf,
        /// Its place in the file.
        index: usize,
        /// What is missing or strange.
        what: String,
    },
}

/// Files of episodes, `.json` or `.json.gz`.
#[derive(Copy, Clone, Debug)]
pub struct EpisodeFile;

impl EpisodeFile {
    /// Reads a file of ImageNav or PointNav episodes (a JSON list, or an object with `episodes`), of NRNS episodes, or
    /// of InstanceImageNav v3. Whether a file is compressed is told by its first bytes.
    ///
    /// # Errors
    /// [`HabitatError`] naming the file, and the episode where one is at fault.
    pub fn read(path: &Path) -> Result<Vec<RawEpisode>, HabitatError> {
        let text = unpacked(path)?;
        let json =
            serde_json::from_slice(&text).map_err(|source| HabitatError::NotJson { path: path.into(), source })?;
        let strange = |what: &str| HabitatError::NotEpisodes { path: path.into(), what: what.into() };
        let (episodes, goals) = match json {
            Value::Array(episodes) => (episodes, None),
            Value::Object(mut fields) => match (fields.remove("episodes"), fields.remove("goals")) {
                (Some(Value::Array(episodes)), goals) => (episodes, goals),
                _ if fields.contains_key("goals_by_category") => return Err(strange("these are ObjectNav episodes")),
                _ => return Err(strange("it has no list named episodes")),
            },
            _ => return Err(strange("neither a list nor an object")),
        };
        let instances = match goals {
            Some(Value::Object(goals)) => instance::read_all(goals).map_err(|what| strange(&what))?,
            _ => BTreeMap::new(),
        };
        let one = |(index, value)| {
            read_one(value, &instances).map_err(|what| HabitatError::Episode { path: path.into(), index, what })
        };
        episodes.into_iter().enumerate().map(one).collect()
    }

    /// Writes episodes in the format of ImageNav, an object with `episodes`; compressed if the name ends in `.gz`.
    /// Goals have a `rotation`, and `info` keeps under `homing` what Habitat's format has no place for.
    ///
    /// # Errors
    /// [`HabitatError::Write`] naming the file.
    pub fn write(path: &Path, episodes: &[RawEpisode]) -> Result<(), HabitatError> {
        let failed = |source| HabitatError::Write { path: path.into(), source };
        let file = FileOut { episodes: episodes.iter().map(EpisodeOut::of).collect() };
        let text = serde_json::to_vec(&file).map_err(|e| failed(e.into()))?;
        let bytes = if path.extension().is_some_and(|e| e == "gz") {
            let mut packer = GzEncoder::new(Vec::new(), Compression::default());
            packer.write_all(&text).and_then(|()| packer.finish()).map_err(failed)?
        } else {
            text
        };
        std::fs::write(path, bytes).map_err(failed)
    }
}

fn unpacked(path: &Path) -> Result<Vec<u8>, HabitatError> {
    let failed = |source| HabitatError::Read { path: path.into(), source };
    let too_large = || HabitatError::TooLarge { path: path.into() };
    if std::fs::metadata(path).map_err(failed)?.len() > TEXT_BYTES_MAX {
        return Err(too_large());
    }
    let bytes = std::fs::read(path).map_err(failed)?;
    if !bytes.starts_with(&[0x1f, 0x8b]) {
        return Ok(bytes);
    }
    let mut text = Vec::new();
    MultiGzDecoder::new(bytes.as_slice()).take(TEXT_BYTES_MAX + 1).read_to_end(&mut text).map_err(failed)?;
    if text.len() as u64 > TEXT_BYTES_MAX { Err(too_large()) } else { Ok(text) }
}

/// What the formats have in common.
#[derive(Deserialize)]
struct EpisodeIn {
    episode_id: EpisodeId,
    scene_id: String,
    start_position: [f64; 3],
    start_rotation: [f64; 4],
    goals: Option<Vec<GoalIn>>,
    length_shortest: Option<f64>,
    info: Option<InfoIn>,
    #[serde(flatten)]
    wanted: instance::Wanted,
}

#[derive(Deserialize)]
struct GoalIn {
    position: [f64; 3],
    rotation: Option<[f64; 4]>,
}

#[derive(Deserialize)]
struct InfoIn {
    geodesic_distance: Option<f64>,
    homing: Option<Own>,
}

fn read_one(value: Value, instances: &BTreeMap<String, Instance>) -> Result<RawEpisode, String> {
    let episode: EpisodeIn = serde_json::from_value(value).map_err(|e| e.to_string())?;
    let (stated_m, own) = episode.info.map_or((None, None), |i| (i.geodesic_distance, i.homing));
    let first = episode.goals.and_then(|goals| goals.into_iter().next());
    let (goal, view_points, success_m) = match first {
        Some(goal) => (RawGoal { position: goal.position, rotation: goal.rotation, camera: None }, Vec::new(), None),
        None => {
            let (goal, view_points) = episode.wanted.goal(&episode.scene_id, instances)?;
            (goal, view_points, Some(instance::SUCCESS_M))
        }
    };
    Ok(RawEpisode {
        id: episode.episode_id,
        scene_id: episode.scene_id,
        start_position: episode.start_position,
        start_rotation: episode.start_rotation,
        goal,
        view_points,
        success_m,
        geodesic_m: stated_m.or(episode.length_shortest),
        own,
    })
}

#[derive(Serialize)]
struct FileOut<'a> {
    episodes: Vec<EpisodeOut<'a>>,
}

#[derive(Serialize)]
struct EpisodeOut<'a> {
    episode_id: &'a EpisodeId,
    scene_id: &'a str,
    start_position: [f64; 3],
    start_rotation: [f64; 4],
    info: InfoOut<'a>,
    goals: [GoalOut; 1],
    shortest_paths: Option<()>,
    start_room: Option<()>,
}

#[derive(Serialize)]
struct InfoOut<'a> {
    geodesic_distance: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    homing: Option<&'a Own>,
}

#[derive(Serialize)]
struct GoalOut {
    position: [f64; 3],
    #[serde(skip_serializing_if = "Option::is_none")]
    rotation: Option<[f64; 4]>,
    radius: Option<f64>,
}

impl<'a> EpisodeOut<'a> {
    fn of(raw: &'a RawEpisode) -> Self {
        Self {
            episode_id: &raw.id,
            scene_id: &raw.scene_id,
            start_position: raw.start_position,
            start_rotation: raw.start_rotation,
            info: InfoOut { geodesic_distance: raw.geodesic_m, homing: raw.own.as_ref() },
            goals: [GoalOut { position: raw.goal.position, rotation: raw.goal.rotation, radius: None }],
            shortest_paths: None,
            start_room: None,
        }
    }
}
