//! From a photo's file to an image with a camera. What the header claims is checked before anything is decoded.

mod header;

use std::sync::Arc;

use homing_core::{GoalPhoto, Intrinsics, IntrinsicsError, RgbImage};
use opencv::core::{Mat, Vector};
use opencv::prelude::*;
use opencv::{imgcodecs, imgproc};
use thiserror::Error;

use header::{Format, Header};

/// Most pixels of a photo: 50 million.
pub const PIXELS_MAX: u64 = 50_000_000;

/// Where the photo's field of view comes from.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum FieldOfView {
    /// This horizontal field of view, radians.
    Given(f64),
    /// The focal length the camera noted in the file (EXIF, 35 mm equivalent); this horizontal field of view where the
    /// file says nothing, radians.
    FromFileOr(f64),
}

/// A decoded photo.
#[derive(Clone, Debug, PartialEq)]
pub struct Photo {
    /// The pixels, turned upright as the file says.
    pub rgb: RgbImage,
    /// The camera, principal point in the middle.
    pub intrinsics: Intrinsics,
    /// The 35 mm equivalent focal length used, if it came from the file.
    pub focal_35mm: Option<u16>,
}

impl Photo {
    /// As a goal with a number.
    #[must_use]
    pub fn into_goal(self, id: u64) -> GoalPhoto {
        GoalPhoto { id, rgb: Arc::new(self.rgb), intrinsics: self.intrinsics }
    }
}

/// Why a file is not a usable photo.
#[derive(Debug, Error)]
pub enum PhotoError {
    /// The file has no content.
    #[error("the photo's file is empty: copy it again")]
    Empty,
    /// Neither PNG nor JPEG.
    #[error("the file is neither a PNG nor a JPEG image: convert the photo to one of them")]
    Format,
    /// The file ends too early.
    #[error("the {format} file is cut off: copy it again")]
    Truncated {
        /// PNG or JPEG.
        format: &'static str,
    },
    /// An absurd size.
    #[error("the photo claims {width}x{height} pixels; at most {max} a side and {} million in all are read: make it smaller", PIXELS_MAX / 1_000_000, max = Intrinsics::SIDE_MAX)]
    Size {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// The header is sound, the content is not.
    #[error("the {format} file is damaged ({reason}): open it in an image editor and save it again")]
    Damaged {
        /// PNG or JPEG.
        format: &'static str,
        /// What the decoder said.
        reason: String,
    },
    /// A field of view that no camera has.
    #[error("the photo's camera: {0}: give a horizontal field of view between 0 and 180 degrees")]
    Camera(#[from] IntrinsicsError),
}

/// Decodes a PNG or JPEG file.
///
/// # Errors
/// [`PhotoError`] says what is wrong with the file and what to do. Nothing is allocated for an image of absurd size.
pub fn decode_photo(bytes: &[u8], field_of_view: FieldOfView) -> Result<Photo, PhotoError> {
    let header = header::read(bytes)?;
    check_size(&header)?;
    let rgb = decode(bytes, header.format)?;
    let (width, height) = (rgb.width(), rgb.height());
    // The file may ask for a quarter turn.
    if (width, height) != (header.width, header.height) && (height, width) != (header.width, header.height) {
        let reason = format!("{width}x{height} pixels instead of {}x{}", header.width, header.height);
        return Err(PhotoError::Damaged { format: header.format.name(), reason });
    }
    let (hfov_rad, focal_35mm) = match field_of_view {
        FieldOfView::Given(hfov_rad) => (hfov_rad, None),
        FieldOfView::FromFileOr(hfov_rad) => (hfov_rad, header.focal_35mm),
    };
    let intrinsics = match focal_35mm {
        Some(focal) => from_35mm(width, height, focal)?,
        None => Intrinsics::from_hfov(width, height, hfov_rad)?,
    };
    Ok(Photo { rgb, intrinsics, focal_35mm })
}

fn check_size(header: &Header) -> Result<(), PhotoError> {
    let (width, height) = (header.width, header.height);
    let sides = 1..=Intrinsics::SIDE_MAX;
    let fits = sides.contains(&width) && sides.contains(&height) && u64::from(width) * u64::from(height) <= PIXELS_MAX;
    if fits { Ok(()) } else { Err(PhotoError::Size { width, height }) }
}

/// The equivalent focal length gives the same diagonal field of view on a 36x24 mm film, whose diagonal is 43.27 mm.
fn from_35mm(width: u32, height: u32, focal_35mm: u16) -> Result<Intrinsics, IntrinsicsError> {
    let diagonal_px = (f64::from(width).powi(2) + f64::from(height).powi(2)).sqrt();
    let f = f64::from(focal_35mm) * diagonal_px / (36.0_f64.powi(2) + 24.0_f64.powi(2)).sqrt();
    Intrinsics::new(width, height, f, f, 0.5 * (f64::from(width) - 1.0), 0.5 * (f64::from(height) - 1.0))
}

fn decode(bytes: &[u8], format: Format) -> Result<RgbImage, PhotoError> {
    let damaged = |reason: String| PhotoError::Damaged { format: format.name(), reason };
    let pixels = decode_rgb(bytes).map_err(|e| damaged(e.message))?;
    let Some((width, height, data)) = pixels else { return Err(damaged("it does not decode".to_owned())) };
    RgbImage::new(width, height, data).map_err(|e| damaged(e.to_string()))
}

fn decode_rgb(bytes: &[u8]) -> opencv::Result<Option<(u32, u32, Vec<u8>)>> {
    let bgr = imgcodecs::imdecode(&Vector::<u8>::from_slice(bytes), imgcodecs::IMREAD_COLOR)?;
    if bgr.empty() {
        return Ok(None);
    }
    let mut rgb = Mat::default();
    imgproc::cvt_color_def(&bgr, &mut rgb, imgproc::COLOR_BGR2RGB)?;
    Ok(Some((rgb.cols().unsigned_abs(), rgb.rows().unsigned_abs(), rgb.data_bytes()?.to_vec())))
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "a failing test should say where")]

