//! How near each cell is to an obstacle, and what it costs to drive there.

use homing_core::{Cell, GridGeometry, OccupancyGrid, PlanarPose};

use crate::config::{BodyConfig, UnknownCells};

/// A rectangle of cells: minima inside, maxima outside.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct Window {
    /// First column.
    pub column_min: usize,
    /// One past the last column.
    pub column_max: usize,
    /// First row.
    pub row_min: usize,
    /// One past the last row.
    pub row_max: usize,
}

impl Window {
    /// The cells within `radius_m` of a point along either axis, cut at the grid's border; empty if it misses the grid.
    #[must_use]
    pub fn around(geometry: &GridGeometry, at_m: (f64, f64), radius_m: f64) -> Self {
        let span = |centre: f64, origin: f64, n: usize| {
            let low = ((centre - radius_m - origin) / geometry.resolution_m).floor().max(0.0) as usize;
            let high = ((centre + radius_m - origin) / geometry.resolution_m).ceil().max(0.0) as usize;
            (low.min(n), high.min(n).max(low.min(n)))
        };
        let (column_min, column_max) = span(at_m.0, geometry.origin_x_m, geometry.width);
        let (row_min, row_max) = span(at_m.1, geometry.origin_y_m, geometry.height);
        Self { column_min, column_max, row_min, row_max }
    }

    /// The smallest window that holds both.
    #[must_use]
    pub fn union(&self, other: &Window) -> Window {
        Window {
            column_min: self.column_min.min(other.column_min),
            column_max: self.column_max.max(other.column_max),
            row_min: self.row_min.min(other.row_min),
            row_max: self.row_max.max(other.row_max),
        }
    }

    /// Grown by `n` cells on every side and kept one cell off the grid's border, so that neighbours always exist.
    #[must_use]
    pub fn grown(&self, n: usize, geometry: &GridGeometry) -> Window {
        Window {
            column_min: self.column_min.saturating_sub(n).max(1),
            column_max: (self.column_max + n).min(geometry.width.saturating_sub(1)),
            row_min: self.row_min.saturating_sub(n).max(1),
            row_max: (self.row_max + n).min(geometry.height.saturating_sub(1)),
        }
    }

    /// Every (column, row), row by row.
    pub fn cells(self) -> impl Iterator<Item = (usize, usize)> {
        (self.row_min..self.row_max)
            .flat_map(move |row| (self.column_min..self.column_max).map(move |column| (column, row)))
    }

    /// True if the cell lies inside.
    #[must_use]
    pub fn contains(&self, column: usize, row: usize) -> bool {
        (self.column_min..self.column_max).contains(&column) && (self.row_min..self.row_max).contains(&row)
    }
}

/// Distance to the nearest obstacle around every cell of a window, capped at the clearance that costs nothing extra.
#[derive(Clone, Debug)]
pub struct Terrain {
    geometry: GridGeometry,
    window: Window,
    reach: usize,
    /// Squared distance to the nearest obstacle, cells, capped at `reach` squared.
    square: Vec<i16>,
    column_distance: Vec<i16>,
    /// Cost of a free cell by squared distance; infinite inside the inflated obstacle.
    cost: Vec<f32>,
    /// The same with the body's bare radius, for tight places.
    cost_tight: Vec<f32>,
    unknown_cost: f32,
    hard_square: i16,
    inflated_square: i16,
}

/// A metre through a gap that leaves no margin counts as so many: the body gets through, but slowly.
const TIGHT_COST: f32 = 3.0;

/// How much room a route must keep.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Room {
    /// Radius and margin.
    Comfortable,
    /// The bare radius.
    Tight,
}

impl Terrain {
    /// For one geometry and body.
    #[must_use]
    pub fn new(geometry: GridGeometry, body: &BodyConfig, unknown: UnknownCells) -> Self {
        let cells = |metres: f64| metres / geometry.resolution_m;
        let inflated = cells(body.radius_m + body.margin_m);
        let hard = (cells(body.radius_m) - 0.25).max(0.5);
        let reach = (cells(body.clearance_m).ceil().max(inflated.ceil() + 1.0) as usize).clamp(2, 100);
        let soft = reach as f64;
        let price = |square: usize, closed_below: f64| {
            let distance = (square as f64).sqrt();
            if distance < closed_below {
                return f32::INFINITY;
            }
            let nearness = ((soft - distance) / (soft - hard).max(1.0)).clamp(0.0, 1.0);
            (1.0 + 2.0 * nearness * nearness) as f32
        };
        let squares = 0..=reach * reach;
        Self {
            geometry,
            window: Window { column_min: 0, column_max: 0, row_min: 0, row_max: 0 },
            reach,
            square: vec![(reach * reach) as i16; geometry.len()],
            column_distance: vec![0; geometry.len()],
            cost: squares.clone().map(|s| price(s, inflated)).collect(),
            cost_tight: squares.map(|s| price(s, hard)).collect(),
            unknown_cost: match unknown {
                UnknownCells::Closed => f32::INFINITY,
                UnknownCells::Open { cost } => cost,
            },
            hard_square: (hard * hard).ceil() as i16,
            inflated_square: (inflated * inflated).ceil() as i16,
        }
    }

