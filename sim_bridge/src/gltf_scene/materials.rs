//! Looks of a document.

use gltf::{Document, material::AlphaMode};

use crate::scene::Material;

/// Alpha below which a blended surface is left out: the rasterizer knows opaque pixels and holes only.
const BLEND_CUTOFF: f32 = 0.5;

/// Linear albedo of white paint.
const WHITE: f32 = 0.7;

/// One look per material of the document, and after them the default one.
pub fn read(document: &Document) -> Vec<Material> {
    let mut materials: Vec<Material> = document.materials().map(|material| look(&material)).collect();
    materials.push(Material {
        base_colour: [0.8, 0.8, 0.8, 1.0],
        texture: None,
        double_sided: false,
        alpha_cutoff: 0.0,
        unlit: false,
    });
    materials
}

fn look(material: &gltf::Material<'_>) -> Material {
    let surface = material.pbr_metallic_roughness();
    let texture = surface.base_color_texture();
    let [r, g, b, alpha] = surface.base_color_factor();
    // No surface is whiter than this; files leave plain materials at the default 1.
    let [r, g, b] = if texture.is_none() && !material.unlit() { [r, g, b].map(|c| c.min(WHITE)) } else { [r, g, b] };
    Material {
        base_colour: [r, g, b, alpha],
        texture: texture.map(|info| info.texture().source().index()),
        double_sided: material.double_sided(),
        alpha_cutoff: match material.alpha_mode() {
            AlphaMode::Opaque => 0.0,
            AlphaMode::Mask => material.alpha_cutoff().unwrap_or(0.5),
            AlphaMode::Blend => BLEND_CUTOFF,
        },
        unlit: material.unlit(),
    }
}
