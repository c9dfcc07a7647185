//! Colours every pixel of a band once.

use crate::render::geometry::{Corner, Geometry};
use crate::render::mip::MipTexture;
use crate::render::raster::{Band, NOTHING};
use crate::render::setup::{Bins, Plane, ScreenTriangle};

/// Footprints longer than this many times their width (squared) are averaged from two probes along the longer axis, and
/// from four: floors at a grazing angle stay sharp.
const TWO_PROBES2: f32 = 1.5 * 1.5;
const FOUR_PROBES2: f32 = 3.0 * 3.0;

/// What is seen where no surface is.
const BACKGROUND: [u8; 3] = [168, 186, 206];

/// Texture coordinates of a triangle over the image.
pub struct Texturing<'a> {
    texture: &'a MipTexture,
    u: Plane,
    v: Plane,
    q: Plane,
}

/// The footprint of a pixel in its texture.
struct Footprint {
    u: f32,
    v: f32,
    /// Longer axis, texture repeats.
    major: (f32, f32),
    /// Squared lengths of both axes, texels.
    long2: f32,
    short2: f32,
}

impl<'a> Texturing<'a> {
    /// Of one triangle.
    pub fn new(triangle: &ScreenTriangle, geometry: &Geometry, texture: &'a MipTexture) -> Self {
        let corners = geometry.triangles[triangle.index as usize].map(|i| &geometry.corners[i as usize]);
        // Whole repeats are taken off, so that single precision is enough per pixel.
        let low = |k: usize| f64::from(corners[0].uv[k].min(corners[1].uv[k]).min(corners[2].uv[k]) as i32);
        let (low_u, low_v) = (low(0), low(1));
        Self {
            texture,
            u: attribute(triangle, corners, |c| f64::from(c.uv[0]) - low_u),
            v: attribute(triangle, corners, |c| f64::from(c.uv[1]) - low_v),
            q: triangle.inverse_depth,
        }
    }

    /// Alpha, 0 to 1, at a pixel with inverse depth `q`.
    pub fn alpha(&self, column: i32, row: i32, q: f32) -> f32 {
        let (x, y) = (f64::from(column), f64::from(row));
        let f = self.footprint(self.u.at(x, y) as f32, self.v.at(x, y) as f32, 1.0 / q);
        self.texture.alpha(f.u, f.v, 0.5 * log2(f.short2.max(1.0)))
    }

    /// `u_z`, `v_z` are u/z and v/z; derivatives of u = (u/z) / (1/z) by the quotient rule.
    #[inline]
    fn footprint(&self, u_z: f32, v_z: f32, z: f32) -> Footprint {
        let (u, v) = (u_z * z, v_z * z);
        let (qx, qy) = (self.q.x as f32, self.q.y as f32);
        let (ux, vx) = ((self.u.x as f32 - u * qx) * z, (self.v.x as f32 - v * qx) * z);
        let (uy, vy) = ((self.u.y as f32 - u * qy) * z, (self.v.y as f32 - v * qy) * z);
        let length2 = |du: f32, dv: f32| {
            let (a, b) = (du * self.texture.width, dv * self.texture.height);
            a * a + b * b
        };
        let (along_x, along_y) = (length2(ux, vx), length2(uy, vy));
        if along_x >= along_y {
            Footprint { u, v, major: (ux, vx), long2: along_x, short2: along_y }
        } else {
            Footprint { u, v, major: (uy, vy), long2: along_y, short2: along_x }
        }
    }

    /// Filtered colour in lanes of value * 256.
    #[inline]
    fn sample(&self, f: &Footprint) -> u64 {
        if f.long2 <= 1.0 {
            return self.texture.trilinear(f.u, f.v, 0.0);
        }
        // Half the logarithm of a squared length: no root is needed.
        let lod = 0.5 * log2(f.long2);
        if f.long2 < TWO_PROBES2 * f.short2 {
            return self.texture.trilinear(f.u, f.v, lod);
        }
        let at = |share: f32, lod: f32| self.texture.trilinear(f.u + f.major.0 * share, f.v + f.major.1 * share, lod);
        if f.long2 < FOUR_PROBES2 * f.short2 {
            return mean(at(-0.25, lod - 1.0), at(0.25, lod - 1.0));
        }
        let lod = lod - 2.0;
        mean(mean(at(-0.375, lod), at(-0.125, lod)), mean(at(0.125, lod), at(0.375, lod)))
    }
}

