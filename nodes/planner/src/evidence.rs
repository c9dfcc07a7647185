//! How much an estimate is worth: not how many matches agree, but how much of the view they bind.
//!
//! Floors and furniture repeat: dozens of matches on one patch of parquet, or on one bookcase of three, agree perfectly on a
//! pose that is metres off. They cover a small part of the image and do not cover more as the robot comes near. The goal's
//! own view does: measured with SIFT in simulated flats (640x480, 120 degrees), true estimates touch 5 to 14 of 48 image
//! cells from 2 m away, 18 to 28 within 1 m and 40 at the goal; false ones 2 to 9 anywhere.

use homing_core::{Base, Camera, DepthImage, Intrinsics, MatchedPoint, Transform};

const COLUMNS: usize = 8;
const ROWS: usize = 6;
/// Matches on the floor are left out: its pattern is the same in every room.
const FLOOR_M: f64 = 0.1;
/// Matches that one image cell can speak for.
const PER_CELL: usize = 4;

/// What stands behind an estimate.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct Evidence {
    /// Matches that count: off the floor, and at most a few for each part of the image.
    pub n_inliers: usize,
    /// Matches off the floor, however crowded.
    pub n_off_floor: usize,
    /// Image cells (of 48) that hold such a match; `None` if the estimate came without its matches.
    pub n_cells: Option<usize>,
}

/// The image the matches belong to, to tell the floor by.
pub struct View<'a> {
    /// Depth registered to the image.
    pub depth: &'a DepthImage,
    /// Where the camera sits.
    pub t_base_camera: &'a Transform<Base, Camera>,
}

/// Weighs an estimate by its matches. `view` is the image it was made from, if it is still at hand.
pub fn weigh(n_inliers: usize, matches: &[MatchedPoint], camera: &Intrinsics, view: Option<&View<'_>>) -> Evidence {
    if matches.is_empty() {
        return Evidence { n_inliers, n_off_floor: n_inliers, n_cells: None };
    }
    let mut cells = [false; COLUMNS * ROWS];
    let mut n_off_floor = 0;
    for point in matches {
        let (x, y) = point.query_px;
        if !(x >= 0.0 && y >= 0.0) || view.is_some_and(|view| is_on_floor(point, camera, view)) {
            continue;
        }
        n_off_floor += 1;
        let column = (x / camera.width() as f32 * COLUMNS as f32) as usize;
        let row = (y / camera.height() as f32 * ROWS as f32) as usize;
        cells[row.min(ROWS - 1) * COLUMNS + column.min(COLUMNS - 1)] = true;
    }
    let n_cells = cells.iter().filter(|cell| **cell).count();
    // The list of matches may be shorter than their number.
    let n_off_floor = n_inliers * n_off_floor / matches.len();
    Evidence { n_inliers: n_off_floor.min(PER_CELL * n_cells), n_off_floor, n_cells: Some(n_cells) }
}

fn is_on_floor(point: &MatchedPoint, camera: &Intrinsics, view: &View<'_>) -> bool {
    let (x, y) = point.query_px;
    view.depth.at(x.round() as u32, y.round() as u32).is_some_and(|depth_m| {
        let p_camera = camera.unproject(f64::from(x), f64::from(y), f64::from(depth_m));
        view.t_base_camera.apply(&p_camera).z.abs() < FLOOR_M
    })
}

impl Evidence {
    /// True if it covers as much of the image as the goal's view must from `range_m` away, turned by `turn_rad` from the
    /// goal's heading. `rigour` scales what is asked for: 1 at first, less once nothing else is left.
    pub fn suffices(&self, range_m: f64, turn_rad: f64, rigour: f64) -> bool {
        let facing = if turn_rad > 0.7 { 0.5 } else { 1.0 };
        let needed = (16.0 - 6.0 * range_m).clamp(3.0, 14.0) * facing * rigour;
        self.n_cells.is_none_or(|n| n as f64 >= needed)
    }
}
