//! The goal photo as a user gives it: read, checked, and with a camera.

use std::path::Path;

use anyhow::Context;
use homing_core::RgbImage;
use homing_perception::{FieldOfView, Photo, decode_photo};
use homing_protocol::convert::EncodedPhoto;

/// Largest file read, bytes.
const FILE_MAX: u64 = 15 << 20;

/// Field of view assumed for a photo that does not tell, degrees: a phone's main camera.
pub const PHONE_HFOV_DEG: f64 = 66.0;

/// A horizontal field of view from the command line, degrees.
pub fn field_of_view(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(degrees) if (1.0..=170.0).contains(&degrees) => Ok(degrees),
        _ => Err("a camera's horizontal field of view lies between 1 and 170 degrees".to_owned()),
    }
}

/// Reads a photo. Its camera comes from `hfov_deg` if given, else from the file's EXIF, else from the default.
pub fn read(path: &Path, hfov_deg: Option<f64>) -> anyhow::Result<EncodedPhoto> {
    let said = || format!("the photo {}", path.display());
    let size = std::fs::metadata(path).with_context(said)?.len();
    if size > FILE_MAX {
        anyhow::bail!(
            "the photo {} has {} MB, at most {} are taken: make it smaller",
            path.display(),
            size >> 20,
            FILE_MAX >> 20
        );
    }
    let file = std::fs::read(path).with_context(said)?;
    let view = match hfov_deg {
        Some(degrees) => FieldOfView::Given(degrees.to_radians()),
        None => FieldOfView::FromFileOr(PHONE_HFOV_DEG.to_radians()),
    };
    let Photo { intrinsics, focal_35mm, .. } = decode_photo(&file, view).with_context(said)?;
    if hfov_deg.is_none() {
        let degrees = intrinsics.hfov_rad().to_degrees();
        let source = if focal_35mm.is_some() { "says the file" } else { "assumed, the file does not tell" };
        eprintln!("the photo's camera: horizontal field of view {degrees:.0} deg ({source}); --hfov-deg corrects it");
    }
    Ok(EncodedPhoto { id: name_of(&file), file, intrinsics })
}

/// An image as a PNG file.
pub fn png(image: &RgbImage) -> anyhow::Result<Vec<u8>> {
    let mut file = Vec::new();
    let encoder = image::codecs::png::PngEncoder::new_with_quality(
        &mut file,
        image::codecs::png::CompressionType::Fast,
        image::codecs::png::FilterType::Adaptive,
    );
    image::ImageEncoder::write_image(
        encoder,
        image.data(),
        image.width(),
        image.height(),
        image::ExtendedColorType::Rgb8,
    )?;
    Ok(file)
}

/// A name for a photo: the same file has the same name (FNV-1a); never zero, which means "no goal".
pub fn name_of(file: &[u8]) -> u64 {
    file.iter()
        .fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3))
        .max(1)
}
