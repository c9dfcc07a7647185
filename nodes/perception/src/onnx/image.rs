//! Images as networks want them: channels, range and size.

use homing_core::RgbImage;
use opencv::core::{Mat, Size};
use opencv::imgproc;
use opencv::prelude::*;

use super::contract::FoundPort;
use crate::PerceptionError;

/// What the values of the input tensor are.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Pixels {
    /// One channel, luma (ITU-R BT.601), 0 to `range`.
    Luma {
        /// Value of white.
        range: f32,
    },
    /// One channel, the mean of red, green and blue, 0 to 255.
    MeanOfRgb,
    /// Three channels, each `value / 255`, less `mean`, over `sd`.
    Rgb {
        /// Per channel.
        mean: [f32; 3],
        /// Per channel.
        sd: [f32; 3],
    },
}

/// Sizes a network takes.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum InputSize {
    /// This alone: columns, rows.
    Fixed(usize, usize),
    /// Any whose sides are multiples of this.
    MultipleOf(usize),
}

impl InputSize {
    /// What a model takes whose input ends in height and width: the sides it was exported with, if it was with fixed ones.
    #[must_use]
    pub fn of(port: &FoundPort, multiple: usize) -> Self {
        match port.shape[..] {
            [.., Some(height), Some(width)] => Self::Fixed(width, height),
            _ => Self::MultipleOf(multiple),
        }
    }

    /// The size an image of `width` x `height` is brought to, its longer side at most `side_max`.
    #[must_use]
    pub fn for_image(self, (width, height): (usize, usize), side_max: usize) -> (usize, usize) {
        match self {
            Self::Fixed(width, height) => (width, height),
            Self::MultipleOf(multiple) => {
                let shrink = (side_max as f64 / width.max(height) as f64).min(1.0);
                let round = |side: usize| {
                    let multiples = (side as f64 * shrink / multiple as f64).round().max(1.0);
                    multiples as usize * multiple
                };
                (round(width), round(height))
            }
        }
    }
}

/// The input tensor of one image, and how to get back to its pixels.
#[derive(Clone, Debug, Default)]
pub struct Prepared {
    /// Channels, rows, columns; row-major.
    pub data: Vec<f32>,
    /// Channels.
    pub channels: usize,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Columns and rows of the image.
    pub original: (u32, u32),
}

impl Prepared {
    /// Fills itself from an image brought to `size` (columns, rows).
    ///
    /// # Errors
    /// [`PerceptionError::OpenCv`] if the image cannot be resized.
    pub fn fill(&mut self, image: &RgbImage, size: (usize, usize), pixels: Pixels) -> Result<(), PerceptionError> {
        self.original = (image.width(), image.height());
        (self.width, self.height) = size;
        self.channels = if matches!(pixels, Pixels::Rgb { .. }) { 3 } else { 1 };
        let resized;
        let rgb = if (image.width() as usize, image.height() as usize) == size {
            image.data()
        } else {
            resized = resize(image, size).map_err(PerceptionError::opencv("resize an image"))?;
            resized.data_bytes().map_err(PerceptionError::opencv("read a resized image"))?
        };
        self.data.clear();
        let (rgb, _) = rgb.as_chunks::<3>();
        match pixels {
            Pixels::Luma { range } => self.data.extend(rgb.iter().map(|&p| luma(p) * (range / 255.0))),
            Pixels::MeanOfRgb => self
                .data
                .extend(rgb.iter().map(|p| f32::from(u16::from(p[0]) + u16::from(p[1]) + u16::from(p[2])) / 3.0)),
            Pixels::Rgb { mean, sd } => {
                for c in 0..3 {
                    let (scale, shift) = (1.0 / (255.0 * sd[c]), mean[c] / sd[c]);
                    self.data.extend(rgb.iter().map(|p| f32::from(p[c]) * scale - shift));
                }
            }
        }
        Ok(())
    }

    /// The tensor's shape.
    #[must_use]
    pub fn shape(&self) -> Vec<usize> {
        vec![1, self.channels, self.height, self.width]
    }

