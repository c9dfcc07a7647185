//! The topics a planner hears and speaks on.

use homing_protocol::interfaces::homing_msgs::{GoalEstimate, GoalPhoto, MotionCommand, MotionResult, NavigationState};
use homing_protocol::interfaces::{nav_msgs, sensor_msgs, tf2_msgs};
use homing_protocol::{Publisher, Session, Subscription, topics};

/// All of them.
pub struct Links {
    pub depths: Subscription<sensor_msgs::Image>,
    pub infos: Subscription<sensor_msgs::CameraInfo>,
    pub odometry: Subscription<nav_msgs::Odometry>,
    pub mounts: Subscription<tf2_msgs::TFMessage>,
    pub estimates: Subscription<GoalEstimate>,
    pub results: Subscription<MotionResult>,
    pub goal: Publisher<GoalPhoto>,
    pub command: Publisher<MotionCommand>,
    pub state: Publisher<NavigationState>,
    pub map: Publisher<nav_msgs::OccupancyGrid>,
}

impl Links {
    pub fn open(session: &Session) -> anyhow::Result<Self> {
        Ok(Self {
            depths: session.subscribe(&topics::CAMERA_DEPTH, 2)?,
            infos: session.subscribe(&topics::CAMERA_INFO, 2)?,
            odometry: session.subscribe(&topics::ODOM, 16)?,
            mounts: session.subscribe(&topics::TF_STATIC, 4)?,
            estimates: session.subscribe(&topics::GOAL_ESTIMATE, 4)?,
            results: session.subscribe(&topics::MOTION_RESULT, 4)?,
            goal: session.publisher(&topics::GOAL_IMAGE)?,
            command: session.publisher(&topics::MOTION_COMMAND)?,
            state: session.publisher(&topics::NAVIGATION_STATE)?,
            map: session.publisher(&topics::MAP)?,
        })
    }
}
