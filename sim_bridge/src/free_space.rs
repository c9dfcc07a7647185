//! The part of a scene's floor where a robot of one radius can be, all connected.

use homing_core::GridGeometry;

/// Where the centre of a robot of one radius can be and go.
#[derive(Clone, Debug, PartialEq)]
pub struct FreeSpace {
    geometry: GridGeometry,
    radius_m: f64,
    free: Vec<bool>,
    cells: usize,
}

impl FreeSpace {
    /// The largest connected set of cells whose clearance (metres, row-major) exceeds a radius; the first of equally
    /// large ones.
    pub(crate) fn largest(geometry: GridGeometry, clearance_m: &[f32], radius_m: f64) -> Self {
        let fits = |i: usize| f64::from(clearance_m[i]) > radius_m;
        let mut label = vec![0_u32; geometry.len()];
        let mut sizes = vec![0_usize];
        for seed in 0..geometry.len() {
            if label[seed] == 0 && fits(seed) {
                let name = sizes.len() as u32;
                sizes.push(flood(&mut label, seed, name, &geometry, fits));
            }
        }
        let largest = (0..sizes.len()).rev().max_by_key(|i| sizes[*i]).unwrap_or(0);
        let free = label.iter().map(|l| *l as usize == largest && largest > 0).collect();
        Self { geometry, radius_m, free, cells: sizes[largest] }
    }

    /// Where the grid lies, world frame.
    #[must_use]
    pub fn geometry(&self) -> &GridGeometry {
        &self.geometry
    }

    /// Radius it was made for, metres.
    #[must_use]
    pub fn radius_m(&self) -> f64 {
        self.radius_m
    }

    /// Square metres.
    #[must_use]
    pub fn area_m2(&self) -> f64 {
        self.cells as f64 * self.geometry.resolution_m * self.geometry.resolution_m
    }

    /// One flag a cell, row-major: the robot can be at the cell's centre.
    #[must_use]
    pub fn cells(&self) -> &[bool] {
        &self.free
    }

    /// True if the cell that holds the point, world frame, metres, is free.
    #[must_use]
    pub fn contains(&self, x_m: f64, y_m: f64) -> bool {
        self.geometry.cell_at(x_m, y_m).is_some_and(|(c, r)| self.free[self.geometry.index(c, r)])
    }

    /// The point itself if it is free, else the centre of the nearest free cell at most `within_m` metres away; world
    /// frame, metres.
    #[must_use]
    pub fn nearest(&self, x_m: f64, y_m: f64, within_m: f64) -> Option<(f64, f64)> {
        if self.contains(x_m, y_m) {
            return Some((x_m, y_m));
        }
        let g = &self.geometry;
        let cell = |v: f64, origin: f64, n: usize| (((v - origin) / g.resolution_m).max(0.0) as usize).min(n);
        let columns = cell(x_m - within_m, g.origin_x_m, g.width)..cell(x_m + within_m, g.origin_x_m, g.width - 1) + 1;
        let rows = cell(y_m - within_m, g.origin_y_m, g.height)..cell(y_m + within_m, g.origin_y_m, g.height - 1) + 1;
        let free = rows.flat_map(|r| columns.clone().map(move |c| (c, r))).filter(|(c, r)| self.free[g.index(*c, *r)]);
        let far = |p: &(f64, f64)| libm::hypot(p.0 - x_m, p.1 - y_m);
        free.map(|(c, r)| g.centre(c, r)).filter(|p| far(p) <= within_m).min_by(|a, b| far(a).total_cmp(&far(b)))
    }

    /// True if every cell on the straight line between two points is free.
    #[must_use]
    pub fn line_is_free(&self, from: (f64, f64), to: (f64, f64)) -> bool {
        let (dx, dy) = (to.0 - from.0, to.1 - from.1);
        let n = (libm::sqrt(dx * dx + dy * dy) / (0.4 * self.geometry.resolution_m)).ceil().max(1.0);
        (0..=n as u32).all(|k| {
            let s = f64::from(k) / n;
            self.contains(from.0 + s * dx, from.1 + s * dy)
        })
    }

    /// Centre of the `n`-th free cell, counted row by row, world frame, metres.
    #[must_use]
    pub fn nth(&self, n: usize) -> Option<(f64, f64)> {
        let index = (0..self.free.len()).filter(|i| self.free[*i]).nth(n)?;
        Some(self.geometry.centre(index % self.geometry.width, index / self.geometry.width))
    }

    /// Number of free cells.
    #[must_use]
    pub fn len(&self) -> usize {
        self.cells
    }

    /// Never true: a free space has at least a square metre.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.cells == 0
    }
}

/// Names all cells that hang together with `seed` and says how many they are.
fn flood(label: &mut [u32], seed: usize, name: u32, g: &GridGeometry, free: impl Fn(usize) -> bool) -> usize {
    let mut stack = vec![seed];
    label[seed] = name;
    let mut n = 0;
    while let Some(at) = stack.pop() {
        n += 1;
        let (column, row) = (at % g.width, at / g.width);
        let near = [
            (column > 0).then(|| at - 1),
            (column + 1 < g.width).then_some(at + 1),
            (row > 0).then(|| at - g.width),
            (row + 1 < g.height).then_some(at + g.width),
        ];
        for next in near.into_iter().flatten() {
            if label[next] == 0 && free(next) {
                label[next] = name;
                stack.push(next);
            }
        }
    }
    n
}
