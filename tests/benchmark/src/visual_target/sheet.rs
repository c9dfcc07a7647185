//! A sheet of pictures: start view, target view and final view of some pairs, side by side.

use homing_core::RgbImage;
use homing_sim::arena::{Arena, BodySize, SceneRef};
use homing_sim::episode::Viewpoint;

use super::pairs::{TargetPair, view};
use super::run::PairRun;
use crate::RunError;

/// Columns of one picture on the sheet.
const WIDTH: u32 = 400;
/// Between pictures, pixels.
const GAP: u32 = 6;
/// White.
const PAPER: u8 = 255;

/// One row for each pair with its run: what was seen at the start, the target, and what was seen at the end.
///
/// # Errors
/// [`RunError`] for a flat or camera that cannot be.
pub fn contact_sheet(rows: &[(&TargetPair, &PairRun)], camera: &Viewpoint) -> Result<RgbImage, RunError> {
    let small = Viewpoint { width: WIDTH, height: WIDTH * camera.height / camera.width, ..*camera };
    let (w, h) = (WIDTH as usize, small.height as usize);
    let gap = GAP as usize;
    let (width, height) = (3 * w + 2 * gap, (rows.len() * (h + gap)).saturating_sub(gap).max(1));
    let mut data = vec![PAPER; 3 * width * height];
    for (row, (pair, run)) in rows.iter().enumerate() {
        let arena = Arena::load(&SceneRef::Flat { seed: pair.flat }, BodySize::default())?;
        for (column, at) in [pair.start, pair.target, run.end].into_iter().enumerate() {
            let picture = view(&arena, &small, at)?.rgb;
            for (k, line) in picture.data().chunks_exact(3 * w).enumerate() {
                let from = 3 * ((row * (h + gap) + k) * width + column * (w + gap));
                data[from..from + 3 * w].copy_from_slice(line);
            }
        }
    }
    RgbImage::new(width as u32, height as u32, data).map_err(RunError::Image)
}
