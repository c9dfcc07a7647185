//! Light that gives shape, computed once: lamps with soft shadows, and light from all around that corners shut out.

use crate::render::occupancy::Occupancy;
use crate::render::srgb;
use crate::scene::{Lamp, Material, Scene};

/// Directions of the openness probe about the normal: (along normal, across, across).
const PROBES: [[f32; 3]; 9] = [
    [1.0, 0.0, 0.0],
    [0.71, 0.70, 0.0],
    [0.71, -0.35, 0.61],
    [0.71, -0.35, -0.61],
    [0.42, 0.45, 0.78],
    [0.42, -0.91, 0.0],
    [0.42, 0.45, -0.78],
    [0.42, -0.45, 0.78],
    [0.42, 0.91, 0.0],
];
/// How far the probe looks, and how much a hit there still darkens.
const REACHES: [(f32, f32); 5] = [(0.06, 1.0), (0.14, 0.85), (0.26, 0.65), (0.42, 0.4), (0.65, 0.2)];
/// Light from all around, where nothing is near.
const AMBIENT: f32 = 0.46;
/// Light of one lamp right below it.
const LAMP: f32 = 1.25;
/// Radius of a lamp's soft edge, metres.
const LAMP_RADIUS_M: f32 = 0.14;

/// Light of a scene, ready to be asked.
pub struct Light<'a> {
    scene: &'a Scene,
    occupancy: Occupancy,
}

/// A place on a surface.
#[derive(Copy, Clone, Debug)]
pub struct Place {
    /// World frame, metres.
    pub position: [f32; 3],
    /// Unit normal, world frame.
    pub normal: [f32; 3],
}

impl<'a> Light<'a> {
    /// Prepares the light of a scene.
    pub fn new(scene: &'a Scene) -> Self {
        Self { scene, occupancy: Occupancy::new(scene) }
    }

    /// What texels at a place are multiplied with, display exponent. `colour` is linear RGB.
    pub fn factor(&self, place: &Place, colour: [f32; 3], material: &Material) -> [f32; 3] {
        let base = material.base_colour;
        let light = if material.unlit { [1.0; 3] } else { self.irradiance(place, material.double_sided) };
        core::array::from_fn(|k| srgb::display_factor(light[k] * (base[k] * colour[k]).clamp(0.0, 1.0)))
    }

    fn irradiance(&self, place: &Place, two_sided: bool) -> [f32; 3] {
        let n = place.normal;
        let open = self.openness(place, two_sided);
        if self.scene.lamps.is_empty() {
            // Even light, a little different on every side so that edges show.
            let even = 0.95 * n[2] * n[2] + 0.88 * n[0] * n[0] + 0.74 * n[1] * n[1];
            return [even.max(0.3) * (0.35 + 0.65 * open); 3];
        }
        let from_above = if two_sided { 0.0 } else { 0.1 * n[2] };
        let mut light = [AMBIENT * (1.0 + from_above) * (0.25 + 0.75 * open); 3];
        for lamp in &self.scene.lamps {
            let share = self.lamp_share(place, lamp, two_sided);
            (0..3).for_each(|k| light[k] += LAMP * share * lamp.colour[k]);
        }
        light
    }

    /// Lambert's cosine, a fall-off that ends at the lamp's reach, and how much of the lamp is in sight.
    fn lamp_share(&self, place: &Place, lamp: &Lamp, two_sided: bool) -> f32 {
        let d: [f32; 3] = core::array::from_fn(|k| lamp.position[k] - place.position[k]);
        let r2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
        let r = r2.sqrt().max(1e-3);
        let cosine = (d[0] * place.normal[0] + d[1] * place.normal[1] + d[2] * place.normal[2]) / r;
        let lambert = if two_sided { cosine.abs() } else { cosine.max(0.0) };
        if r >= lamp.reach_m || lambert <= 0.0 {
            return 0.0;
        }
        let fade = 1.0 - r2 / (lamp.reach_m * lamp.reach_m);
        let sign = if cosine < 0.0 { -1.0 } else { 1.0 };
        let start = self.lifted(place, sign);
        let spots = [(0.0, 0.0), (1.0, 0.3), (-0.3, 1.0), (-1.0, -0.3), (0.3, -1.0)];
        let in_sight = spots.iter().filter(|(x, y)| {
            let [lx, ly, lz] = lamp.position;
            self.occupancy.is_free(start, [lx + LAMP_RADIUS_M * x, ly + LAMP_RADIUS_M * y, lz])
        });
        lambert * fade * fade / (1.0 + 0.3 * r2) * in_sight.count() as f32 / spots.len() as f32
    }

