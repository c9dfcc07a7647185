//! Images of a document as textures whose sides are powers of two.

use std::io::Cursor;
use std::path::Path;

use gltf::{Document, image::Source};
use image::{ImageReader, Limits, imageops::FilterType};
use rayon::prelude::*;

use super::{SceneError, buffers};
use crate::scene::Texture;

/// Longest side kept, texels.
const SIDE_MAX: u32 = 1024;
/// Longest side decoded, texels.
const DECODED_SIDE_MAX: u32 = 16_384;

/// One texture per image of the document.
pub fn decode(
    name: &str,
    document: &Document,
    buffers: &[Vec<u8>],
    folder: Option<&Path>,
) -> Result<Vec<Texture>, SceneError> {
    let encoded: Result<Vec<Vec<u8>>, SceneError> = document
        .images()
        .map(|image| match image.source() {
            Source::View { view, .. } => buffers::view(name, &view, buffers).map(<[u8]>::to_vec),
            Source::Uri { uri, .. } => buffers::fetch(name, uri, folder),
        })
        .collect();
    let decode = |(index, bytes): (usize, &Vec<u8>)| {
        texture(bytes).map_err(|source| SceneError::Texture { name: name.into(), index, source })
    };
    encoded?.par_iter().enumerate().map(decode).collect()
}

/// PNG or JPEG, told apart by content.
fn texture(bytes: &[u8]) -> Result<Texture, image::ImageError> {
    let mut reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format()?;
    let mut limits = Limits::default();
    limits.max_image_width = Some(DECODED_SIDE_MAX);
    limits.max_image_height = Some(DECODED_SIDE_MAX);
    reader.limits(limits);
    let image = reader.decode()?;
    let (width, height) = (fitting(image.width()), fitting(image.height()));
    let image = if (width, height) == (image.width(), image.height()) {
        image.into_rgba8()
    } else {
        image::imageops::resize(&image.into_rgba8(), width, height, FilterType::Triangle)
    };
    Ok(Texture { width, height, rgba: image.into_raw() })
}

/// The nearest power of two, at most [`SIDE_MAX`].
fn fitting(side: u32) -> u32 {
    let above = side.clamp(1, SIDE_MAX).next_power_of_two();
    let below = (above / 2).max(1);
    if above - side.min(above) <= side.saturating_sub(below) { above } else { below }
}

#[cfg(test)]
mod tests {
    use super::fitting;

    #[test]
    fn sides_become_powers_of_two() {
        assert_eq!([1, 2, 3, 5, 6, 300, 512, 700, 1500, 9000].map(fitting), [1, 2, 4, 4, 8, 256, 512, 512, 1024, 1024]);
    }
}
