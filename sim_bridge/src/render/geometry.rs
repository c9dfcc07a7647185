//! A scene cut into clusters of neighbouring triangles, with light baked into its corners.

use std::collections::BTreeMap;

use rayon::prelude::*;

use crate::render::chart::{self, Chart};
use crate::render::light::{Light, Place};
use crate::scene::{Material, Mesh, Scene};

/// Faces of one cluster at most: small enough to cull well, large enough to keep the culling cheap.
const CLUSTER_FACES: usize = 64;

/// One corner as the shading pass needs it.
#[derive(Copy, Clone, Debug)]
pub struct Corner {
    /// World frame, metres.
    pub position: [f32; 3],
    /// Texture repeats.
    pub uv: [f32; 2],
    /// What the texel is multiplied with, display exponent, red green blue. On a triangle with a chart: its place on the
    /// chart, and nothing.
    pub light: [f32; 3],
}

/// Looks of a triangle.
#[derive(Copy, Clone, Debug)]
pub struct Look {
    /// Index into the mip chains.
    pub texture: usize,
    /// Not culled from behind.
    pub double_sided: bool,
    /// Alpha below which a pixel is a hole; 0 for opaque.
    pub alpha_cutoff: f32,
}

/// Neighbouring triangles of one look.
#[derive(Clone, Debug)]
pub struct Cluster {
    /// Range of [`Geometry::corners`].
    pub corners: core::ops::Range<usize>,
    /// Range of [`Geometry::triangles`].
    pub triangles: core::ops::Range<usize>,
    /// Index into [`Geometry::looks`].
    pub look: usize,
    /// Centre of the bounding box, metres.
    pub centre: [f64; 3],
    /// Half sides of the bounding box, metres.
    pub half: [f64; 3],
}

/// Everything the passes read.
#[derive(Clone, Debug, Default)]
pub struct Geometry {
    /// In the order in which ties in depth are resolved.
    pub clusters: Vec<Cluster>,
    /// Corners, cluster by cluster.
    pub corners: Vec<Corner>,
    /// Indices into `corners`.
    pub triangles: Vec<[u32; 3]>,
    /// Index into `charts` of every triangle that has one.
    pub chart_of: Vec<Option<u32>>,
    /// Light maps of large faces.
    pub charts: Vec<Chart>,
    /// One per material, and one for triangles whose material is missing.
    pub looks: Vec<Look>,
}

impl Geometry {
    /// Cuts up and lights a scene.
    pub fn new(scene: &Scene) -> Self {
        let light = Light::new(scene);
        let plain = plain_material();
        let mut geometry = Self::default();
        let white = scene.textures.len();
        geometry.looks = scene.materials.iter().chain([&plain]).map(|m| look(m, white)).collect();
        let parts: Vec<Vec<Part>> = scene
            .meshes
            .par_iter()
            .map(|mesh| {
                let material = scene.materials.get(mesh.material).unwrap_or(&plain);
                split(mesh).par_iter().map(|faces| part(mesh, faces, material, &light)).collect()
            })
            .collect();
        for (mesh, parts) in scene.meshes.iter().zip(parts) {
            for part in parts {
                geometry.push(part, mesh.material.min(scene.materials.len()));
            }
        }
        geometry
    }

    fn push(&mut self, part: Part, look: usize) {
        let (first_corner, first_triangle) = (self.corners.len(), self.triangles.len());
        let offset = first_corner as u32;
        let (centre, half) = bounds(&part.corners);
        self.corners.extend(part.corners);
        self.triangles.extend(part.triangles.iter().map(|t| t.map(|i| i + offset)));
        let first_chart = self.charts.len() as u32;
        self.charts.extend(part.charts);
        self.chart_of.extend(part.chart_of.iter().map(|chart| chart.map(|c| c + first_chart)));
        self.clusters.push(Cluster {
            corners: first_corner..self.corners.len(),
            triangles: first_triangle..self.triangles.len(),
            look,
            centre,
            half,
        });
    }
}

/// A cluster before it has its place in the whole.
#[derive(Default)]
struct Part {
    corners: Vec<Corner>,
    triangles: Vec<[u32; 3]>,
    charts: Vec<Chart>,
    chart_of: Vec<Option<u32>>,
}

/// A triangle, or two that share a side and follow each other as a quadrilateral's do.
#[derive(Copy, Clone, Debug)]
struct Face {
    first: [u32; 3],
    fourth: Option<u32>,
    centre: [f32; 3],
}

fn plain_material() -> Material {
    Material { base_colour: [1.0; 4], texture: None, double_sided: true, alpha_cutoff: 0.0, unlit: false }
}

