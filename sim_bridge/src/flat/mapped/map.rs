//! Reading a navigability map: an 8-bit PNG and what its name and a file beside it say of its scale.

use std::path::{Path, PathBuf};

use homing_core::GridGeometry;
use image::DynamicImage;
use serde::Deserialize;
use thiserror::Error;

use crate::habitat::axes;

/// Width of the square that published maps cover, metres: their scale is this over their columns.
const SQUARE_M: f64 = 152.3640;
/// Habitat's x at the upper border of row 0 of a published map, metres.
const X_AT_ROW_0_M: f64 = 90.0399;
/// Habitat's z at the left border of column 0 of a published map, metres.
const Z_AT_COLUMN_0_M: f64 = -62.3241;
/// A map needs at least this much navigable floor, square metres.
const FLOOR_M2_MIN: f64 = 1.0;
/// The navigable part may span at most this, metres.
const SPAN_M_MAX: f64 = 120.0;
/// Scales accepted, metres per pixel.
const SCALES: (f64, f64) = (0.005, 0.5);
/// Largest file read, bytes.
const FILE_BYTES_MAX: u64 = 256 << 20;

/// Why a file is no navigability map.
#[derive(Debug, Error)]
pub enum MapError {
    /// The file cannot be read.
    #[error("cannot read the map {}: {source}", path.display())]
    Read {
        /// Which file.
        path: PathBuf,
        /// Why not.
        source: std::io::Error,
    },
    /// Not an image, or a broken one.
    #[error("{} is not an image that can be read: {source}", path.display())]
    NotImage {
        /// Which file.
        path: PathBuf,
        /// What the decoder found.
        source: image::ImageError,
    },
    /// Colours or 16 bits: then it is a picture of a map.
    #[error("{} holds {found}, a navigability map is 8-bit grey: 0 blocked, all else navigable", path.display())]
    NotGrey {
        /// Which file.
        path: PathBuf,
        /// Its kind of pixel.
        found: String,
    },
    /// All pixels say the same.
    #[error("every pixel of {} is {value}: a map has navigable (not 0) and blocked (0) ones", path.display())]
    OneColour {
        /// Which file.
        path: PathBuf,
        /// That value.
        value: u8,
    },
    /// Too little floor for a robot, or so much that the scale must be wrong.
    #[error(
        "the navigable part of {} is {area_m2:.2} square metres and spans {span_m:.0} m; a scene has at least \
         {FLOOR_M2_MIN} square metre and at most {SPAN_M_MAX} m: check metres_per_pixel",
        path.display()
    )]
    Size {
        /// Which file.
        path: PathBuf,
        /// Navigable area, square metres.
        area_m2: f64,
        /// Its longer side, metres.
        span_m: f64,
    },
    /// Specks all over.
    #[error("the map {name} has {found} separate outlines, at most {allowed} are built: it is noise, not rooms")]
    Ragged {
        /// The map's name.
        name: String,
        /// Outlines found.
        found: usize,
        /// Outlines allowed.
        allowed: usize,
    },
    /// The file beside the map does not say what it should.
    #[error("{} does not describe a map: {what}", path.display())]
    Description {
        /// The TOML file.
        path: PathBuf,
        /// What is wrong with it.
        what: String,
    },
}

/// Where an agent's centre can be on one floor, as pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct NavMap {
    /// The file's name without its ending.
    pub name: String,
    /// Where the pixels lie, world frame.
    pub geometry: GridGeometry,
    /// One flag a pixel, by [`GridGeometry::index`].
    pub navigable: Vec<bool>,
    /// Height of the floor in Habitat's frame, metres; in the world frame it is 0.
    pub floor_y_m: f64,
}

/// What `NAME.toml` beside `NAME.png` may say.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Description {
    metres_per_pixel: Option<f64>,
    x_at_row_0_m: Option<f64>,
    z_at_column_0_m: Option<f64>,
    floor_y_m: Option<f64>,
}

