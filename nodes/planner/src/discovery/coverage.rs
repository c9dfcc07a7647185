//! Which views of the flat have been seen: a goal photo taken at a place, looking some way, is only recognised from near
//! there by a camera that looks about the same way. So mapping free space is not enough; it has to be looked at.

use homing_core::{Cell, OccupancyGrid, wrap_angle};

use crate::angles::sin_cos;

/// Viewing directions told apart at one place.
pub const N_SECTORS: u32 = 16;
/// Side of a place, metres.
const PLACE_M: f64 = 0.5;
const N_RAYS: usize = 60;
const RAY_STEP_M: f64 = 0.1;

/// How alike two views must be for one to stand for the other.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Likeness {
    /// Largest distance between the two places, in line of sight, metres.
    pub range_m: f64,
    /// Largest difference of heading, radians.
    pub half_angle_rad: f64,
}

/// A place in sight.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// Index into the coarse grid.
    pub index: usize,
    /// The map does not know it yet.
    pub unknown: bool,
}

/// Views seen, by place and direction.
#[derive(Clone, Debug, Default)]
pub struct Coverage {
    columns: usize,
    rows: usize,
    cells_per_place: usize,
    /// Directions seen of known places, one bit each.
    seen: Vec<u16>,
    /// Directions in which unknown places were stared at in vain.
    stared: Vec<u16>,
    reachable: Vec<bool>,
    stamp: Vec<u32>,
    stamp_now: u32,
    /// Cells along each ray, as offsets.
    fan: Vec<Vec<(isize, isize)>>,
    fan_range_m: f64,
}

impl Coverage {
    /// Forgets what was seen; sized for a map.
    pub fn reset(&mut self, map: &OccupancyGrid) {
        let g = &map.geometry;
        self.cells_per_place = ((PLACE_M / g.resolution_m).round() as usize).max(1);
        self.columns = g.width.div_ceil(self.cells_per_place);
        self.rows = g.height.div_ceil(self.cells_per_place);
        let n = self.columns * self.rows;
        self.seen = vec![0; n];
        self.stared = vec![0; n];
        self.reachable = vec![false; n];
        self.stamp = vec![0; n];
        self.stamp_now = 0;
    }

    /// True if it is sized for this map.
    pub fn fits(&self, map: &OccupancyGrid) -> bool {
        let per = self.cells_per_place.max(1);
        self.columns == map.geometry.width.div_ceil(per) && self.rows == map.geometry.height.div_ceil(per)
    }

    /// Notes which places the robot can stand at: a photo is taken where a robot can stand. Returns one cell of each, the
    /// reachable one nearest to the place's middle, as (place, cell's column and row).
    pub fn find_reachable(&mut self, map: &OccupancyGrid, travel_m: &[f32]) -> Vec<(usize, (usize, usize))> {
        let per = self.cells_per_place;
        let middle = (per as i64 - 1) / 2;
        let mut nearest = vec![(i64::MAX, (0, 0)); self.reachable.len()];
        for (row, line) in travel_m.chunks_exact(map.geometry.width).enumerate() {
            let (place_row, dr) = (row / per * self.columns, (row % per) as i64 - middle);
            for (column, _) in line.iter().enumerate().filter(|(_, t)| **t < f32::INFINITY) {
                let at = place_row + column / per;
                let dc = (column % per) as i64 - middle;
                let away = dc * dc + dr * dr;
                if away < nearest[at].0 {
                    nearest[at] = (away, (column, row));
                }
            }
        }
        for (reachable, (away, _)) in self.reachable.iter_mut().zip(&nearest) {
            *reachable = *away < i64::MAX;
        }
        nearest.into_iter().enumerate().filter(|(_, n)| n.0 < i64::MAX).map(|(at, n)| (at, n.1)).collect()
    }

