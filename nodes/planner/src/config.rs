//! The planner's knobs, their defaults, and what makes a set of them impossible.

use core::time::Duration;

use thiserror::Error;

use crate::arrival::ArrivalConfig;
use crate::goal_filter::FilterConfig;
use crate::mapper::MapperConfig;
use crate::switches::{SwitchConfig, SwitchKind};

/// What to do about a depth image without a single usable depth.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum BlindPolicy {
    /// Stand still until depth comes back; but turn away from what the map knows to be right ahead, once around at most.
    Hold,
    /// Turn in place: a body that touches a wall sees nothing until it turns away.
    TurnInPlace,
}

/// Whether a route to a goal may cross cells that were never seen.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum UnknownCells {
    /// Never.
    Closed,
    /// At this multiple of a free cell's cost.
    Open {
        /// At least 1.
        cost: f32,
    },
}

/// The body, as far as planning cares.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct BodyConfig {
    /// Radius of the circle that holds the footprint, metres.
    pub radius_m: f64,
    /// Distance kept from obstacles beyond the radius, metres.
    pub margin_m: f64,
    /// Cells nearer to an obstacle than this cost more, metres.
    pub clearance_m: f64,
    /// Length of one forward step, metres.
    pub forward_m: f64,
    /// Angle of one turn, radians.
    pub turn_rad: f64,
    /// Fastest forward speed, m/s: a faster odometry jumped.
    pub linear_m_s_max: f64,
    /// Fastest turn, rad/s: a faster odometry jumped.
    pub angular_rad_s_max: f64,
}

impl Default for BodyConfig {
    fn default() -> Self {
        Self {
            radius_m: 0.18,
            margin_m: 0.05,
            clearance_m: 0.5,
            forward_m: 0.25,
            turn_rad: 15.0_f64.to_radians(),
            linear_m_s_max: 1.0,
            angular_rad_s_max: 2.0,
        }
    }
}

/// All knobs of the planner.
#[derive(Clone, Debug, PartialEq)]
pub struct PlannerConfig {
    /// Side of the square map centred on the odometry origin, metres.
    pub map_side_m: f64,
    /// Side of a map cell, metres.
    pub resolution_m: f64,
    /// Depth to map.
    pub mapper: MapperConfig,
    /// The body.
    pub body: BodyConfig,
    /// Goal fusion.
    pub filter: FilterConfig,
    /// Between exploring and exploiting.
    pub switches: SwitchConfig,
    /// The decision to stop.
    pub arrival: ArrivalConfig,
    /// Routes to goals through unseen cells.
    pub unknown_cells: UnknownCells,
    /// Depth images without depth.
    pub blind: BlindPolicy,
    /// Decisions per episode (SLING 4.1: 500).
    pub step_budget: u64,
    /// An observation older than this is stale.
    pub observation_age_max: Duration,
}

impl Default for PlannerConfig {
    fn default() -> Self {
        Self {
            map_side_m: 48.0,
            resolution_m: 0.05,
            mapper: MapperConfig::default(),
            body: BodyConfig::default(),
            filter: FilterConfig::default(),
            switches: SwitchConfig::default(),
            arrival: ArrivalConfig::default(),
            unknown_cells: UnknownCells::Open { cost: 3.0 },
            blind: BlindPolicy::Hold,
            step_budget: 500,
            observation_age_max: Duration::from_secs(1),
        }
    }
}

/// Why a set of knobs is impossible.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum ConfigError {
    /// A number lies outside what the planner can work with.
    #[error("{name} = {value} must lie in {min}..={max}")]
    OutOfRange {
        /// The knob.
        name: &'static str,
        /// Its value.
        value: f64,
        /// Smallest value accepted.
        min: f64,
        /// Largest value accepted.
        max: f64,
    },
    /// A lower limit is not below its upper limit.
    #[error("{lower} must be below {upper}")]
    Order {
        /// The knob that should be smaller.
        lower: &'static str,
        /// The knob that should be larger.
        upper: &'static str,
    },
}

impl PlannerConfig {
    /// Checks every number.
    ///
    /// # Errors
    /// [`ConfigError`] names the first knob that cannot work and its limits.
    pub fn check(&self) -> Result<(), ConfigError> {
        let (body, mapper) = (&self.body, &self.mapper);
        let unknown_cost = match self.unknown_cells {
            UnknownCells::Closed => 1.0,
            UnknownCells::Open { cost } => f64::from(cost),
        };
        let probability_min = match self.switches.kind {
            SwitchKind::Fused | SwitchKind::Sling => 0.5,
            SwitchKind::Learned { probability_min } => f64::from(probability_min),
        };
        let ranges = [
            ("map_side_m", self.map_side_m, 2.0, 100.0),
            ("resolution_m", self.resolution_m, 0.02, 0.25),
            ("body.radius_m", body.radius_m, 0.02, 1.0),
            ("body.margin_m", body.margin_m, 0.0, 0.5),
            ("body.clearance_m", body.clearance_m, 0.0, 2.0),
            ("body.forward_m", body.forward_m, 0.02, 1.0),
            ("body.turn_rad", body.turn_rad, 0.01, 1.6),
            ("body.linear_m_s_max", body.linear_m_s_max, 0.01, 20.0),
            ("body.angular_rad_s_max", body.angular_rad_s_max, 0.01, 50.0),
            ("mapper.range_min_m", mapper.range_min_m, 0.0, 5.0),
            ("mapper.range_max_m", mapper.range_max_m, 0.5, 20.0),
            ("mapper.band_min_m", mapper.band_min_m, 0.01, 1.0),
            ("mapper.band_max_m", mapper.band_max_m, 0.05, 5.0),
            ("unknown_cells.cost", unknown_cost, 1.0, 100.0),
            ("switches.distance_max_m", self.switches.distance_max_m, 0.5, 20.0),
            ("switches.kind.probability_min", probability_min, 0.0, 1.0),
            ("arrival.near_m", self.arrival.near_m, 0.1, 2.0),
            ("arrival.fine_rad", self.arrival.fine_rad, 0.001, 1.0),
            ("step_budget", self.step_budget as f64, 1.0, 1e9),
        ];
        for (name, value, min, max) in ranges {
            if !(value.is_finite() && value >= min && value <= max) {
                return Err(ConfigError::OutOfRange { name, value, min, max });
            }
        }
        if mapper.range_min_m >= mapper.range_max_m {
            return Err(ConfigError::Order { lower: "mapper.range_min_m", upper: "mapper.range_max_m" });
        }
        if mapper.band_min_m >= mapper.band_max_m {
            return Err(ConfigError::Order { lower: "mapper.band_min_m", upper: "mapper.band_max_m" });
        }
        Ok(())
    }
}
