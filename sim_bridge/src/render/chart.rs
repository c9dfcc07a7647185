//! Light maps of large flat faces: a coarse picture of the light on each, where corners alone would be too few.

use crate::render::light::{Light, Place, cross, unit};
use crate::scene::{Material, Mesh};

/// From one value of a chart to the next, metres.
const SPACING_M: f32 = 0.11;
/// Faces with no side longer than this are lit at their corners, metres.
const SIDE_MIN_M: f32 = 0.3;
/// Values along one side at most.
const VALUES_MAX: usize = 48;
/// The outermost values are taken this far inside: corners of rooms lie in the walls' cubes. Metres.
const INSET_M: f32 = 0.02;

/// The light on one face: a grid over the rectangle around it.
#[derive(Clone, Debug)]
pub struct Chart {
    /// Values along the first side.
    pub width: usize,
    /// Values along the second side.
    pub height: usize,
    /// What texels are multiplied with, display exponent, row-major; the fourth number is unused.
    pub values: Vec<[f32; 4]>,
}

/// The rectangle around a flat face.
struct Rectangle {
    origin: [f32; 3],
    axes: [[f32; 3]; 2],
    low: [f32; 2],
    sides: [f32; 2],
    normal: [f32; 3],
}

/// Bakes the light of a face of one or two triangles that lie in one plane, and says where on the chart each of the
/// mesh's vertices `corners` is. `None` for faces better lit at their corners.
pub fn bake(mesh: &Mesh, corners: &[u32], material: &Material, light: &Light<'_>) -> Option<(Chart, Vec<[f32; 2]>)> {
    if material.unlit || !mesh.colours.is_empty() {
        return None;
    }
    let rectangle = Rectangle::around(mesh, corners)?;
    let [width, height] = rectangle.sides.map(|side| ((side / SPACING_M) as usize + 2).min(VALUES_MAX));
    let value = |i: usize| {
        let share = [(i % width) as f32 / (width - 1) as f32, (i / width) as f32 / (height - 1) as f32];
        let place = Place { position: rectangle.point(share), normal: rectangle.normal };
        let [r, g, b] = light.factor(&place, [1.0; 3], material);
        [r, g, b, 0.0]
    };
    let values = (0..width * height).map(value).collect();
    let places = corners
        .iter()
        .map(|&i| {
            let [s, t] = rectangle.share(mesh.vertices[i as usize].position);
            [s * (width - 1) as f32, t * (height - 1) as f32]
        })
        .collect();
    Some((Chart { width, height, values }, places))
}

impl Rectangle {
    fn around(mesh: &Mesh, corners: &[u32]) -> Option<Self> {
        let points: Vec<[f32; 3]> = corners.iter().map(|&i| mesh.vertices[i as usize].position).collect();
        let to = |k: usize| -> [f32; 3] { core::array::from_fn(|c| points[k][c] - points[0][c]) };
        let first = unit(to(1));
        let normal = unit(cross(first, to(2)));
        if normal == [0.0; 3] {
            return None;
        }
        let smooth = corners.iter().any(|&i| dot(mesh.vertices[i as usize].normal, normal).abs() < 0.99);
        let bent = (3..points.len()).any(|k| dot(to(k), normal).abs() > 1e-3);
        // Authored normals say which side is lit.
        let facing = dot(mesh.vertices[corners[0] as usize].normal, normal) >= 0.0;
        let normal = if facing { normal } else { normal.map(|c| -c) };
        let mut rectangle =
            Self { origin: points[0], axes: [first, cross(normal, first)], low: [0.0; 2], sides: [0.0; 2], normal };
        for k in 0..2 {
            let along = (0..points.len()).map(|i| dot(to(i), rectangle.axes[k]));
            let (low, high) = along.fold((f32::MAX, f32::MIN), |(l, h), a| (l.min(a), h.max(a)));
            (rectangle.low[k], rectangle.sides[k]) = (low, high - low);
        }
        let large =
            rectangle.sides[0].max(rectangle.sides[1]) > SIDE_MIN_M && rectangle.sides.iter().all(|s| *s > 0.04);
        (large && !smooth && !bent).then_some(rectangle)
    }

    /// A point of the face by its shares of both sides, a little inside.
    fn point(&self, share: [f32; 2]) -> [f32; 3] {
        let along: [f32; 2] = core::array::from_fn(|k| {
            let inset = INSET_M.min(0.5 * self.sides[k]);
            self.low[k] + (share[k] * self.sides[k]).clamp(inset, self.sides[k] - inset)
        });
        core::array::from_fn(|c| self.origin[c] + along[0] * self.axes[0][c] + along[1] * self.axes[1][c])
    }

    fn share(&self, point: [f32; 3]) -> [f32; 2] {
        let d: [f32; 3] = core::array::from_fn(|c| point[c] - self.origin[c]);
        core::array::from_fn(|k| ((dot(d, self.axes[k]) - self.low[k]) / self.sides[k]).clamp(0.0, 1.0))
    }
}

impl Chart {
    /// Light at a place of the chart, bilinear.
    #[inline]
    pub fn at(&self, s: f32, t: f32) -> [f32; 4] {
        let (s, t) = (s.max(0.0).min((self.width - 1) as f32), t.max(0.0).min((self.height - 1) as f32));
        let (i, j) = ((s as i32).min(self.width as i32 - 2), (t as i32).min(self.height as i32 - 2));
        let (fs, ft) = (s - i as f32, t - j as f32);
        let below = (j * self.width as i32 + i) as usize;
        let (a, b) = (self.values[below], self.values[below + 1]);
        let (c, d) = (self.values[below + self.width], self.values[below + self.width + 1]);
        core::array::from_fn(|k| {
            let (top, bottom) = (a[k] + (b[k] - a[k]) * fs, c[k] + (d[k] - c[k]) * fs);
            top + (bottom - top) * ft
        })
    }
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
