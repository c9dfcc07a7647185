//! Occupancy from depth: what stands in the robot's way, what is free, what was never seen.
//!
//! Each frame becomes a fan of azimuth sectors seen from above. In a sector, depths whose height lies in the body's
//! band are obstacles; the floor is free up to the first of them. Cells keep a small hit-or-miss count, so that one
//! noisy frame neither builds nor removes a wall (constants after Active Neural SLAM's map, heights 0.1 m to body height).

use homing_core::{Base, Camera, Cell, DepthImage, GridGeometry, Intrinsics, OccupancyGrid, PlanarPose, Transform};

use crate::angles::sin_cos;
use crate::projection::{Projection, azimuth_of, sector_of};
use crate::terrain::Window;

/// Range bins are half a cell of the usual map.
const BIN_M: f32 = 0.025;
/// Two pixels of one sector must agree on an obstacle: single ones fly between foreground and background.
const PIXELS_MIN: u8 = 2;
const HIT: i8 = 4;
const HIT_FAR: i8 = 2;
/// Beyond this a depth camera's error is about a cell, metres.
const FAR_M: f32 = 4.0;
const COUNT_MIN: i8 = -6;
const COUNT_MAX: i8 = 8;
const OCCUPIED_FROM: i8 = 2;
/// A count that no sequence of misses wears down: the body itself ran into it.
const BUMPED: i8 = i8::MAX;

/// How depth becomes occupancy.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct MapperConfig {
    /// Depth that ends nearer than this on the floor is too near to measure, metres.
    pub range_min_m: f64,
    /// Obstacles beyond this are not drawn, only the free space before them, metres.
    pub range_max_m: f64,
    /// Lower end of the heights that stop the body, metres above the floor.
    pub band_min_m: f64,
    /// Upper end of the heights that stop the body, metres above the floor.
    pub band_max_m: f64,
    /// A floor that lies this far below the robot's is a drop, metres.
    pub drop_m: f64,
    /// Frames with a smaller share of usable depths are blind.
    pub valid_share_min: f64,
}

impl Default for MapperConfig {
    fn default() -> Self {
        Self {
            range_min_m: 0.3,
            range_max_m: 6.0,
            band_min_m: 0.10,
            band_max_m: 1.5,
            drop_m: 0.25,
            valid_share_min: 0.005,
        }
    }
}

/// What a frame gave.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Integrated {
    /// The map was updated.
    Seen,
    /// Next to no usable depth, or an image that does not belong to its camera: nothing was written.
    Blind,
}

/// The map and what is needed to update it.
#[derive(Clone, Debug)]
pub struct Mapper {
    config: MapperConfig,
    grid: OccupancyGrid,
    counts: Vec<i8>,
    hit_in_frame: Vec<u32>,
    frame: u32,
    known: Option<Window>,
    projection: Option<Projection>,
    fan: Fan,
}

/// One frame seen from above.
#[derive(Clone, Debug, Default)]
struct Fan {
    n_bins: usize,
    /// Obstacle pixels by sector and range bin.
    bins: Vec<u8>,
    /// Farthest floor seen, metres.
    floor_m: Vec<f32>,
    /// Free up to here, metres.
    free_m: Vec<f32>,
    /// Something so near that it has no measurable range.
    touching: Vec<bool>,
    /// Something in the band beyond the map's range.
    open: Vec<bool>,
}

impl Mapper {
    /// An empty map.
    #[must_use]
    pub fn new(geometry: GridGeometry, config: MapperConfig) -> Self {
        Self {
            config,
            counts: vec![0; geometry.len()],
            hit_in_frame: vec![0; geometry.len()],
            grid: OccupancyGrid::unknown(geometry),
            frame: 0,
            known: None,
            projection: None,
            fan: Fan::default(),
        }
    }

    /// Forgets everything.
    pub fn reset(&mut self) {
        self.grid.cells.fill(Cell::Unknown);
        self.counts.fill(0);
        self.known = None;
    }

    /// The map.
    #[must_use]
    pub fn map(&self) -> &OccupancyGrid {
        &self.grid
    }

    /// The smallest window that holds every known cell.
    #[must_use]
    pub fn known(&self) -> Option<Window> {
        self.known
    }

    /// Draws one depth image taken with the base at `pose` (odometry frame).
    pub fn integrate(
        &mut self,
        depth: &DepthImage,
        intrinsics: &Intrinsics,
        t_base_camera: &Transform<Base, Camera>,
        pose: &PlanarPose,
    ) -> Integrated {
        if (depth.width(), depth.height()) != (intrinsics.width(), intrinsics.height()) || !t_base_camera.is_finite() {
            return Integrated::Blind;
        }
        let projection = match self.projection.take().filter(|p| p.fits(intrinsics, t_base_camera)) {
            Some(projection) => projection,
            None => Projection::new(intrinsics, t_base_camera),
        };
        let valid = self.fan.spread(depth, &projection, &self.config);
        let integrated = if (valid as f64) < self.config.valid_share_min * projection.rays.len() as f64 {
            Integrated::Blind
        } else {
            self.frame = self.frame.wrapping_add(1);
            self.carve_free(&projection, pose);
            self.mark_hits(&projection, pose);
            Integrated::Seen
        };
        self.projection = Some(projection);
        integrated
    }