    /// Places in line of sight of a cell, at most `range_m` away. A view is hoped to reach `hope_m` into the unknown.
    pub fn in_sight(
        &mut self,
        map: &OccupancyGrid,
        (column, row): (usize, usize),
        range_m: f64,
        hope_m: f64,
    ) -> Vec<Place> {
        if self.fan_range_m != range_m {
            self.fan = fan(range_m, map.geometry.resolution_m);
            self.fan_range_m = range_m;
        }
        self.stamp_now = self.stamp_now.wrapping_add(1);
        let hope = (hope_m / RAY_STEP_M) as u32;
        let (width, height) = (map.geometry.width, map.geometry.height);
        let mut places = Vec::new();
        for ray in &self.fan {
            let mut n_unknown = 0;
            for (step, &(across, up)) in ray.iter().enumerate() {
                let (c, r) = (column.wrapping_add_signed(across), row.wrapping_add_signed(up));
                if c >= width || r >= height {
                    break;
                }
                let cell = map.cells[r * width + c];
                n_unknown += u32::from(cell == Cell::Unknown);
                if (cell == Cell::Occupied && step > 0) || n_unknown > hope {
                    break;
                }
                let index = (r / self.cells_per_place) * self.columns + c / self.cells_per_place;
                if self.stamp[index] != self.stamp_now {
                    self.stamp[index] = self.stamp_now;
                    places.push(Place { index, unknown: cell == Cell::Unknown });
                }
            }
        }
        places
    }

    /// The camera looks along `yaw_rad` at these places.
    pub fn look(&mut self, places: &[Place], yaw_rad: f64, likeness: &Likeness) {
        let directions = directions_like(yaw_rad, likeness.half_angle_rad);
        for place in places {
            let mask = if place.unknown { &mut self.stared } else { &mut self.seen };
            mask[place.index] |= directions;
        }
    }

    /// What looking around at these places would show that was not seen, square metres times share of directions.
    pub fn gain_m2(&self, places: &[Place], unknown_worth: f64) -> f64 {
        self.gain_of(places, u16::MAX, unknown_worth)
    }

    /// The same, with one more turn at a time from `yaw_rad`: what is shown after 1, 2, ... `n` turns of `turn_rad` (left
    /// positive).
    pub fn gains_of_turns_m2(
        &self,
        places: &[Place],
        yaw_rad: f64,
        (turn_rad, n): (f64, usize),
        likeness: &Likeness,
        unknown_worth: f64,
    ) -> Vec<f64> {
        let mut shown = 0;
        (1..=n)
            .map(|k| {
                shown |= directions_like(yaw_rad + k as f64 * turn_rad, likeness.half_angle_rad);
                self.gain_of(places, shown, unknown_worth)
            })
            .collect()
    }

    fn gain_of(&self, places: &[Place], directions: u16, unknown_worth: f64) -> f64 {
        let mut gain = 0.0;
        for place in places {
            if place.unknown {
                gain += unknown_worth * f64::from((!self.stared[place.index] & directions).count_ones());
            } else if self.reachable[place.index] {
                gain += f64::from((!self.seen[place.index] & directions).count_ones());
            }
        }
        gain * PLACE_M * PLACE_M / f64::from(N_SECTORS)
    }
}

/// Cells along rays in all directions, as offsets (columns, rows) from where they start.
fn fan(range_m: f64, resolution_m: f64) -> Vec<Vec<(isize, isize)>> {
    let n_steps = (range_m / RAY_STEP_M) as usize;
    (0..N_RAYS)
        .map(|ray| {
            let (sin, cos) = sin_cos(core::f64::consts::TAU * ray as f64 / N_RAYS as f64);
            let cells = |along: f64| (along / resolution_m).round() as isize;
            (0..=n_steps).map(|step| step as f64 * RAY_STEP_M).map(|m| (cells(m * cos), cells(m * sin))).collect()
        })
        .collect()
}

/// The directions that a view along `yaw_rad` stands for.
fn directions_like(yaw_rad: f64, half_angle_rad: f64) -> u16 {
    (0..N_SECTORS)
        .filter(|&i| {
            let middle = core::f64::consts::TAU * f64::from(i) / f64::from(N_SECTORS);
            wrap_angle(middle - yaw_rad).abs() <= half_angle_rad
        })
        .fold(0, |mask, i| mask | (1 << i))
}
