//! Where a robot can be: a grid of obstacles and floor from the triangles of any scene.

use homing_core::GridGeometry;
use rayon::prelude::*;
use thiserror::Error;

use crate::free_space::FreeSpace;
use crate::raster::{Corner, cells_under, clip_band, solid_triangles, triangles};
use crate::scene::Scene;

/// Side of a cell, metres.
pub const CELL_M: f64 = 0.025;
/// What is lower than this above the floor is driven over, metres.
pub const STEP_M: f64 = 0.05;
/// Clearances are not told apart beyond this, metres.
pub const CLEARANCE_M_MAX: f64 = 2.0;
/// Most cells of a grid: 125 m by 125 m.
const CELLS_MAX: f64 = 25e6;
/// A connected floor smaller than this is none, square metres.
const FLOOR_M2_MIN: f64 = 1.0;

/// Why a scene cannot be driven in.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum NavGridError {
    /// There is no level surface to stand on, or furniture covers it.
    #[error(
        "{scene} has no floor that a robot of {radius_m} m radius could stand on: the largest connected part is \
             {found_m2:.2} square metres; check that the scene is in metres and that up is up"
    )]
    NoFloor {
        /// The scene's name.
        scene: String,
        /// Radius asked for, metres.
        radius_m: f64,
        /// Square metres found.
        found_m2: f64,
    },
    /// The floor is larger than the simulator keeps in memory.
    #[error(
        "the floor of {scene} spans {width_m:.0} m by {depth_m:.0} m, more than the simulator can hold \
             (125 m by 125 m): check that the scene is in metres, or cut it"
    )]
    TooLarge {
        /// The scene's name.
        scene: String,
        /// Extent along x, metres.
        width_m: f64,
        /// Extent along y, metres.
        depth_m: f64,
    },
}

/// Obstacles and clearances on a grid of [`CELL_M`], world frame. A cell is blocked if a solid triangle between
/// [`STEP_M`] above the floor and the robot's height touches it, or if no floor lies beneath it.
#[derive(Clone, Debug, PartialEq)]
pub struct NavGrid {
    geometry: GridGeometry,
    floor_z_m: f64,
    blocked: Vec<bool>,
    clearance_m: Vec<f32>,
}

impl NavGrid {
    /// Rasterizes a scene for a robot of that height, metres.
    ///
    /// # Errors
    /// [`NavGridError`] for a scene without floor or of absurd size.
    pub fn new(scene: &Scene, height_m: f64) -> Result<Self, NavGridError> {
        let none = || NavGridError::NoFloor { scene: scene.name.clone(), radius_m: 0.0, found_m2: 0.0 };
        let floor_z_m = floor_height(scene).ok_or_else(none)?;
        let floor: Vec<[Corner; 3]> = level_triangles(scene).filter(|t| is_floor(t, floor_z_m)).collect();
        let geometry = extent_of(&floor, &scene.name)?;
        let mut blocked = vec![true; geometry.len()];
        for triangle in &floor {
            cells_under(triangle, &geometry, |i| blocked[i] = false);
        }
        let band = (floor_z_m + STEP_M, floor_z_m + height_m);
        let mut polygon = Vec::with_capacity(8);
        for triangle in solid_triangles(scene) {
            clip_band(&triangle, 2, band, &mut polygon);
            cells_under(&polygon, &geometry, |i| blocked[i] = true);
        }
        let clearance_m = clearances(&blocked, &geometry);
        Ok(Self { geometry, floor_z_m, blocked, clearance_m })
    }

    /// Where the grid lies, world frame.
    #[must_use]
    pub fn geometry(&self) -> &GridGeometry {
        &self.geometry
    }

    /// Height of the floor, world frame, metres.
    #[must_use]
    pub fn floor_z_m(&self) -> f64 {
        self.floor_z_m
    }

    /// True if something stands on the cell or nothing lies under it. Outside the grid everything is blocked.
    #[must_use]
    pub fn is_blocked(&self, column: usize, row: usize) -> bool {
        let g = &self.geometry;
        column >= g.width || row >= g.height || self.blocked[g.index(column, row)]
    }

