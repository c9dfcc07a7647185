//! Collects triangles by material, and draws the textures once all are known.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::geometry::Spot;
use crate::scene::{Lamp, Material, Mesh, Scene, Texture, Vertex};
use crate::textures::{self, Surface};

/// How something looks: a surface drawn from a seed, tinted; or a plain colour.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(super) struct Look {
    /// Texture, or none for a plain colour.
    pub surface: Option<(Surface, u64)>,
    /// Linear RGB that multiplies the texture.
    pub tint: [f32; 3],
    /// Which extra rules hold.
    pub finish: Finish,
}

/// Special treatment by the renderer.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(super) enum Finish {
    /// Lit, seen from outside.
    Usual,
    /// Lit, seen from both sides: leaves, curtains.
    TwoSided,
    /// Shown as it is: windows, screens, lamps.
    Glowing,
}

impl Look {
    /// A surface in its own colours.
    pub fn of(surface: Surface, seed: u64) -> Self {
        Self { surface: Some((surface, seed)), tint: [1.0; 3], finish: Finish::Usual }
    }

    /// A plain colour, linear RGB.
    pub fn plain(tint: [f32; 3]) -> Self {
        Self { surface: None, tint, finish: Finish::Usual }
    }

    /// The same, multiplied by a colour.
    pub fn tinted(self, tint: [f32; 3]) -> Self {
        Self { tint, ..self }
    }

    /// The same with another finish.
    pub fn finished(self, finish: Finish) -> Self {
        Self { finish, ..self }
    }

    /// Metres covered by one repetition of the texture, or `None` for pictures and plain colours.
    pub fn side_m(&self) -> Option<f64> {
        self.surface.map(|(s, _)| f64::from(s.side_m())).filter(|side| *side > 0.0)
    }
}

/// Whether robot and laser meet a triangle.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(super) enum Contact {
    /// They do.
    Solid,
    /// They do not: rugs, posters, skirting boards, lamps.
    Ghost,
}

/// How much of a flat is made.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Detail {
    /// Shapes and textures.
    Full,
    /// Shapes only, in plain colours: for whoever drives but never looks. Geometry equals that of [`Detail::Full`].
    Shape,
}

/// Textures drawn so far: the states of a flat share theirs.
pub(super) type Stock = BTreeMap<(Surface, u64), Texture>;

/// A scene under construction.
#[derive(Default)]
pub(super) struct SceneBuilder {
    looks: Vec<Look>,
    meshes: Vec<Mesh>,
    /// Lamps so far.
    pub lamps: Vec<Lamp>,
}

impl SceneBuilder {
    /// The mesh that holds the triangles of a look.
    pub fn mesh(&mut self, look: &Look, contact: Contact) -> &mut Mesh {
        let material = self.looks.iter().position(|l| l == look).unwrap_or_else(|| {
            self.looks.push(*look);
            self.looks.len() - 1
        });
        let solid = contact == Contact::Solid;
        let found = self.meshes.iter().position(|m| m.material == material && m.solid == solid);
        let index = found.unwrap_or_else(|| {
            self.meshes.push(Mesh { material, solid, ..Mesh::default() });
            self.meshes.len() - 1
        });
        &mut self.meshes[index]
    }

    /// A pen that draws in a local frame.
    pub fn pen(&mut self, spot: Spot) -> super::pen::Pen<'_> {
        super::pen::Pen::new(self, spot)
    }

    /// Draws the textures that are not in stock yet, each once and side by side, and hands the scene over.
    pub fn finish(self, name: String, detail: Detail, stock: &mut Stock) -> Scene {
        let mut drawn: Vec<(Surface, u64)> = Vec::new();
        let mut materials: Vec<Material> = self.looks.iter().map(|look| material_of(look, &mut drawn)).collect();
        if detail == Detail::Shape {
            drawn.clear();
            materials.iter_mut().for_each(|m| m.texture = None);
        }
        let missing: Vec<(Surface, u64)> = drawn.iter().copied().filter(|d| !stock.contains_key(d)).collect();
        stock.par_extend(missing.par_iter().map(|&(surface, seed)| ((surface, seed), textures::draw(surface, seed))));
        let textures = drawn.iter().filter_map(|d| stock.get(d).cloned()).collect();
        Scene { name, meshes: self.meshes, materials, textures, lamps: self.lamps }
    }
}

fn material_of(look: &Look, drawn: &mut Vec<(Surface, u64)>) -> Material {
    let texture = look.surface.map(|wanted| {
        drawn.iter().position(|d| *d == wanted).unwrap_or_else(|| {
            drawn.push(wanted);
            drawn.len() - 1
        })
    });
    let [r, g, b] = look.tint;
    Material {
        base_colour: [r, g, b, 1.0],
        texture,
        double_sided: look.finish == Finish::TwoSided,
        alpha_cutoff: 0.0,
        unlit: look.finish == Finish::Glowing,
    }
}

/// Appends a convex polygon given counter-clockwise as a fan.
pub(super) fn push_fan(mesh: &mut Mesh, corners: &[Vertex]) {
    let first = mesh.vertices.len() as u32;
    mesh.vertices.extend_from_slice(corners);
    let n = corners.len() as u32;
    mesh.triangles.extend((1..n.saturating_sub(1)).map(|k| [first, first + k, first + k + 1]));
}