    /// The body stands here: whatever the map says, these cells are free.
    pub fn mark_visited(&mut self, pose: &PlanarPose, radius_m: f64) {
        let geometry = self.grid.geometry;
        for (column, row) in Window::around(&geometry, (pose.x_m, pose.y_m), radius_m).cells() {
            let (x, y) = geometry.centre(column, row);
            if pose.distance_to(x, y) <= radius_m {
                let index = geometry.index(column, row);
                self.counts[index] = COUNT_MIN;
                self.set(column, row, index, Cell::Free);
            }
        }
    }

    /// The body drove forward and was stopped: something stands before it that depth does not show (a pane of glass, a low
    /// threshold). Two cells deep, `width_m` wide, from `reach_m` before the base.
    pub fn mark_bump(&mut self, pose: &PlanarPose, reach_m: f64, width_m: f64) {
        let geometry = self.grid.geometry;
        let (sin, cos) = sin_cos(pose.yaw_rad);
        let half = (0.5 * width_m / geometry.resolution_m).round().max(0.0) as i64;
        for depth in 0..3 {
            for side in -2 * half..=2 * half {
                let ahead = reach_m + 0.5 * f64::from(depth) * geometry.resolution_m;
                let left = 0.5 * side as f64 * geometry.resolution_m;
                let (x, y) = (pose.x_m + ahead * cos - left * sin, pose.y_m + ahead * sin + left * cos);
                if let Some((column, row)) = geometry.cell_at(x, y) {
                    let index = geometry.index(column, row);
                    self.counts[index] = BUMPED;
                    self.set(column, row, index, Cell::Occupied);
                }
            }
        }
    }

    /// Takes back every bump, for when they leave no way out. Returns how many cells were freed.
    pub fn forget_bumps(&mut self) -> usize {
        let mut n_freed = 0;
        for (count, cell) in self.counts.iter_mut().zip(&mut self.grid.cells) {
            if *count == BUMPED {
                *count = 0;
                *cell = Cell::Free;
                n_freed += 1;
            }
        }
        n_freed
    }

    fn carve_free(&mut self, projection: &Projection, pose: &PlanarPose) {
        let geometry = self.grid.geometry;
        let (sin, cos) = (libm::sinf(pose.yaw_rad as f32), libm::cosf(pose.yaw_rad as f32));
        let [cx, cy, _] = projection.camera_m;
        let (x0, y0) = (pose.x_m as f32 + cx * cos - cy * sin, pose.y_m as f32 + cx * sin + cy * cos);
        let reach = self.config.range_max_m as f32;
        let window = Window::around(&geometry, (f64::from(x0), f64::from(y0)), f64::from(reach));
        let half_cell = 0.5 * geometry.resolution_m as f32;
        for row in window.row_min..window.row_max {
            let dy = geometry.centre(0, row).1 as f32 - y0;
            for column in window.column_min..window.column_max {
                let dx = geometry.centre(column, 0).0 as f32 - x0;
                let (forward, left) = (dx * cos + dy * sin, dy * cos - dx * sin);
                let square = dx * dx + dy * dy;
                if square > reach * reach || forward < -0.5 * libm::fabsf(left) {
                    continue;
                }
                let sector = sector_of(libm::atan2f(left, forward), projection.n_sectors);
                let range = square.sqrt();
                if range + half_cell >= self.fan.free_m[sector] {
                    continue;
                }
                self.miss(column, row, range < projection.floor_from_m[sector]);
            }
        }
    }

    /// A ray passed over a cell. Where the camera cannot look down to the floor it only makes the unknown free.
    fn miss(&mut self, column: usize, row: usize, above_floor: bool) {
        let index = self.grid.geometry.index(column, row);
        let unknown = self.grid.cells[index] == Cell::Unknown;
        if self.counts[index] == BUMPED || (above_floor && !unknown) {
            return;
        }
        self.counts[index] = (self.counts[index] - 1).max(COUNT_MIN);
        if unknown || self.counts[index] < OCCUPIED_FROM {
            self.set(column, row, index, Cell::Free);
        }
    }

    fn mark_hits(&mut self, projection: &Projection, pose: &PlanarPose) {
        let width_rad = core::f32::consts::TAU / projection.n_sectors as f32;
        let cell_m = self.grid.geometry.resolution_m as f32;
        for sector in 0..projection.n_sectors {
            for bin in 0..self.fan.n_bins {
                if !self.fan.is_hit(sector, bin) {
                    continue;
                }
                let range = (bin as f32 + 0.5) * BIN_M;
                // A sector wider than a cell must not leave gaps in a wall.
                let n_across = (range * width_rad / cell_m).ceil().clamp(1.0, 8.0) as usize;
                for i in 0..n_across {
                    let share = (i as f32 + 0.5) / n_across as f32 - 0.5;
                    self.hit(projection, pose, azimuth_of(sector, projection.n_sectors) + share * width_rad, range);
                }
            }
        }
    }