    /// A point just outside the surface's own cube.
    fn lifted(&self, place: &Place, sign: f32) -> [f32; 3] {
        let lift = 1.3 * self.occupancy.cell_m() * sign;
        core::array::from_fn(|k| place.position[k] + lift * place.normal[k])
    }

    /// 1 where nothing is near, towards 0 in narrow corners. Of a two-sided surface the freer side counts.
    fn openness(&self, place: &Place, two_sided: bool) -> f32 {
        let front = self.openness_of_side(place, 1.0);
        if two_sided { front.max(self.openness_of_side(place, -1.0)) } else { front }
    }

    fn openness_of_side(&self, place: &Place, sign: f32) -> f32 {
        let n = place.normal.map(|c| c * sign);
        let helper = if n[2].abs() < 0.7 { [0.0, 0.0, 1.0] } else { [1.0, 0.0, 0.0] };
        let u = unit(cross(n, helper));
        let v = cross(n, u);
        let start = self.lifted(place, sign);
        let shut: f32 = PROBES
            .iter()
            .map(|[along, a, b]| {
                let d: [f32; 3] = core::array::from_fn(|k| along * n[k] + a * u[k] + b * v[k]);
                let hit = REACHES
                    .iter()
                    .find(|(reach, _)| self.occupancy.holds(core::array::from_fn(|k| start[k] + reach * d[k])));
                hit.map_or(0.0, |(_, darkness)| *darkness)
            })
            .sum();
        1.0 - shut / PROBES.len() as f32
    }
}

/// Vector product.
pub fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The same direction at length 1; nothing for a vector without direction.
pub fn unit(v: [f32; 3]) -> [f32; 3] {
    let length = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
    if length > 1e-12 { v.map(|c| c / length) } else { [0.0; 3] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Mesh, Vertex};

    const UP: [f32; 3] = [0.0, 0.0, 1.0];

    fn sheet(corners: [[f32; 3]; 4]) -> Mesh {
        let vertex = |position: [f32; 3]| Vertex { position, normal: UP, uv: [0.0; 2] };
        Mesh {
            vertices: corners.map(vertex).to_vec(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            solid: true,
            ..Mesh::default()
        }
    }

    /// A floor, a table of 1 m at (0, 0), a wall at x = 2 up to 2.5 m, a lamp at (0.3, 0, 2.3).
    fn scene() -> Scene {
        let flat = |h: f32, z: f32| sheet([[-h, -h, z], [h, -h, z], [h, h, z], [-h, h, z]]);
        let wall = sheet([[2.0, -4.0, 0.0], [2.0, 4.0, 0.0], [2.0, 4.0, 2.5], [2.0, -4.0, 2.5]]);
        let lamp = Lamp { position: [0.3, 0.0, 2.3], colour: [1.0; 3], reach_m: 7.0 };
        Scene { meshes: vec![flat(4.0, 0.0), flat(0.5, 0.75), wall], lamps: vec![lamp], ..Scene::default() }
    }

    fn at(scene: &Scene, x: f32, y: f32) -> f32 {
        Light::new(scene).irradiance(&Place { position: [x, y, 0.0], normal: UP }, false)[0]
    }

    #[test]
    fn furniture_and_walls_throw_shadows() {
        let scene = scene();
        assert!(at(&scene, 0.0, 0.0) < at(&scene, 0.0, 1.2) - 0.2, "below the table");
        // Both are 2.5 m from the lamp.
        assert!(at(&scene, 2.8, 0.0) < at(&scene, -2.2, 0.0) - 0.08, "behind the wall");
    }

    #[test]
    fn corners_are_darker_than_the_open_floor() {
        let dark = Scene { lamps: vec![], ..scene() };
        assert!(at(&dark, 1.95, 3.0) < 0.9 * at(&dark, -2.0, 3.0));
        assert!((at(&dark, -2.0, 3.0) - 0.95).abs() < 1e-3);
    }
}