    /// Distance from the centre of a cell to the nearest point of a blocked cell, metres, at most
    /// [`CLEARANCE_M_MAX`]: a disc of radius r around the centre is free exactly where this exceeds r.
    #[must_use]
    pub fn clearance_m(&self, column: usize, row: usize) -> f64 {
        let g = &self.geometry;
        if column >= g.width || row >= g.height { 0.0 } else { f64::from(self.clearance_m[g.index(column, row)]) }
    }

    /// True if a disc at (x, y), world frame, touches no blocked cell. Radius up to [`CLEARANCE_M_MAX`], metres.
    #[must_use]
    pub fn disc_is_free(&self, x_m: f64, y_m: f64, radius_m: f64) -> bool {
        let g = &self.geometry;
        let Some((column, row)) = g.cell_at(x_m, y_m) else { return false };
        // The clearance of the cell's centre bounds that of every point in the cell.
        let (clearance, half_diagonal) = (self.clearance_m(column, row), CELL_M * core::f64::consts::FRAC_1_SQRT_2);
        if clearance > radius_m + half_diagonal {
            return true;
        }
        if clearance + half_diagonal <= radius_m {
            return false;
        }
        self.gap_exceeds(x_m, y_m, radius_m)
    }

    fn gap_exceeds(&self, x_m: f64, y_m: f64, radius_m: f64) -> bool {
        let g = &self.geometry;
        let cell = |v: f64, origin: f64| ((v - origin) / g.resolution_m).floor() as i64;
        let rows = cell(y_m - radius_m, g.origin_y_m)..=cell(y_m + radius_m, g.origin_y_m);
        for row in rows {
            for column in cell(x_m - radius_m, g.origin_x_m)..=cell(x_m + radius_m, g.origin_x_m) {
                let outside = row < 0 || column < 0;
                if !outside && !self.is_blocked(column as usize, row as usize) {
                    continue;
                }
                let x0 = g.origin_x_m + column as f64 * g.resolution_m;
                let y0 = g.origin_y_m + row as f64 * g.resolution_m;
                let dx = (x0 - x_m).max(x_m - x0 - g.resolution_m).max(0.0);
                let dy = (y0 - y_m).max(y_m - y0 - g.resolution_m).max(0.0);
                if dx * dx + dy * dy <= radius_m * radius_m {
                    return false;
                }
            }
        }
        true
    }

    /// The largest connected set of places for a disc of that radius, metres. `scene` is named in the error.
    ///
    /// # Errors
    /// [`NavGridError::NoFloor`] if there is less than a square metre of it.
    pub fn free_space(&self, scene: &str, radius_m: f64) -> Result<FreeSpace, NavGridError> {
        let space = FreeSpace::largest(self.geometry, &self.clearance_m, radius_m);
        if space.area_m2() < FLOOR_M2_MIN {
            return Err(NavGridError::NoFloor { scene: scene.to_owned(), radius_m, found_m2: space.area_m2() });
        }
        Ok(space)
    }
}

fn level_triangles(scene: &Scene) -> impl Iterator<Item = [Corner; 3]> + '_ {
    scene.meshes.iter().flat_map(triangles).filter(|t| {
        let n = double_area(t);
        n[2].abs() > 0.7 * libm::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]) && n[2].abs() > 1e-12
    })
}

