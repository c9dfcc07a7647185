//! One still of a finished episode: the map with both paths beside the goal photo and the final view.

use std::io;
use std::path::{Path, PathBuf};

use homing_core::{OccupancyGrid, PlanarPose, RgbImage};
use thiserror::Error;

use crate::canvas::{Align, Canvas, Rect, Style, text_width};
use crate::encode;
use crate::palette::light;

mod plan;

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

/// Size of the picture, pixels.
const SIZE: (usize, usize) = (1600, 900);
const MAP_PANEL: Rect = Rect { x: 40.0, y: 176.0, width: 1050.0, height: 688.0 };
const GOAL_PANEL: Rect = Rect { x: 1120.0, y: 176.0, width: 440.0, height: 320.0 };
const VIEW_PANEL: Rect = Rect { x: 1120.0, y: 544.0, width: 440.0, height: 320.0 };

/// Draws an episode on 1600 x 900 pixels: headline and facts, the map with its paths, and the two views.
#[must_use]
pub fn episode_picture(episode: &EpisodePicture<'_>) -> RgbImage {
    let mut canvas = Canvas::new(SIZE.0, SIZE.1, light::GROUND);
    draw_header(&mut canvas, episode);
    plan::draw(&mut canvas, MAP_PANEL, episode);
    draw_view(&mut canvas, GOAL_PANEL, "The photo it was shown", episode.goal_photo);
    draw_view(&mut canvas, VIEW_PANEL, "What it sees at the end", episode.final_view);
    canvas.into_image()
}

/// Writes an image as PNG.
///
/// # Errors
/// [`PictureError::Write`] when the file cannot be made or written.
pub fn write_png(image: &RgbImage, path: &Path) -> Result<(), PictureError> {
    let bytes = encode::png(image).map_err(io::Error::other);
    bytes
        .and_then(|bytes| std::fs::write(path, bytes))
        .map_err(|source| PictureError::Write { path: path.to_owned(), source })
}

fn draw_header(canvas: &mut Canvas, episode: &EpisodePicture<'_>) {
    let colour = if episode.success { light::GOOD } else { light::BAD };
    canvas.line(&[(44.0, 42.0), (44.0, 112.0)], 8.0, colour);
    canvas.text((66.0, 68.0), Align::Left, Style::bold(27.0, light::TEXT), episode.title);
    let mut x = 66.0;
    for (name, value) in episode.facts {
        let width = text_width(name, 9.5).max(text_width(value, 13.0));
        if x + width > SIZE.0 as f64 - 40.0 {
            break;
        }
        canvas.text((x, 96.0), Align::Left, Style::regular(9.5, light::FAINT), name);
        canvas.text((x, 121.0), Align::Left, Style::bold(13.0, light::TEXT), value);
        x += width + 44.0;
    }
}

/// An image in a panel, as large as its proportions allow, with a caption above.
fn draw_view(canvas: &mut Canvas, panel: Rect, caption: &str, image: &RgbImage) {
    canvas.text((panel.x, panel.y - 11.0), Align::Left, Style::bold(10.5, light::TEXT), caption);
    canvas.fill(panel, light::PANEL);
    let (width, height) = (f64::from(image.width()), f64::from(image.height()));
    let scale = (panel.width / width).min(panel.height / height);
    let (width, height) = (width * scale, height * scale);
    let x = panel.x + 0.5 * (panel.width - width);
    let y = panel.y + 0.5 * (panel.height - height);
    canvas.image(Rect { x, y, width, height }, image);
}
