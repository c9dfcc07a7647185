//! RGB-D views of generated flats in pairs with exact geometry: what features and matchers are trained on and measured
//! with.
//!
//! [`draw`] takes the pictures of one flat, in groups around points of interest so that most of them see something that
//! another sees too. Each has a camera of its own. Correspondences follow from depth and pose; [`overlap`] says how much
//! two views share. [`export`] writes the views of many flats to a folder.

mod draw;
pub mod export;
mod overlap;
pub mod record;
mod stage;

use homing_core::{Camera, DepthImage, Intrinsics, IntrinsicsError, RgbImage, Transform};
use thiserror::Error;

pub use draw::{draw, draw_with};
pub use overlap::{agrees, overlap, seen_share};

use crate::arena::ArenaError;
use crate::constants::{CAMERA_HEIGHT, CAMERA_HEIGHT_M, CAMERA_HFOV_RAD, CAMERA_WIDTH};
use crate::scene::World;

/// How many views of what size.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct ViewSpec {
    /// Views of one flat. A flat that offers fewer gives fewer.
    pub n_views: usize,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl Default for ViewSpec {
    fn default() -> Self {
        Self { n_views: 16, width: 320, height: 240 }
    }
}

impl ViewSpec {
    /// Views of the size that the robot's own camera has.
    #[must_use]
    pub fn of_robot(n_views: usize) -> Self {
        Self { n_views, width: CAMERA_WIDTH, height: CAMERA_HEIGHT }
    }
}

/// What takes the pictures.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub enum Cameras {
    /// For each picture a camera of its own: height, field of view, pitch and roll are drawn. What training needs.
    #[default]
    Drawn,
    /// The same level camera for all: what a robot sees, and is shown.
    Level {
        /// Above the floor, metres.
        height_m: f64,
        /// Horizontal field of view, radians.
        hfov_rad: f64,
    },
}

impl Cameras {
    /// The robot's own camera.
    pub const ROBOT: Self = Self::Level { height_m: CAMERA_HEIGHT_M, hfov_rad: CAMERA_HFOV_RAD };
}

/// One picture.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// The camera, without distortion.
    pub camera: Intrinsics,
    /// Where it was: x right, y down, z forward, in the flat's frame with z up, metres.
    pub t_world_camera: Transform<World, Camera>,
    /// Colour.
    pub rgb: RgbImage,
    /// Depth along the optical axis; [`draw`] gives whole millimetres, as an export stores it.
    pub depth: DepthImage,
    /// Which state of the flat it shows: 0 as generated, others with other light and some furniture moved.
    pub variant: u32,
}

impl View {
    /// Heading of the optical axis on the floor, radians from the world's x axis, left positive.
    #[must_use]
    pub fn yaw_rad(&self) -> f64 {
        let forward = self.t_world_camera.rotation() * nalgebra::Vector3::z();
        libm::atan2(forward.y, forward.x)
    }
}

/// Two views that share at least [`OVERLAP_MIN`].
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct ViewPair {
    /// Index of one view.
    pub a: usize,
    /// Index of the other, larger than `a`.
    pub b: usize,
    /// What they share, see [`overlap`].
    pub overlap: f64,
    /// Difference of their headings, radians, 0 to pi.
    pub yaw_rad: f64,
    /// Between the two cameras, metres.
    pub distance_m: f64,
}

/// All views of one flat.
#[derive(Clone, Debug, PartialEq)]
pub struct FlatViews {
    /// The flat's seed.
    pub seed: u64,
    /// Pictures.
    pub views: Vec<View>,
    /// Every pair that shares enough, by `a`, then `b`.
    pub pairs: Vec<ViewPair>,
}

/// Pairs that share less are not listed.
pub const OVERLAP_MIN: f64 = 0.1;

/// Why there are no views.
#[derive(Debug, Error)]
pub enum ViewsError {
    /// The flat cannot be stood in.
    #[error(transparent)]
    Arena(#[from] ArenaError),
    /// The size asked for is no image's.
    #[error(transparent)]
    Camera(#[from] IntrinsicsError),
}
