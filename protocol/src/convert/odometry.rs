//! Odometry <-> nav_msgs/Odometry.

use homing_core::{Base, Frame, Odom, Odometry, Transform};

use super::{Malformed, ToDomain, ToMessage, finite, header, isometry, pose_message, stamp};
use crate::interfaces::nav_msgs;

const NAME: &str = "nav_msgs/Odometry";

impl ToMessage<nav_msgs::Odometry> for Odometry {
    fn to_message(&self) -> nav_msgs::Odometry {
        let mut message = nav_msgs::Odometry {
            header: header(self.stamp, Odom::NAME),
            child_frame_id: Base::NAME.to_owned(),
            ..Default::default()
        };
        message.pose.pose = pose_message(self.t_odom_base.isometry());
        message.twist.twist.linear.x = self.linear_m_s;
        message.twist.twist.angular.z = self.angular_rad_s;
        message
    }
}

impl ToDomain<Odometry> for nav_msgs::Odometry {
    fn to_domain(&self) -> Result<Odometry, Malformed> {
        let (p, q) = (&self.pose.pose.position, &self.pose.pose.orientation);
        Ok(Odometry {
            stamp: stamp(&self.header.stamp, NAME)?,
            t_odom_base: Transform::new(isometry([p.x, p.y, p.z], [q.x, q.y, q.z, q.w], NAME)?),
            linear_m_s: finite(self.twist.twist.linear.x, "twist.linear.x", NAME)?,
            angular_rad_s: finite(self.twist.twist.angular.z, "twist.angular.z", NAME)?,
        })
    }
}
