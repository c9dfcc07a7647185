//! Reads folders of RGB-D frames: 7-Scenes style (frame-XXXXXX.color.*, .depth.png).

use std::error::Error;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use homing_core::{DepthImage, GoalPhoto, Intrinsics, RgbImage, RgbdFrame, Stamp};
use opencv::core::Mat;
use opencv::prelude::*;
use opencv::{imgcodecs, imgproc};

pub type Fallible<T> = Result<T, Box<dyn Error>>;

/// One frame of a folder.
pub struct NumberedFrame {
    pub number: u64,
    pub frame: RgbdFrame,
}

impl NumberedFrame {
    pub fn as_goal(&self) -> GoalPhoto {
        GoalPhoto { id: self.number, rgb: Arc::clone(&self.frame.rgb), intrinsics: self.frame.intrinsics }
    }
}

/// All frames of a 7-Scenes folder, in order. The colour files end in jpg or png.
pub fn seven_scenes(folder: &Path) -> Fallible<Vec<NumberedFrame>> {
    let intrinsics = Intrinsics::new(640, 480, 585.0, 585.0, 320.0, 240.0)?;
    let mut frames = Vec::new();
    for color in files_with(folder, ".color.")? {
        let name = color.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let stem = name.split('.').next().unwrap_or_default().to_owned();
        let number: u64 = stem.trim_start_matches("frame-").parse()?;
        let depth = read_depth(&folder.join(format!("{stem}.depth.png")))?;
        let rgb = Arc::new(read_rgb(&color)?);
        let frame = RgbdFrame::new(Stamp(number * 33_000_000), rgb, Arc::new(depth), intrinsics)?;
        frames.push(NumberedFrame { number, frame });
    }
    Ok(frames)
}

/// Paths in the folder whose name contains `part`, sorted.
pub fn files_with(folder: &Path, part: &str) -> Fallible<Vec<PathBuf>> {
    let entries = std::fs::read_dir(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let mut paths = entries.map(|entry| entry.map(|e| e.path())).collect::<Result<Vec<_>, _>>()?;
    paths.retain(|path| path.file_name().is_some_and(|n| n.to_string_lossy().contains(part)));
    paths.sort();
    Ok(paths)
}

pub fn read_rgb(path: &Path) -> Fallible<RgbImage> {
    let bgr = imgcodecs::imread(path, imgcodecs::IMREAD_COLOR)?;
    let mut rgb = Mat::default();
    imgproc::cvt_color_def(&bgr, &mut rgb, imgproc::COLOR_BGR2RGB)?;
    Ok(RgbImage::new(u32::try_from(rgb.cols())?, u32::try_from(rgb.rows())?, rgb.data_bytes()?.to_vec())?)
}

pub fn read_depth(path: &Path) -> Fallible<DepthImage> {
    let mm = imgcodecs::imread(path, imgcodecs::IMREAD_UNCHANGED)?;
    Ok(DepthImage::from_millimetres(u32::try_from(mm.cols())?, u32::try_from(mm.rows())?, mm.data_typed::<u16>()?)?)
}
