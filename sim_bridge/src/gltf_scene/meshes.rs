//! Triangles of a document, in world axes.

use gltf::{Document, Node, Primitive, mesh::Mode};

use super::{EXTENT_MAX_M, SceneError, TRIANGLES_MAX, buffers, normals, too_large};
use crate::scene::{Mesh, Vertex};

/// A 4x4 matrix, column-major as glTF has it.
type Matrix = [[f32; 4]; 4];

const IDENTITY: Matrix = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]];

/// One mesh per primitive of every node of the default scene (of all scenes where none is the default).
pub fn read(name: &str, document: &Document, buffers: &[Vec<u8>]) -> Result<Vec<Mesh>, SceneError> {
    let roots: Vec<Node<'_>> = match document.default_scene() {
        Some(scene) => scene.nodes().collect(),
        None => document.scenes().flat_map(|scene| scene.nodes()).collect(),
    };
    let mut open: Vec<(Node<'_>, Matrix)> = roots.into_iter().rev().map(|node| (node, IDENTITY)).collect();
    // Each node once: a file whose nodes form a ring ends too.
    let mut seen = vec![false; document.nodes().len()];
    let mut meshes = Vec::new();
    let mut n_triangles = 0;
    while let Some((node, t_scene_parent)) = open.pop() {
        if core::mem::replace(&mut seen[node.index()], true) {
            continue;
        }
        let t_scene_node = product(&t_scene_parent, &node.transform().matrix());
        for primitive in node.mesh().iter().flat_map(gltf::Mesh::primitives) {
            let Some(mesh) = read_primitive(name, &primitive, &t_scene_node, document, buffers)? else { continue };
            n_triangles += mesh.triangles.len();
            if n_triangles > TRIANGLES_MAX {
                let (found, allowed) = (format!("over {n_triangles}"), TRIANGLES_MAX.to_string());
                return Err(too_large(name, "the number of triangles", found, allowed));
            }
            meshes.push(mesh);
        }
        open.extend(node.children().map(|child| (child, t_scene_node)).collect::<Vec<_>>().into_iter().rev());
    }
    Ok(meshes)
}

