//! The occupancy grid: what planner, discovery policies and people look at.

/// What is known of a cell.
#[derive(Copy, Clone, Debug, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Cell {
    /// Never seen.
    Unknown = 0,
    /// Seen, and nothing is in the way.
    Free = 1,
    /// Something a robot would hit.
    Occupied = 2,
}

/// Where a grid lies: cell (column, row) covers `resolution_m` squared, its lower corner at
/// `origin + (column, row) * resolution`, x along columns and y along rows, in the odometry frame.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct GridGeometry {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Side of a cell, metres.
    pub resolution_m: f64,
    /// x of the lower corner of cell (0, 0), metres.
    pub origin_x_m: f64,
    /// y of the lower corner of cell (0, 0), metres.
    pub origin_y_m: f64,
}

impl GridGeometry {
    /// A square of `side_m` metres centred on the frame's origin.
    #[must_use]
    pub fn centred(side_m: f64, resolution_m: f64) -> Self {
        let n = (side_m / resolution_m).round().max(1.0) as usize;
        let half = 0.5 * n as f64 * resolution_m;
        Self { width: n, height: n, resolution_m, origin_x_m: -half, origin_y_m: -half }
    }

    /// Number of cells.
    #[must_use]
    pub fn len(&self) -> usize {
        self.width * self.height
    }

    /// True if the grid has no cells.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The cell (column, row) that holds a point, or `None` outside the grid or for a point that is not finite.
    #[must_use]
    pub fn cell_at(&self, x_m: f64, y_m: f64) -> Option<(usize, usize)> {
        let c = ((x_m - self.origin_x_m) / self.resolution_m).floor();
        let r = ((y_m - self.origin_y_m) / self.resolution_m).floor();
        (c >= 0.0 && r >= 0.0 && c < self.width as f64 && r < self.height as f64).then_some((c as usize, r as usize))
    }

    /// Centre of a cell, metres (x, y).
    #[must_use]
    pub fn centre(&self, column: usize, row: usize) -> (f64, f64) {
        (
            self.origin_x_m + (column as f64 + 0.5) * self.resolution_m,
            self.origin_y_m + (row as f64 + 0.5) * self.resolution_m,
        )
    }

    /// Index of a cell in row-major storage.
    #[must_use]
    pub fn index(&self, column: usize, row: usize) -> usize {
        row * self.width + column
    }
}

/// A grid of cells, row-major.
#[derive(Clone, Debug, PartialEq)]
pub struct OccupancyGrid {
    /// Where it lies.
    pub geometry: GridGeometry,
    /// `geometry.len()` cells, row-major.
    pub cells: Vec<Cell>,
}

impl OccupancyGrid {
    /// All unknown.
    #[must_use]
    pub fn unknown(geometry: GridGeometry) -> Self {
        Self { geometry, cells: vec![Cell::Unknown; geometry.len()] }
    }

    /// The cell at (column, row); outside the grid everything is unknown.
    #[must_use]
    pub fn at(&self, column: usize, row: usize) -> Cell {
        if column < self.geometry.width && row < self.geometry.height {
            self.cells[self.geometry.index(column, row)]
        } else {
            Cell::Unknown
        }
    }
}
