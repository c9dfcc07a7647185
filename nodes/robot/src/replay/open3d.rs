//! The layout of Open3D's reconstruction system (and of ICL-NUIM sequences packed for it): image/NNNNN.jpg|png,
//! depth/NNNNN.png, trajectory.log (an index line and a 4x4 camera-to-world matrix per frame), and
//! camera_primesense.json or intrinsic.json, whose matrix is stored column by column.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use homing_core::{Camera, Intrinsics, Transform};
use serde::Deserialize;

use super::error::RecordingError;
use super::pose::{pose, read_text};
use super::recording::{Entry, World, list};

#[derive(Deserialize)]
struct CameraFile {
    width: u32,
    height: u32,
    intrinsic_matrix: [f64; 9],
}

/// True if the folder holds this layout.
pub(super) fn is_here(directory: &Path) -> bool {
    directory.join("trajectory.log").is_file() && directory.join("depth").is_dir() && colour_folder(directory).is_some()
}

/// Size and intrinsics of the camera; a PrimeSense's (f = 525, c = (319.5, 239.5) at 640x480) where no file says.
pub(super) fn intrinsics(directory: &Path) -> Result<Intrinsics, RecordingError> {
    let candidates = ["camera_primesense.json", "intrinsic.json"].map(|name| directory.join(name));
    let Some(file) = candidates.iter().find(|file| file.is_file()) else {
        return Intrinsics::new(640, 480, 525.0, 525.0, 319.5, 239.5)
            .map_err(|e| RecordingError::Intrinsics { file: directory.to_owned(), what: e.to_string() });
    };
    let bad = |what: String| RecordingError::Intrinsics { file: file.clone(), what };
    let camera: CameraFile = serde_json::from_str(&read_text(file)?).map_err(|e| bad(e.to_string()))?;
    let k = camera.intrinsic_matrix;
    Intrinsics::new(camera.width, camera.height, k[0], k[4], k[6], k[7]).map_err(|e| bad(e.to_string()))
}

/// Every frame of the folder, complete.
pub(super) fn entries(directory: &Path) -> Result<BTreeMap<u32, Entry>, RecordingError> {
    let log = directory.join("trajectory.log");
    let poses = trajectory(&log)?;
    let depths = numbered(&directory.join("depth"))?;
    let colour_folder = colour_folder(directory).unwrap_or_else(|| directory.join("image"));
    let colours = numbered(&colour_folder)?;
    if let Some((&number, depth)) = depths.iter().find(|(number, _)| !colours.contains_key(number)) {
        let name = depth.file_stem().unwrap_or_default().to_string_lossy();
        return Err(RecordingError::MissingFile { number, file: colour_folder.join(format!("{name}.jpg")) });
    }
    let mut entries = BTreeMap::new();
    for (number, colour) in colours {
        let Some(depth) = depths.get(&number).cloned() else {
            let name = colour.file_stem().unwrap_or_default().to_string_lossy();
            return Err(RecordingError::MissingFile { number, file: directory.join(format!("depth/{name}.png")) });
        };
        let Some(&t_world_camera) = poses.get(&number) else {
            return Err(RecordingError::MissingPose { number, file: log });
        };
        entries.insert(number, Entry { colour, depth, t_world_camera });
    }
    Ok(entries)
}

fn colour_folder(directory: &Path) -> Option<PathBuf> {
    ["image", "color"].iter().map(|name| directory.join(name)).find(|folder| folder.is_dir())
}

// Files named by a number, by that number.
fn numbered(folder: &Path) -> Result<BTreeMap<u32, PathBuf>, RecordingError> {
    let number = |name: &String| name.rsplit_once('.').and_then(|(stem, _)| stem.parse::<u32>().ok());
    Ok(list(folder)?.iter().filter_map(|name| Some((number(name)?, folder.join(name)))).collect())
}

// Five lines a frame: its number (and two more that are not needed), then the matrix.
fn trajectory(file: &Path) -> Result<BTreeMap<u32, Transform<World, Camera>>, RecordingError> {
    let text = read_text(file)?;
    let lines: Vec<(usize, &str)> =
        text.lines().enumerate().map(|(i, line)| (i + 1, line)).filter(|(_, line)| !line.trim().is_empty()).collect();
    let mut poses = BTreeMap::new();
    for block in lines.chunks(5) {
        let &[(line, index), a, b, c, d] = block else {
            return Err(RecordingError::malformed(file, block[0].0, "the last entry is cut short"));
        };
        let number = index.split_whitespace().next().and_then(|word| word.parse().ok());
        let number =
            number.ok_or_else(|| RecordingError::malformed(file, line, format!("'{index}' is not an index line")))?;
        poses.insert(number, pose(file, [a, b, c, d])?);
    }
    Ok(poses)
}