    /// A position in the tensor, in the image's pixels; the centre of the top-left pixel is (0, 0) in both.
    #[must_use]
    pub fn to_image(&self, x: f32, y: f32) -> (f32, f32) {
        let back = |v: f32, original: u32, side: usize| (v + 0.5) * (original as f32 / side as f32) - 0.5;
        (back(x, self.original.0, self.width), back(y, self.original.1, self.height))
    }
}

/// The same integer as [`RgbImage::to_luma`].
fn luma([r, g, b]: [u8; 3]) -> f32 {
    ((299 * u32::from(r) + 587 * u32::from(g) + 114 * u32::from(b) + 500) / 1000) as f32
}

fn resize(image: &RgbImage, (width, height): (usize, usize)) -> opencv::Result<Mat> {
    let full = Mat::new_rows_cols_with_data(image.height() as i32, 3 * image.width() as i32, image.data())?;
    let full = full.reshape(3, image.height() as i32)?;
    let mut resized = Mat::default();
    let shrinks = (image.width() as usize) > width || (image.height() as usize) > height;
    let method = if shrinks { imgproc::INTER_AREA } else { imgproc::INTER_LINEAR };
    imgproc::resize(&full, &mut resized, Size::new(width as i32, height as i32), 0.0, 0.0, method)?;
    Ok(resized)
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "tests")]
mod tests {
    use super::*;

    fn gradient(width: u32, height: u32) -> RgbImage {
        let pixel = |i: u32| [(i % width) as u8, (i / width) as u8, 30];
        RgbImage::new(width, height, (0..width * height).flat_map(pixel).collect()).unwrap()
    }

    #[test]
    fn sizes_are_multiples_and_bounded() {
        let any = InputSize::MultipleOf(32);
        assert_eq!(any.for_image((640, 480), 640), (640, 480));
        assert_eq!(any.for_image((4000, 3000), 640), (640, 480));
        assert_eq!(any.for_image((3000, 4000), 640), (480, 640));
        assert_eq!(any.for_image((1, 500), 640), (32, 512));
        assert_eq!(InputSize::Fixed(640, 480).for_image((10, 10), 640), (640, 480));
        let fixed = FoundPort { name: String::new(), element: None, shape: vec![None, Some(1), Some(480), Some(640)] };
        assert_eq!(InputSize::of(&fixed, 32), InputSize::Fixed(640, 480));
    }

    #[test]
    fn values_are_those_of_the_contract() {
        let image = gradient(32, 32);
        let mut prepared = Prepared::default();
        prepared.fill(&image, (32, 32), Pixels::MeanOfRgb).unwrap();
        assert_eq!((prepared.data[0], prepared.data[33]), (10.0, 32.0 / 3.0));
        prepared.fill(&image, (32, 32), Pixels::Luma { range: 255.0 }).unwrap();
        assert_eq!(prepared.data.iter().map(|x| *x as u8).collect::<Vec<_>>(), image.to_luma());
        prepared.fill(&image, (32, 32), Pixels::Rgb { mean: [0.5; 3], sd: [0.25; 3] }).unwrap();
        assert_eq!((prepared.shape(), prepared.data.len()), (vec![1, 3, 32, 32], 3072));
        assert!((prepared.data[2 * 1024] - (30.0 / 255.0 - 0.5) / 0.25).abs() < 1e-6);
    }

    #[test]
    fn positions_survive_resizing() {
        let image = gradient(200, 100);
        let mut prepared = Prepared::default();
        prepared.fill(&image, (64, 32), Pixels::MeanOfRgb).unwrap();
        assert_eq!(prepared.to_image(-0.5, -0.5), (-0.5, -0.5));
        assert_eq!(prepared.to_image(63.5, 31.5), (199.5, 99.5));
        // The mean of red (the column), green (the row) and 30 at a tensor's position is that of the image there.
        let (x, y) = prepared.to_image(20.0, 10.0);
        assert!((prepared.data[10 * 64 + 20] - (x + y + 30.0) / 3.0).abs() < 0.5);
    }
}
