//! How fast a body may go, and how quickly that may change.

use core::time::Duration;

use thiserror::Error;

/// A planar velocity of the base.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Velocity {
    /// Forward, m/s, negative backwards.
    pub linear_m_s: f64,
    /// Left turn, rad/s.
    pub angular_rad_s: f64,
}

impl Velocity {
    /// Standing still.
    pub const ZERO: Self = Self { linear_m_s: 0.0, angular_rad_s: 0.0 };

    /// True if both numbers are finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.linear_m_s.is_finite() && self.angular_rad_s.is_finite()
    }

    /// True if both numbers are exactly zero.
    #[must_use]
    pub fn is_zero(&self) -> bool {
        self.linear_m_s == 0.0 && self.angular_rad_s == 0.0
    }
}

/// The speeds and accelerations a body is held to, the same forwards and backwards, left and right.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct VelocityLimits {
    linear_m_s_max: f64,
    angular_rad_s_max: f64,
    linear_m_s2_max: f64,
    angular_rad_s2_max: f64,
}

/// A limit that limits nothing, or everything.
#[derive(Debug, Clone, PartialEq, Error)]
#[error("{name} = {value} must be positive and finite")]
pub struct LimitsError {
    /// Which limit.
    pub name: &'static str,
    /// Its value.
    pub value: f64,
}

impl VelocityLimits {
    /// Checked construction: m/s, rad/s, m/s^2, rad/s^2.
    ///
    /// # Errors
    /// [`LimitsError`] for a limit that is not positive and finite.
    pub fn new(
        linear_m_s_max: f64,
        angular_rad_s_max: f64,
        linear_m_s2_max: f64,
        angular_rad_s2_max: f64,
    ) -> Result<Self, LimitsError> {
        for (name, value) in [
            ("linear_m_s_max", linear_m_s_max),
            ("angular_rad_s_max", angular_rad_s_max),
            ("linear_m_s2_max", linear_m_s2_max),
            ("angular_rad_s2_max", angular_rad_s2_max),
        ] {
            if !(value.is_finite() && value > 0.0) {
                return Err(LimitsError { name, value });
            }
        }
        Ok(Self { linear_m_s_max, angular_rad_s_max, linear_m_s2_max, angular_rad_s2_max })
    }

    /// Fastest forward and backward speed, m/s.
    #[must_use]
    pub fn linear_m_s_max(&self) -> f64 {
        self.linear_m_s_max
    }

    /// Fastest turn either way, rad/s.
    #[must_use]
    pub fn angular_rad_s_max(&self) -> f64 {
        self.angular_rad_s_max
    }

    /// Strongest forward acceleration and ordinary braking, m/s^2.
    #[must_use]
    pub fn linear_m_s2_max(&self) -> f64 {
        self.linear_m_s2_max
    }

    /// Strongest angular acceleration, rad/s^2.
    #[must_use]
    pub fn angular_rad_s2_max(&self) -> f64 {
        self.angular_rad_s2_max
    }

    /// The nearest velocity within the limits; `None` for one that is not finite.
    #[must_use]
    pub fn clamp(&self, velocity: Velocity) -> Option<Velocity> {
        velocity.is_finite().then(|| Velocity {
            linear_m_s: velocity.linear_m_s.clamp(-self.linear_m_s_max, self.linear_m_s_max),
            angular_rad_s: velocity.angular_rad_s.clamp(-self.angular_rad_s_max, self.angular_rad_s_max),
        })
    }

    /// From `current` towards `wanted` as far as the accelerations allow in `dt`. A wish that is not finite means zero.
    #[must_use]
    pub fn approach(&self, current: Velocity, wanted: Velocity, dt: Duration) -> Velocity {
        let wanted = self.clamp(wanted).unwrap_or(Velocity::ZERO);
        let dt_s = dt.as_secs_f64();
        let step = |from: f64, to: f64, most: f64| from + (to - from).clamp(-most, most);
        Velocity {
            linear_m_s: step(current.linear_m_s, wanted.linear_m_s, self.linear_m_s2_max * dt_s),
            angular_rad_s: step(current.angular_rad_s, wanted.angular_rad_s, self.angular_rad_s2_max * dt_s),
        }
    }
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "tests")]
mod tests {
    use super::*;

    fn limits() -> VelocityLimits {
        VelocityLimits::new(0.5, 1.0, 1.0, 2.0).unwrap()
    }

    #[test]
    fn refuses_limits_that_limit_nothing() {
        assert_eq!(VelocityLimits::new(0.5, f64::NAN, 1.0, 2.0).unwrap_err().name, "angular_rad_s_max");
        assert!(VelocityLimits::new(0.5, 1.0, 0.0, 2.0).is_err());
        assert!(VelocityLimits::new(f64::INFINITY, 1.0, 1.0, 2.0).is_err());
    }

    #[test]
    fn clamps_and_refuses_nan() {
        let fast = Velocity { linear_m_s: -9.0, angular_rad_s: 9.0 };
        assert_eq!(limits().clamp(fast), Some(Velocity { linear_m_s: -0.5, angular_rad_s: 1.0 }));
        assert_eq!(limits().clamp(Velocity { linear_m_s: f64::NAN, angular_rad_s: 0.0 }), None);
    }

    #[test]
    fn accelerates_no_faster_than_allowed() {
        let wanted = Velocity { linear_m_s: 0.5, angular_rad_s: -1.0 };
        let v = limits().approach(Velocity::ZERO, wanted, Duration::from_millis(20));
        assert!((v.linear_m_s - 0.02).abs() < 1e-12 && (v.angular_rad_s + 0.04).abs() < 1e-12);
        assert_eq!(limits().approach(wanted, wanted, Duration::from_millis(20)), wanted);
    }
}
