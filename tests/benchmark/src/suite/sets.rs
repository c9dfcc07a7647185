//! The sets of episodes: NRNS's folds on generated flats, and scenes with episode files of their own.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use homing_sim::arena::{Arena, BodySize, SceneRef};
use homing_sim::episode::{Episode, Level, Viewpoint};
use homing_sim::flat::Detail;
use homing_sim::flat::mapped::{AGENT_HEIGHT_M, AGENT_RADIUS_M};
use homing_sim::folds::{Fold, Task as FoldTask, free_viewpoint};
use homing_sim::habitat::{EpisodeFile, HabitatError, find_scene, place};
use thiserror::Error;

use crate::RunError;

/// Habitat's agent: what episode files are made for.
pub const HABITAT_AGENT: BodySize = BodySize { radius_m: AGENT_RADIUS_M, height_m: AGENT_HEIGHT_M };

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
    /// Drawn in a generated flat.
    Drawn {
        /// Its kind.
        fold: Fold,
        /// Its number in the fold.
        task: FoldTask,
        /// What takes the photo.
        camera: Viewpoint,
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
            EpisodeSource::Drawn { fold, task, camera } => Ok(fold.draw(arena, *task, *camera)?),
            EpisodeSource::Given(episode) => Ok((**episode).clone()),
        }
    }
}

/// What takes the photos of a set.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Photographer {
    /// The robot's own camera.
    Robot,
    /// A person: another height, tilt, field of view and size for every photo (IGL-Nav's free-view goals).
    Person,
}

/// The first `n` episodes of a fold, in turn from each of its flats.
#[must_use]
pub fn flats(fold: Fold, n: usize, photographer: Photographer) -> Vec<EpisodeRef> {
    let level = fold.level;
    let episode = |(k, task): (usize, FoldTask)| EpisodeRef {
        scene: SceneRef::Flat { seed: task.flat },
        body: BodySize::default(),
        id: format!("{}-{k}", level.name()),
        level,
        source: EpisodeSource::Drawn {
            fold,
            task,
            camera: match photographer {
                Photographer::Robot => Viewpoint::default(),
                Photographer::Person => free_viewpoint(task.episode),
            },
        },
    };
    fold.tasks(n as u64).enumerate().map(episode).collect()
}

/// Why a set cannot be used at all.
#[derive(Debug, Error)]
pub enum SetError {
    /// An episode file cannot be read.
    #[error(transparent)]
    File(#[from] HabitatError),
    /// The folder cannot be read.
    #[error("cannot read the folder {}: {source}", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// There is nothing to run in it.
    #[error("{} holds no episode that can be run: {why}", path.display())]
    Empty {
        /// The folder.
        path: PathBuf,
        /// What was refused.
        why: String,
    },
}

/// Episodes read from files, and what was refused of them, by reason.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FileSet {
    /// Those that can be run, in the order of the files.
    pub episodes: Vec<EpisodeRef>,
    /// How many could not, by reason.
    pub refused: BTreeMap<String, usize>,
}

