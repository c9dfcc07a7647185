//! Image files to images. Headers are checked before anything is decoded: a file that claims other sizes than the camera
//! has is refused without the memory it asks for.

use std::io::Cursor;
use std::path::Path;

use homing_core::{DepthImage, RgbImage};
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};

use super::error::RecordingError;

// An image file is a few megabytes at most.
const FILE_BYTES_MAX: u64 = 64 * 1024 * 1024;

/// A colour image (JPEG or PNG) of exactly `size` (columns, rows).
pub(super) fn colour(file: &Path, size: (u32, u32)) -> Result<RgbImage, RecordingError> {
    let decoded = decode(file, size)?.into_rgb8();
    RgbImage::new(size.0, size.1, decoded.into_raw()).map_err(|e| undecodable(file, &e))
}

/// A depth image (16-bit grey PNG, millimetres; 0 and 65535 invalid) of exactly `size` (columns, rows).
pub(super) fn depth(file: &Path, size: (u32, u32)) -> Result<DepthImage, RecordingError> {
    match decode(file, size)? {
        DynamicImage::ImageLuma16(millimetres) => {
            DepthImage::from_millimetres(size.0, size.1, millimetres.as_raw()).map_err(|e| undecodable(file, &e))
        }
        other => Err(RecordingError::NotDepth { file: file.to_owned(), found: format!("{:?}", other.color()) }),
    }
}

fn decode(file: &Path, size: (u32, u32)) -> Result<DynamicImage, RecordingError> {
    let bytes = read(file)?;
    let mut reader = ImageReader::new(Cursor::new(&bytes))
        .with_guessed_format()
        .map_err(|source| RecordingError::unreadable(file, source))?;
    if reader.format() == Some(ImageFormat::Jpeg) && !jpeg_is_whole(&bytes) {
        return Err(undecodable(file, &"the JPEG data are cut short"));
    }
    reader.limits(limits(size));
    let decoder = reader.into_decoder().map_err(|e| undecodable(file, &e))?;
    let found = decoder.dimensions();
    if found != size {
        return Err(RecordingError::Size { file: file.to_owned(), found, expected: size });
    }
    DynamicImage::from_decoder(decoder).map_err(|e| undecodable(file, &e))
}

fn read(file: &Path) -> Result<Vec<u8>, RecordingError> {
    let length = std::fs::metadata(file).map_err(|source| RecordingError::unreadable(file, source))?.len();
    if length > FILE_BYTES_MAX {
        return Err(undecodable(file, &format!("{length} bytes are too many for one image")));
    }
    std::fs::read(file).map_err(|source| RecordingError::unreadable(file, source))
}

// The decoder fills what is missing of a JPEG with grey and says nothing. Within the coded data a byte 0xFF is never
// followed by these marker bytes, so an end marker (D9) after the last start of scan (DA) is the real end.
fn jpeg_is_whole(bytes: &[u8]) -> bool {
    let scan = bytes.windows(2).rposition(|marker| marker == [0xff, 0xda]);
    scan.is_some_and(|start| bytes[start..].windows(2).any(|marker| marker == [0xff, 0xd9]))
}

// No limit on the sides: they are compared with the camera's, which says more than "too large". The memory is limited to
// what 16-bit RGBA of the right size and the decoder's own tables need.
fn limits((width, height): (u32, u32)) -> Limits {
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some(u64::from(width) * u64::from(height) * 8 + 16 * 1024 * 1024);
    limits
}

fn undecodable(file: &Path, what: &impl std::fmt::Display) -> RecordingError {
    RecordingError::Undecodable { file: file.to_owned(), what: what.to_string() }
}
