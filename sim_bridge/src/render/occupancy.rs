//! Which small cubes of space hold a surface: what light and its absence are traced through.

use crate::scene::Scene;

/// Side of a cube where the scene is small enough, metres.
const CELL_M: f32 = 0.08;
/// Cubes at most.
const CELLS_MAX: f32 = 24e6;

/// Most steps on one way; longer ones are taken in larger steps.
const STEPS_MAX: f32 = 4096.0;

/// A box of cubes, one byte each.
pub struct Occupancy {
    /// Cubes to the nearest one that holds a surface, along the axis that is farthest off; 0 for those that do.
    gaps: Vec<u8>,
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
        let gaps = vec![u8::MAX; size[0] * size[1] * size[2]];
        let mut grid = Self { gaps, size, low, per_metre: 1.0 / cell };
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
        grid.measure_gaps();
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
                    self.gaps[cell] = 0;
                }
            }
        }
    }

    /// Chessboard distances in two passes over all neighbours (Rosenfeld and Pfaltz 1968).
    fn measure_gaps(&mut self) {
        let [width, depth, height] = self.size;
        let (mut near, mut row) = (vec![u8::MAX; width + 2], vec![u8::MAX; width + 2]);
        for forward in [true, false] {
            for k in 0..height * depth {
                let k = if forward { k } else { height * depth - 1 - k };
                let (y, z) = (k % depth, k / depth);
                // The row beside this one, and three of the layer below: all of them passed before.
                let (z_past, y_past) =
                    if forward { (z.checked_sub(1), y.wrapping_sub(1)) } else { (Some(z + 1), y + 1) };
                near.fill(u8::MAX);
                let below = z_past.into_iter().flat_map(|z| [(y.wrapping_sub(1), z), (y, z), (y + 1, z)]);
                for (y, z) in below.chain([(y_past, z)]).filter(|(y, z)| *y < depth && *z < height) {
                    let passed = &self.gaps[(z * depth + y) * width..(z * depth + y + 1) * width];
                    near[1..=width].iter_mut().zip(passed).for_each(|(n, p)| *n = (*n).min(*p));
                }
                let here = &mut self.gaps[k * width..(k + 1) * width];
                for (i, gap) in here.iter().enumerate() {
                    row[i + 1] = near[i].min(near[i + 1]).min(near[i + 2]).saturating_add(1).min(*gap);
                }
                for i in 1..=width {
                    let i = if forward { i } else { width + 1 - i };
                    let beside = if forward { row[i - 1] } else { row[i + 1] };
                    row[i] = row[i].min(beside.saturating_add(1));
                }
                here.copy_from_slice(&row[1..=width]);
            }
        }
    }

    #[inline]
    fn cell(&self, p: [f32; 3]) -> Option<usize> {
        let at: [f32; 3] = core::array::from_fn(|k| (p[k] - self.low[k]) * self.per_metre);
        let inside = (0..3).all(|k| at[k] >= 0.0 && at[k] < self.size[k] as i32 as f32);
        inside.then(|| {
            let [x, y, z] = at.map(|c| c as i32 as usize);
            (z * self.size[1] + y) * self.size[0] + x
        })
    }

    /// True if the cube at a point (world frame, metres) holds a surface.
    #[inline]
    pub fn holds(&self, p: [f32; 3]) -> bool {
        self.cell(p).is_some_and(|cell| self.gaps[cell] == 0)
    }

    /// Side of a cube, metres.
    pub fn cell_m(&self) -> f32 {
        1.0 / self.per_metre
    }

    /// True if nothing lies on the straight way between two points: asked at steps a little shorter than a cube, of which
    /// those are left out that cannot reach a surface.
    pub fn is_free(&self, from: [f32; 3], to: [f32; 3]) -> bool {
        let d: [f32; 3] = core::array::from_fn(|k| to[k] - from[k]);
        let length = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
        let n = (length * self.per_metre * 1.1).min(STEPS_MAX) as u32 + 1;
        let leaps = length * self.per_metre < n as f32;
        let mut i = 0;
        while i < n {
            let t = i as f32 / n as f32;
            let gap = self.cell(core::array::from_fn(|k| from[k] + t * d[k])).map_or(1, |cell| self.gaps[cell]);
            if gap == 0 {
                return false;
            }
            i += if leaps { u32::from(gap) } else { 1 };
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flat::{Detail, generate_as};

    fn holds_on_the_way(grid: &Occupancy, from: [f32; 3], to: [f32; 3]) -> bool {
        let d: [f32; 3] = core::array::from_fn(|k| to[k] - from[k]);
        let length = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
        let n = (length * grid.per_metre * 1.1) as u32 + 1;
        (0..n).any(|i| grid.holds(core::array::from_fn(|k| from[k] + i as f32 / n as f32 * d[k])))
    }

    #[test]
    fn leaping_misses_nothing() {
        let grid = Occupancy::new(&generate_as(3, Detail::Shape).scene);
        let point = |k: u32| -> [f32; 3] {
            let share = |step: u32| (k.wrapping_mul(step) >> 8) as f32 / 16_777_216.0;
            [9.5 * share(2_654_435_769) - 0.2, 8.5 * share(2_246_822_519) - 0.2, 2.8 * share(3_266_489_917) - 0.1]
        };
        let mut free = 0;
        for k in 0..20_000 {
            let (from, far) = (point(2 * k), point(2 * k + 1));
            let to: [f32; 3] = core::array::from_fn(|i| from[i] + 0.25 * (far[i] - from[i]));
            let expected = !holds_on_the_way(&grid, from, to);
            assert_eq!(grid.is_free(from, to), expected, "{from:?} to {to:?}");
            free += u32::from(expected);
        }
        assert!((100..19_900).contains(&free), "{free} ways are free");
    }

    #[test]
    fn gaps_are_chessboard_distances() {
        let (size, held) = ([9, 7, 6], [[2, 3, 1], [8, 0, 5]]);
        let mut grid = Occupancy { gaps: vec![u8::MAX; 9 * 7 * 6], size, low: [0.0; 3], per_metre: 1.0 };
        let index = |p: [usize; 3]| (p[2] * size[1] + p[1]) * size[0] + p[0];
        held.iter().for_each(|p| grid.gaps[index(*p)] = 0);
        grid.measure_gaps();
        for p in (0..9 * 7 * 6_usize).map(|i| [i % 9, i / 9 % 7, i / 63]) {
            let far = |q: &[usize; 3]| (0..3).map(|k| p[k].abs_diff(q[k])).max().unwrap_or(0);
            let nearest = held.iter().map(far).min().unwrap_or(0);
            assert_eq!(usize::from(grid.gaps[index(p)]), nearest, "{p:?}");
        }
    }
}
