//! geometry_msgs/TwistStamped -> velocities.

use super::{Malformed, finite};
use crate::interfaces::geometry_msgs;

const NAME: &str = "geometry_msgs/TwistStamped";

/// Forward speed (m/s) and turning speed (rad/s, left positive) for a differential base.
///
/// # Errors
/// [`Malformed`] for NaN or infinite speeds.
pub fn to_velocity(message: &geometry_msgs::TwistStamped) -> Result<(f64, f64), Malformed> {
    Ok((
        finite(message.twist.linear.x, "twist.linear.x", NAME)?,
        finite(message.twist.angular.z, "twist.angular.z", NAME)?,
    ))
}