fn double_area(t: &[Corner; 3]) -> [f64; 3] {
    let u: [f64; 3] = core::array::from_fn(|k| t[1][k] - t[0][k]);
    let v: [f64; 3] = core::array::from_fn(|k| t[2][k] - t[0][k]);
    [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
}

fn is_floor(t: &[Corner; 3], floor_z_m: f64) -> bool {
    t.iter().all(|c| (c[2] - floor_z_m).abs() <= STEP_M + 1e-6)
}

/// The lowest height, to the centimetre, with at least half as much level surface as the height that has most.
fn floor_height(scene: &Scene) -> Option<f64> {
    let mut by_centimetre: std::collections::BTreeMap<i64, (f64, f64)> = std::collections::BTreeMap::new();
    for t in level_triangles(scene) {
        let (z, area) = ((t[0][2] + t[1][2] + t[2][2]) / 3.0, double_area(&t)[2].abs());
        let bin = by_centimetre.entry((z * 100.0).round() as i64).or_default();
        *bin = (bin.0 + area, bin.1 + area * z);
    }
    let most = by_centimetre.values().map(|b| b.0).fold(0.0, f64::max);
    by_centimetre.values().find(|b| b.0 >= 0.5 * most).map(|b| b.1 / b.0)
}

fn extent_of(floor: &[[Corner; 3]], scene: &str) -> Result<GridGeometry, NavGridError> {
    let all = |axis: usize| floor.iter().flatten().map(move |c| c[axis]);
    let (x0, x1) = all(0).fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(v), h.max(v)));
    let (y0, y1) = all(1).fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(v), h.max(v)));
    let cells = |low: f64, high: f64| ((high - low) / CELL_M).ceil().max(1.0) + 4.0;
    if cells(x0, x1) * cells(y0, y1) > CELLS_MAX {
        return Err(NavGridError::TooLarge { scene: scene.to_owned(), width_m: x1 - x0, depth_m: y1 - y0 });
    }
    Ok(GridGeometry {
        width: cells(x0, x1) as usize,
        height: cells(y0, y1) as usize,
        resolution_m: CELL_M,
        origin_x_m: x0 - 2.0 * CELL_M,
        origin_y_m: y0 - 2.0 * CELL_M,
    })
}

/// Exact distances from cell centres to the nearest blocked square, columns first, then rows.
fn clearances(blocked: &[bool], g: &GridGeometry) -> Vec<f32> {
    let reach = (CLEARANCE_M_MAX / g.resolution_m) as usize;
    let vertical = vertical_gaps(blocked, g, reach as u32);
    let mut out = vec![0_f32; g.len()];
    out.par_chunks_mut(g.width).enumerate().for_each(|(row, line)| {
        let gaps = &vertical[row * g.width..(row + 1) * g.width];
        for (column, value) in line.iter_mut().enumerate() {
            *value = (nearest_squared(gaps, column, reach) as f32).sqrt() * g.resolution_m as f32;
        }
    });
    out
}

/// Cells up or down to the nearest blocked cell of the same column, at most `reach`. The outside of the grid is blocked.
fn vertical_gaps(blocked: &[bool], g: &GridGeometry, reach: u32) -> Vec<u32> {
    let mut gaps = vec![0_u32; g.len()];
    for row in 0..g.height {
        for i in row * g.width..(row + 1) * g.width {
            let below = if row == 0 { 0 } else { gaps[i - g.width] };
            gaps[i] = if blocked[i] { 0 } else { (below + 1).min(reach) };
        }
    }
    for row in (0..g.height).rev() {
        for i in row * g.width..(row + 1) * g.width {
            let above = if row + 1 == g.height { 0 } else { gaps[i + g.width] };
            gaps[i] = gaps[i].min(above + 1);
        }
    }
    gaps
}

/// Square of the distance, in cells, from the centre of cell `column` of a row to the nearest blocked square.
fn nearest_squared(gaps: &[u32], column: usize, reach: usize) -> f64 {
    if gaps[column] == 0 {
        return 0.0;
    }
    let to_edge = |cells: usize| (cells as f64 - 0.5).max(0.0);
    let mut best = to_edge(gaps[column] as usize).min(reach as f64);
    best *= best;
    for dx in 1..=reach {
        let across = to_edge(dx) * to_edge(dx);
        if across >= best {
            break;
        }
        let gap = |c: Option<usize>| c.and_then(|c| gaps.get(c)).map_or(0.0, |v| to_edge(*v as usize));
        let up = gap(column.checked_sub(dx)).min(gap(Some(column + dx)));
        best = best.min(across + up * up);
    }
    best
}
