//! From clusters to triangles as linear functions of the pixel, and these sorted into bands of rows.

use homing_core::{Camera, Intrinsics, Transform};
use rayon::prelude::*;

use crate::render::NEAR_M;
use crate::render::geometry::{Cluster, Corner, Geometry};
use crate::scene::World;

/// Clusters set up by one task.
const CLUSTERS_PER_TASK: usize = 8;

/// A camera at a pose, as numbers.
pub struct View {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
    // Rows of the rotation from world to camera axes.
    axes: [[f64; 3]; 3],
    // Position in the world, metres.
    eye: [f64; 3],
    // Inward normals of the image's four sides and of the near plane, world axes.
    sides: [[f64; 3]; 5],
    finite: bool,
}

/// `f(x, y) = x * f.x + y * f.y + f.c` over pixels.
#[derive(Copy, Clone, Debug, Default)]
pub struct Plane {
    /// Per column.
    pub x: f64,
    /// Per row.
    pub y: f64,
    /// At pixel (0, 0).
    pub c: f64,
}

impl Plane {
    /// Value at a pixel.
    #[inline]
    pub fn at(&self, x: f64, y: f64) -> f64 {
        self.x * x + self.y * y + self.c
    }
}

/// A triangle over the image. With barycentric weights `b`: `inverse_depth` is 1/z, `b1` and `b2` are b_1/z and b_2/z.
#[derive(Clone, Debug)]
pub struct ScreenTriangle {
    /// Number of the triangle in the geometry.
    pub index: u32,
    /// Number of its look.
    pub look: u32,
    /// First row it may touch.
    pub row_first: i32,
    /// Last row it may touch.
    pub row_last: i32,
    /// Columns at which a row crosses an edge, as (slope, offset) over the row number: left bounds first.
    pub crossings: [(f64, f64); 4],
    /// How many of `crossings` bound from the left.
    pub n_left: u8,
    /// How many are in use.
    pub n_crossings: u8,
    /// Whether pixels may be holes.
    pub cut_out: bool,
    /// Smallest and largest 1/z of its corners.
    pub inverse_depth_range: (f32, f32),
    /// 1/z.
    pub inverse_depth: Plane,
    /// b_1/z.
    pub b1: Plane,
    /// b_2/z.
    pub b2: Plane,
}

impl View {
    /// From the camera's intrinsics and pose.
    pub fn new(camera: &Intrinsics, t_world_camera: &Transform<World, Camera>) -> Self {
        let rotation = t_world_camera.rotation().to_rotation_matrix();
        let r = rotation.matrix();
        let axes = [0, 1, 2].map(|k| [r[(0, k)], r[(1, k)], r[(2, k)]]);
        let eye = t_world_camera.translation();
        let (fx, fy, cx, cy) = (camera.fx(), camera.fy(), camera.cx(), camera.cy());
        let (width, height) = (camera.width() as usize, camera.height() as usize);
        // Half a pixel beyond the outermost centres, so that nothing is lost to rounding.
        let (left, right) = ((-0.5 - cx) / fx, (width as f64 - 0.5 - cx) / fx);
        let (top, bottom) = ((-0.5 - cy) / fy, (height as f64 - 0.5 - cy) / fy);
        let normals = [[1.0, 0.0, -left], [-1.0, 0.0, right], [0.0, 1.0, -top], [0.0, -1.0, bottom], [0.0, 0.0, 1.0]];
        let to_world =
            |n: [f64; 3]| core::array::from_fn(|k| n[0] * axes[0][k] + n[1] * axes[1][k] + n[2] * axes[2][k]);
        Self {
            width,
            height,
            fx,
            fy,
            cx,
            cy,
            axes,
            eye: [eye.x, eye.y, eye.z],
            sides: normals.map(to_world),
            finite: t_world_camera.is_finite(),
        }
    }

    fn sees(&self, cluster: &Cluster) -> bool {
        self.finite
            && self.sides.iter().all(|n| {
                let reach: f64 =
                    (0..3).map(|k| n[k] * (cluster.centre[k] - self.eye[k]) + n[k].abs() * cluster.half[k]).sum();
                reach > -1e-6
            })
    }

    fn to_camera(&self, corner: &Corner) -> [f64; 3] {
        let d: [f64; 3] = core::array::from_fn(|k| f64::from(corner.position[k]) - self.eye[k]);
        core::array::from_fn(|k| self.axes[k][0] * d[0] + self.axes[k][1] * d[1] + self.axes[k][2] * d[2])
    }

