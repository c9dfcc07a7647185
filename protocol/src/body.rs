//! What every body says, whether simulated, recorded or real.

use homing_core::{Base, Camera, MotionResult, Observation, Odometry, Transform};

use crate::convert::{CameraInfoMessage, Lease, ToMessage, camera_mount_message, color_message, depth_message, to_tf};
use crate::interfaces::{homing_msgs, nav_msgs, sensor_msgs, tf2_msgs};
use crate::publisher::{PublishError, Publisher};
use crate::session::Session;
use crate::topics;

/// The senders of a body.
pub struct BodyPublishers {
    color: Publisher<sensor_msgs::Image>,
    depth: Publisher<sensor_msgs::Image>,
    info: Publisher<sensor_msgs::CameraInfo>,
    odom: Publisher<nav_msgs::Odometry>,
    scan: Publisher<sensor_msgs::LaserScan>,
    tf: Publisher<tf2_msgs::TFMessage>,
    tf_static: Publisher<tf2_msgs::TFMessage>,
    result: Publisher<homing_msgs::MotionResult>,
    lease: Publisher<homing_msgs::MotionLease>,
    t_base_camera: Transform<Base, Camera>,
}

impl BodyPublishers {
    /// Announces all of them for a body whose camera sits at `t_base_camera`.
    ///
    /// # Errors
    /// [`PublishError`] when zenoh refuses a declaration.
    pub fn announce(session: &Session, t_base_camera: Transform<Base, Camera>) -> Result<Self, PublishError> {
        Ok(Self {
            color: session.publisher(&topics::CAMERA_COLOR)?,
            depth: session.publisher(&topics::CAMERA_DEPTH)?,
            info: session.publisher(&topics::CAMERA_INFO)?,
            odom: session.publisher(&topics::ODOM)?,
            scan: session.publisher(&topics::SCAN)?,
            tf: session.publisher(&topics::TF)?,
            tf_static: session.publisher(&topics::TF_STATIC)?,
            result: session.publisher(&topics::MOTION_RESULT)?,
            lease: session.publisher(&topics::MOTION_LEASE)?,
            t_base_camera,
        })
    }

    /// Everything seen at one moment; the images last, so that who has them has the rest.
    ///
    /// # Errors
    /// [`PublishError`] when the session is closed.
    pub fn observation(&self, observation: &Observation) -> Result<(), PublishError> {
        let frame = &observation.frame;
        self.tf_static.publish(&camera_mount_message(frame.stamp, &self.t_base_camera))?;
        self.odometry(&observation.odometry)?;
        if let Some(scan) = &observation.scan {
            self.scan.publish(&scan.to_message())?;
        }
        self.info.publish(&CameraInfoMessage { stamp: frame.stamp, intrinsics: frame.intrinsics }.to_message())?;
        self.depth.publish(&depth_message(frame.stamp, &frame.depth))?;
        self.color.publish(&color_message(frame.stamp, &frame.rgb))
    }

    /// Where the robot believes it is.
    ///
    /// # Errors
    /// [`PublishError`] when the session is closed.
    pub fn odometry(&self, odometry: &Odometry) -> Result<(), PublishError> {
        self.tf.publish(&to_tf(odometry))?;
        self.odom.publish(&odometry.to_message())
    }

    /// What a command came to.
    ///
    /// # Errors
    /// [`PublishError`] when the session is closed.
    pub fn result(&self, result: &MotionResult) -> Result<(), PublishError> {
        self.result.publish(&result.to_message())
    }

    /// Who may command.
    ///
    /// # Errors
    /// [`PublishError`] when the session is closed.
    pub fn lease(&self, lease: &Lease) -> Result<(), PublishError> {
        self.lease.publish(&lease.to_message())
    }
}
