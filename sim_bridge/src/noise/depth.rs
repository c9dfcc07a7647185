//! Noise of a structured-light depth camera: the Redwood model (Choi et al., CVPR 2015, after Teichman et al., RSS 2013),
//! as habitat-sim applies it.

use homing_core::{DepthImage, ImageError};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::npy::{self, NpyError};
use super::pixel;

/// From this depth on the sensor sees nothing, metres.
pub const RANGE_END_M: f32 = 10.0;
/// Depth times disparity, metres times pixels: focal length times baseline.
const DEPTH_DISPARITY: f32 = 35.130;
/// Disparity is quantised to so many steps a pixel.
const STEPS_PER_PIXEL: f32 = 8.0;
/// Deviation of the disparity, pixels.
const DISPARITY_SD: f32 = 0.027_778;
/// Deviation of where a pixel looks, pixels.
const SHIFT_SD: f32 = 0.25;

/// How noisy depth is.
#[derive(Copy, Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DepthNoise {
    /// Multiplies the deviations of disparity and shift; quantisation and range stay. 0 leaves these two alone.
    pub multiplier: f64,
    /// The sensor sees nothing nearer than this, metres.
    pub range_min_m: f64,
}

impl DepthNoise {
    /// As published: without a near end.
    pub const PUBLISHED: Self = Self { multiplier: 1.0, range_min_m: 0.0 };
}

impl Default for DepthNoise {
    /// The published noise on a camera that sees from 0.4 m on, as the first Kinect does in its near mode.
    fn default() -> Self {
        Self { multiplier: 1.0, range_min_m: 0.4 }
    }
}

/// Why an array is no distortion.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum DistortionError {
    /// No array.
    #[error(transparent)]
    Npy(#[from] NpyError),
    /// Another size.
    #[error("a depth distortion has 80 x 80 x 5 = 32000 factors; this array has the shape {shape:?}")]
    Shape {
        /// The shape found.
        shape: Vec<usize>,
    },
    /// A factor that is not a number.
    #[error("factor {index} of the depth distortion is not finite")]
    NotFinite {
        /// Its index in the array.
        index: usize,
    },
}

/// Factors by which a camera's depth is too long: for cells of 8 by 6 pixels of a 640x480 image, at depths of 1, 3, 5, 7
/// and 9 m. Redwood's own table is the user's to fetch; without one nothing is distorted.
#[derive(Clone, Debug, PartialEq)]
pub struct Distortion {
    factors: Vec<f32>,
}

const CELLS: usize = 80;
const DEPTHS: usize = 5;

impl Distortion {
    /// From the bytes of a .npy file with 80 x 80 x 5 floats (row, column, depth) in C order, however folded.
    ///
    /// # Errors
    /// [`DistortionError`] for anything else.
    pub fn from_npy(bytes: &[u8]) -> Result<Self, DistortionError> {
        let array = npy::read(bytes)?;
        if array.values.len() != CELLS * CELLS * DEPTHS {
            return Err(DistortionError::Shape { shape: array.shape });
        }
        match array.values.iter().position(|f| !f.is_finite()) {
            Some(index) => Err(DistortionError::NotFinite { index }),
            None => Ok(Self { factors: array.values }),
        }
    }

    /// The depth without distortion, metres; 0 if there is none. `row` and `column` count pixels of a 640x480 image.
    fn undistorted(&self, row: usize, column: usize, depth_m: f32) -> f32 {
        let cell = (row / 6).min(CELLS - 1) * CELLS + (column / 8).min(CELLS - 1);
        let upper = ((depth_m + 1.0) * 0.5) as usize;
        let share = (depth_m - (2.0 * upper as f32 - 1.0)) * 0.5;
        let factor = |k: usize| self.factors[cell * DEPTHS + k.min(DEPTHS - 1)];
        let f = (1.0 - share) * factor(upper.saturating_sub(1)) + share * factor(upper);
        if f < 1e-5 { 0.0 } else { depth_m / f }
    }
}

/// What the sensor makes of true depth: it looks a little beside each pixel, at every second row and column; depth is
/// distorted, made a disparity with an error, quantised, and made depth again. Equal seeds give equal images.
///
/// # Errors
/// [`ImageError`] is passed on from the image's construction; the size is one that an image already has.
pub fn redwood(
    depth: &DepthImage,
    noise: &DepthNoise,
    distortion: Option<&Distortion>,
    seed: u64,
) -> Result<DepthImage, ImageError> {
    let (width, height) = (depth.width() as usize, depth.height() as usize);
    let sensor = Sensor { depth: depth.data(), width, height, noise: *noise, distortion, seed };
    let mut seen = vec![0.0_f32; width * height];
    seen.par_chunks_mut(width).enumerate().for_each(|(row, line)| sensor.line(row, line));
    DepthImage::from_metres(depth.width(), depth.height(), seen)
}