    /// The plane `n . ray(x, y)` with the ray through a pixel at unit depth.
    fn plane(&self, n: [f64; 3]) -> Plane {
        let (x, y) = (n[0] / self.fx, n[1] / self.fy);
        Plane { x, y, c: n[2] - x * self.cx - y * self.cy }
    }
}

/// Visible triangles in the geometry's order, a list per task.
pub fn triangles(geometry: &Geometry, view: &View) -> Vec<Vec<ScreenTriangle>> {
    let visible: Vec<&Cluster> = geometry.clusters.iter().filter(|c| view.sees(c)).collect();
    visible
        .par_chunks(CLUSTERS_PER_TASK)
        .map(|clusters| {
            let mut out = Vec::new();
            let mut corners = Vec::new();
            for cluster in clusters {
                corners.clear();
                corners.extend(geometry.corners[cluster.corners.clone()].iter().map(|c| view.to_camera(c)));
                set_up_cluster(geometry, view, cluster, &corners, &mut out);
            }
            out
        })
        .collect()
}

fn set_up_cluster(
    geometry: &Geometry,
    view: &View,
    cluster: &Cluster,
    corners: &[[f64; 3]],
    out: &mut Vec<ScreenTriangle>,
) {
    let look = &geometry.looks[cluster.look];
    for index in cluster.triangles.clone() {
        let v = geometry.triangles[index].map(|i| corners[i as usize - cluster.corners.start]);
        if let Some(mut triangle) = set_up(view, &v, look.double_sided) {
            triangle.index = index as u32;
            triangle.look = cluster.look as u32;
            triangle.cut_out = look.alpha_cutoff > 0.0;
            out.push(triangle);
        }
    }
}

/// One triangle, or nothing if it is behind the camera, faces away, or covers no pixel's centre.
fn set_up(view: &View, v: &[[f64; 3]; 3], double_sided: bool) -> Option<ScreenTriangle> {
    let nearest = v[0][2].min(v[1][2]).min(v[2][2]);
    let farthest = v[0][2].max(v[1][2]).max(v[2][2]);
    if farthest < NEAR_M {
        return None;
    }
    let edges = [cross(&v[1], &v[2]), cross(&v[2], &v[0]), cross(&v[0], &v[1])];
    // Positive for triangles seen from behind: the optical frame's y axis points down.
    let volume = dot(&v[0], &edges[0]);
    if volume == 0.0 || (volume > 0.0 && !double_sided) {
        return None;
    }
    let crosses_near = nearest < NEAR_M;
    let rows = if crosses_near { (0, view.height as i32 - 1) } else { touched_rows(view, v)? };
    let mut triangle = ScreenTriangle {
        index: 0,
        look: 0,
        row_first: rows.0,
        row_last: rows.1,
        crossings: [(0.0, 0.0); 4],
        n_left: 0,
        n_crossings: 0,
        cut_out: false,
        inverse_depth_range: ((1.0 / farthest) as f32, (1.0 / nearest.max(NEAR_M)) as f32),
        inverse_depth: Plane::default(),
        b1: Plane::default(),
        b2: Plane::default(),
    };
    let scale = 1.0 / volume;
    let planes = edges.map(|e| view.plane(e));
    let scaled = planes.map(|p| Plane { x: p.x * scale, y: p.y * scale, c: p.c * scale });
    let sum = |f: fn(&Plane) -> f64| f(&scaled[0]) + f(&scaled[1]) + f(&scaled[2]);
    triangle.inverse_depth = Plane { x: sum(|p| p.x), y: sum(|p| p.y), c: sum(|p| p.c) };
    (triangle.b1, triangle.b2) = (scaled[1], scaled[2]);
    for plane in &planes {
        bound(&mut triangle, plane, volume > 0.0)?;
    }
    if crosses_near {
        let q = triangle.inverse_depth;
        bound(&mut triangle, &Plane { x: -q.x, y: -q.y, c: 1.0 / NEAR_M - q.c }, true)?;
    }
    (triangle.row_first <= triangle.row_last).then_some(triangle)
}