    /// Something stands in the way at a range from the camera; counts once per frame and cell.
    fn hit(&mut self, projection: &Projection, pose: &PlanarPose, azimuth_rad: f32, range_m: f32) {
        let [cx, cy, _] = projection.camera_m;
        let (sin, cos) = (libm::sinf(pose.yaw_rad as f32), libm::cosf(pose.yaw_rad as f32));
        let (bx, by) = (cx + range_m * libm::cosf(azimuth_rad), cy + range_m * libm::sinf(azimuth_rad));
        let (x, y) = (pose.x_m as f32 + bx * cos - by * sin, pose.y_m as f32 + bx * sin + by * cos);
        let Some((column, row)) = self.grid.geometry.cell_at(f64::from(x), f64::from(y)) else { return };
        let index = self.grid.geometry.index(column, row);
        if self.hit_in_frame[index] == self.frame || self.counts[index] == BUMPED {
            return;
        }
        self.hit_in_frame[index] = self.frame;
        let hit = if range_m < FAR_M { HIT } else { HIT_FAR };
        self.counts[index] = (self.counts[index] + hit).min(COUNT_MAX);
        if self.counts[index] >= OCCUPIED_FROM {
            self.set(column, row, index, Cell::Occupied);
        }
    }

    fn set(&mut self, column: usize, row: usize, index: usize, cell: Cell) {
        if self.grid.cells[index] == Cell::Unknown {
            let at = Window { column_min: column, column_max: column + 1, row_min: row, row_max: row + 1 };
            self.known = Some(self.known.map_or(at, |known| known.union(&at)));
        }
        self.grid.cells[index] = cell;
    }
}

impl Fan {
    /// Sorts the pixels into sectors and ranges. Returns how many had a depth.
    fn spread(&mut self, depth: &DepthImage, projection: &Projection, config: &MapperConfig) -> usize {
        self.clear(projection.n_sectors, (config.range_max_m as f32 / BIN_M) as usize);
        let (range_min, range_max) = (config.range_min_m as f32, config.range_max_m as f32);
        let (band_min, band_max) = (config.band_min_m as f32, config.band_max_m as f32);
        let (camera_z, drop, n_bins) = (projection.camera_m[2], config.drop_m as f32, self.n_bins);
        let depths = depth.data();
        let mut valid = 0;
        for ray in &projection.rays {
            let d = depths[ray.pixel as usize];
            if d <= 0.0 {
                continue;
            }
            valid += 1;
            let (mut range, height) = (d * ray.reach, camera_z + d * ray.rise);
            let sector = ray.sector as usize;
            if height > band_max {
                continue;
            }
            if height < band_min && height > -drop {
                self.floor_m[sector] = self.floor_m[sector].max(range.min(range_max));
                continue;
            }
            if height <= -drop {
                // The ray went through where the floor should have been.
                range = camera_z / -ray.rise * ray.reach;
            }
            if range < range_min {
                self.touching[sector] = true;
            } else if range >= range_max {
                self.open[sector] = true;
            } else {
                let bin = &mut self.bins[sector * n_bins + ((range / BIN_M) as usize).min(n_bins - 1)];
                *bin = bin.saturating_add(1);
            }
        }
        self.find_free(projection.n_sectors, range_max);
        valid
    }

    fn clear(&mut self, n_sectors: usize, n_bins: usize) {
        self.n_bins = n_bins.max(1);
        self.bins.clear();
        self.bins.resize(n_sectors * self.n_bins, 0);
        self.floor_m.clear();
        self.floor_m.resize(n_sectors, 0.0);
        self.free_m.clear();
        self.free_m.resize(n_sectors, 0.0);
        self.touching.clear();
        self.touching.resize(n_sectors, false);
        self.open.clear();
        self.open.resize(n_sectors, false);
    }

    fn find_free(&mut self, n_sectors: usize, range_max: f32) {
        for sector in 0..n_sectors {
            let first_hit = (0..self.n_bins).find(|&bin| self.is_hit(sector, bin));
            self.free_m[sector] = match first_hit {
                _ if self.touching[sector] => 0.0,
                Some(bin) => bin as f32 * BIN_M,
                None if self.open[sector] => range_max,
                None => self.floor_m[sector],
            };
        }
    }

    fn is_hit(&self, sector: usize, bin: usize) -> bool {
        let at = sector * self.n_bins + bin;
        if self.bins[at] == 0 {
            return false;
        }
        let next = if bin + 1 < self.n_bins { self.bins[at + 1] } else { 0 };
        let previous = if bin > 0 { self.bins[at - 1] } else { 0 };
        self.bins[at].saturating_add(next.max(previous)) >= PIXELS_MIN
    }
}