/// An attribute over z as a plane over the image.
fn attribute(triangle: &ScreenTriangle, corners: [&Corner; 3], value: impl Fn(&Corner) -> f64) -> Plane {
    let [a, b, c] = corners.map(value);
    let (q, b1, b2) = (&triangle.inverse_depth, &triangle.b1, &triangle.b2);
    let mix = |f: fn(&Plane) -> f64| a * f(q) + (b - a) * f(b1) + (c - a) * f(b2);
    Plane { x: mix(|p| p.x), y: mix(|p| p.y), c: mix(|p| p.c) }
}

/// Mean of two colours, lane by lane.
#[inline]
fn mean(a: u64, b: u64) -> u64 {
    const TOP_CLEAR: u64 = 0x7fff_7fff_7fff_7fff;
    ((a >> 1) & TOP_CLEAR) + ((b >> 1) & TOP_CLEAR)
}

/// Base-2 logarithm of a positive number from its bits; the mantissa by a parabola, good to 0.01.
#[inline]
fn log2(x: f32) -> f32 {
    let bits = x.to_bits();
    let exponent = ((bits >> 23) & 0xff) as i32 - 127;
    let m = f32::from_bits((bits & 0x007f_ffff) | 0x3f80_0000) - 1.0;
    exponent as f32 + m * (1.343_75 - 0.343_75 * m)
}

/// Colours a band and turns its inverse depths into metres.
pub fn band(band: &mut Band<'_>, rgb: &mut [u8], bins: &Bins<'_>, geometry: &Geometry, textures: &[MipTexture]) {
    let width = band.width;
    let rows =
        band.depth.chunks_exact_mut(width).zip(band.ids.chunks_exact(width)).zip(rgb.chunks_exact_mut(3 * width));
    for (row, ((depth, ids), rgb)) in rows.enumerate() {
        let y = (band.first_row + row) as f64;
        let mut start = 0;
        while start < width {
            let id = ids[start];
            let length = ids[start..].iter().take_while(|other| **other == id).count();
            let pixels = start..start + length;
            let out = &mut rgb[3 * start..3 * (start + length)];
            if id == NOTHING {
                out.chunks_exact_mut(3).for_each(|p| p.copy_from_slice(&BACKGROUND));
            } else {
                run(bins.triangle(id as usize), (start as f64, y), &mut depth[pixels], out, geometry, textures);
            }
            start += length;
        }
    }
}

/// A run of pixels of one row that show one triangle.
fn run(
    triangle: &ScreenTriangle,
    (x, y): (f64, f64),
    depth: &mut [f32],
    rgb: &mut [u8],
    geometry: &Geometry,
    textures: &[MipTexture],
) {
    let look = &geometry.looks[triangle.look as usize];
    let index = triangle.index as usize;
    let texturing = Texturing::new(triangle, geometry, &textures[look.texture]);
    let corners = geometry.triangles[index].map(|i| &geometry.corners[i as usize]);
    let light = [0, 1, 2].map(|k| attribute(triangle, corners, |c| f64::from(c.light[k])));
    let chart = geometry.chart_of[index].map(|c| &geometry.charts[c as usize]);
    let start = [texturing.u, texturing.v, light[0], light[1], light[2]].map(|p| (p.at(x, y) as f32, p.x as f32));
    for (i, (depth, rgb)) in depth.iter_mut().zip(rgb.chunks_exact_mut(3)).enumerate() {
        let i = i as i32 as f32;
        let z = 1.0 / *depth;
        *depth = z;
        let [u_z, v_z, a, b, c] = start.map(|(value, step)| value + step * i);
        let colour = texturing.sample(&texturing.footprint(u_z, v_z, z));
        let [red, green, blue] = match chart {
            Some(chart) => {
                let [red, green, blue, _] = chart.at(a * z, b * z);
                [red, green, blue]
            }
            None => [a * z, b * z, c * z],
        };
        let lit = |lane: u32, light: f32| {
            let value = ((colour >> lane) & 0xffff) as i32 as f32;
            (value * (light * (1.0 / 256.0)) + 0.5).clamp(0.0, 255.0) as i32 as u8
        };
        rgb.copy_from_slice(&[lit(0, red), lit(32, green), lit(16, blue)]);
    }
}