/// All episodes of the `*.json` and `*.json.gz` files in a folder: Habitat's ImageNav and InstanceImageNav, or NRNS's. Their
/// scenes lie in `scenes`: .glb files, or navigability maps. What takes place nowhere there is counted and left out.
///
/// # Errors
/// [`SetError`] for a file that is no episode file, and a folder without any episode that can be run.
pub fn from_files(folder: &Path, scenes: &Path) -> Result<FileSet, SetError> {
    let listing = std::fs::read_dir(folder).map_err(|source| SetError::Folder { path: folder.to_owned(), source })?;
    let mut files: Vec<PathBuf> = listing.filter_map(|entry| entry.ok().map(|e| e.path())).collect();
    files.retain(|p| p.to_string_lossy().ends_with(".json.gz") || p.extension().is_some_and(|e| e == "json"));
    files.sort();
    let mut set = FileSet::default();
    let mut arenas: Vec<Arena> = Vec::new();
    for file in &files {
        let stem = file.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let stem = stem.split('.').next().unwrap_or_default().to_owned();
        for raw in EpisodeFile::read(file)? {
            let mut refuse = |reason: String| *set.refused.entry(reason).or_default() += 1;
            let scene = match find_scene(scenes, &raw.scene_id, raw.start_position[1]) {
                Ok(scene) => scene,
                Err(missing) => {
                    refuse(missing.to_string());
                    continue;
                }
            };
            let known = arenas.iter().position(|a| *a.scene_ref() == scene);
            let index = match known {
                Some(index) => index,
                None => match Arena::load_as(&scene, HABITAT_AGENT, Detail::Shape) {
                    Ok(arena) => {
                        arenas.push(arena);
                        arenas.len() - 1
                    }
                    Err(error) => {
                        refuse(error.to_string());
                        continue;
                    }
                },
            };
            match place(&raw, &arenas[index]) {
                Ok(episode) => set.episodes.push(EpisodeRef {
                    scene,
                    body: HABITAT_AGENT,
                    id: format!("{stem}-{}", raw.id),
                    level: Level::of(episode.shortest_path_m),
                    source: EpisodeSource::Given(Box::new(episode)),
                }),
                Err(refusal) => refuse(refusal.reason().to_owned()),
            }
        }
    }
    if set.episodes.is_empty() {
        let reasons = set.refused.iter().map(|(reason, n)| format!("{n} times {reason}")).collect::<Vec<_>>();
        let why = if files.is_empty() { "no *.json or *.json.gz in it".to_owned() } else { reasons.join("; ") };
        return Err(SetError::Empty { path: folder.to_owned(), why });
    }
    Ok(set)
}

/// At most `n` episodes of each scene and level, evenly out of all.
#[must_use]
pub fn thinned(episodes: &[EpisodeRef], n: usize) -> Vec<EpisodeRef> {
    let mut by_cell: Vec<((&SceneRef, Level), Vec<&EpisodeRef>)> = Vec::new();
    for episode in episodes {
        let key = (&episode.scene, episode.level);
        match by_cell.iter_mut().find(|(k, _)| *k == key) {
            Some((_, cell)) => cell.push(episode),
            None => by_cell.push((key, vec![episode])),
        }
    }
    let pick = |cell: &[&EpisodeRef], k: usize| cell[k * cell.len() / n.min(cell.len())].clone();
    by_cell.iter().flat_map(|(_, cell)| (0..n.min(cell.len())).map(move |k| pick(cell, k))).collect()
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test may fail by panicking")]
mod tests {
    use homing_sim::episode::Shape;
    use homing_sim::folds::Split;

    use super::*;

    #[test]
    fn a_folder_without_episodes_says_so() {
        let folder = tempfile::tempdir().unwrap();
        let refused = from_files(folder.path(), folder.path()).err().unwrap().to_string();
        assert!(refused.contains("no *.json"), "{refused}");
        std::fs::write(
            folder.path().join("a.json"),
            r#"[{"episode_id": 1, "scene_id": "Nowhere.glb", "start_position": [0, 0, 0],
                "start_rotation": [0, 0, 0, 1], "goals": [{"position": [1, 0, 0]}],
                "info": {"geodesic_distance": 1.0}}]"#,
        )
        .unwrap();
        let refused = from_files(folder.path(), folder.path()).err().unwrap().to_string();
        assert!(refused.contains("Nowhere"), "{refused}");
        std::fs::write(folder.path().join("a.json"), "{").unwrap();
        let refused = from_files(folder.path(), folder.path()).err().unwrap().to_string();
        assert!(refused.contains("a.json"), "{refused}");
    }

    fn curved(level: Level) -> Fold {
        Fold { split: Split::Test, shape: Shape::Curved, level }
    }

    #[test]
    fn thinning_takes_evenly_from_every_scene_and_level() {
        let all: Vec<EpisodeRef> =
            Level::ALL[..3].iter().flat_map(|l| flats(curved(*l), 56, Photographer::Robot)).collect();
        let some = thinned(&all, 2);
        assert_eq!(some.len(), 3 * 14 * 2);
        let of_one = some.iter().filter(|e| e.level == Level::Hard && e.scene == all[0].scene);
        assert_eq!(of_one.map(|e| e.id.as_str()).collect::<Vec<_>>(), ["hard-0", "hard-28"]);
        assert_eq!(thinned(&all, 1000).len(), all.len());
    }
}
