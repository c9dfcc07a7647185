//! sRGB by tables, and the display exponent in which light is multiplied.

use std::sync::LazyLock;

/// With a pure power as display curve, `(texel * light)^(1/2.2) = texel^(1/2.2) * light^(1/2.2)`: light that is raised
/// to this power once, at set-up, multiplies stored texels directly.
const DISPLAY_EXPONENT: f32 = 1.0 / 2.2;

/// Linear value of every 8-bit sRGB code (IEC 61966-2-1).
static LINEAR: LazyLock<[f32; 256]> = LazyLock::new(|| {
    core::array::from_fn(|code| {
        let s = code as f32 / 255.0;
        if s <= 0.04045 { s / 12.92 } else { libm::powf((s + 0.055) / 1.055, 2.4) }
    })
});

/// 8-bit sRGB code of a linear value quantised to 4096 steps.
static CODE: LazyLock<[u8; 4097]> = LazyLock::new(|| {
    core::array::from_fn(|step| {
        let l = step as f32 / 4096.0;
        let s = if l <= 0.003_130_8 { 12.92 * l } else { 1.055 * libm::powf(l, 1.0 / 2.4) - 0.055 };
        (s * 255.0 + 0.5) as u8
    })
});

/// Linear light, 0 to 1, of an sRGB code.
pub fn linear(code: u8) -> f32 {
    LINEAR[usize::from(code)]
}

/// sRGB code of linear light; clamps to 0..=1.
pub fn code(linear: f32) -> u8 {
    CODE[(linear.clamp(0.0, 1.0) * 4096.0 + 0.5) as usize]
}

/// What a linear light multiplies a display code with.
pub fn display_factor(light: f32) -> f32 {
    if light > 0.0 { libm::powf(light, DISPLAY_EXPONENT) } else { 0.0 }
}
