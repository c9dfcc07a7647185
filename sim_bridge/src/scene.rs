//! What a scene is made of, whether generated or loaded. World frame: metres, z up, the floor at z = 0.

use homing_core::Frame;

/// The simulator's own frame. Never leaves this crate but on the ground-truth topics: robots do not know it.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct World;

impl Frame for World {
    const NAME: &'static str = "world";
}

/// One corner of a triangle.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Vertex {
    /// World frame, metres.
    pub position: [f32; 3],
    /// Unit outward normal, world frame.
    pub normal: [f32; 3],
    /// Texture coordinates; they repeat outside 0..1.
    pub uv: [f32; 2],
}

/// Triangles of one material.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Corners.
    pub vertices: Vec<Vertex>,
    /// Linear RGB that multiplies the look, one per vertex; empty means white.
    pub colours: Vec<[f32; 3]>,
    /// Indices into `vertices`, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Index into [`Scene::materials`].
    pub material: usize,
    /// False for what neither robot nor laser meets: rugs, posters, lamps near the ceiling.
    pub solid: bool,
}

/// How a surface looks.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Multiplies the texture; linear RGBA 0 to 1.
    pub base_colour: [f32; 4],
    /// Index into [`Scene::textures`].
    pub texture: Option<usize>,
    /// Drawn from both sides.
    pub double_sided: bool,
    /// Texels with less alpha than this are holes; 0 means opaque.
    pub alpha_cutoff: f32,
    /// Shown as it is, without light: windows with daylight, screens, scanned scenes with baked light.
    pub unlit: bool,
}

/// 8-bit sRGB with alpha, row-major, first row at v = 0.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// Columns, a power of two.
    pub width: u32,
    /// Rows, a power of two.
    pub height: u32,
    /// Four bytes a texel.
    pub rgba: Vec<u8>,
}

/// A lamp: a point light below a ceiling.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Lamp {
    /// World frame, metres.
    pub position: [f32; 3],
    /// Linear RGB, 1 is a usual ceiling lamp.
    pub colour: [f32; 3],
    /// Its light is gone at this distance, metres.
    pub reach_m: f32,
}

/// Everything the renderer draws and the body can bump into.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    /// For reports: "flat seed 1000", "small_house.glb".
    pub name: String,
    /// Geometry.
    pub meshes: Vec<Mesh>,
    /// Looks, by [`Mesh::material`].
    pub materials: Vec<Material>,
    /// Images, by [`Material::texture`].
    pub textures: Vec<Texture>,
    /// Lamps; none means even light.
    pub lamps: Vec<Lamp>,
}
