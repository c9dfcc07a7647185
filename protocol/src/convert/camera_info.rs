//! Intrinsics <-> sensor_msgs/CameraInfo.

use homing_core::{Camera, Frame, Intrinsics, Stamp};

use super::{Malformed, ToDomain, ToMessage, header, stamp};
use crate::interfaces::sensor_msgs::CameraInfo;

const NAME: &str = "sensor_msgs/CameraInfo";

/// Intrinsics with the stamp of the images they belong to.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct CameraInfoMessage {
    /// Stamp of the images.
    pub stamp: Stamp,
    /// The camera.
    pub intrinsics: Intrinsics,
}

impl ToMessage<CameraInfo> for CameraInfoMessage {
    fn to_message(&self) -> CameraInfo {
        let i = &self.intrinsics;
        CameraInfo {
            header: header(self.stamp, Camera::NAME),
            height: i.height(),
            width: i.width(),
            distortion_model: "plumb_bob".to_owned(),
            d: vec![0.0; 5],
            k: [i.fx(), 0.0, i.cx(), 0.0, i.fy(), i.cy(), 0.0, 0.0, 1.0],
            r: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            p: [i.fx(), 0.0, i.cx(), 0.0, 0.0, i.fy(), i.cy(), 0.0, 0.0, 0.0, 1.0, 0.0],
            ..CameraInfo::default()
        }
    }
}

impl ToDomain<CameraInfoMessage> for CameraInfo {
    fn to_domain(&self) -> Result<CameraInfoMessage, Malformed> {
        let stamp = stamp(&self.header.stamp, NAME)?;
        if self.d.iter().any(|c| *c != 0.0) {
            return Err(Malformed::new(NAME, "images are distorted (d is not zero): send rectified ones"));
        }
        let [fx, skew, cx, _, fy, cy, ..] = self.k;
        if skew != 0.0 {
            return Err(Malformed::new(NAME, format!("skew of {skew} is not supported")));
        }
        if self.binning_x > 1 || self.binning_y > 1 {
            let (x, y) = (self.binning_x, self.binning_y);
            return Err(Malformed::new(NAME, format!("binning of {x}x{y}: send the intrinsics of the image as it is")));
        }
        let intrinsics = Intrinsics::new(self.width, self.height, fx, fy, cx, cy)
            .map_err(|e| Malformed::new(NAME, e.to_string()))?;
        Ok(CameraInfoMessage { stamp, intrinsics })
    }
}
