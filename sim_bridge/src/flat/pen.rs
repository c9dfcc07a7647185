//! Draws boxes, beams, turned bodies and cushions in a local frame (x right, y forward, z up).

use core::f64::consts::TAU;

use super::builder::{Contact, Look, SceneBuilder, push_fan};
use super::geometry::Spot;
use crate::scene::Vertex;

/// A point or direction of the local frame, metres.
pub(super) type Vec3 = [f64; 3];

/// Texture coordinates of a face.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(super) enum Mapping {
    /// The surface repeats every so many metres, starting at the given metres (u, v).
    Metres(f64, f64),
    /// The same turned by a quarter: what runs along u runs upwards.
    MetresUp(f64, f64),
    /// The picture covers the face once.
    Picture,
}

/// Draws into a scene from a local frame.
pub(super) struct Pen<'a> {
    scene: &'a mut SceneBuilder,
    spot: Spot,
    contact: Contact,
}

impl<'a> Pen<'a> {
    /// Draws solid things in this frame.
    pub fn new(scene: &'a mut SceneBuilder, spot: Spot) -> Self {
        Self { scene, spot, contact: Contact::Solid }
    }

    /// A pen for a frame within this one, moved in metres and then turned in radians.
    pub fn at(&mut self, x: f64, y: f64, turn_rad: f64) -> Pen<'_> {
        let spot = self.spot.shifted(x, y).turned(turn_rad);
        Pen { scene: self.scene, spot, contact: self.contact }
    }

    /// The same pen for things that nobody bumps into.
    pub fn ghost(&mut self) -> Pen<'_> {
        Pen { scene: self.scene, spot: self.spot, contact: Contact::Ghost }
    }

    fn vertex(&self, p: Vec3, n: Vec3, uv: [f64; 2]) -> Vertex {
        let (x, y) = self.spot.point(p[0], p[1]);
        let (nx, ny) = self.spot.direction(n[0], n[1]);
        Vertex {
            position: [x as f32, y as f32, p[2] as f32],
            normal: [nx as f32, ny as f32, n[2] as f32],
            uv: [uv[0] as f32, uv[1] as f32],
        }
    }

    /// A flat face: its corners bottom left, bottom right, top right, top left as its viewer sees them.
    pub fn face(&mut self, look: &Look, corners: [Vec3; 4], mapping: Mapping) {
        let (right, up) = (sub(corners[1], corners[0]), sub(corners[3], corners[0]));
        let n = unit(cross(right, up));
        let side = look.side_m().unwrap_or(1.0);
        let (w, h) = (norm(right), norm(up));
        let uvs = match mapping {
            Mapping::Picture => [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]],
            Mapping::Metres(u, v) => {
                let (u0, u1, v0, v1) = (u / side, (u + w) / side, v / side, (v + h) / side);
                [[u0, v1], [u1, v1], [u1, v0], [u0, v0]]
            }
            Mapping::MetresUp(u, v) => {
                let (u0, u1, v0, v1) = (u / side, (u + h) / side, v / side, (v + w) / side);
                [[u0, v0], [u0, v1], [u1, v1], [u1, v0]]
            }
        };
        let vertices: Vec<Vertex> = (0..4).map(|i| self.vertex(corners[i], n, uvs[i])).collect();
        push_fan(self.scene.mesh(look, self.contact), &vertices);
    }

    /// A body with six faces from its bottom and top corners, each counter-clockwise seen from above. The texture of the
    /// faces repeats by metres.
    pub fn hexahedron(&mut self, look: &Look, bottom: [Vec3; 4], top: [Vec3; 4]) {
        for i in 0..4 {
            let j = (i + 1) % 4;
            self.face(look, [bottom[i], bottom[j], top[j], top[i]], along_grain(&[bottom[i], bottom[j], top[i]]));
        }
        self.face(look, top, along_grain(&[top[0], top[1], top[3]]));
        if bottom[0][2] > 0.005 {
            self.face(look, [bottom[3], bottom[2], bottom[1], bottom[0]], Mapping::Metres(0.0, 0.0));
        }
    }

    /// An upright box between two corners.
    pub fn cuboid(&mut self, look: &Look, min: Vec3, max: Vec3) {
        let ring = |z: f64| [[min[0], min[1], z], [max[0], min[1], z], [max[0], max[1], z], [min[0], max[1], z]];
        self.hexahedron(look, ring(min[2]), ring(max[2]));
    }

    /// A picture on the front (towards +y) of a box `x0..x1`, `z0..z1` at depth `y`.
    pub fn front(&mut self, look: &Look, x: (f64, f64), y: f64, z: (f64, f64)) {
        let corners = [[x.1, y, z.0], [x.0, y, z.0], [x.0, y, z.1], [x.1, y, z.1]];
        let mapping = if look.side_m().is_some() { Mapping::Metres(0.0, 0.0) } else { Mapping::Picture };
        self.face(look, corners, mapping);
    }

    /// A slanting square beam between two points, `side` metres thick.
    pub fn beam(&mut self, look: &Look, from: Vec3, to: Vec3, side: f64) {
        let h = 0.5 * side;
        let ring = |c: Vec3| {
            [
                [c[0] - h, c[1] - h, c[2]],
                [c[0] + h, c[1] - h, c[2]],
                [c[0] + h, c[1] + h, c[2]],
                [c[0] - h, c[1] + h, c[2]],
            ]
        };
        self.hexahedron(look, ring(from), ring(to));
    }

    /// A body turned on a lathe about the vertical through (x, y): its outline as (radius, height) from bottom to top.
    /// Smooth around and sharp along, so that rims show.
    pub fn turned(&mut self, look: &Look, centre: (f64, f64), outline: &[(f64, f64)], sides: usize) {
        let side_m = look.side_m().unwrap_or(1.0);
        for pair in outline.windows(2) {
            let ((r0, z0), (r1, z1)) = (pair[0], pair[1]);
            let length = libm::sqrt((r1 - r0) * (r1 - r0) + (z1 - z0) * (z1 - z0)).max(1e-9);
            let (n_out, n_up) = ((z1 - z0) / length, (r0 - r1) / length);
            let around = TAU * r0.max(r1) / side_m;
            let corner = |k: usize, r: f64, z: f64| {
                let angle = TAU * k as f64 / sides as f64;
                let (c, s) = (libm::cos(angle), libm::sin(angle));
                let uv = [around * k as f64 / sides as f64, -z / side_m];
                self.vertex([centre.0 + r * c, centre.1 + r * s, z], [n_out * c, n_out * s, n_up], uv)
            };
            let quads: Vec<[Vertex; 4]> = (0..sides)
                .map(|k| [corner(k, r0, z0), corner(k + 1, r0, z0), corner(k + 1, r1, z1), corner(k, r1, z1)])
                .collect();
            let mesh = self.scene.mesh(look, self.contact);
            for q in quads {
                match (r0 > 1e-9, r1 > 1e-9) {
                    (true, true) => push_fan(mesh, &q),
                    (true, false) => push_fan(mesh, &q[..3]),
                    (false, true) => push_fan(mesh, &[q[0], q[2], q[3]]),
                    (false, false) => {}
                }
            }
        }
    }

    /// A round post from `z.0` to `z.1`, with its top closed.
    pub fn post(&mut self, look: &Look, centre: (f64, f64), radius: f64, z: (f64, f64)) {
        self.turned(look, centre, &[(radius, z.0), (radius, z.1), (0.0, z.1)], 10);
    }

    /// A cushion: a box whose edges are rounded with `radius`.
    pub fn cushion(&mut self, look: &Look, min: Vec3, max: Vec3, radius: f64) {
        const STEPS: [f64; 5] = [-1.0, -0.7, 0.0, 0.7, 1.0];
        let centre = [0.5 * (min[0] + max[0]), 0.5 * (min[1] + max[1]), 0.5 * (min[2] + max[2])];
        let half = [0.5 * (max[0] - min[0]), 0.5 * (max[1] - min[1]), 0.5 * (max[2] - min[2])];
        let radius = radius.min(half[0]).min(half[1]).min(half[2]);
        let side_m = look.side_m().unwrap_or(1.0);
        for (axis, sign) in [(0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0), (2, 1.0), (2, -1.0)] {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let corner = |i: usize, j: usize| {
                let mut on_cube = [0.0; 3];
                (on_cube[axis], on_cube[u], on_cube[v]) = (sign, STEPS[i], STEPS[j]);
                let (p, n) = rounded(on_cube, half, radius);
                let at = [centre[0] + p[0], centre[1] + p[1], centre[2] + p[2]];
                self.vertex(at, n, [at[u] / side_m, at[v] / side_m])
            };
            let mut quads = Vec::with_capacity(16);
            for i in 0..STEPS.len() - 1 {
                for j in 0..STEPS.len() - 1 {
                    let q = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
                    quads.push(if sign > 0.0 { q } else { [q[0], q[3], q[2], q[1]] });
                }
            }
            let mesh = self.scene.mesh(look, self.contact);
            quads.iter().for_each(|q| push_fan(mesh, q));
        }
    }
}