    use super::*;

    const HFOV: FieldOfView = FieldOfView::FromFileOr(1.0);

    fn encoded(extension: &str) -> Vec<u8> {
        let pixels: Vec<u8> = (0..24 * 32 * 3).map(|i| (i * 7 % 251) as u8).collect();
        let image = Mat::new_rows_cols_with_data(24, 32 * 3, &pixels).unwrap();
        let image = image.reshape(3, 24).unwrap();
        let mut file = Vector::<u8>::new();
        imgcodecs::imencode_def(extension, &image, &mut file).unwrap();
        file.to_vec()
    }

    /// An EXIF segment with FocalLengthIn35mmFilm = 28, big-endian.
    fn with_exif(jpeg: &[u8]) -> Vec<u8> {
        let mut exif = b"Exif\0\0MM\0\x2a\0\0\0\x08".to_vec();
        exif.extend(b"\0\x01\x87\x69\0\x04\0\0\0\x01\0\0\0\x1a\0\0\0\0");
        exif.extend(b"\0\x01\xa4\x05\0\x03\0\0\0\x01\0\x1c\0\0\0\0\0\0");
        let length = u16::try_from(exif.len() + 2).unwrap().to_be_bytes();
        [&jpeg[..2], &[0xff, 0xe1], &length, &exif, &jpeg[2..]].concat()
    }

    #[test]
    fn png_and_jpeg_decode_with_the_field_of_view_given() {
        for extension in [".png", ".jpg"] {
            let photo = decode_photo(&encoded(extension), HFOV).unwrap();
            assert_eq!((photo.rgb.width(), photo.rgb.height()), (32, 24));
            assert!((photo.intrinsics.hfov_rad() - 1.0).abs() < 1e-9);
        }
        let png = decode_photo(&encoded(".png"), HFOV).unwrap();
        // OpenCV keeps blue first; the file's first pixel is blue 0, green 7, red 14.
        assert_eq!(&png.rgb.data()[..3], &[14, 7, 0]);
    }

    #[test]
    fn the_focal_length_in_the_file_is_used_unless_one_is_given() {
        let file = with_exif(&encoded(".jpg"));
        let photo = decode_photo(&file, HFOV).unwrap();
        assert_eq!(photo.focal_35mm, Some(28));
        assert!((photo.intrinsics.fx() - 28.0 * 40.0 / 43.2666).abs() < 1e-3);
        let given = decode_photo(&file, FieldOfView::Given(1.0)).unwrap();
        assert!((given.intrinsics.hfov_rad() - 1.0).abs() < 1e-9);
    }

    #[test]
    fn what_is_not_a_photo_is_refused_with_advice() {
        let refused = |bytes: &[u8]| decode_photo(bytes, HFOV).unwrap_err();
        assert!(matches!(refused(b""), PhotoError::Empty));
        assert!(matches!(refused(b"hello, world"), PhotoError::Format));
        for extension in [".png", ".jpg"] {
            let file = encoded(extension);
            for cut in [3, 12, 20, file.len() / 2, file.len() - 3] {
                let error = refused(&file[..cut]);
                assert!(
                    matches!(error, PhotoError::Truncated { .. } | PhotoError::Format),
                    "{extension} {cut}: {error}"
                );
            }
        }
    }

    #[test]
    fn an_absurd_size_is_refused_before_decoding() {
        let mut file = encoded(".png");
        file[16..20].copy_from_slice(&60_000_u32.to_be_bytes());
        assert!(matches!(decode_photo(&file, HFOV), Err(PhotoError::Size { width: 60_000, height: 24 })));
        file[16..20].copy_from_slice(&10_000_u32.to_be_bytes());
        file[20..24].copy_from_slice(&10_000_u32.to_be_bytes());
        assert!(matches!(decode_photo(&file, HFOV), Err(PhotoError::Size { .. })));
    }

    #[test]
    fn damage_inside_is_an_error_or_an_image_never_a_crash() {
        // The JPEG decoder prints a line for each damaged block, so only its headers are tried byte by byte.
        for (extension, step) in [(".png", 1), (".jpg", 37)] {
            let file = encoded(extension);
            for i in (0..file.len()).step_by(step) {
                let mut damaged = file.clone();
                damaged[i] ^= 0x55;
                let _ = decode_photo(&damaged, HFOV);
            }
        }
        assert!(decode_photo(&encoded(".png"), FieldOfView::Given(f64::NAN)).is_err());
    }
}
