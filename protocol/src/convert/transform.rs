//! Camera mount and odometry <-> tf2_msgs/TFMessage.

use homing_core::{Base, Camera, Frame, Odometry, Stamp, Transform};

use super::{Malformed, header, isometry};
use crate::interfaces::{geometry_msgs, tf2_msgs};

const NAME: &str = "tf2_msgs/TFMessage";

/// base_link -> camera_optical_frame, for tf_static.
#[must_use]
pub fn camera_mount_message(at: Stamp, t_base_camera: &Transform<Base, Camera>) -> tf2_msgs::TFMessage {
    tf_message(at, t_base_camera)
}

/// odom -> base_link, for tf.
#[must_use]
pub fn to_tf(odometry: &Odometry) -> tf2_msgs::TFMessage {
    tf_message(odometry.stamp, &odometry.t_odom_base)
}

/// Finds base_link -> camera_optical_frame among static transforms; `None` if it is not among them.
///
/// # Errors
/// [`Malformed`] when it is there but not a rigid transform.
pub fn to_camera_mount(message: &tf2_msgs::TFMessage) -> Result<Option<Transform<Base, Camera>>, Malformed> {
    let Some(found) =
        message.transforms.iter().find(|t| t.header.frame_id == Base::NAME && t.child_frame_id == Camera::NAME)
    else {
        return Ok(None);
    };
    let (p, q) = (&found.transform.translation, &found.transform.rotation);
    Ok(Some(Transform::new(isometry([p.x, p.y, p.z], [q.x, q.y, q.z, q.w], NAME)?)))
}

fn tf_message<A: Frame, B: Frame>(at: Stamp, t_a_b: &Transform<A, B>) -> tf2_msgs::TFMessage {
    let (p, q) = (t_a_b.translation(), t_a_b.rotation().coords);
    tf2_msgs::TFMessage {
        transforms: vec![geometry_msgs::TransformStamped {
            header: header(at, A::NAME),
            child_frame_id: B::NAME.to_owned(),
            transform: geometry_msgs::Transform {
                translation: geometry_msgs::Vector3 { x: p.x, y: p.y, z: p.z },
                rotation: geometry_msgs::Quaternion { x: q.x, y: q.y, z: q.z, w: q.w },
            },
        }],
    }
}