/// Rows whose centres lie between the corners, or nothing if no pixel's centre lies in the bounding box.
fn touched_rows(view: &View, v: &[[f64; 3]; 3]) -> Option<(i32, i32)> {
    let px = v.map(|p| (view.fx * p[0] / p[2] + view.cx, view.fy * p[1] / p[2] + view.cy));
    let (left, right) = (px[0].0.min(px[1].0).min(px[2].0), px[0].0.max(px[1].0).max(px[2].0));
    let (top, bottom) = (px[0].1.min(px[1].1).min(px[2].1), px[0].1.max(px[1].1).max(px[2].1));
    let (first, last) = pixels_between(left, right, view.width)?;
    debug_assert!(first <= last);
    pixels_between(top, bottom, view.height)
}

/// How far a triangle reaches beyond its edges, pixels: seams between meshes whose corners were rounded stay closed.
pub const EDGE_SLACK_PX: f64 = 1.0 / 4096.0;

/// First and last pixel centre in `low..=high` (widened by the slack) within `0..side`.
#[inline]
pub fn pixels_between(low: f64, high: f64, side: usize) -> Option<(i32, i32)> {
    let low = (low - EDGE_SLACK_PX).max(0.0).min(side as f64);
    let high = (high + EDGE_SLACK_PX).max(-1.0).min(side as f64 - 1.0);
    let cut = low as i32;
    let first = cut + i32::from(f64::from(cut) < low);
    let last = (high + 1.0) as i32 - 1;
    (first <= last).then_some((first, last))
}

/// Adds the half plane in which `edge` is not negative (not positive for `!inside_positive`).
fn bound(triangle: &mut ScreenTriangle, edge: &Plane, inside_positive: bool) -> Option<()> {
    let sign = if inside_positive { 1.0 } else { -1.0 };
    if edge.x == 0.0 {
        return bound_rows(triangle, edge.y * sign, edge.c * sign);
    }
    let crossing = (-edge.y / edge.x, -edge.c / edge.x);
    let n = usize::from(triangle.n_crossings);
    triangle.crossings[n] = crossing;
    if edge.x * sign > 0.0 {
        triangle.crossings.swap(n, usize::from(triangle.n_left));
        triangle.n_left += 1;
    }
    triangle.n_crossings += 1;
    Some(())
}

/// A horizontal edge bounds the rows: `slope * row + offset >= 0`.
fn bound_rows(triangle: &mut ScreenTriangle, slope: f64, offset: f64) -> Option<()> {
    if slope == 0.0 {
        return (offset >= 0.0).then_some(());
    }
    let row = -offset / slope;
    let (low, high) = if slope > 0.0 { (row, f64::from(i32::MAX)) } else { (-1.0, row) };
    let (first, last) = pixels_between(low, high, 1 << 15)?;
    triangle.row_first = triangle.row_first.max(first);
    triangle.row_last = triangle.row_last.min(last);
    (triangle.row_first <= triangle.row_last).then_some(())
}

fn cross(a: &[f64; 3], b: &[f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn dot(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Triangles per band of rows, each band in the order of the geometry.
pub struct Bins<'a> {
    chunks: &'a [Vec<ScreenTriangle>],
    starts: Vec<usize>,
    // Task and place in its list.
    entries: Vec<(u32, u32)>,
}

impl<'a> Bins<'a> {
    /// Sorts triangles into `n_bands` bands of `band_rows` rows each.
    pub fn new(chunks: &'a [Vec<ScreenTriangle>], n_bands: usize, band_rows: usize) -> Self {
        let bands = |t: &ScreenTriangle| t.row_first as usize / band_rows..=t.row_last as usize / band_rows;
        let mut starts = vec![0_usize; n_bands + 1];
        for triangle in chunks.iter().flatten() {
            for band in bands(triangle) {
                starts[band + 1] += 1;
            }
        }
        for band in 0..n_bands {
            starts[band + 1] += starts[band];
        }
        let mut next = starts.clone();
        let mut entries = vec![(0, 0); starts[n_bands]];
        for (chunk, list) in chunks.iter().enumerate() {
            for (place, triangle) in list.iter().enumerate() {
                for band in bands(triangle) {
                    entries[next[band]] = (chunk as u32, place as u32);
                    next[band] += 1;
                }
            }
        }
        Self { chunks, starts, entries }
    }

    /// Entries of one band.
    pub fn of(&self, band: usize) -> core::ops::Range<usize> {
        self.starts[band]..self.starts[band + 1]
    }

    /// The triangle behind an entry.
    #[inline]
    pub fn triangle(&self, entry: usize) -> &'a ScreenTriangle {
        let (chunk, place) = self.entries[entry];
        &self.chunks[chunk as usize][place as usize]
    }
}