/// Wood is cut so that its grain (u) runs along the longer edge. Starts where the face is, so that no two boards repeat.
fn along_grain([origin, right, up]: &[Vec3; 3]) -> Mapping {
    let (u, v) = (1.37 * origin[0] + 0.61 * origin[2], 0.83 * origin[1] + 1.19 * origin[2]);
    let (w, h) = (norm(sub(*right, *origin)), norm(sub(*up, *origin)));
    if h > w { Mapping::MetresUp(u, v) } else { Mapping::Metres(u, v) }
}

/// A point of the unit cube's surface moved onto a box with rounded edges, and the normal there. The outer steps of the
/// cube (beyond 0.7) fall on the rounding.
fn rounded(on_cube: Vec3, half: Vec3, radius: f64) -> (Vec3, Vec3) {
    let mut core = [0.0; 3];
    let mut out = [0.0; 3];
    for k in 0..3 {
        let c = on_cube[k];
        core[k] = c.clamp(-0.7, 0.7) / 0.7 * (half[k] - radius);
        out[k] = if c.abs() > 0.99 {
            c
        } else if c.abs() > 0.69 {
            0.38 * c
        } else {
            0.0
        };
    }
    let n = unit(out);
    ([core[0] + radius * n[0], core[1] + radius * n[1], core[2] + radius * n[2]], n)
}

fn sub(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn norm(a: Vec3) -> f64 {
    libm::sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])
}

fn unit(a: Vec3) -> Vec3 {
    let n = norm(a).max(1e-12);
    [a[0] / n, a[1] / n, a[2] / n]
}
