//! Colour and depth images <-> sensor_msgs/Image.

use hiroz::ZBuf;
use homing_core::{Camera, DepthImage, Frame, RgbImage, Stamp};

use super::{Malformed, header, stamp};
use crate::interfaces::sensor_msgs::Image;

const NAME: &str = "sensor_msgs/Image";

/// Colour as rgb8.
#[must_use]
pub fn color_message(at: Stamp, image: &RgbImage) -> Image {
    Image {
        header: header(at, Camera::NAME),
        height: image.height(),
        width: image.width(),
        encoding: "rgb8".to_owned(),
        is_bigendian: 0,
        step: 3 * image.width(),
        data: ZBuf::from(image.data()),
    }
}

/// Depth as 32FC1, metres: the same bits arrive.
#[must_use]
pub fn depth_message(at: Stamp, image: &DepthImage) -> Image {
    let bytes: Vec<u8> = image.data().iter().flat_map(|d| d.to_le_bytes()).collect();
    Image {
        header: header(at, Camera::NAME),
        height: image.height(),
        width: image.width(),
        encoding: "32FC1".to_owned(),
        is_bigendian: 0,
        step: 4 * image.width(),
        data: ZBuf::from(bytes),
    }
}

/// Reads rgb8 or bgr8.
///
/// # Errors
/// [`Malformed`] for other encodings, and for sizes that do not fit the data.
pub fn to_rgb(message: &Image) -> Result<(Stamp, RgbImage), Malformed> {
    let at = stamp(&message.header.stamp, NAME)?;
    let swap = match message.encoding.as_str() {
        "rgb8" => false,
        "bgr8" => true,
        other => return Err(Malformed::new(NAME, format!("colour encoding {other:?} is neither rgb8 nor bgr8"))),
    };
    let mut data = packed_rows(message, 3)?;
    if swap {
        data.chunks_exact_mut(3).for_each(|p| p.swap(0, 2));
    }
    let image = RgbImage::new(message.width, message.height, data).map_err(|e| Malformed::new(NAME, e.to_string()))?;
    Ok((at, image))
}

/// Reads 32FC1 (metres) or 16UC1 (millimetres). Invalid pixels are masked, not refused.
///
/// # Errors
/// [`Malformed`] for other encodings, and for sizes that do not fit the data.
pub fn to_depth(message: &Image) -> Result<(Stamp, DepthImage), Malformed> {
    let at = stamp(&message.header.stamp, NAME)?;
    let (width, height, big) = (message.width, message.height, message.is_bigendian != 0);
    let image = match message.encoding.as_str() {
        "32FC1" => {
            let read = |b: &[u8; 4]| if big { f32::from_be_bytes(*b) } else { f32::from_le_bytes(*b) };
            let metres = packed_rows(message, 4)?.as_chunks::<4>().0.iter().map(read).collect();
            DepthImage::from_metres(width, height, metres)
        }
        "16UC1" | "mono16" => {
            let read = |b: &[u8; 2]| if big { u16::from_be_bytes(*b) } else { u16::from_le_bytes(*b) };
            let millimetres: Vec<u16> = packed_rows(message, 2)?.as_chunks::<2>().0.iter().map(read).collect();
            DepthImage::from_millimetres(width, height, &millimetres)
        }
        other => return Err(Malformed::new(NAME, format!("depth encoding {other:?} is neither 32FC1 nor 16UC1"))),
    };
    Ok((at, image.map_err(|e| Malformed::new(NAME, e.to_string()))?))
}

/// The pixels without padding at the ends of rows.
fn packed_rows(message: &Image, pixel_bytes: usize) -> Result<Vec<u8>, Malformed> {
    let data = bytes(&message.data);
    let (width, height, step) = (message.width as usize, message.height as usize, message.step as usize);
    let row = width * pixel_bytes;
    if step < row || data.len() != step.saturating_mul(height) {
        return Err(Malformed::new(
            NAME,
            format!(
                "{width}x{height} {} with rows of {step} bytes does not fit {} bytes of data",
                message.encoding,
                data.len()
            ),
        ));
    }
    if step == row {
        return Ok(data);
    }
    Ok(data.chunks_exact(step).flat_map(|r| &r[..row]).copied().collect())
}

pub(super) fn bytes(buffer: &ZBuf) -> Vec<u8> {
    let mut data = Vec::with_capacity(zenoh::bytes::ZBytes::from(buffer.0.clone()).len());
    for slice in buffer.0.zslices() {
        data.extend_from_slice(slice.as_slice());
    }
    data
}
