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
    mask_x: u32,
    mask_y: u32,
    // Sides in fractions of a texel.
    scale_x: f32,
    scale_y: f32,
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
        let last = self.levels.len() as i32 - 1;
        // Only the middle half of the way between two levels is blended: half of the pixels need one level alone.
        let lod = lod.max(0.0).min(last as f32);
        let below = lod as i32;
        let blend = (2.0 * (lod - below as f32) - 0.5).clamp(0.0, 1.0);
        let weight = (blend * ONE as f32) as i32;
        let near = below + i32::from(weight == ONE);
        if weight == 0 || near > below {
            return self.levels[near as usize].bilinear(u, v);
        }
        let far = self.levels[near as usize + 1].bilinear(u, v);
        lerp_wide(self.levels[near as usize].bilinear(u, v), far, weight as u64)
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
        Self {
            texels,
            width_shift: width.trailing_zeros(),
            mask_x: width - 1,
            mask_y: height - 1,
            scale_x: (width * ONE as u32) as f32,
            scale_y: (height * ONE as u32) as f32,
        }
    }

    /// The next level: 2x2 boxes averaged in linear light, colours weighted by alpha so that holes do not bleed.
    fn halved(&self) -> Self {
        let (width, height) = (self.mask_x.div_ceil(2).max(1), self.mask_y.div_ceil(2).max(1));
        let texel =
            |x: u32, y: u32| self.texels[(((y & self.mask_y) << self.width_shift) | (x & self.mask_x)) as usize];
        let box_of = |i: u32| {
            let (x, y) = (2 * (i % width), 2 * (i / width));
            average([texel(x, y), texel(x + 1, y), texel(x, y + 1), texel(x + 1, y + 1)])
        };
        Self::new((0..width * height).map(box_of).collect(), width, height)
    }

    #[inline]
    fn bilinear(&self, u: f32, v: f32) -> u64 {
        if let [only] = self.texels[..] {
            return spread(only) << FRACTION_BITS;
        }
        // The bias is whole repeats of any texture: it needs not be taken off again.
        let x = (u * self.scale_x + HALF_TEXEL) as i32;
        let y = (v * self.scale_y + HALF_TEXEL) as i32;
        let (wx, wy) = ((x & (ONE - 1)) as u64, (y & (ONE - 1)) as u64);
        let (x, y) = ((x >> FRACTION_BITS) as u32, (y >> FRACTION_BITS) as u32);
        let (x0, x1) = (x & self.mask_x, x.wrapping_add(1) & self.mask_x);
        let (row0, row1) =
            ((y & self.mask_y) << self.width_shift, (y.wrapping_add(1) & self.mask_y) << self.width_shift);
        let texel = |row: u32, column: u32| spread(self.texels[(row | column) as usize]);
        let top = lerp(texel(row0, x0), texel(row0, x1), wx);
        let bottom = lerp(texel(row1, x0), texel(row1, x1), wx);
        lerp_wide(top, bottom, wy)
    }
}

/// Shifts to texel centres, and keeps the cast's argument positive so that cutting the fraction off rounds down. A whole
/// number of repeats for every side up to 4096 texels.
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
    a.wrapping_mul((ONE as u64).wrapping_sub(weight)).wrapping_add(b.wrapping_mul(weight))
}

/// Between two lanes of `value * 256`; keeps the scale.
#[inline]
fn lerp_wide(a: u64, b: u64, weight: u64) -> u64 {
    const BYTES: u64 = 0x00ff_00ff_00ff_00ff;
    let (a_high, a_low) = ((a >> 8) & BYTES, a & BYTES);
    let (b_high, b_low) = ((b >> 8) & BYTES, b & BYTES);
    lerp(a_high, b_high, weight).wrapping_add((lerp(a_low, b_low, weight) >> 8) & BYTES)
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
