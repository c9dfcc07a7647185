//! Mip chains and filtered lookup.

use rayon::prelude::*;

use crate::render::srgb;
use crate::scene::{Scene, Texture};

/// Fraction bits of texel coordinates and blend weights.
const FRACTION_BITS: u32 = 8;
const ONE: i32 = 1 << FRACTION_BITS;

/// One level of a chain. Texels are packed little-endian RGBA.
#[derive(Clone, Debug)]
struct Level {
    texels: Vec<u32>,
    width_shift: u32,
    mask_x: i32,
    mask_y: i32,
}

/// A texture with all its halved copies. Sides are powers of two.
#[derive(Clone, Debug)]
pub struct MipTexture {
    levels: Vec<Level>,
    /// Columns of level 0.
    pub width: f32,
    /// Rows of level 0.
    pub height: f32,
}

/// Chains of a scene's textures, and after them a white one for materials that have none.
pub fn chains(scene: &Scene) -> Vec<MipTexture> {
    let white = Texture { width: 1, height: 1, rgba: vec![255; 4] };
    let mut chains: Vec<MipTexture> = scene.textures.par_iter().map(MipTexture::new).collect();
    chains.push(MipTexture::new(&white));
    chains
}

impl MipTexture {
    /// Halves until one texel is left. A texture whose bytes do not fit its sides, or whose sides are no powers of two,
    /// becomes white.
    pub fn new(texture: &Texture) -> Self {
        let texels = (texture.width as usize).saturating_mul(texture.height as usize);
        let sound = texture.width.is_power_of_two()
            && texture.height.is_power_of_two()
            && texture.rgba.len() == texels.saturating_mul(4);
        if !sound {
            return Self::new(&Texture { width: 1, height: 1, rgba: vec![255; 4] });
        }
        let packed = texture.rgba.chunks_exact(4).map(|t| u32::from_le_bytes([t[0], t[1], t[2], t[3]])).collect();
        let mut levels = vec![Level::new(packed, texture.width, texture.height)];
        while let Some(last) = levels.last() {
            if last.texels.len() == 1 {
                break;
            }
            let halved = last.halved();
            levels.push(halved);
        }
        Self { levels, width: texture.width as f32, height: texture.height as f32 }
    }

    /// Trilinear sample. `u, v` in repeats, `lod` in levels; result in four 16-bit lanes with value * 256
    /// (red in the lowest 16 bits, then blue, green, alpha).
    #[inline]
    pub fn trilinear(&self, u: f32, v: f32, lod: f32) -> u64 {
        let last = self.levels.len() - 1;
        let lod = (lod * ONE as f32).clamp(0.0, (last as i32 * ONE) as f32) as i32;
        let (below, blend) = ((lod >> FRACTION_BITS) as usize, lod & (ONE - 1));
        let near = self.levels[below].bilinear(u, v);
        if blend < 8 || below == last {
            return near;
        }
        lerp_wide(near, self.levels[below + 1].bilinear(u, v), blend as u64)
    }

    /// Alpha, 0 to 1, at the level given (bilinear, no blend between levels).
    #[inline]
    pub fn alpha(&self, u: f32, v: f32, lod: f32) -> f32 {
        let level = ((lod + 0.5).max(0.0) as usize).min(self.levels.len() - 1);
        (self.levels[level].bilinear(u, v) >> 48) as f32 * (1.0 / 65280.0)
    }
}

impl Level {
    fn new(texels: Vec<u32>, width: u32, height: u32) -> Self {
        Self { texels, width_shift: width.trailing_zeros(), mask_x: width as i32 - 1, mask_y: height as i32 - 1 }
    }

    /// The next level: 2x2 boxes averaged in linear light, colours weighted by alpha so that holes do not bleed.
    fn halved(&self) -> Self {
        let (width, height) = ((self.mask_x as u32).div_ceil(2).max(1), (self.mask_y as u32).div_ceil(2).max(1));
        let mut texels = Vec::with_capacity((width * height) as usize);
        for y in 0..height as i32 {
            for x in 0..width as i32 {
                let four = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(dx, dy)| self.texel(2 * x + dx, 2 * y + dy));
                texels.push(average(four));
            }
        }
        Self::new(texels, width, height)
    }

    #[inline]
    fn texel(&self, x: i32, y: i32) -> u32 {
        let index = (((y & self.mask_y) as usize) << self.width_shift) | (x & self.mask_x) as usize;
        self.texels[index]
    }

    #[inline]
    fn bilinear(&self, u: f32, v: f32) -> u64 {
        let x = (u * ((self.mask_x + 1) * ONE) as f32 + HALF_TEXEL) as i32 - BIAS;
        let y = (v * ((self.mask_y + 1) * ONE) as f32 + HALF_TEXEL) as i32 - BIAS;
        let (wx, wy) = ((x & (ONE - 1)) as u64, (y & (ONE - 1)) as u64);
        let (x, y) = (x >> FRACTION_BITS, y >> FRACTION_BITS);
        let top = lerp(spread(self.texel(x, y)), spread(self.texel(x + 1, y)), wx);
        let bottom = lerp(spread(self.texel(x, y + 1)), spread(self.texel(x + 1, y + 1)), wx);
        lerp_wide(top, bottom, wy)
    }
}

/// Shifts to texel centres, and keeps the cast's argument positive so that cutting the fraction off rounds down.
const BIAS: i32 = 1 << 20;
const HALF_TEXEL: f32 = (BIAS - ONE / 2) as f32;

/// Four bytes into four 16-bit lanes.
#[inline]
fn spread(texel: u32) -> u64 {
    u64::from(texel & 0x00ff_00ff) | (u64::from((texel >> 8) & 0x00ff_00ff) << 32)
}

/// `value * 256` lanes between two lanes of bytes.
#[inline]
fn lerp(a: u64, b: u64, weight: u64) -> u64 {
    a * (ONE as u64 - weight) + b * weight
}

/// Between two lanes of `value * 256`; keeps the scale.
#[inline]
fn lerp_wide(a: u64, b: u64, weight: u64) -> u64 {
    const BYTES: u64 = 0x00ff_00ff_00ff_00ff;
    let (a_high, a_low) = ((a >> 8) & BYTES, a & BYTES);
    let (b_high, b_low) = ((b >> 8) & BYTES, b & BYTES);
    lerp(a_high, b_high, weight) + ((lerp(a_low, b_low, weight) >> 8) & BYTES)
}

fn average(texels: [u32; 4]) -> u32 {
    let bytes = texels.map(u32::to_le_bytes);
    let alpha: u32 = bytes.iter().map(|t| u32::from(t[3])).sum();
    let channel = |c: usize| {
        let weight = |t: &[u8; 4]| if alpha == 0 { 1.0 } else { f32::from(t[3]) };
        let sum: f32 = bytes.iter().map(|t| weight(t) * srgb::linear(t[c])).sum();
        srgb::code(sum / if alpha == 0 { 4.0 } else { alpha as f32 })
    };
    u32::from_le_bytes([channel(0), channel(1), channel(2), ((alpha + 2) / 4) as u8])
}
