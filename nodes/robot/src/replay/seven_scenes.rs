//! The layout of Microsoft 7-Scenes (Shotton et al., CVPR 2013): frame-NNNNNN.{color.jpg|color.png, depth.png, pose.txt}
//! in one folder, optionally camera-intrinsics.txt.
//!
//! Depth was taken by a second lens and is NOT registered to the colour. Both are treated as one camera with the depth
//! camera's intrinsics (f = 585, c = (320, 240) at 640x480), as is usual with this set; the colour lens's focal length is
//! nearer 525, which is part of the errors measured on it. [`super::Recording::with_rig`] takes the difference out.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use homing_core::Intrinsics;

use super::error::RecordingError;
use super::pose::{numbers, pose, read_text};
use super::recording::Entry;

/// True if the folder holds frames of this layout.
pub(super) fn is_here(names: &[String]) -> bool {
    names.iter().any(|name| colour_number(name).is_some())
}

/// Size and intrinsics of the depth camera.
pub(super) fn intrinsics(directory: &Path) -> Result<Intrinsics, RecordingError> {
    let file = directory.join("camera-intrinsics.txt");
    let bad = |what: String| RecordingError::Intrinsics { file: file.clone(), what };
    let (fx, fy, cx, cy) = if file.exists() {
        let text = read_text(&file)?;
        let mut rows = [[0.0; 3]; 2];
        let lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
        let mut found = 0;
        for (row, (i, line)) in rows.iter_mut().zip(lines) {
            *row = numbers::<3>(&file, i + 1, line)?;
            found += 1;
        }
        if found < 2 {
            return Err(bad("expected the three rows of the camera matrix".into()));
        }
        (rows[0][0], rows[1][1], rows[0][2], rows[1][2])
    } else {
        (585.0, 585.0, 320.0, 240.0)
    };
    Intrinsics::new(640, 480, fx, fy, cx, cy).map_err(|e| bad(e.to_string()))
}

/// Every frame of the folder, complete.
pub(super) fn entries(directory: &Path, names: &[String]) -> Result<BTreeMap<u32, Entry>, RecordingError> {
    let mut entries = BTreeMap::new();
    for name in names {
        if let Some(number) = colour_number(name) {
            let stem = name.split('.').next().unwrap_or(name);
            let depth = required(number, directory.join(format!("{stem}.depth.png")))?;
            let pose_file = required(number, directory.join(format!("{stem}.pose.txt")))?;
            let t_world_camera = read_pose(&pose_file)?;
            entries.insert(number, Entry { colour: directory.join(name), depth, t_world_camera });
        }
    }
    for name in names {
        if let Some(number) = number_of(name, &[".depth.png"])
            && !entries.contains_key(&number)
        {
            let file = directory.join(name.replace(".depth.png", ".color.jpg"));
            return Err(RecordingError::MissingFile { number, file });
        }
    }
    Ok(entries)
}

fn colour_number(name: &str) -> Option<u32> {
    number_of(name, &[".color.jpg", ".color.png"])
}

fn number_of(name: &str, endings: &[&str]) -> Option<u32> {
    let rest = name.strip_prefix("frame-")?;
    endings.iter().find_map(|ending| rest.strip_suffix(ending))?.parse().ok()
}

fn required(number: u32, file: PathBuf) -> Result<PathBuf, RecordingError> {
    if file.is_file() { Ok(file) } else { Err(RecordingError::MissingFile { number, file }) }
}

fn read_pose(
    file: &Path,
) -> Result<homing_core::Transform<super::recording::World, homing_core::Camera>, RecordingError> {
    let text = read_text(file)?;
    let lines: Vec<(usize, &str)> =
        text.lines().enumerate().map(|(i, line)| (i + 1, line)).filter(|(_, line)| !line.trim().is_empty()).collect();
    match lines.as_slice() {
        [a, b, c, d] => pose(file, [*a, *b, *c, *d]),
        other => Err(RecordingError::malformed(file, other.len(), format!("expected 4 rows, found {}", other.len()))),
    }
}
