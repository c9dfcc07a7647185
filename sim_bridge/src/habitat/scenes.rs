//! Which of our scenes an episode takes place in.

use std::path::{Path, PathBuf};

use thiserror::Error;

use crate::arena::SceneRef;

/// A map serves episodes whose start is at most this far from its floor, metres.
pub(super) const MAP_FLOOR_M: f64 = 0.1;
/// Before the number of a flat in a scene's name.
const FLAT: &str = "flat_";

/// No scene of that name.
#[derive(Debug, Error)]
pub enum SceneMissing {
    /// Neither a file nor a map.
    #[error(
        "the scenes folder {} has neither {name}.glb nor a map {name}_FLOOR.png within {MAP_FLOOR_M} m of the floor at {floor_y_m:.2} m",
        folder.display()
    )]
    NotThere {
        /// The folder that was searched.
        folder: PathBuf,
        /// The scene's name.
        name: String,
        /// Height of the episode's start, Habitat's frame, metres.
        floor_y_m: f64,
    },
    /// The folder cannot be read.
    #[error("cannot read the scenes folder {}: {source}", folder.display())]
    Folder {
        /// The folder.
        folder: PathBuf,
        /// Why not.
        source: std::io::Error,
    },
}

/// The name of a scene without folders and endings.
pub(super) fn stem(scene_id: &str) -> &str {
    let name = scene_id.rsplit(['/', '\\']).next().unwrap_or(scene_id);
    let name = name.strip_suffix(".glb").or_else(|| name.strip_suffix(".gltf")).unwrap_or(name);
    name.strip_suffix(".basis").unwrap_or(name)
}

/// The name by which episode files know a scene.
#[must_use]
pub fn scene_name(scene: &SceneRef) -> String {
    let of = |path: &Path| path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    match scene {
        SceneRef::Flat { seed } => format!("{FLAT}{seed}"),
        SceneRef::Glb { path } => stem(&of(path)).to_owned(),
        SceneRef::Layout { map } => {
            let name = of(map);
            let name = name.strip_suffix(".png").unwrap_or(&name);
            split_floor(name).map_or(name, |(scene, _)| scene).to_owned()
        }
    }
}

/// The scene's name and the floor's height of a map called `NAME_HEIGHT`.
fn split_floor(name: &str) -> Option<(&str, f64)> {
    let (scene, height) = name.rsplit_once('_')?;
    Some((scene, height.parse().ok()?))
}

/// Finds the scene of an episode that starts at a height (Habitat's frame, metres): a generated flat by its number, a
/// glTF file in the folder (at the id's own path or at its name alone), else the map of the nearest floor.
///
/// # Errors
/// [`SceneMissing`] naming the folder and what was looked for.
pub fn find_scene(folder: &Path, scene_id: &str, floor_y_m: f64) -> Result<SceneRef, SceneMissing> {
    let name = stem(scene_id);
    if let Some(seed) = name.strip_prefix(FLAT).and_then(|n| n.parse().ok()) {
        return Ok(SceneRef::Flat { seed });
    }
    let within = Path::new(scene_id).is_relative() && !scene_id.contains("..");
    let whole = within.then(|| folder.join(scene_id)).into_iter();
    let endings = [".glb", ".basis.glb", ".gltf"].map(|ending| folder.join(format!("{name}{ending}")));
    if let Some(path) = whole.chain(endings).find(|p| p.is_file()) {
        return Ok(SceneRef::Glb { path });
    }
    let unread = |source| SceneMissing::Folder { folder: folder.into(), source };
    let mut maps = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(unread)? {
        let path = entry.map_err(unread)?.path();
        let file = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        if let Some((scene, height)) = file.strip_suffix(".png").and_then(split_floor)
            && scene == name
        {
            maps.push(((height - floor_y_m).abs(), path));
        }
    }
    maps.sort_by(|a, b| a.0.total_cmp(&b.0).then_with(|| a.1.cmp(&b.1)));
    match maps.into_iter().next() {
        Some((far, map)) if far <= MAP_FLOOR_M => Ok(SceneRef::Layout { map }),
        _ => Err(SceneMissing::NotThere { folder: folder.into(), name: name.into(), floor_y_m }),
    }
}
