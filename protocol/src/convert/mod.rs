//! Domain values to ROS 2 messages and back, one file per arrow. What is malformed is refused with a reason; nothing is
//! guessed.

mod camera_info;
mod estimate;
mod goal_photo;
mod image;
mod map;
mod motion;
mod navigation;
mod odometry;
mod scan;
mod transform;
mod twist;

use homing_core::Stamp;
use thiserror::Error;

use crate::interfaces::{builtin_interfaces, geometry_msgs, std_msgs};

pub use camera_info::CameraInfoMessage;
pub use goal_photo::EncodedPhoto;
pub use image::{color_message, depth_message, to_depth, to_rgb};
pub use motion::Lease;
pub use transform::{camera_mount_message, to_camera_mount, to_tf};
pub use twist::to_velocity;

/// Why a message does not describe a value.
#[derive(Debug, Clone, PartialEq, Error)]
#[error("{message}: {reason}")]
pub struct Malformed {
    /// ROS type.
    pub message: &'static str,
    /// Which field, and what is wrong with it.
    pub reason: String,
}

impl Malformed {
    pub(crate) fn new(message: &'static str, reason: impl Into<String>) -> Self {
        Self { message, reason: reason.into() }
    }
}

/// A domain value as a message.
pub trait ToMessage<M> {
    /// The message.
    fn to_message(&self) -> M;
}

/// A message as a domain value.
pub trait ToDomain<T> {
    /// The value.
    ///
    /// # Errors
    /// [`Malformed`] says which field cannot be.
    fn to_domain(&self) -> Result<T, Malformed>;
}

/// A stamp as ROS messages carry it.
#[must_use]
pub fn time(stamp: Stamp) -> builtin_interfaces::Time {
    let (seconds, nanoseconds) = stamp.to_parts();
    builtin_interfaces::Time { sec: i32::try_from(seconds).unwrap_or(i32::MAX), nanosec: nanoseconds }
}

/// The stamp of a `message`.
///
/// # Errors
/// [`Malformed`] for a time before the clock's origin, or more nanoseconds than a second has.
pub fn stamp(time: &builtin_interfaces::Time, message: &'static str) -> Result<Stamp, Malformed> {
    let seconds = u32::try_from(time.sec)
        .map_err(|_| Malformed::new(message, format!("stamp of {} s is before the clock's origin", time.sec)))?;
    if time.nanosec >= 1_000_000_000 {
        return Err(Malformed::new(message, format!("stamp has {} ns in a second", time.nanosec)));
    }
    Ok(Stamp::from_parts(seconds, time.nanosec))
}

pub(crate) fn header(stamp: Stamp, frame: &str) -> std_msgs::Header {
    std_msgs::Header { stamp: time(stamp), frame_id: frame.to_owned() }
}

pub(crate) fn finite(value: f64, field: &str, message: &'static str) -> Result<f64, Malformed> {
    if value.is_finite() { Ok(value) } else { Err(Malformed::new(message, format!("{field} is {value}"))) }
}

pub(crate) fn pose_message(isometry: &nalgebra::Isometry3<f64>) -> geometry_msgs::Pose {
    let (p, q) = (isometry.translation.vector, isometry.rotation.coords);
    geometry_msgs::Pose {
        position: geometry_msgs::Point { x: p.x, y: p.y, z: p.z },
        orientation: geometry_msgs::Quaternion { x: q.x, y: q.y, z: q.z, w: q.w },
    }
}

/// Position and orientation with a quaternion that is nearly of unit length.
pub(crate) fn isometry(
    position: [f64; 3],
    orientation: [f64; 4],
    message: &'static str,
) -> Result<nalgebra::Isometry3<f64>, Malformed> {
    for value in position.iter().chain(&orientation) {
        finite(*value, "pose", message)?;
    }
    let [x, y, z, w] = orientation;
    let quaternion = nalgebra::Quaternion::new(w, x, y, z);
    let norm = quaternion.norm();
    if (norm - 1.0).abs() > 1e-2 {
        return Err(Malformed::new(message, format!("orientation has length {norm:.3}, not 1")));
    }
    // One that is already of unit length is taken as it is: renormalising would move its last bit, and a value sent
    // over the network must come back as it was.
    let rotation = if (norm - 1.0).abs() < 1e-12 {
        nalgebra::UnitQuaternion::new_unchecked(quaternion)
    } else {
        nalgebra::UnitQuaternion::new_normalize(quaternion)
    };
    Ok(nalgebra::Isometry3::from_parts(nalgebra::Translation3::from(nalgebra::Vector3::from(position)), rotation))
}