/// `None` for points and lines.
fn read_primitive(
    name: &str,
    primitive: &Primitive<'_>,
    t_scene_node: &Matrix,
    document: &Document,
    buffers: &[Vec<u8>],
) -> Result<Option<Mesh>, SceneError> {
    for accessor in primitive.attributes().map(|(_, accessor)| accessor).chain(primitive.indices()) {
        buffers::check(name, &accessor, buffers)?;
    }
    let reader = primitive.reader(|buffer| buffers.get(buffer.index()).map(Vec::as_slice));
    let Some(positions) = reader.read_positions() else { return Ok(None) };
    let positions: Vec<[f32; 3]> = positions.map(|p| to_world(&transform(t_scene_node, p, 1.0))).collect();
    check_extent(name, &positions)?;
    let indices: Vec<u32> =
        reader.read_indices().map_or_else(|| (0..positions.len() as u32).collect(), |i| i.into_u32().collect());
    let Some(mut triangles) = triangles(primitive.mode(), &indices) else { return Ok(None) };
    triangles.retain(|t| t.iter().all(|&i| (i as usize) < positions.len()));
    let cofactors = cofactors(t_scene_node);
    if determinant(t_scene_node, &cofactors) < 0.0 {
        triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
    let uvs = texture_coordinates(primitive, |set| Some(reader.read_tex_coords(set)?.into_f32().collect()));
    let colours: Vec<[f32; 3]> = reader.read_colors(0).map(|c| c.into_rgb_f32().collect()).unwrap_or_default();
    let vertex = |(i, position): (usize, &[f32; 3])| Vertex {
        position: *position,
        normal: [0.0; 3],
        uv: uvs.get(i).copied().unwrap_or_default(),
    };
    let mut mesh = Mesh {
        vertices: positions.iter().enumerate().map(vertex).collect(),
        colours: if colours.len() == positions.len() { colours } else { Vec::new() },
        triangles,
        material: primitive.material().index().unwrap_or(document.materials().len()),
        solid: true,
    };
    match reader.read_normals() {
        Some(found) => {
            for (vertex, n) in mesh.vertices.iter_mut().zip(found) {
                vertex.normal = normals::unit(to_world(&transform(&cofactors, n, 0.0)));
            }
        }
        None => normals::compute(&mut mesh),
    }
    Ok(Some(mesh))
}

fn check_extent(name: &str, positions: &[[f32; 3]]) -> Result<(), SceneError> {
    match positions.iter().flatten().find(|c| c.is_nan() || c.abs() > EXTENT_MAX_M) {
        Some(c) => Err(too_large(name, "a coordinate", format!("{c} m"), format!("{EXTENT_MAX_M} m"))),
        None => Ok(()),
    }
}

fn triangles(mode: Mode, indices: &[u32]) -> Option<Vec<[u32; 3]>> {
    match mode {
        Mode::Triangles => Some(indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect()),
        Mode::TriangleStrip => {
            let corners = |(i, t): (usize, &[u32])| if i % 2 == 0 { [t[0], t[1], t[2]] } else { [t[1], t[0], t[2]] };
            Some(indices.windows(3).enumerate().map(corners).collect())
        }
        Mode::TriangleFan => {
            let (centre, rim) = indices.split_first()?;
            Some(rim.windows(2).map(|t| [*centre, t[0], t[1]]).collect())
        }
        Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip => None,
    }
}

/// Coordinates for the base colour, with KHR_texture_transform applied (offset, then rotation, then scale, read from
/// the right).
fn texture_coordinates(primitive: &Primitive<'_>, read: impl Fn(u32) -> Option<Vec<[f32; 2]>>) -> Vec<[f32; 2]> {
    let material = primitive.material();
    let Some(info) = material.pbr_metallic_roughness().base_color_texture() else { return Vec::new() };
    let change = info.texture_transform();
    let set = change.as_ref().and_then(|t| t.tex_coord()).unwrap_or(info.tex_coord());
    let Some(mut uvs) = read(set) else { return Vec::new() };
    if let Some(change) = change {
        let ([u0, v0], [su, sv]) = (change.offset(), change.scale());
        let (sin, cos) = libm::sincosf(change.rotation());
        for uv in &mut uvs {
            let (u, v) = (uv[0] * su, uv[1] * sv);
            *uv = [cos * u + sin * v + u0, cos * v - sin * u + v0];
        }
    }
    uvs
}

/// glTF's axes (y up) to ours (z up).
fn to_world(p: &[f32; 3]) -> [f32; 3] {
    [p[0], -p[2], p[1]]
}

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    core::array::from_fn(|column| core::array::from_fn(|row| (0..4).map(|k| a[k][row] * b[column][k]).sum()))
}

fn transform(m: &Matrix, p: [f32; 3], w: f32) -> [f32; 3] {
    core::array::from_fn(|row| m[0][row] * p[0] + m[1][row] * p[1] + m[2][row] * p[2] + m[3][row] * w)
}

/// Cofactors of the upper 3x3: what normals are transformed with, whatever the scale.
fn cofactors(m: &Matrix) -> Matrix {
    let at = |column: usize, row: usize| m[column % 3][row % 3];
    let mut result = IDENTITY;
    for (column, out) in result.iter_mut().take(3).enumerate() {
        for (row, value) in out.iter_mut().take(3).enumerate() {
            *value =
                at(column + 1, row + 1) * at(column + 2, row + 2) - at(column + 1, row + 2) * at(column + 2, row + 1);
        }
    }
    result
}

fn determinant(m: &Matrix, cofactors: &Matrix) -> f32 {
    (0..3).map(|row| m[0][row] * cofactors[0][row]).sum()
}
