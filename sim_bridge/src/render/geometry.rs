//! A scene cut into clusters of neighbouring triangles, with light baked into its corners.

use rayon::prelude::*;

use crate::render::light::Light;
use crate::scene::{Material, Mesh, Scene};

/// Triangles of one cluster at most: small enough to cull well, large enough to keep the culling cheap.
const CLUSTER_TRIANGLES: usize = 96;

/// One corner as the shading pass needs it.
#[derive(Copy, Clone, Debug)]
pub struct Corner {
    /// World frame, metres.
    pub position: [f32; 3],
    /// Texture repeats.
    pub uv: [f32; 2],
    /// What the texel is multiplied with, display exponent, red green blue.
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
                split(mesh).iter().map(|triangles| part(mesh, triangles, material, &light)).collect()
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
struct Part {
    corners: Vec<Corner>,
    triangles: Vec<[u32; 3]>,
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

/// Usable triangles of a mesh in groups of neighbours: the list is halved at the median of its longest axis until a
/// group is small enough.
fn split(mesh: &Mesh) -> Vec<Vec<[u32; 3]>> {
    let usable = |t: &&[u32; 3]| {
        t.iter().all(|&i| mesh.vertices.get(i as usize).is_some_and(|v| v.position.iter().all(|c| c.abs() < 1e6)))
    };
    let centred: Vec<([f32; 3], [u32; 3])> = mesh
        .triangles
        .iter()
        .filter(usable)
        .map(|t| {
            let [a, b, c] = t.map(|i| mesh.vertices[i as usize].position);
            (core::array::from_fn(|k| (a[k] + b[k] + c[k]) / 3.0), *t)
        })
        .collect();
    let mut groups = Vec::new();
    let mut open = vec![centred];
    while let Some(mut group) = open.pop() {
        if group.len() > CLUSTER_TRIANGLES {
            let axis = longest_axis(&group);
            group.sort_by(|a, b| a.0[axis].total_cmp(&b.0[axis]));
            let upper = group.split_off(group.len() / 2);
            open.push(upper);
            open.push(group);
        } else if !group.is_empty() {
            groups.push(group.into_iter().map(|(_, t)| t).collect());
        }
    }
    groups
}

fn longest_axis(group: &[([f32; 3], [u32; 3])]) -> usize {
    let extent = |k: usize| {
        let (low, high) = group.iter().fold((f32::MAX, f32::MIN), |(l, h), (c, _)| (l.min(c[k]), h.max(c[k])));
        high - low
    };
    let sides = [extent(0), extent(1), extent(2)];
    (0..3).fold(0, |best, k| if sides[k] > sides[best] { k } else { best })
}

fn part(mesh: &Mesh, triangles: &[[u32; 3]], material: &Material, light: &Light) -> Part {
    let mut used: Vec<u32> = triangles.iter().flatten().copied().collect();
    used.sort_unstable();
    used.dedup();
    let place = |i: u32| used.partition_point(|&j| j < i) as u32;
    let corner = |i: u32| {
        let vertex = &mesh.vertices[i as usize];
        let colour = mesh.colours.get(i as usize).copied().unwrap_or([1.0; 3]);
        Corner {
            position: vertex.position,
            uv: vertex.uv.map(|c| if c.abs() < 1e5 { c } else { 0.0 }),
            light: light.factor(vertex, colour, material),
        }
    };
    Part {
        corners: used.iter().map(|&i| corner(i)).collect(),
        triangles: triangles.iter().map(|t| t.map(place)).collect(),
    }
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
