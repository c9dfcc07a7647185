//! A rasterizer of our own on the CPU: colour and metric depth of a [`Scene`] through a pinhole camera.
//!
//! Three passes. *Set-up* culls clusters of triangles and writes every remaining triangle as linear functions of the
//! pixel (Olano and Greer, "Triangle Scan Conversion using 2D Homogeneous Coordinates", 1997: nothing needs clipping).
//! *Visibility* finds the nearest triangle of every pixel, *shading* then colours each pixel once.
//!
//! The same scene and camera give the same bytes on every CPU and with any number of threads: bands of rows are
//! independent, triangles keep one order (the first of two at equal depth wins), and only IEEE operations are used
//! between set-up and pixel.

mod chart;
mod geometry;
mod light;
mod mip;
mod occupancy;
mod raster;
mod setup;
mod shade;
pub(crate) mod srgb;

use std::sync::Arc;

use homing_core::{Camera, DepthImage, Intrinsics, RgbImage, Transform};
use rayon::prelude::*;

use crate::render::geometry::Geometry;
use crate::render::mip::MipTexture;
use crate::render::setup::{Bins, View};
use crate::scene::{Scene, World};

/// Nearer surfaces are not drawn, metres.
pub const NEAR_M: f64 = 0.03;

/// Rows of one unit of work. A band's depths and triangle numbers stay in the second-level cache.
const BAND_ROWS: usize = 16;

/// Draws a scene. The seam behind which another backend (a GPU) may stand.
pub trait Render: Send {
    /// Colour (8-bit sRGB) and depth (metres along the optical axis, 0 where nothing is) seen by `camera` at
    /// `t_world_camera`. The centre of the top-left pixel is (0, 0), as in [`Intrinsics::project`]. A pose that is not
    /// finite sees nothing.
    fn render(&mut self, camera: &Intrinsics, t_world_camera: &Transform<World, Camera>) -> (RgbImage, DepthImage);
}

/// The rasterizer with everything it derives from a scene once: mip chains, clusters for culling, baked light.
#[derive(Clone, Debug)]
pub struct Renderer {
    scene: Arc<Scene>,
    geometry: Geometry,
    textures: Vec<MipTexture>,
}

/// What one frame cost.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub struct FrameCount {
    /// Triangles set up after culling.
    pub triangles: usize,
    /// Triangles in the scene.
    pub triangles_total: usize,
}

impl Renderer {
    /// Prepares a scene. Triangles that name missing vertices or materials, or are not finite, are left out.
    #[must_use]
    pub fn new(scene: Arc<Scene>) -> Self {
        let textures = mip::chains(&scene);
        let geometry = Geometry::new(&scene);
        Self { scene, geometry, textures }
    }

    /// The scene being drawn.
    #[must_use]
    pub fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    /// How many triangles a camera at this pose has to deal with.
    #[must_use]
    pub fn count(&self, camera: &Intrinsics, t_world_camera: &Transform<World, Camera>) -> FrameCount {
        let view = View::new(camera, t_world_camera);
        FrameCount {
            triangles: setup::triangles(&self.geometry, &view).iter().map(Vec::len).sum(),
            triangles_total: self.geometry.triangles.len(),
        }
    }

    fn draw(&self, view: &View) -> (Vec<u8>, Vec<f32>) {
        let (width, height) = (view.width, view.height);
        let chunks = setup::triangles(&self.geometry, view);
        let bins = Bins::new(&chunks, height.div_ceil(BAND_ROWS), BAND_ROWS);
        let mut rgb = vec![0_u8; width * height * 3];
        let mut depth = vec![0_f32; width * height];
        let bands = depth.par_chunks_mut(BAND_ROWS * width).zip(rgb.par_chunks_mut(BAND_ROWS * width * 3));
        bands.enumerate().for_each(|(band, (depth, rgb))| {
            let mut ids = vec![raster::NOTHING; depth.len()];
            let triangles = bins.of(band);
            let mut target = raster::Band { first_row: band * BAND_ROWS, width, depth: &mut *depth, ids: &mut ids };
            raster::opaque(&mut target, &bins, triangles.clone());
            raster::cut_out(&mut target, &bins, triangles, &self.geometry, &self.textures);
            shade::band(&mut target, rgb, &bins, &self.geometry, &self.textures);
        });
        (rgb, depth)
    }
}

impl Render for Renderer {
    #[expect(clippy::expect_used, reason = "the buffers are sized from the camera, whose sides are at least 1")]
    fn render(&mut self, camera: &Intrinsics, t_world_camera: &Transform<World, Camera>) -> (RgbImage, DepthImage) {
        let view = View::new(camera, t_world_camera);
        let (rgb, depth) = self.draw(&view);
        let rgb = RgbImage::new(camera.width(), camera.height(), rgb).expect("colour buffer of the camera's size");
        let depth =
            DepthImage::from_metres(camera.width(), camera.height(), depth).expect("depth buffer of the camera's size");
        (rgb, depth)
    }
}

#[cfg(test)]
mod tests;
