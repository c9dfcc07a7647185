//! The goal photo, as the file it came from <-> homing_msgs/GoalPhoto.

use homing_core::{Frame, Goal, Intrinsics, Stamp};

use super::{Malformed, ToDomain, ToMessage, header};
use crate::interfaces::homing_msgs;

const NAME: &str = "homing_msgs/GoalPhoto";

/// A photo that is not decoded yet: decoding is perception's.
#[derive(Clone, Debug, PartialEq)]
pub struct EncodedPhoto {
    /// Names the photo.
    pub id: u64,
    /// The file: PNG or JPEG.
    pub file: Vec<u8>,
    /// The camera that took it, at the size of the decoded image.
    pub intrinsics: Intrinsics,
}

impl ToMessage<homing_msgs::GoalPhoto> for EncodedPhoto {
    fn to_message(&self) -> homing_msgs::GoalPhoto {
        let i = &self.intrinsics;
        homing_msgs::GoalPhoto {
            header: header(Stamp::default(), Goal::NAME),
            goal_id: self.id,
            format: if self.file.starts_with(&[0xff, 0xd8]) { "jpeg" } else { "png" }.to_owned(),
            data: self.file.as_slice().into(),
            width: i.width(),
            height: i.height(),
            fx: i.fx(),
            fy: i.fy(),
            cx: i.cx(),
            cy: i.cy(),
        }
    }
}

impl ToDomain<EncodedPhoto> for homing_msgs::GoalPhoto {
    fn to_domain(&self) -> Result<EncodedPhoto, Malformed> {
        let intrinsics = Intrinsics::new(self.width, self.height, self.fx, self.fy, self.cx, self.cy)
            .map_err(|e| Malformed::new(NAME, e.to_string()))?;
        let file = super::image::bytes(&self.data);
        if file.is_empty() {
            return Err(Malformed::new(NAME, "the photo has no bytes"));
        }
        Ok(EncodedPhoto { id: self.goal_id, file, intrinsics })
    }
}
