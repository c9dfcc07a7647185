//! Which small cubes of space hold a surface: what light and its absence are traced through.

use crate::scene::Scene;

/// Side of a cube where the scene is small enough, metres.
const CELL_M: f32 = 0.08;
/// Cubes at most.
const CELLS_MAX: f32 = 24e6;

/// A box of cubes, one byte each.
pub struct Occupancy {
    cells: Vec<bool>,
    size: [usize; 3],
    low: [f32; 3],
    per_metre: f32,
}

impl Occupancy {
    /// Marks every cube that a lit triangle passes through. Unlit ones (lamp shades, windows) stop no light.
    pub fn new(scene: &Scene) -> Self {
        let corners = scene.meshes.iter().flat_map(|m| &m.vertices).map(|v| v.position);
        let (mut low, mut high) = ([f32::MAX; 3], [f32::MIN; 3]);
        for p in corners.filter(|p| p.iter().all(|c| c.abs() < 1e5)) {
            for k in 0..3 {
                low[k] = low[k].min(p[k] - 0.2);
                high[k] = high[k].max(p[k] + 0.2);
            }
        }
        let extent: [f32; 3] = core::array::from_fn(|k| (high[k] - low[k]).max(0.1));
        let cell = CELL_M.max(libm::cbrtf(extent[0] * extent[1] * extent[2] / CELLS_MAX));
        let size = extent.map(|e| ((e / cell) as usize + 1).min(1 << 13));
        let cells = vec![false; size[0] * size[1] * size[2]];
        let mut grid = Self { cells, size, low, per_metre: 1.0 / cell };
        for mesh in &scene.meshes {
            if scene.materials.get(mesh.material).is_some_and(|m| m.unlit) {
                continue;
            }
            for triangle in &mesh.triangles {
                let [a, b, c] = triangle.map(|i| mesh.vertices.get(i as usize).map(|v| v.position));
                if let (Some(a), Some(b), Some(c)) = (a, b, c) {
                    grid.mark(a, b, c, 0.5 * cell);
                }
            }
        }
        grid
    }

    /// Marks points spread over a triangle, at most `spacing` metres apart.
    fn mark(&mut self, a: [f32; 3], b: [f32; 3], c: [f32; 3], spacing: f32) {
        let (ab, ac): ([f32; 3], [f32; 3]) =
            (core::array::from_fn(|k| b[k] - a[k]), core::array::from_fn(|k| c[k] - a[k]));
        let length = |v: &[f32; 3]| (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
        let steps = |v: &[f32; 3]| ((length(v) / spacing).min(4096.0) as u32 + 1) as f32;
        let (n, m) = (steps(&ab), steps(&ac));
        for i in 0..=n as u32 {
            let s = i as f32 / n;
            for j in 0..=(m * (1.0 - s)) as u32 {
                let t = j as f32 / m;
                if let Some(cell) = self.cell(core::array::from_fn(|k| a[k] + s * ab[k] + t * ac[k])) {
                    self.cells[cell] = true;
                }
            }
        }
    }

    fn cell(&self, p: [f32; 3]) -> Option<usize> {
        let at: [f32; 3] = core::array::from_fn(|k| (p[k] - self.low[k]) * self.per_metre);
        let inside = (0..3).all(|k| at[k] >= 0.0 && at[k] < self.size[k] as f32);
        inside.then(|| (at[2] as usize * self.size[1] + at[1] as usize) * self.size[0] + at[0] as usize)
    }

    /// True if the cube at a point (world frame, metres) holds a surface.
    #[inline]
    pub fn holds(&self, p: [f32; 3]) -> bool {
        self.cell(p).is_some_and(|cell| self.cells[cell])
    }

    /// Side of a cube, metres.
    pub fn cell_m(&self) -> f32 {
        1.0 / self.per_metre
    }

    /// True if nothing lies on the straight way between two points.
    pub fn is_free(&self, from: [f32; 3], to: [f32; 3]) -> bool {
        let d: [f32; 3] = core::array::from_fn(|k| to[k] - from[k]);
        let length = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
        let n = (length * self.per_metre * 1.1).min(4096.0) as u32 + 1;
        !(0..n).any(|i| {
            let t = i as f32 / n as f32;
            self.holds(core::array::from_fn(|k| from[k] + t * d[k]))
        })
    }
}