struct Sensor<'a> {
    depth: &'a [f32],
    width: usize,
    height: usize,
    noise: DepthNoise,
    distortion: Option<&'a Distortion>,
    seed: u64,
}

impl Sensor<'_> {
    fn line(&self, row: usize, line: &mut [f32]) {
        let (last_row, last_column) = (self.height as f32 - 1.0, self.width as f32 - 1.0);
        let (shift, error) = (SHIFT_SD * self.noise.multiplier as f32, DISPARITY_SD * self.noise.multiplier as f32);
        let range_min_m = self.noise.range_min_m as f32;
        let table = pixel::table();
        for (column, seen) in line.iter_mut().enumerate() {
            let [r0, r1, r2] = pixel::normals(table, self.seed, (row * self.width + column) as u64);
            let y = ((row as f32 + shift * r0).clamp(0.0, last_row) + 0.5) as usize;
            let x = ((column as f32 + shift * r1).clamp(0.0, last_column) + 0.5) as usize;
            let depth_m = self.depth[(y - y % 2) * self.width + (x - x % 2)];
            // 0 is no depth, and stays none.
            if depth_m >= RANGE_END_M || depth_m <= 0.0 || depth_m < range_min_m {
                continue;
            }
            *seen = quantised(self.undistorted(y, x, depth_m), error * r2);
        }
    }

    fn undistorted(&self, y: usize, x: usize, depth_m: f32) -> f32 {
        let Some(distortion) = self.distortion else { return depth_m };
        let on = |at: usize, length: usize, of: usize| (2 * at * of + length.max(2) - 1) / (2 * (length.max(2) - 1));
        distortion.undistorted(on(y, self.height, 479), on(x, self.width, 639), depth_m)
    }
}

