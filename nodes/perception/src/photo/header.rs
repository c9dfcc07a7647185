//! Size, completeness and focal length from the first bytes of a PNG or JPEG file, without decoding it.

use super::PhotoError;

/// Image formats that are read.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(super) enum Format {
    Png,
    Jpeg,
}

impl Format {
    pub(super) fn name(self) -> &'static str {
        match self {
            Format::Png => "PNG",
            Format::Jpeg => "JPEG",
        }
    }

    fn truncated(self) -> PhotoError {
        PhotoError::Truncated { format: self.name() }
    }
}

/// What a file says about itself.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(super) struct Header {
    pub format: Format,
    pub width: u32,
    pub height: u32,
    /// EXIF FocalLengthIn35mmFilm, millimetres.
    pub focal_35mm: Option<u16>,
}

const PNG_SIGNATURE: &[u8] = b"\x89PNG\r\n\x1a\n";

pub(super) fn read(bytes: &[u8]) -> Result<Header, PhotoError> {
    if bytes.is_empty() {
        return Err(PhotoError::Empty);
    }
    if bytes.starts_with(PNG_SIGNATURE) {
        return read_png(bytes).ok_or_else(|| Format::Png.truncated());
    }
    if bytes.starts_with(&[0xff, 0xd8, 0xff]) {
        return read_jpeg(bytes).ok_or_else(|| Format::Jpeg.truncated());
    }
    Err(PhotoError::Format)
}

/// Walks the chunks to IEND; `None` if the file ends before it.
fn read_png(bytes: &[u8]) -> Option<Header> {
    if bytes.get(12..16)? != b"IHDR" {
        return None;
    }
    let (width, height) = (be_u32(bytes, 16)?, be_u32(bytes, 20)?);
    let mut at = PNG_SIGNATURE.len();
    loop {
        let length = be_u32(bytes, at)? as usize;
        let kind = bytes.get(at + 4..at + 8)?;
        // Length, kind and checksum are 12 bytes more.
        let next = at.checked_add(length)?.checked_add(12)?;
        if next > bytes.len() {
            return None;
        }
        if kind == b"IEND" {
            return Some(Header { format: Format::Png, width, height, focal_35mm: None });
        }
        at = next;
    }
}

/// Walks the segments to the image data, and looks for the end marker behind it.
fn read_jpeg(bytes: &[u8]) -> Option<Header> {
    let (mut size, mut focal_35mm) = (None, None);
    let mut at = 2;
    loop {
        // Any number of fill bytes may stand before a marker.
        while *bytes.get(at)? == 0xff && *bytes.get(at + 1)? == 0xff {
            at += 1;
        }
        let marker = *bytes.get(at + 1)?;
        let length = usize::from(be_u16(bytes, at + 2)?);
        let body = bytes.get(at + 4..at + 2 + length)?;
        match marker {
            // Start of frame, all codings; C4, C8 and CC are tables.
            0xc0..=0xcf if !matches!(marker, 0xc4 | 0xc8 | 0xcc) => size = Some((be_u16(body, 3)?, be_u16(body, 1)?)),
            0xe1 if body.starts_with(b"Exif\0\0") => focal_35mm = focal_35mm.or(exif_focal_35mm(&body[6..])),
            0xda => break,
            _ => {}
        }
        at += 2 + length;
    }
    let (width, height) = size?;
    let complete = bytes[at..].windows(2).rev().any(|pair| pair == [0xff, 0xd9]);
    let (width, height) = (u32::from(width), u32::from(height));
    complete.then_some(Header { format: Format::Jpeg, width, height, focal_35mm })
}

/// The 35 mm equivalent focal length in an EXIF block (a TIFF file); `None` if absent, malformed or out of 5 to 2000.
fn exif_focal_35mm(tiff: &[u8]) -> Option<u16> {
    const EXIF_DIRECTORY: u16 = 0x8769;
    const FOCAL_35MM: u16 = 0xa405;
    let tiff = match tiff.get(..4)? {
        b"II\x2a\0" => Tiff { bytes: tiff, little_endian: true },
        b"MM\0\x2a" => Tiff { bytes: tiff, little_endian: false },
        _ => return None,
    };
    let directory = tiff.u32(tiff.entry(tiff.u32(4)? as usize, EXIF_DIRECTORY)?)? as usize;
    let focal = tiff.u16(tiff.entry(directory, FOCAL_35MM)?)?;
    (5..=2000).contains(&focal).then_some(focal)
}

struct Tiff<'a> {
    bytes: &'a [u8],
    little_endian: bool,
}

impl Tiff<'_> {
    /// Where the value of a tag stands, in the directory at an offset.
    fn entry(&self, directory: usize, tag: u16) -> Option<usize> {
        let n = usize::from(self.u16(directory)?);
        let entries = (0..n).map(|i| directory + 2 + 12 * i);
        entries.take_while(|&at| at + 12 <= self.bytes.len()).find(|&at| self.u16(at) == Some(tag)).map(|at| at + 8)
    }

    fn u16(&self, at: usize) -> Option<u16> {
        let raw = be_u16(self.bytes, at)?;
        Some(if self.little_endian { raw.swap_bytes() } else { raw })
    }

    fn u32(&self, at: usize) -> Option<u32> {
        let raw = be_u32(self.bytes, at)?;
        Some(if self.little_endian { raw.swap_bytes() } else { raw })
    }
}

fn be_u16(bytes: &[u8], at: usize) -> Option<u16> {
    let end = at.checked_add(2)?;
    bytes.get(at..end)?.try_into().ok().map(u16::from_be_bytes)
}

fn be_u32(bytes: &[u8], at: usize) -> Option<u32> {
    let end = at.checked_add(4)?;
    bytes.get(at..end)?.try_into().ok().map(u32::from_be_bytes)
}
