//! The ROS 2 interfaces on the wire: our own, generated from `msg/`, `srv/` and `action/`, and ROS's.

#[expect(
    missing_docs,
    clippy::allow_attributes,
    clippy::expect_used,
    reason = "generated from .msg files, which hold the documentation"
)]
mod generated {
    include!(concat!(env!("OUT_DIR"), "/generated.rs"));
}

pub use generated::ros::homing_msgs;
pub use hiroz_msgs::ros::{builtin_interfaces, geometry_msgs, nav_msgs, sensor_msgs, std_msgs, tf2_msgs};