/// Depth by a disparity in steps, metres: 0 where the depth is none or the disparity vanishes.
fn quantised(depth_m: f32, disparity_error: f32) -> f32 {
    let steps = (DEPTH_DISPARITY / depth_m + disparity_error) * STEPS_PER_PIXEL;
    // Half a step up; a negative or vanishing disparity becomes 0, an infinite one (no depth) the largest integer.
    let steps = (steps + 0.5) as u32;
    if steps == 0 || steps == u32::MAX { 0.0 } else { DEPTH_DISPARITY * STEPS_PER_PIXEL / steps as f32 }
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test may fail by panicking")]
mod tests {
    use super::*;

    const QUIET: DepthNoise = DepthNoise { multiplier: 0.0, range_min_m: 0.0 };

    fn flat(width: u32, height: u32, depth_m: f32) -> DepthImage {
        DepthImage::from_metres(width, height, vec![depth_m; (width * height) as usize]).unwrap()
    }

    fn seen(depth_m: f32, noise: &DepthNoise) -> f32 {
        redwood(&flat(8, 6, depth_m), noise, None, 1).unwrap().data()[20]
    }

    /// A table with one factor for each depth of 1, 3, 5, 7 and 9 m, the same everywhere.
    fn everywhere(factors: [f32; DEPTHS]) -> Distortion {
        Distortion { factors: factors.repeat(CELLS * CELLS) }
    }

    #[test]
    fn quantisation_by_hand() {
        // 281.04 / 1 m = 281.04 -> 281; 281.04 / 3 = 93.68 -> 94; 281.04 / 5 = 56.208 -> 56; 281.04 / 9.9 = 28.39 -> 28.
        for (depth_m, steps) in [(1.0, 281.0), (3.0, 94.0), (5.0, 56.0), (9.9, 28.0)] {
            let expected = 281.04 / steps;
            let found = seen(depth_m, &QUIET);
            assert!((found - expected).abs() < 1e-5 * expected, "{depth_m} m is seen at {found}, not {expected}");
        }
        // Half a step less disparity is the next one: 281.04 / 28 = 10.037 m, 281.04 / 29 = 9.691 m.
        assert!((seen(9.8, &QUIET) - 281.04 / 29.0).abs() < 1e-4, "28.68 steps are 29");
    }

    #[test]
    fn nothing_is_seen_from_ten_metres_on_nor_nearer_than_the_near_end() {
        assert!(seen(9.99, &QUIET) > 0.0);
        for depth_m in [10.0, 10.01, 40.0, 0.0] {
            assert_eq!(seen(depth_m, &DepthNoise::PUBLISHED), 0.0, "{depth_m} m");
        }
        let default = DepthNoise { multiplier: 0.0, ..DepthNoise::default() };
        assert_eq!(seen(0.39, &default), 0.0);
        assert!(seen(0.41, &default) > 0.0 && seen(0.39, &QUIET) > 0.0);
    }

    #[test]
    fn the_error_grows_with_the_square_of_the_depth() {
        let deviation = |depth_m: f32| {
            let image = redwood(&flat(320, 240, depth_m), &DepthNoise::PUBLISHED, None, 3).unwrap();
            let n = image.data().len() as f64;
            (image.data().iter().map(|d| f64::from(d - depth_m).powi(2)).sum::<f64>() / n).sqrt()
        };
        // At a depth of exactly n steps the error of 0.0278 px is 0.222 steps: 2.45 % of the pixels are more than half a step
        // off and one step wrong, a deviation of 0.156 steps of depth / n each.
        for steps in [138.0_f32, 69.0, 35.0] {
            let depth_m = 281.04 / steps;
            let (found, expected) = (deviation(depth_m), f64::from(0.1564 * depth_m / steps));
            assert!((found / expected - 1.0).abs() < 0.1, "{depth_m} m: {found} for {expected}");
        }
    }

    #[test]
    fn pixels_look_at_every_second_one_and_a_little_beside() {
        // Columns 0, 2, 4 .. have depths of 1, 2, 3 ..; the odd ones are never looked at.
        let data = (0..48).map(|i| if i % 8 % 2 == 0 { (i % 8 / 2 + 1) as f32 } else { 9.0 }).collect();
        let stripes = DepthImage::from_metres(8, 6, data).unwrap();
        let still = redwood(&stripes, &QUIET, None, 1).unwrap();
        let row: Vec<f32> = still.data()[..8].iter().map(|d| d.round()).collect();
        assert_eq!(row, [1.0, 1.0, 2.0, 2.0, 3.0, 3.0, 4.0, 4.0]);
        let moving = redwood(&stripes, &DepthNoise { multiplier: 4.0, range_min_m: 0.0 }, None, 1).unwrap();
        let moved = moving.data().iter().zip(still.data()).filter(|(a, b)| (*a - *b).abs() > 0.6).count();
        assert!((4..40).contains(&moved), "{moved} of 48 pixels look elsewhere");
    }

    #[test]
    fn equal_seeds_give_equal_images_with_any_number_of_threads() {
        let image = flat(64, 48, 3.3);
        let one = redwood(&image, &DepthNoise::default(), None, 5).unwrap();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
        assert_eq!(pool.install(|| redwood(&image, &DepthNoise::default(), None, 5)).unwrap(), one);
        assert_ne!(redwood(&image, &DepthNoise::default(), None, 6).unwrap(), one);
    }

    #[test]
    fn distortion_is_interpolated_between_its_depths() {
        let twice = everywhere([2.0; DEPTHS]);
        assert_eq!(twice.undistorted(0, 0, 4.0), 2.0);
        let growing = everywhere([1.0, 2.0, 4.0, 4.0, 4.0]);
        // Half way between 1 m (1.0) and 3 m (2.0); at 3 m; at 9.5 m the last; below 1 m the first.
        for (depth_m, factor) in [(2.0, 1.5), (3.0, 2.0), (4.0, 3.0), (9.5, 4.0), (0.5, 1.0)] {
            let found = growing.undistorted(479, 639, depth_m);
            assert!((found - depth_m / factor).abs() < 1e-6, "{depth_m} m: {found}");
        }
        assert_eq!(everywhere([0.0; DEPTHS]).undistorted(3, 3, 2.0), 0.0);
        let image = redwood(&flat(8, 6, 4.0), &QUIET, Some(&everywhere([0.0; DEPTHS])), 1).unwrap();
        assert!(image.data().iter().all(|d| *d == 0.0), "without a factor there is no depth");
        let halved = redwood(&flat(8, 6, 4.0), &QUIET, Some(&twice), 1).unwrap();
        assert!((halved.data()[7] - 281.04 / 141.0).abs() < 1e-5, "140.52 steps are 141");
    }

    #[test]
    fn a_table_of_another_size_is_refused() {
        let file = |shape: &str, values: &[f32]| {
            let header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': {shape}, }}\n");
            let data: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
            [b"\x93NUMPY\x01\x00".as_slice(), &(header.len() as u16).to_le_bytes(), header.as_bytes(), &data].concat()
        };
        let ones = vec![1.0; CELLS * CELLS * DEPTHS];
        assert_eq!(Distortion::from_npy(&file("(80, 80, 5)", &ones)), Ok(everywhere([1.0; DEPTHS])));
        let small = Distortion::from_npy(&file("(2, 2)", &ones[..4]));
        assert_eq!(small, Err(DistortionError::Shape { shape: vec![2, 2] }));
        let mut hole = ones.clone();
        hole[77] = f32::NAN;
        assert_eq!(Distortion::from_npy(&file("(6400, 5)", &hole)), Err(DistortionError::NotFinite { index: 77 }));
        assert_eq!(Distortion::from_npy(b"abc"), Err(DistortionError::Npy(NpyError::Magic)));
    }
}