impl NavMap {
    /// Reads a map. Rows run against Habitat's x, columns along its z. Scale and place are those of the published
    /// Gibson maps (row = (90.0399 - x) / s, column = (z + 62.3241) / s, s = 152.364 m / columns) unless `NAME.toml`
    /// beside the map says otherwise (`metres_per_pixel`, `x_at_row_0_m`, `z_at_column_0_m`, `floor_y_m`). The floor's
    /// height is the number after the name's last underscore, else 0.
    ///
    /// # Errors
    /// [`MapError`] naming the file and what is wrong with it.
    pub fn read(path: &Path) -> Result<Self, MapError> {
        let grey = read_grey(path)?;
        let description = read_description(&path.with_extension("toml"))?;
        let name = path.file_stem().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let first = grey.as_raw().first().copied().unwrap_or(0);
        if grey.as_raw().iter().all(|v| (*v > 0) == (first > 0)) {
            return Err(MapError::OneColour { path: path.into(), value: first });
        }
        let scale = description.metres_per_pixel.unwrap_or(SQUARE_M / f64::from(grey.width()));
        let corner =
            (description.x_at_row_0_m.unwrap_or(X_AT_ROW_0_M), description.z_at_column_0_m.unwrap_or(Z_AT_COLUMN_0_M));
        let floor_y_m = description.floor_y_m.or_else(|| name.rsplit('_').next()?.parse().ok()).unwrap_or(0.0);
        let (geometry, navigable) = cropped(&grey, scale, corner);
        let area_m2 = navigable.iter().filter(|n| **n).count() as f64 * scale * scale;
        let span_m = geometry.width.max(geometry.height) as f64 * scale;
        if !(area_m2 >= FLOOR_M2_MIN && span_m <= SPAN_M_MAX) {
            return Err(MapError::Size { path: path.into(), area_m2, span_m });
        }
        Ok(Self { name, geometry, navigable, floor_y_m })
    }

    /// A number that other maps do not share: FNV-1a over scale, sides and pixels.
    #[must_use]
    pub fn seed(&self) -> u64 {
        let g = &self.geometry;
        let numbers = [g.width as u64, g.height as u64, g.resolution_m.to_bits()];
        let bytes = numbers.iter().flat_map(|n| n.to_le_bytes()).chain(self.navigable.iter().map(|n| u8::from(*n)));
        bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
    }
}

fn read_grey(path: &Path) -> Result<image::GrayImage, MapError> {
    let unread = |source| MapError::Read { path: path.into(), source };
    let bytes = std::fs::metadata(path).map_err(unread)?.len();
    if bytes > FILE_BYTES_MAX {
        let what = format!("{bytes} bytes, at most {FILE_BYTES_MAX} are read");
        return Err(unread(std::io::Error::new(std::io::ErrorKind::FileTooLarge, what)));
    }
    let bytes = std::fs::read(path).map_err(unread)?;
    match image::load_from_memory(&bytes).map_err(|source| MapError::NotImage { path: path.into(), source })? {
        DynamicImage::ImageLuma8(grey) => Ok(grey),
        other => Err(MapError::NotGrey { path: path.into(), found: format!("{:?} pixels", other.color()) }),
    }
}

fn read_description(path: &Path) -> Result<Description, MapError> {
    let text = match std::fs::read_to_string(path) {
        Ok(text) => text,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(Description::default()),
        Err(source) => return Err(MapError::Read { path: path.into(), source }),
    };
    let wrong = |what: String| MapError::Description { path: path.into(), what };
    let description: Description = toml::from_str(&text).map_err(|e| wrong(e.to_string()))?;
    let places = [description.x_at_row_0_m, description.z_at_column_0_m, description.floor_y_m];
    if places.iter().flatten().any(|v| !v.is_finite()) {
        return Err(wrong("a place that is not a number".into()));
    }
    match description.metres_per_pixel {
        Some(scale) if !(SCALES.0..=SCALES.1).contains(&scale) => {
            Err(wrong(format!("metres_per_pixel is {scale}, it must be from {} to {}", SCALES.0, SCALES.1)))
        }
        _ => Ok(description),
    }
}

/// The rectangle around the navigable pixels, in the world frame.
fn cropped(grey: &image::GrayImage, scale: f64, (x_at_row_0, z_at_column_0): (f64, f64)) -> (GridGeometry, Vec<bool>) {
    let set = || grey.enumerate_pixels().filter(|(_, _, p)| p.0[0] > 0).map(|(column, row, _)| (column, row));
    let (columns, rows) = set().fold(((u32::MAX, 0), (u32::MAX, 0)), |(c, r), (column, row)| {
        ((c.0.min(column), c.1.max(column)), (r.0.min(row), r.1.max(row)))
    });
    let lower = axes::to_world([
        x_at_row_0 - f64::from(rows.1 + 1) * scale,
        0.0,
        z_at_column_0 + f64::from(columns.1 + 1) * scale,
    ]);
    let geometry = GridGeometry {
        width: (rows.1 - rows.0 + 1) as usize,
        height: (columns.1 - columns.0 + 1) as usize,
        resolution_m: scale,
        origin_x_m: lower[0],
        origin_y_m: lower[1],
    };
    let mut navigable = vec![false; geometry.len()];
    for (column, row) in set() {
        navigable[geometry.index((rows.1 - row) as usize, (columns.1 - column) as usize)] = true;
    }
    (geometry, navigable)
}
