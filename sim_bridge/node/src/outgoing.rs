//! What the simulated body says: all that a robot says, and the truth on a topic of its own.

use homing_core::RobotBridge;
use homing_privileged::{GROUND_TRUTH, GroundTruth};
use homing_protocol::convert::ToMessage;
use homing_protocol::interfaces::homing_msgs;
use homing_protocol::{BodyPublishers, PublishError, Publisher, Session};
use homing_sim::Simulator;

/// All senders of the simulated body.
pub struct Outgoing {
    /// As a robot.
    pub body: BodyPublishers,
    truth: Publisher<homing_msgs::GroundTruth>,
}

impl Outgoing {
    pub fn announce(session: &Session, simulator: &Simulator) -> Result<Self, PublishError> {
        Ok(Self {
            body: BodyPublishers::announce(session, simulator.capabilities().t_base_camera)?,
            truth: session.publisher(&GROUND_TRUTH)?,
        })
    }

    pub fn truth(&self, truth: &GroundTruth) -> Result<(), PublishError> {
        self.truth.publish(&truth.to_message())
    }
}
