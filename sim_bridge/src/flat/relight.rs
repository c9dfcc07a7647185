//! Other light in the same flat: lamps off, dimmed or of another colour, and another time of day.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use crate::scene::Scene;

/// Share of the lamps that are switched off.
const OFF_SHARE: f64 = 0.25;
/// What a window or a screen shows by day, at dusk and at night, against a bright day.
const BRIGHTNESS: [f32; 3] = [1.0, 0.4, 0.05];

/// Changes the lamps of a scene (one stays on at least), and how bright its windows and screens are.
pub(super) fn relight(scene: &mut Scene, rng: &mut ChaCha8Rng) {
    let always_on = rng.random_range(0..scene.lamps.len().max(1) as u64) as usize;
    for (i, lamp) in scene.lamps.iter_mut().enumerate() {
        let off = rng.random_bool(OFF_SHARE) && i != always_on;
        let (strength, warm) = (rng.random_range(0.4..1.3_f32), rng.random_range(0.6..1.0_f32));
        let strength = if off { 0.0 } else { strength };
        lamp.colour = [strength, strength * (0.5 + 0.5 * warm), strength * warm];
    }
    let brightness = BRIGHTNESS[rng.random_range(0..3_u32) as usize];
    for material in scene.materials.iter_mut().filter(|m| m.unlit && m.texture.is_some()) {
        let [r, g, b, alpha] = material.base_colour;
        material.base_colour = [r * brightness, g * brightness, b * brightness, alpha];
    }
}
