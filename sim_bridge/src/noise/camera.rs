//! Noise of a colour camera: motion blur, exposure and white balance that miss, sensor noise, JPEG.

use std::io::Cursor;

use homing_core::{ImageError, Intrinsics, RgbImage};
use image::ImageReader;
use image::codecs::jpeg::JpegEncoder;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::pixel;
use crate::render::srgb;

/// How noisy colour is.
#[derive(Copy, Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CameraNoise {
    /// The shutter is open so long, seconds: turning smears the image.
    pub exposure_s: f64,
    /// Deviation of an image's exposure, powers of two of light.
    pub exposure_stops_sd: f64,
    /// Deviation of red's and blue's share against green, 0.03 for three percent of light.
    pub white_balance_sd: f64,
    /// Deviation of a pixel's value, grey levels of 255.
    pub grey_levels_sd: f64,
    /// Quality of the JPEG that the image is sent as, 1 to 100; `None` for no compression.
    pub jpeg_quality: Option<u8>,
}

impl Default for CameraNoise {
    /// An indoor exposure of a sixtieth of a second, a tenth of a stop, two grey levels, quality 85.
    fn default() -> Self {
        Self {
            exposure_s: 1.0 / 60.0,
            exposure_stops_sd: 0.1,
            white_balance_sd: 0.03,
            grey_levels_sd: 2.0,
            jpeg_quality: Some(85),
        }
    }
}

impl CameraNoise {
    /// A perfect camera.
    pub const NONE: Self = Self {
        exposure_s: 0.0,
        exposure_stops_sd: 0.0,
        white_balance_sd: 0.0,
        grey_levels_sd: 0.0,
        jpeg_quality: None,
    };
}

