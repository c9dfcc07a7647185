//! Light that gives shape, baked once.

use crate::render::srgb;
use crate::scene::{Material, Scene, Vertex};

/// Light of a scene, ready to be asked.
pub struct Light<'a> {
    scene: &'a Scene,
}

impl<'a> Light<'a> {
    /// Prepares the light of a scene.
    pub fn new(scene: &'a Scene) -> Self {
        Self { scene }
    }

    /// What texels at this vertex are multiplied with, display exponent.
    pub fn factor(&self, vertex: &Vertex, colour: [f32; 3], material: &Material) -> [f32; 3] {
        let base = material.base_colour;
        let light = if material.unlit { [1.0; 3] } else { self.irradiance(vertex, material.double_sided) };
        core::array::from_fn(|k| srgb::display_factor(light[k] * (base[k] * colour[k]).clamp(0.0, 1.0)))
    }

    fn irradiance(&self, vertex: &Vertex, two_sided: bool) -> [f32; 3] {
        let n = vertex.normal;
        if self.scene.lamps.is_empty() {
            let even = 0.92 * n[2] * n[2] + 0.85 * n[0] * n[0] + 0.7 * n[1] * n[1];
            return [even.max(0.3); 3];
        }
        let up = if two_sided { 0.5 } else { 0.5 + 0.5 * n[2] };
        let mut light = [0.28 + 0.10 * up; 3];
        for lamp in &self.scene.lamps {
            let d: [f32; 3] = core::array::from_fn(|k| lamp.position[k] - vertex.position[k]);
            let r2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
            let r = r2.sqrt().max(1e-3);
            if r >= lamp.reach_m {
                continue;
            }
            let cosine = (d[0] * n[0] + d[1] * n[1] + d[2] * n[2]) / r;
            let lambert = if two_sided { cosine.abs() } else { cosine.max(0.0) };
            let fade = 1.0 - (r / lamp.reach_m) * (r / lamp.reach_m);
            let share = (0.15 + 0.85 * lambert) * fade * fade / (1.0 + 0.25 * r2);
            for k in 0..3 {
                light[k] += 0.9 * share * lamp.colour[k];
            }
        }
        light
    }
}
