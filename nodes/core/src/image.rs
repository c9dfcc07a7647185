//! Colour and depth images as the pipeline uses them.

use thiserror::Error;

/// Why a buffer is not an image.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum ImageError {
    /// The buffer does not hold `width * height` pixels.
    #[error("a {width}x{height} image needs {expected} values, the buffer has {found}")]
    Length {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
        /// Values needed.
        expected: usize,
        /// Values given.
        found: usize,
    },
    /// One side is zero.
    #[error("image of size {width}x{height} is empty")]
    Empty {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
    },
}

fn check(width: u32, height: u32, channels: usize, found: usize) -> Result<(), ImageError> {
    if width == 0 || height == 0 {
        return Err(ImageError::Empty { width, height });
    }
    let expected = (width as usize).saturating_mul(height as usize).saturating_mul(channels);
    if expected != found {
        return Err(ImageError::Length { width, height, expected, found });
    }
    Ok(())
}

/// 8-bit RGB, row-major, three bytes a pixel.
#[derive(Clone, PartialEq, Eq)]
pub struct RgbImage {
    width: u32,
    height: u32,
    data: Vec<u8>,
}

impl RgbImage {
    /// Takes `3 * width * height` bytes, row-major.
    ///
    /// # Errors
    /// [`ImageError`] when the buffer's length does not fit.
    pub fn new(width: u32, height: u32, data: Vec<u8>) -> Result<Self, ImageError> {
        check(width, height, 3, data.len())?;
        Ok(Self { width, height, data })
    }

    /// Columns.
    #[must_use]
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Rows.
    #[must_use]
    pub fn height(&self) -> u32 {
        self.height
    }

    /// `3 * width * height` bytes, row-major.
    #[must_use]
    pub fn data(&self) -> &[u8] {
        &self.data
    }

    /// Luma (ITU-R BT.601), one byte a pixel, row-major.
    #[must_use]
    pub fn to_luma(&self) -> Vec<u8> {
        self.data
            .chunks_exact(3)
            .map(|p| ((299 * u32::from(p[0]) + 587 * u32::from(p[1]) + 114 * u32::from(p[2]) + 500) / 1000) as u8)
            .collect()
    }
}

impl core::fmt::Debug for RgbImage {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "RgbImage({}x{})", self.width, self.height)
    }
}

/// Depth along the optical axis in metres, row-major. Invalid pixels (no return, NaN, negative, beyond range) are 0.
#[derive(Clone, PartialEq)]
pub struct DepthImage {
    width: u32,
    height: u32,
    data: Vec<f32>,
}

impl DepthImage {
    /// Depths that are not finite, not positive or beyond this are invalid, metres. A Kinect's 65535 mm is among them.
    pub const RANGE_MAX_M: f32 = 60.0;

    /// Takes `width * height` depths in metres; whatever is not a usable depth becomes 0.
    ///
    /// # Errors
    /// [`ImageError`] when the buffer's length does not fit.
    pub fn from_metres(width: u32, height: u32, mut data: Vec<f32>) -> Result<Self, ImageError> {
        check(width, height, 1, data.len())?;
        for d in &mut data {
            if !(*d > 0.0 && *d <= Self::RANGE_MAX_M) {
                *d = 0.0;
            }
        }
        Ok(Self { width, height, data })
    }

    /// Takes `width * height` depths in millimetres as sensors send them; 0 and 65535 are invalid.
    ///
    /// # Errors
    /// [`ImageError`] when the buffer's length does not fit.
    pub fn from_millimetres(width: u32, height: u32, data: &[u16]) -> Result<Self, ImageError> {
        Self::from_metres(width, height, data.iter().map(|&mm| f32::from(mm) * 1e-3).collect())
    }

    /// Columns.
    #[must_use]
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Rows.
    #[must_use]
    pub fn height(&self) -> u32 {
        self.height
    }

    /// `width * height` metres, row-major, 0 where invalid.
    #[must_use]
    pub fn data(&self) -> &[f32] {
        &self.data
    }

    /// Metres at a pixel, `None` where invalid or outside the image.
    #[must_use]
    pub fn at(&self, column: u32, row: u32) -> Option<f32> {
        if column >= self.width || row >= self.height {
            return None;
        }
        let d = self.data[row as usize * self.width as usize + column as usize];
        (d > 0.0).then_some(d)
    }

    /// Share of pixels with a usable depth, 0 to 1.
    #[must_use]
    pub fn valid_share(&self) -> f64 {
        self.data.iter().filter(|d| **d > 0.0).count() as f64 / self.data.len() as f64
    }
}

impl core::fmt::Debug for DepthImage {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "DepthImage({}x{})", self.width, self.height)
    }
}