/// Why an image did not come through.
#[derive(Debug, Error)]
pub enum CameraError {
    /// The compressed image has another size.
    #[error(transparent)]
    Size(#[from] ImageError),
    /// The codec failed.
    #[error("the image did not survive its compression: {0}")]
    Jpeg(#[from] image::ImageError),
}

/// Light's factors of one image, red, green and blue.
type Gains = [f32; 3];

/// What the camera makes of an image, in the order in which it happens: the turn smears light along the rows, exposure and
/// white balance multiply it, it is clipped and becomes sRGB, the sensor adds its noise, the image is compressed.
/// `turn_rad_s` is the rate of the turn that just ended. Equal seeds give equal images; with compression, where JPEG is
/// decoded to the same bits.
///
/// # Errors
/// [`CameraError`] when compression fails.
pub fn expose(
    rgb: &RgbImage,
    noise: &CameraNoise,
    camera: &Intrinsics,
    turn_rad_s: f64,
    seed: u64,
) -> Result<RgbImage, CameraError> {
    let width = rgb.width() as usize;
    let smear_px = smear_px(noise, camera, turn_rad_s);
    let gains = gains(noise, seed);
    let grey_levels_sd = noise.grey_levels_sd as f32;
    let mut exposed = vec![0_u8; rgb.data().len()];
    exposed.par_chunks_mut(3 * width).zip(rgb.data().par_chunks(3 * width)).enumerate().for_each(
        |(row, (out, light))| {
            develop(light, &smear_px, gains, out);
            add_noise(grey_levels_sd, seed, (row * width) as u64, out);
        },
    );
    match noise.jpeg_quality {
        None => Ok(RgbImage::new(rgb.width(), rgb.height(), exposed)?),
        Some(quality) => compressed(rgb, &exposed, quality),
    }
}

/// Length of the smear at each column, pixels. A turn about the vertical moves what is seen in direction u = (x - cx) / fx
/// by fx (1 + u^2) pixels a radian along the row. What it moves up and down away from the horizon is left out.
fn smear_px(noise: &CameraNoise, camera: &Intrinsics, turn_rad_s: f64) -> Vec<f64> {
    let turned_rad = (turn_rad_s * noise.exposure_s).abs();
    let at = |column: u32| {
        let u = (f64::from(column) - camera.cx()) / camera.fx();
        turned_rad * camera.fx() * (1.0 + u * u)
    };
    (0..camera.width()).map(at).collect()
}

/// One draw of exposure and white balance for the whole image.
fn gains(noise: &CameraNoise, seed: u64) -> Gains {
    let [stops, red, blue] = pixel::normals(pixel::table(), seed, u64::MAX).map(f64::from);
    let exposure = libm::exp2(noise.exposure_stops_sd * stops);
    let balance = |z: f64| (1.0 + noise.white_balance_sd * z).max(0.0);
    [exposure * balance(red), exposure, exposure * balance(blue)].map(|g| g as f32)
}

/// One row: sRGB to light, smeared, multiplied, and back. Nothing is touched where nothing is to be done.
fn develop(codes: &[u8], smear_px: &[f64], gains: Gains, out: &mut [u8]) {
    // Below a pixel nothing is smeared that a pixel's own width does not smear.
    let is_smeared = smear_px.iter().any(|length| *length > 1.0);
    if !is_smeared && gains == [1.0; 3] {
        out.copy_from_slice(codes);
        return;
    }
    for (channel, gain) in gains.into_iter().enumerate() {
        let light: Vec<f32> = codes.iter().skip(channel).step_by(3).map(|code| srgb::linear(*code)).collect();
        let light = if is_smeared { smeared(&light, smear_px) } else { light };
        for (pixel, value) in out.chunks_exact_mut(3).zip(light) {
            pixel[channel] = srgb::code(value * gain);
        }
    }
}

/// Means over windows of given lengths around each pixel's centre, cut off at the row's ends.
fn smeared(light: &[f32], smear_px: &[f64]) -> Vec<f32> {
    let mut sums = Vec::with_capacity(light.len() + 1);
    let mut sum = 0.0_f64;
    sums.push(sum);
    for value in light {
        sum += f64::from(*value);
        sums.push(sum);
    }
    // Light of the row up to a position between pixels.
    let up_to = |x: f64| {
        let whole = (x as usize).min(light.len() - 1);
        sums[whole] + (x - whole as f64) * f64::from(light[whole])
    };
    let width = light.len() as f64;
    let mean = |(column, length): (usize, &f64)| {
        if *length <= 1.0 {
            return light[column];
        }
        let (from, to) = (column as f64 + 0.5 - 0.5 * length, column as f64 + 0.5 + 0.5 * length);
        let (from, to) = (from.max(0.0), to.min(width));
        ((up_to(to) - up_to(from)) / (to - from)) as f32
    };
    smear_px.iter().take(light.len()).enumerate().map(mean).collect()
}

fn add_noise(grey_levels_sd: f32, seed: u64, first_pixel: u64, row: &mut [u8]) {
    if grey_levels_sd <= 0.0 {
        return;
    }
    let table = pixel::table();
    for (pixel, values) in (first_pixel..).zip(row.chunks_exact_mut(3)) {
        for (value, z) in values.iter_mut().zip(pixel::normals(table, seed, pixel)) {
            // Half a level up rounds; the cast clips at both ends.
            *value = (f32::from(*value) + grey_levels_sd * z + 0.5) as u8;
        }
    }
}

fn compressed(like: &RgbImage, data: &[u8], quality: u8) -> Result<RgbImage, CameraError> {
    let (width, height) = (like.width(), like.height());
    let mut file = Vec::new();
    JpegEncoder::new_with_quality(&mut file, quality.clamp(1, 100)).encode(
        data,
        width,
        height,
        image::ExtendedColorType::Rgb8,
    )?;
    let mut reader = ImageReader::new(Cursor::new(file));
    reader.set_format(image::ImageFormat::Jpeg);
    Ok(RgbImage::new(width, height, reader.decode()?.into_rgb8().into_raw())?)
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test may fail by panicking")]
mod tests {
    use super::*;

    /// Ninety degrees across 64 pixels: a focal length of 32.
    fn camera() -> Intrinsics {
        Intrinsics::from_hfov(64, 48, core::f64::consts::FRAC_PI_2).unwrap()
    }

    fn image(pixel: impl Fn(u32, u32) -> [u8; 3]) -> RgbImage {
        let data = (0..48).flat_map(|y| (0..64).map(move |x| (x, y))).flat_map(|(x, y)| pixel(x, y)).collect();
        RgbImage::new(64, 48, data).unwrap()
    }

    fn checkers() -> RgbImage {
        image(|x, y| if (x / 4 + y / 4).is_multiple_of(2) { [200, 180, 160] } else { [40, 60, 80] })
    }

    fn mean(image: &RgbImage, channel: usize) -> f64 {
        image.data().iter().skip(channel).step_by(3).map(|v| f64::from(*v)).sum::<f64>() / (64.0 * 48.0)
    }

    /// Mean squared difference of neighbours along rows and along columns.
    fn gradients(image: &RgbImage) -> (f64, f64) {
        let at = |x: usize, y: usize| f64::from(image.data()[3 * (y * 64 + x)]);
        let (mut along, mut across) = (0.0, 0.0);
        for y in 0..47 {
            for x in 0..63 {
                along += (at(x + 1, y) - at(x, y)).powi(2);
                across += (at(x, y + 1) - at(x, y)).powi(2);
            }
        }
        (along, across)
    }

    fn with(noise: CameraNoise, turn_rad_s: f64, seed: u64) -> RgbImage {
        expose(&checkers(), &noise, &camera(), turn_rad_s, seed).unwrap()
    }

    #[test]
    fn a_perfect_camera_changes_nothing() {
        assert_eq!(with(CameraNoise::NONE, 5.0, 1), checkers());
        // Every code survives light and back.
        let codes = image(|x, y| [(x * 4 + y % 4) as u8; 3]);
        let nearly = CameraNoise { exposure_stops_sd: 1e-9, white_balance_sd: 1e-6, ..CameraNoise::NONE };
        assert_eq!(expose(&codes, &nearly, &camera(), 0.0, 1).unwrap(), codes);
    }

    #[test]
    fn turning_smears_rows_and_leaves_columns() {
        let noise = CameraNoise { exposure_s: 0.02, ..CameraNoise::NONE };
        let (still, turned) = (gradients(&with(noise, 0.0, 1)), gradients(&with(noise, 4.0, 1)));
        assert!(turned.0 < 0.5 * still.0, "along the rows: {} after {}", turned.0, still.0);
        assert!(turned.1 > 0.4 * still.1, "across the rows: {} after {}", turned.1, still.1);
        assert_eq!(with(noise, 4.0, 1), with(noise, -4.0, 1), "the side does not matter");
    }

    #[test]
    fn the_smear_by_hand() {
        // 0.0625 rad: 32 * 0.0625 = 2 px in the middle, twice that where u = 1 (at the image's edge, 32 px aside).
        let noise = CameraNoise { exposure_s: 0.0625, ..CameraNoise::NONE };
        let lengths = smear_px(&noise, &camera(), -1.0);
        assert!((lengths[31] - 2.0).abs() < 0.01 && (lengths[0] - 3.94).abs() < 0.02, "{} {}", lengths[31], lengths[0]);
        // A window of 2 px about the centre of pixel 1 holds half of 0, all of 1, half of 2.
        let smeared = smeared(&[0.0, 1.0, 0.5, 0.0], &[2.0; 4]);
        let expected = [(0.0 + 0.5) / 1.5, (0.0 + 1.0 + 0.25) / 2.0, (0.5 + 0.5) / 2.0, 0.25 / 1.5];
        for (found, expected) in smeared.into_iter().zip(expected) {
            assert!((f64::from(found) - expected).abs() < 1e-6, "{found} for {expected}");
        }
    }

    #[test]
    fn exposure_brightens_or_darkens_the_whole_image_and_clips() {
        let noise = CameraNoise { exposure_stops_sd: 1.0, ..CameraNoise::NONE };
        let before = mean(&checkers(), 1);
        let mut brighter = 0;
        for seed in 0..40 {
            let after = mean(&with(noise, 0.0, seed), 1);
            let gain = gains(&noise, seed)[1];
            assert_eq!(after > before, gain > 1.0, "seed {seed}: {before} becomes {after} with a gain of {gain}");
            brighter += usize::from(after > before);
        }
        assert!((10..31).contains(&brighter), "{brighter} of 40 are brighter");
        // Twice the light of code 200 (0.578) is more than there is; half of it (0.289) has the code 146.
        let mut row = [0; 3];
        develop(&[200; 3], &[0.0], [2.0, 1.0, 0.5], &mut row);
        assert_eq!(row, [255, 200, 146]);
    }

    #[test]
    fn white_balance_shifts_red_and_blue_against_green() {
        let noise = CameraNoise { white_balance_sd: 0.2, ..CameraNoise::NONE };
        let grey = image(|_, _| [100; 3]);
        let shifted = expose(&grey, &noise, &camera(), 0.0, 4).unwrap();
        assert_eq!(mean(&shifted, 1), 100.0);
        assert!((mean(&shifted, 0) - 100.0).abs() > 1.0 && (mean(&shifted, 2) - 100.0).abs() > 1.0);
    }

    #[test]
    fn sensor_noise_has_its_deviation_and_no_bias() {
        let noise = CameraNoise { grey_levels_sd: 5.0, ..CameraNoise::NONE };
        let grey = image(|_, _| [100; 3]);
        let noisy = expose(&grey, &noise, &camera(), 0.0, 4).unwrap();
        let variance = noisy.data().iter().map(|v| (f64::from(*v) - 100.0).powi(2)).sum::<f64>() / (3.0 * 64.0 * 48.0);
        assert!((variance.sqrt() - 5.0).abs() < 0.2, "{}", variance.sqrt());
        assert!((mean(&noisy, 0) - 100.0).abs() < 0.4);
        assert_ne!(expose(&grey, &noise, &camera(), 0.0, 5).unwrap(), noisy);
        assert_eq!(expose(&grey, &noise, &camera(), 0.0, 4).unwrap(), noisy);
    }

    #[test]
    fn compression_loses_more_at_lower_quality() {
        let loss = |quality| {
            let compressed = with(CameraNoise { jpeg_quality: Some(quality), ..CameraNoise::NONE }, 0.0, 1);
            let pairs = compressed.data().iter().zip(checkers().data().to_vec());
            pairs.map(|(a, b)| (f64::from(*a) - f64::from(b)).powi(2)).sum::<f64>()
        };
        let (high, low) = (loss(95), loss(10));
        assert!(high > 0.0 && low > 4.0 * high, "{high} at 95, {low} at 10");
    }
}