fn look(material: &Material, white: usize) -> Look {
    Look {
        texture: material.texture.filter(|t| *t < white).unwrap_or(white),
        double_sided: material.double_sided,
        alpha_cutoff: material.alpha_cutoff,
    }
}

/// Usable faces of a mesh in groups of neighbours: the list is halved at the median of its longest axis until a group is
/// small enough.
fn split(mesh: &Mesh) -> Vec<Vec<Face>> {
    let mut groups = Vec::new();
    let mut open = vec![faces(mesh)];
    while let Some(mut group) = open.pop() {
        if group.len() > CLUSTER_FACES {
            let axis = longest_axis(&group);
            group.sort_by(|a, b| a.centre[axis].total_cmp(&b.centre[axis]));
            let upper = group.split_off(group.len() / 2);
            open.push(upper);
            open.push(group);
        } else if !group.is_empty() {
            groups.push(group);
        }
    }
    groups
}

fn faces(mesh: &Mesh) -> Vec<Face> {
    let position = |i: u32| mesh.vertices.get(i as usize).map(|v| v.position);
    let sound = |i: &u32| position(*i).is_some_and(|p| p.iter().all(|c| c.abs() < 1e6));
    let mut faces: Vec<Face> = Vec::with_capacity(mesh.triangles.len() / 2);
    for t in mesh.triangles.iter().filter(|t| t.iter().all(sound)) {
        match faces.last_mut() {
            Some(last) if last.fourth.is_none() && t[0] == last.first[0] && t[1] == last.first[2] => {
                last.fourth = Some(t[2]);
            }
            _ => {
                let [a, b, c] = t.map(|i| mesh.vertices[i as usize].position);
                let centre = core::array::from_fn(|k| (a[k] + b[k] + c[k]) / 3.0);
                faces.push(Face { first: *t, fourth: None, centre });
            }
        }
    }
    faces
}

fn longest_axis(group: &[Face]) -> usize {
    let extent = |k: usize| {
        let (low, high) = group.iter().fold((f32::MAX, f32::MIN), |(l, h), f| (l.min(f.centre[k]), h.max(f.centre[k])));
        high - low
    };
    let sides = [extent(0), extent(1), extent(2)];
    (0..3).fold(0, |best, k| if sides[k] > sides[best] { k } else { best })
}

fn part(mesh: &Mesh, faces: &[Face], material: &Material, light: &Light<'_>) -> Part {
    let mut part = Part::default();
    // Where a vertex that is lit on its own has gone.
    let mut placed: BTreeMap<u32, u32> = BTreeMap::new();
    for face in faces {
        let [a, b, c] = face.first;
        let ring: Vec<u32> = [a, b, c].into_iter().chain(face.fourth).collect();
        let baked = chart::bake(mesh, &ring, material, light);
        let chart = baked.as_ref().map(|_| part.charts.len() as u32);
        let here: Vec<u32> = match baked {
            Some((chart, places)) => {
                part.charts.push(chart);
                let charted = ring.iter().zip(places).map(|(&i, [s, t])| corner(mesh, i, [s, t, 0.0]));
                let first = part.corners.len() as u32;
                part.corners.extend(charted);
                (first..part.corners.len() as u32).collect()
            }
            None => ring
                .iter()
                .map(|&i| {
                    *placed.entry(i).or_insert_with(|| {
                        part.corners.push(corner(mesh, i, lit(mesh, i, material, light)));
                        part.corners.len() as u32 - 1
                    })
                })
                .collect(),
        };
        for k in 1..here.len() - 1 {
            part.triangles.push([here[0], here[k], here[k + 1]]);
            part.chart_of.push(chart);
        }
    }
    part
}

fn corner(mesh: &Mesh, i: u32, light: [f32; 3]) -> Corner {
    let vertex = &mesh.vertices[i as usize];
    Corner { position: vertex.position, uv: vertex.uv.map(|c| if c.abs() < 1e5 { c } else { 0.0 }), light }
}

fn lit(mesh: &Mesh, i: u32, material: &Material, light: &Light<'_>) -> [f32; 3] {
    let vertex = &mesh.vertices[i as usize];
    let colour = mesh.colours.get(i as usize).copied().unwrap_or([1.0; 3]);
    light.factor(&Place { position: vertex.position, normal: vertex.normal }, colour, material)
}

fn bounds(corners: &[Corner]) -> ([f64; 3], [f64; 3]) {
    let mut low = [f64::MAX; 3];
    let mut high = [f64::MIN; 3];
    for corner in corners {
        for k in 0..3 {
            low[k] = low[k].min(f64::from(corner.position[k]));
            high[k] = high[k].max(f64::from(corner.position[k]));
        }
    }
    (core::array::from_fn(|k| 0.5 * (low[k] + high[k])), core::array::from_fn(|k| 0.5 * (high[k] - low[k])))
}
