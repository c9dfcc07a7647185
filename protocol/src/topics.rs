//! Every topic: its name, message, sender, quality of service and rate. The system on a page.
//!
//! The simulator's privileged topics (ground truth, reset) stand in `sim_bridge/privileged`, a crate that perception and
//! planner may not depend on.

use std::marker::PhantomData;

use hiroz::MessageTypeInfo;
use hiroz_cdr::{CdrDeserialize, CdrSerialize, CdrSerializedSize};

use crate::interfaces::homing_msgs::{
    GoalEstimate, GoalPhoto, MotionCommand, MotionLease, MotionResult, NavigationState,
};
use crate::interfaces::{geometry_msgs, nav_msgs, sensor_msgs, tf2_msgs};

/// A generated ROS 2 message.
pub trait Message: MessageTypeInfo + CdrSerialize + CdrDeserialize + CdrSerializedSize + Send + Sync + 'static {}
impl<T: MessageTypeInfo + CdrSerialize + CdrDeserialize + CdrSerializedSize + Send + Sync + 'static> Message for T {}

/// How a topic's messages travel.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Qos {
    /// Large and frequent. A sender is never held up by a slow reader; the newest wins.
    Frame,
    /// Small and urgent: real-time priority, sent at once, never held up.
    Command,
    /// Small: delivered reliably, the newest wins.
    State,
    /// For people: the first to give way.
    Display,
}

/// One row of the table.
#[derive(Debug)]
pub struct Topic<M> {
    /// Name below the robot's namespace.
    pub name: &'static str,
    /// Which process sends it.
    pub sender: &'static str,
    /// How it travels.
    pub qos: Qos,
    /// How often.
    pub rate: &'static str,
    /// Larger messages are refused unread, bytes.
    pub bytes_max: usize,
    message: PhantomData<fn() -> M>,
}

impl<M> Topic<M> {
    /// A row.
    #[must_use]
    pub const fn new(name: &'static str, sender: &'static str, qos: Qos, rate: &'static str, bytes_max: usize) -> Self {
        Self { name, sender, qos, rate, bytes_max, message: PhantomData }
    }
}

const KB: usize = 1 << 10;
const MB: usize = 1 << 20;

/// Colour image, rgb8.
pub const CAMERA_COLOR: Topic<sensor_msgs::Image> =
    Topic::new("camera/color/image_raw", "body", Qos::Frame, "every step, or 10 Hz", 16 * MB);
/// Depth registered to colour: 32FC1 in metres or 16UC1 in millimetres.
pub const CAMERA_DEPTH: Topic<sensor_msgs::Image> =
    Topic::new("camera/depth/image_raw", "body", Qos::Frame, "with each colour image", 16 * MB);
/// Intrinsics of both.
pub const CAMERA_INFO: Topic<sensor_msgs::CameraInfo> =
    Topic::new("camera/color/camera_info", "body", Qos::State, "with each colour image", 16 * KB);
/// Pose of base_link in odom; identity at start.
pub const ODOM: Topic<nav_msgs::Odometry> = Topic::new("odom", "body", Qos::State, "every step, or 50 Hz", 4 * KB);
/// Planar laser scan.
pub const SCAN: Topic<sensor_msgs::LaserScan> =
    Topic::new("scan", "body", Qos::State, "every step, or 10 Hz", 256 * KB);
/// Where the camera sits on the body.
pub const TF_STATIC: Topic<tf2_msgs::TFMessage> = Topic::new("tf_static", "body", Qos::State, "1 Hz", 64 * KB);
/// odom -> base_link, for ROS tools.
pub const TF: Topic<tf2_msgs::TFMessage> = Topic::new("tf", "body", Qos::State, "with each odometry message", 64 * KB);
/// What the body did with a command.
pub const MOTION_RESULT: Topic<MotionResult> =
    Topic::new("motion_result", "body", Qos::Command, "after each motion", 4 * KB);
/// Who may move the robot.
pub const MOTION_LEASE: Topic<MotionLease> =
    Topic::new("motion_lease", "body", Qos::State, "1 Hz, and on change", 4 * KB);
/// Velocities from elsewhere: taken in real time while no lease is held, for 200 ms at a time.
pub const CMD_VEL: Topic<geometry_msgs::TwistStamped> =
    Topic::new("cmd_vel", "a ROS teleoperator, or the body to a ROS base", Qos::Command, "10 Hz and more", 4 * KB);
/// One motion, with lease, sequence, stamp and time to live.
pub const MOTION_COMMAND: Topic<MotionCommand> =
    Topic::new("motion_command", "planner", Qos::Command, "every step, again until answered", 4 * KB);
/// The photo to drive to.
pub const GOAL_IMAGE: Topic<GoalPhoto> =
    Topic::new("goal_image", "planner", Qos::Frame, "1 Hz while a goal is set", 16 * MB);
/// What the planner does and why.
pub const NAVIGATION_STATE: Topic<NavigationState> =
    Topic::new("navigation_state", "planner", Qos::Display, "every step", MB);
/// The planner's map.
pub const MAP: Topic<nav_msgs::OccupancyGrid> = Topic::new("map", "planner", Qos::Display, "every fifth step", 4 * MB);
/// Where the goal is, seen from one frame.
pub const GOAL_ESTIMATE: Topic<GoalEstimate> =
    Topic::new("goal_estimate", "perception", Qos::State, "one per frame", 256 * KB);

/// A row without its message type, for listings.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct Row {
    /// Name below the robot's namespace.
    pub name: &'static str,
    /// ROS type.
    pub message: &'static str,
    /// Which process sends it.
    pub sender: &'static str,
    /// How it travels.
    pub qos: Qos,
    /// How often.
    pub rate: &'static str,
}

fn row<M: MessageTypeInfo>(topic: &Topic<M>) -> Row {
    Row { name: topic.name, message: M::type_name(), sender: topic.sender, qos: topic.qos, rate: topic.rate }
}

/// All rows, in the order of the data's path.
#[must_use]
pub fn table() -> Vec<Row> {
    vec![
        row(&CAMERA_COLOR),
        row(&CAMERA_DEPTH),
        row(&CAMERA_INFO),
        row(&ODOM),
        row(&SCAN),
        row(&TF_STATIC),
        row(&TF),
        row(&GOAL_IMAGE),
        row(&GOAL_ESTIMATE),
        row(&NAVIGATION_STATE),
        row(&MAP),
        row(&MOTION_COMMAND),
        row(&CMD_VEL),
        row(&MOTION_RESULT),
        row(&MOTION_LEASE),
    ]
}