    /// Measures the distances inside `window` (which must keep one cell off the border, see [`Window::grown`]).
    pub fn survey(&mut self, map: &OccupancyGrid, window: Window) {
        self.window = window;
        self.measure_columns(map);
        self.measure_rows();
    }

    /// The body stands here, so there is room for it: what lies under it costs no more than the margin does.
    pub fn stand_at(&mut self, map: &OccupancyGrid, pose: &PlanarPose, radius_m: f64) {
        for (column, row) in Window::around(&self.geometry, (pose.x_m, pose.y_m), radius_m).cells() {
            let (x, y) = self.geometry.centre(column, row);
            if pose.distance_to(x, y) <= radius_m && map.at(column, row) != Cell::Occupied {
                let square = &mut self.square[self.geometry.index(column, row)];
                *square = (*square).max(self.inflated_square);
            }
        }
    }

    /// The window measured last.
    #[must_use]
    pub fn window(&self) -> Window {
        self.window
    }

    /// The grid it belongs to.
    #[must_use]
    pub fn geometry(&self) -> &GridGeometry {
        &self.geometry
    }

    /// Cost per cell for a route through known free cells and, if allowed, unknown ones; infinite where closed.
    #[inline]
    #[must_use]
    pub fn cost(&self, map: &OccupancyGrid, index: usize, room: Room) -> f32 {
        let square = self.square[index] as usize;
        let price = match room {
            Room::Comfortable => self.cost[square],
            Room::Tight => self.cost_tight[square],
        };
        match map.cells[index] {
            Cell::Free => price,
            Cell::Unknown => price * self.unknown_cost,
            Cell::Occupied => f32::INFINITY,
        }
    }

    /// 1 for a free cell with room for the body and its margin, more where only the bare body fits, infinite otherwise.
    #[inline]
    #[must_use]
    pub fn distance_cost(&self, map: &OccupancyGrid, index: usize) -> f32 {
        match (map.cells[index], self.square[index]) {
            (Cell::Free, square) if square >= self.inflated_square => 1.0,
            (Cell::Free, square) if square >= self.hard_square => TIGHT_COST,
            _ => f32::INFINITY,
        }
    }

    /// Squared distance to the nearest obstacle, cells, capped.
    #[must_use]
    pub fn square_at(&self, x_m: f64, y_m: f64) -> i16 {
        match self.geometry.cell_at(x_m, y_m) {
            Some((column, row)) if self.window.contains(column, row) => self.square[self.geometry.index(column, row)],
            _ => 0,
        }
    }

    /// Squared distance below which the bare body touches, cells.
    #[must_use]
    pub fn hard_square(&self) -> i16 {
        self.hard_square
    }

    fn measure_columns(&mut self, map: &OccupancyGrid) {
        let (width, cap) = (self.geometry.width, self.reach as i16);
        let w = self.window;
        // Distances stay below a hundred cells, so nothing here can wrap; plain sums would keep the loops from vectorising.
        for row in w.row_min..w.row_max {
            let line = row * width + w.column_min..row * width + w.column_max;
            let (above, rest) = self.column_distance.split_at_mut(line.start);
            let here = &mut rest[..line.len()];
            let cells = &map.cells[line.clone()];
            if row == w.row_min {
                here.fill(cap);
            } else {
                here.copy_from_slice(&above[line.start - width..line.end - width]);
            }
            for (distance, cell) in here.iter_mut().zip(cells) {
                *distance = if *cell == Cell::Occupied { 0 } else { distance.wrapping_add(1).min(cap) };
            }
        }
        for row in (w.row_min..w.row_max.saturating_sub(1)).rev() {
            let line = row * width + w.column_min..row * width + w.column_max;
            let (head, below) = self.column_distance.split_at_mut(line.end);
            let below = &below[width - line.len()..][..line.len()];
            for (distance, after) in head[line.start..].iter_mut().zip(below) {
                *distance = (*distance).min(after.wrapping_add(1));
            }
        }
    }

    fn measure_rows(&mut self) {
        let (width, reach) = (self.geometry.width, self.reach);
        let w = self.window;
        for row in w.row_min..w.row_max {
            let line = row * width + w.column_min..row * width + w.column_max;
            for at in line.clone() {
                self.column_distance[at] *= self.column_distance[at];
            }
            self.square[line.clone()].copy_from_slice(&self.column_distance[line.clone()]);
            let source = &self.column_distance[line.clone()];
            let nearest = &mut self.square[line];
            for shift in 1..=reach.min(source.len().saturating_sub(1)) {
                let extra = (shift * shift) as i16;
                let n = source.len() - shift;
                for (to, from) in nearest[..n].iter_mut().zip(&source[shift..]) {
                    *to = (*to).min(from.wrapping_add(extra));
                }
                for (to, from) in nearest[shift..].iter_mut().zip(&source[..n]) {
                    *to = (*to).min(from.wrapping_add(extra));
                }
            }
        }
    }
}
