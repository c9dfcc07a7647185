//! A planar laser scanner: exact ranges to the triangles it cuts.

use core::f64::consts::TAU;

use homing_core::{GridGeometry, LaserScan, PlanarPose, Stamp};

use crate::raster::{Corner, cells_under, solid_triangles};
use crate::scene::Scene;

/// Side of the cells by which segments are found, metres.
const BUCKET_M: f64 = 0.1;
/// Most buckets; larger scenes get larger buckets.
const BUCKETS_MAX: f64 = 4e6;

/// What a scanner measures.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct LaserConfig {
    /// Rays, evenly around.
    pub rays: usize,
    /// Shorter returns are invalid, metres.
    pub range_min_m: f64,
    /// Longer returns are none, metres.
    pub range_max_m: f64,
}

impl Default for LaserConfig {
    fn default() -> Self {
        Self { rays: 360, range_min_m: 0.1, range_max_m: 12.0 }
    }
}

/// The outline of a scene at the height of a scanner.
#[derive(Clone, Debug, PartialEq)]
pub struct LaserSlice {
    geometry: GridGeometry,
    segments: Vec<[f64; 4]>,
    first: Vec<u32>,
    members: Vec<u32>,
}

impl LaserSlice {
    /// Cuts the solid triangles of a scene at a height of the world frame, metres.
    #[must_use]
    pub fn new(scene: &Scene, z_m: f64) -> Self {
        let segments: Vec<[f64; 4]> = solid_triangles(scene).filter_map(|t| cut(&t, z_m)).collect();
        let geometry = geometry_around(&segments);
        let mut pairs: Vec<(u32, u32)> = Vec::new();
        for (k, s) in segments.iter().enumerate() {
            let line = [[s[0], s[1], 0.0], [s[2], s[3], 0.0]];
            cells_under(&line, &geometry, |i| pairs.push((i as u32, k as u32)));
        }
        pairs.sort_unstable();
        let mut first = vec![0_u32; geometry.len() + 1];
        pairs.iter().for_each(|(cell, _)| first[*cell as usize + 1] += 1);
        for i in 0..geometry.len() {
            first[i + 1] += first[i];
        }
        Self { geometry, segments, first, members: pairs.into_iter().map(|(_, k)| k).collect() }
    }

    /// Metres from a point of the world frame to the first thing in a direction (radians), or `None` beyond
    /// `range_max_m`. Walks the buckets (Amanatides and Woo 1987).
    #[must_use]
    pub fn range_m(&self, (x_m, y_m): (f64, f64), angle_rad: f64, range_max_m: f64) -> Option<f64> {
        let direction = [libm::cos(angle_rad), libm::sin(angle_rad)];
        let g = &self.geometry;
        let position = [(x_m - g.origin_x_m) / g.resolution_m, (y_m - g.origin_y_m) / g.resolution_m];
        let mut cell = position.map(f64::floor);
        let mut nearest = range_max_m;
        let mut entered = 0.0;
        while entered <= nearest {
            if cell[0] >= 0.0 && cell[1] >= 0.0 && cell[0] < g.width as f64 && cell[1] < g.height as f64 {
                let index = g.index(cell[0] as usize, cell[1] as usize);
                for k in &self.members[self.first[index] as usize..self.first[index + 1] as usize] {
                    if let Some(t) = hit(&self.segments[*k as usize], (x_m, y_m), direction) {
                        nearest = nearest.min(t);
                    }
                }
            }
            let leave: [f64; 2] = core::array::from_fn(|k| {
                let border = if direction[k] > 0.0 { cell[k] + 1.0 } else { cell[k] };
                if direction[k] == 0.0 { f64::MAX } else { (border - position[k]) / direction[k] * g.resolution_m }
            });
            let axis = usize::from(leave[1] < leave[0]);
            entered = leave[axis];
            cell[axis] += if direction[axis] > 0.0 { 1.0 } else { -1.0 };
        }
        (nearest < range_max_m).then_some(nearest)
    }

    /// A full turn from behind the robot, counter-clockwise.
    #[must_use]
    pub fn scan(&self, t_world_base: &PlanarPose, config: &LaserConfig, stamp: Stamp) -> LaserScan {
        let n = config.rays.max(1);
        let (angle_min_rad, angle_increment_rad) = (-0.5 * TAU, TAU / n as f64);
        let from = (t_world_base.x_m, t_world_base.y_m);
        let ranges_m = (0..n)
            .map(|k| {
                let angle = t_world_base.yaw_rad + angle_min_rad + k as f64 * angle_increment_rad;
                let range = self.range_m(from, angle, config.range_max_m);
                range.filter(|r| *r >= config.range_min_m).map_or(f32::INFINITY, |r| r as f32)
            })
            .collect();
        LaserScan {
            stamp,
            angle_min_rad,
            angle_increment_rad,
            range_min_m: config.range_min_m,
            range_max_m: config.range_max_m,
            ranges_m,
        }
    }
}

/// The segment in which a triangle meets the plane at height `z_m`.
fn cut(t: &[Corner; 3], z_m: f64) -> Option<[f64; 4]> {
    let mut ends: Vec<(f64, f64)> = Vec::with_capacity(2);
    for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
        // A corner exactly on the plane counts as above it, so that every triangle is cut twice or not at all.
        if (a[2] >= z_m) != (b[2] >= z_m) {
            let s = (z_m - a[2]) / (b[2] - a[2]);
            ends.push((a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1])));
        }
    }
    match ends[..] {
        [p, q] => Some([p.0, p.1, q.0, q.1]),
        _ => None,
    }
}

fn geometry_around(segments: &[[f64; 4]]) -> GridGeometry {
    let all = |k: usize| segments.iter().flat_map(move |s| [s[k], s[k + 2]]);
    let (x0, x1) = all(0).fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(v), h.max(v)));
    let (y0, y1) = all(1).fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(v), h.max(v)));
    if segments.is_empty() {
        return GridGeometry { width: 1, height: 1, resolution_m: BUCKET_M, origin_x_m: 0.0, origin_y_m: 0.0 };
    }
    let side = libm::sqrt((x1 - x0) * (y1 - y0) / BUCKETS_MAX).max(BUCKET_M);
    let cells = |low: f64, high: f64| ((high - low) / side).floor() as usize + 1;
    GridGeometry { width: cells(x0, x1), height: cells(y0, y1), resolution_m: side, origin_x_m: x0, origin_y_m: y0 }
}

/// Metres along a ray to a segment, both ends included.
fn hit(s: &[f64; 4], (x, y): (f64, f64), d: [f64; 2]) -> Option<f64> {
    let (ex, ey) = (s[2] - s[0], s[3] - s[1]);
    let determinant = d[0] * ey - d[1] * ex;
    if determinant.abs() < 1e-12 {
        return None;
    }
    let (px, py) = (s[0] - x, s[1] - y);
    let along = (px * ey - py * ex) / determinant;
    let share = (px * d[1] - py * d[0]) / determinant;
    (along >= 0.0 && (-1e-9..=1.0 + 1e-9).contains(&share)).then_some(along)
}
