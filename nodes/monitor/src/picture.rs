//! One still of a finished episode: the map with both paths beside the goal photo and the final view.

use std::io;
use std::path::{Path, PathBuf};

use homing_core::{OccupancyGrid, PlanarPose, RgbImage};
use thiserror::Error;

/// What the picture shows. Everything lies in the odometry frame, metres.
#[derive(Copy, Clone, Debug)]
pub struct EpisodePicture<'a> {
    /// Headline: `Goal reached` or why not.
    pub title: &'a str,
    /// True colours the headline green, false red.
    pub success: bool,
    /// Name and value pairs below the headline, such as `("steps", "132")`. Six fit.
    pub facts: &'a [(&'a str, String)],
    /// The map at the end.
    pub map: &'a OccupancyGrid,
    /// Where the robot believed it drove.
    pub estimated_path_m: &'a [(f64, f64)],
    /// Where it really drove; empty if nobody knows.
    pub true_path_m: &'a [(f64, f64)],
    /// The shortest way there; empty if nobody knows.
    pub shortest_path_m: &'a [(f64, f64)],
    /// Where it stood at first.
    pub start: PlanarPose,
    /// Where it stands now: truth if known, else its own belief.
    pub end: PlanarPose,
    /// Where the photo was taken, if known.
    pub goal: Option<PlanarPose>,
    /// Where the robot believes that the photo was taken.
    pub goal_estimate: Option<PlanarPose>,
    /// The photo it was shown.
    pub goal_photo: &'a RgbImage,
    /// What it sees now.
    pub final_view: &'a RgbImage,
}

/// Why a picture could not be written.
#[derive(Debug, Error)]
pub enum PictureError {
    /// The file cannot be written.
    #[error("cannot write the picture {}: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
}

/// Draws an episode on 1600 x 900 pixels.
#[must_use]
pub fn episode_picture(episode: &EpisodePicture<'_>) -> RgbImage {
    todo!()
}

/// Writes an image as PNG.
///
/// # Errors
/// [`PictureError::Write`] when the file cannot be made or written.
pub fn write_png(image: &RgbImage, path: &Path) -> Result<(), PictureError> {
    todo!()
}
