//! Normals for meshes that come without.

use crate::scene::Mesh;

/// Faces whose normals differ by less than this (cosine of 45 degrees) look like one rounded surface.
const CREASE_COSINE: f32 = 0.707;

/// Gives every vertex the area-weighted normal of the faces around it, and splits vertices at creases.
pub fn compute(mesh: &mut Mesh) {
    let faces: Vec<[f32; 3]> = mesh.triangles.iter().map(|t| face(mesh, t)).collect();
    let around = faces_around(mesh);
    // First copy of every vertex, and the next copy of each: a chain per vertex.
    let n = mesh.vertices.len();
    let mut used = vec![false; n];
    let mut copies: Vec<Vec<u32>> = vec![Vec::new(); n];
    for (f, corners) in mesh.triangles.iter_mut().enumerate() {
        let direction = unit(faces[f]);
        for corner in corners {
            let original = *corner as usize;
            let normal = smooth(&around[original], &faces, direction);
            *corner = if used[original] {
                let same = |i: &&u32| close(mesh.vertices[**i as usize].normal, normal);
                match copies[original].iter().find(same) {
                    Some(copy) => *copy,
                    None => {
                        let copy = mesh.vertices.len() as u32;
                        mesh.vertices.push(mesh.vertices[original]);
                        if let Some(colour) = mesh.colours.get(original).copied() {
                            mesh.colours.push(colour);
                        }
                        copies[original].push(copy);
                        copy
                    }
                }
            } else {
                used[original] = true;
                copies[original].push(original as u32);
                original as u32
            };
            mesh.vertices[*corner as usize].normal = normal;
        }
    }
}

/// The same direction, or nothing for a vector without one.
pub fn unit(v: [f32; 3]) -> [f32; 3] {
    let length = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
    if length > 1e-20 { v.map(|c| c / length) } else { [0.0, 0.0, 1.0] }
}

/// Normal of a triangle, as long as twice its area.
fn face(mesh: &Mesh, triangle: &[u32; 3]) -> [f32; 3] {
    let [a, b, c] = triangle.map(|i| mesh.vertices[i as usize].position);
    let (u, v): ([f32; 3], [f32; 3]) = (core::array::from_fn(|k| b[k] - a[k]), core::array::from_fn(|k| c[k] - a[k]));
    [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
}

fn faces_around(mesh: &Mesh) -> Vec<Vec<u32>> {
    let mut around = vec![Vec::new(); mesh.vertices.len()];
    for (f, corners) in mesh.triangles.iter().enumerate() {
        for corner in corners {
            around[*corner as usize].push(f as u32);
        }
    }
    around
}

fn smooth(around: &[u32], faces: &[[f32; 3]], direction: [f32; 3]) -> [f32; 3] {
    let mut sum = [0.0; 3];
    for &f in around {
        let (n, face) = (unit(faces[f as usize]), faces[f as usize]);
        if n[0] * direction[0] + n[1] * direction[1] + n[2] * direction[2] > CREASE_COSINE {
            (0..3).for_each(|k| sum[k] += face[k]);
        }
    }
    unit(sum)
}

fn close(a: [f32; 3], b: [f32; 3]) -> bool {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2] > 0.999
}
