//! What only a simulator can say and only scorers and people may hear: where the robot really is, and the reset.
//!
//! A crate of its own, so that perception and planner cannot import it: a test over `cargo metadata` sees to that.

use std::time::Duration;

use homing_core::{PlanarPose, Stamp};
use homing_protocol::convert::{Malformed, ToDomain, ToMessage, stamp, time};
use homing_protocol::interfaces::homing_msgs;
use homing_protocol::interfaces::homing_msgs::srv::ResetEpisode;
use homing_protocol::service::{ServiceError, call};
use homing_protocol::topics::Qos;
use homing_protocol::{Session, Topic};
use thiserror::Error;

/// Where the robot really is, after each step.
pub const GROUND_TRUTH: Topic<homing_msgs::GroundTruth> =
    Topic::new("privileged/ground_truth", "simulator", Qos::State, "every step, or 10 Hz", 4 << 10);

/// How an episode went, as a scorer saw it.
pub const EPISODE_SUMMARY: Topic<homing_msgs::EpisodeSummary> =
    Topic::new("privileged/episode_summary", "homing", Qos::State, "at the end of an episode", 16 << 10);

/// Puts the robot at the start of an episode.
pub const RESET: &str = "privileged/reset";

const NAME: &str = "homing_msgs/GroundTruth";

/// The truth about one moment, world frame.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct GroundTruth {
    /// When.
    pub stamp: Stamp,
    /// The base.
    pub pose: PlanarPose,
    /// The origin of the odometry frame: where the episode began.
    pub start: PlanarPose,
    /// Way really made since then, metres.
    pub path_length_m: f64,
    /// Actions since then.
    pub steps: u64,
    /// Motions cut short by an obstacle since then.
    pub collisions: u64,
    /// The robot declared the goal reached.
    pub done: bool,
}

impl GroundTruth {
    /// A pose of the world frame in the coordinates of a drift-free odometry frame.
    #[must_use]
    pub fn in_odom(&self, pose: PlanarPose) -> PlanarPose {
        let (dx, dy) = (pose.x_m - self.start.x_m, pose.y_m - self.start.y_m);
        let (sin, cos) = self.start.yaw_rad.sin_cos();
        PlanarPose {
            x_m: cos * dx + sin * dy,
            y_m: cos * dy - sin * dx,
            yaw_rad: homing_core::wrap_angle(pose.yaw_rad - self.start.yaw_rad),
        }
    }
}

impl ToMessage<homing_msgs::GroundTruth> for GroundTruth {
    fn to_message(&self) -> homing_msgs::GroundTruth {
        let mut message = homing_msgs::GroundTruth {
            x_m: self.pose.x_m,
            y_m: self.pose.y_m,
            yaw_rad: self.pose.yaw_rad,
            start_x_m: self.start.x_m,
            start_y_m: self.start.y_m,
            start_yaw_rad: self.start.yaw_rad,
            path_length_m: self.path_length_m,
            steps: self.steps,
            collisions: self.collisions,
            done: self.done,
            ..Default::default()
        };
        "world".clone_into(&mut message.header.frame_id);
        message.header.stamp = time(self.stamp);
        message
    }
}

impl ToDomain<GroundTruth> for homing_msgs::GroundTruth {
    fn to_domain(&self) -> Result<GroundTruth, Malformed> {
        let numbers =
            [self.x_m, self.y_m, self.yaw_rad, self.start_x_m, self.start_y_m, self.start_yaw_rad, self.path_length_m];
        if numbers.iter().any(|n| !n.is_finite()) {
            return Err(Malformed { message: NAME, reason: "a number is not finite".to_owned() });
        }
        Ok(GroundTruth {
            stamp: stamp(&self.header.stamp, NAME)?,
            pose: PlanarPose { x_m: self.x_m, y_m: self.y_m, yaw_rad: self.yaw_rad },
            start: PlanarPose { x_m: self.start_x_m, y_m: self.start_y_m, yaw_rad: self.start_yaw_rad },
            path_length_m: self.path_length_m,
            steps: self.steps,
            collisions: self.collisions,
            done: self.done,
        })
    }
}

/// Why a reset did not happen.
#[derive(Debug, Error)]
pub enum ResetError {
    /// No simulator answers.
    #[error(transparent)]
    Service(#[from] ServiceError),
    /// The simulator does not want the episode.
    #[error("the simulator refused the episode: {reason}")]
    Refused {
        /// Its words.
        reason: String,
    },
}

/// Asks the simulator to put the robot at the start of an episode, given as the simulator's episode JSON.
///
/// # Errors
/// [`ResetError`] when nobody answers within `limit`, or the episode does not fit the scene.
pub async fn reset(session: &Session, episode_json: String, limit: Duration) -> Result<(), ResetError> {
    let question = homing_msgs::ResetEpisodeRequest { episode_json };
    let answer = call::<ResetEpisode>(session, RESET, &question, limit).await?;
    if answer.accepted { Ok(()) } else { Err(ResetError::Refused { reason: answer.message }) }
}
