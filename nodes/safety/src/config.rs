//! What a supervisor is made of, and the defaults.

use core::time::Duration;

use homing_core::Capabilities;

use crate::collision::CollisionConfig;
use crate::controller::ControllerConfig;
use crate::gate::GateConfig;
use crate::limits::{LimitsError, VelocityLimits};
use crate::watchdog::WatchdogConfig;

/// What a supervisor is made of.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct SupervisorConfig {
    /// Which commands are taken; its limits hold for every order.
    pub gate: GateConfig,
    /// When silence stops the robot.
    pub watchdog: WatchdogConfig,
    /// How distances and angles are driven.
    pub controller: ControllerConfig,
    /// What keeps the body off obstacles; `None` switches the monitor off and belongs in a test only.
    pub collision: Option<CollisionConfig>,
    /// A bare velocity acts for this long.
    pub teleop: Duration,
    /// Older odometry does not count.
    pub odometry_age_max: Duration,
    /// An order holds for no longer than this: what drives the motors stops by itself when the ticks stop.
    pub order: Duration,
}

impl SupervisorConfig {
    /// The defaults, within the speeds of a body and accelerations of 1 m/s^2 and 3 rad/s^2. A body without a scanner
    /// must be fed scans made from its depth ([`crate::scan_from_depth`]), or it will not drive.
    ///
    /// # Errors
    /// [`LimitsError`] if the body states a speed that is not positive and finite.
    pub fn for_body(body: &Capabilities) -> Result<Self, LimitsError> {
        let limits = VelocityLimits::new(body.linear_m_s_max, body.angular_rad_s_max, 1.0, 3.0)?;
        Ok(Self {
            gate: GateConfig::new(limits),
            watchdog: WatchdogConfig::default(),
            controller: ControllerConfig::new(&limits),
            collision: Some(CollisionConfig::new(body.radius_m)),
            teleop: Duration::from_millis(200),
            odometry_age_max: Duration::from_millis(300),
            order: Duration::from_millis(100),
        })
    }
}
