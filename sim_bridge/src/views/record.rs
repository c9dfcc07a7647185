//! The files of an export, as bytes (format 1).
//!
//! `set.json` names the flats of a whole export. Each has a folder named by its seed, with `views.json`, and for view
//! number 3 `003.png` (8-bit RGB) and `003.depth.png` (16-bit grey, millimetres along the optical axis, 0 where
//! unknown). Cameras look along z with x to the right and y down; the centre of the top-left pixel is (0, 0).

use homing_core::{DepthImage, RgbImage};
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder, ImageError};
use serde::{Deserialize, Serialize};

use super::{FlatViews, View, ViewPair};

/// Version of the files; readers refuse others.
pub const FORMAT: u32 = 1;
/// Name of the file in a flat's folder that is written last.
pub const VIEWS_FILE: &str = "views.json";
/// Name of the file in the export's folder that is written last.
pub const SET_FILE: &str = "set.json";

/// What `set.json` holds.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SetRecord {
    /// [`FORMAT`].
    pub format: u32,
    /// Seeds of the flats, ascending.
    pub scenes: Vec<u64>,
    /// Columns and rows of every picture.
    pub size: [u32; 2],
    /// Views asked for of each flat.
    pub n_views: usize,
}

/// What `views.json` holds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FlatRecord {
    /// [`FORMAT`].
    pub format: u32,
    /// The flat's seed.
    pub seed: u64,
    /// Pictures.
    pub views: Vec<ViewRecord>,
    /// Pairs that share enough.
    pub pairs: Vec<PairRecord>,
}

/// One picture: its files and its camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ViewRecord {
    /// Name of the colour file.
    pub rgb: String,
    /// Name of the depth file.
    pub depth: String,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Horizontal focal length, pixels.
    pub fx: f64,
    /// Vertical focal length, pixels.
    pub fy: f64,
    /// Horizontal principal point, pixels.
    pub cx: f64,
    /// Vertical principal point, pixels.
    pub cy: f64,
    /// Pose of the camera in the flat, row-major, metres.
    pub t_world_camera: [[f64; 4]; 4],
    /// State of the flat.
    pub variant: u32,
}

/// Two pictures that share something.
#[derive(Copy, Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PairRecord {
    /// Index of one view.
    pub a: usize,
    /// Index of the other.
    pub b: usize,
    /// What they share, 0 to 1, see [`super::overlap`]; rounded to 1e-4.
    pub overlap: f64,
    /// Difference of their headings, degrees, rounded to 1e-3.
    pub yaw_deg: f64,
    /// Between the cameras, metres, rounded to 1e-4.
    pub distance_m: f64,
}

/// A file before it is written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NamedFile {
    /// Name within its folder.
    pub name: String,
    /// Content.
    pub bytes: Vec<u8>,
}

/// The files of one flat's folder in the order in which to write them: `views.json` is last.
///
/// # Errors
/// [`ImageError`] when a picture cannot be encoded.
pub fn files(flat: &FlatViews) -> Result<Vec<NamedFile>, ImageError> {
    let mut files = Vec::with_capacity(2 * flat.views.len() + 1);
    for (i, view) in flat.views.iter().enumerate() {
        files.push(NamedFile { name: rgb_name(i), bytes: rgb_png(&view.rgb)? });
        files.push(NamedFile { name: depth_name(i), bytes: depth_png(&view.depth)? });
    }
    files.push(NamedFile { name: VIEWS_FILE.to_owned(), bytes: json(&FlatRecord::of(flat)) });
    Ok(files)
}

impl FlatRecord {
    /// Of a flat's views.
    #[must_use]
    pub fn of(flat: &FlatViews) -> Self {
        Self {
            format: FORMAT,
            seed: flat.seed,
            views: flat.views.iter().enumerate().map(|(i, view)| ViewRecord::of(i, view)).collect(),
            pairs: flat.pairs.iter().map(PairRecord::of).collect(),
        }
    }
}

impl ViewRecord {
    fn of(i: usize, view: &View) -> Self {
        let m = view.t_world_camera.isometry().to_homogeneous();
        let camera = &view.camera;
        Self {
            rgb: rgb_name(i),
            depth: depth_name(i),
            width: camera.width(),
            height: camera.height(),
            fx: camera.fx(),
            fy: camera.fy(),
            cx: camera.cx(),
            cy: camera.cy(),
            t_world_camera: core::array::from_fn(|r| core::array::from_fn(|c| m[(r, c)])),
            variant: view.variant,
        }
    }
}

impl PairRecord {
    fn of(pair: &ViewPair) -> Self {
        let rounded = |value: f64, steps: f64| (value * steps).round() / steps;
        Self {
            a: pair.a,
            b: pair.b,
            overlap: rounded(pair.overlap, 1e4),
            yaw_deg: rounded(pair.yaw_rad.to_degrees(), 1e3),
            distance_m: rounded(pair.distance_m, 1e4),
        }
    }
}

/// A record as JSON with a line break at its end.
#[must_use]
pub fn json(record: &impl Serialize) -> Vec<u8> {
    // Records hold numbers, strings and lists only: nothing in them can fail to be written.
    let mut bytes = serde_json::to_vec(record).unwrap_or_default();
    bytes.push(b'\n');
    bytes
}

fn rgb_name(i: usize) -> String {
    format!("{i:03}.png")
}

fn depth_name(i: usize) -> String {
    format!("{i:03}.depth.png")
}

fn rgb_png(rgb: &RgbImage) -> Result<Vec<u8>, ImageError> {
    png(rgb.data(), (rgb.width(), rgb.height()), ExtendedColorType::Rgb8)
}

fn depth_png(depth: &DepthImage) -> Result<Vec<u8>, ImageError> {
    let millimetre = |m: &f32| ((m * 1e3 + 0.5) as u16).to_ne_bytes();
    let bytes: Vec<u8> = depth.data().iter().flat_map(millimetre).collect();
    png(&bytes, (depth.width(), depth.height()), ExtendedColorType::L16)
}

fn png(data: &[u8], (width, height): (u32, u32), colour: ExtendedColorType) -> Result<Vec<u8>, ImageError> {
    let mut file = Vec::new();
    let encoder = PngEncoder::new_with_quality(&mut file, CompressionType::Fast, FilterType::Adaptive);
    encoder.write_image(data, width, height, colour)?;
    Ok(file)
}
