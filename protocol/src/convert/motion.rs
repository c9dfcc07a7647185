//! Motion commands, results and leases <-> homing_msgs.

use core::time::Duration;

use homing_core::{Base, Frame, Motion, MotionCommand, MotionOutcome, MotionResult, PlanarPose, Stamp};

use super::{Malformed, ToDomain, ToMessage, finite, header, stamp};
use crate::interfaces::homing_msgs;

const COMMAND: &str = "homing_msgs/MotionCommand";
const RESULT: &str = "homing_msgs/MotionResult";
const LEASE: &str = "homing_msgs/MotionLease";

const VELOCITY: u8 = 0;
const FORWARD: u8 = 1;
const TURN: u8 = 2;
const STOP: u8 = 3;
const DONE: u8 = 4;

impl ToMessage<homing_msgs::MotionCommand> for MotionCommand {
    fn to_message(&self) -> homing_msgs::MotionCommand {
        let mut message = homing_msgs::MotionCommand {
            header: header(self.stamp, Base::NAME),
            session: self.session,
            epoch: self.epoch,
            sequence: self.sequence,
            time_to_live_ns: u64::try_from(self.time_to_live.as_nanos()).unwrap_or(u64::MAX),
            ..Default::default()
        };
        match self.motion {
            Motion::Velocity { linear_m_s, angular_rad_s } => {
                (message.kind, message.linear_m_s, message.angular_rad_s) = (VELOCITY, linear_m_s, angular_rad_s);
            }
            Motion::Forward { distance_m } => (message.kind, message.distance_m) = (FORWARD, distance_m),
            Motion::Turn { angle_rad } => (message.kind, message.angle_rad) = (TURN, angle_rad),
            Motion::Stop { done: false } => message.kind = STOP,
            Motion::Stop { done: true } => message.kind = DONE,
        }
        message
    }
}

impl ToDomain<MotionCommand> for homing_msgs::MotionCommand {
    fn to_domain(&self) -> Result<MotionCommand, Malformed> {
        let motion = match self.kind {
            VELOCITY => Motion::Velocity {
                linear_m_s: finite(self.linear_m_s, "linear_m_s", COMMAND)?,
                angular_rad_s: finite(self.angular_rad_s, "angular_rad_s", COMMAND)?,
            },
            FORWARD => Motion::Forward { distance_m: finite(self.distance_m, "distance_m", COMMAND)? },
            TURN => Motion::Turn { angle_rad: finite(self.angle_rad, "angle_rad", COMMAND)? },
            STOP => Motion::Stop { done: false },
            DONE => Motion::Stop { done: true },
            other => return Err(Malformed::new(COMMAND, format!("kind {other} does not exist"))),
        };
        Ok(MotionCommand {
            session: self.session,
            epoch: self.epoch,
            sequence: self.sequence,
            stamp: stamp(&self.header.stamp, COMMAND)?,
            time_to_live: Duration::from_nanos(self.time_to_live_ns),
            motion,
        })
    }
}

impl ToMessage<homing_msgs::MotionResult> for MotionResult {
    fn to_message(&self) -> homing_msgs::MotionResult {
        homing_msgs::MotionResult {
            header: header(self.outcome.stamp, Base::NAME),
            session: self.session,
            sequence: self.sequence,
            moved_x_m: self.outcome.moved.x_m,
            moved_y_m: self.outcome.moved.y_m,
            moved_yaw_rad: self.outcome.moved.yaw_rad,
            blocked: self.outcome.blocked,
        }
    }
}

impl ToDomain<MotionResult> for homing_msgs::MotionResult {
    fn to_domain(&self) -> Result<MotionResult, Malformed> {
        let moved = PlanarPose {
            x_m: finite(self.moved_x_m, "moved_x_m", RESULT)?,
            y_m: finite(self.moved_y_m, "moved_y_m", RESULT)?,
            yaw_rad: finite(self.moved_yaw_rad, "moved_yaw_rad", RESULT)?,
        };
        let outcome = MotionOutcome { stamp: stamp(&self.header.stamp, RESULT)?, moved, blocked: self.blocked };
        Ok(MotionResult { session: self.session, sequence: self.sequence, outcome })
    }
}

/// Who may move the robot.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Lease {
    /// When it was said.
    pub stamp: Stamp,
    /// Session and epoch of the holder, if there is one.
    pub holder: Option<(u64, u64)>,
    /// Commands accepted so far.
    pub accepted: u64,
    /// Commands refused so far.
    pub refused: u64,
    /// Why the last one was refused, for people.
    pub last_refusal: String,
}

impl ToMessage<homing_msgs::MotionLease> for Lease {
    fn to_message(&self) -> homing_msgs::MotionLease {
        let (session, epoch) = self.holder.unwrap_or_default();
        homing_msgs::MotionLease {
            header: header(self.stamp, Base::NAME),
            held: self.holder.is_some(),
            session,
            epoch,
            accepted: self.accepted,
            refused: self.refused,
            last_refusal: self.last_refusal.clone(),
        }
    }
}

impl ToDomain<Lease> for homing_msgs::MotionLease {
    fn to_domain(&self) -> Result<Lease, Malformed> {
        Ok(Lease {
            stamp: stamp(&self.header.stamp, LEASE)?,
            holder: self.held.then_some((self.session, self.epoch)),
            accepted: self.accepted,
            refused: self.refused,
            last_refusal: self.last_refusal.clone(),
        })
    }
}
