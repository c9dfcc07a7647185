//! The process's TOML file.

use std::time::Duration;

use homing_core::GoalDiscovery;
use homing_planner::{Frontier, PlannerConfig, RandomGoal, Recovery, Straight, SwitchKind};
use homing_protocol::process::SessionSettings;
use serde::Deserialize;

/// `planner.toml`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// Network.
    pub session: SessionSettings,
    /// Goal discovery.
    pub policy: Policy,
    /// The map.
    pub map: MapSettings,
    /// The body.
    pub body: BodySettings,
    /// Switches and budget.
    pub mission: MissionSettings,
    /// Between exploring and driving to the goal.
    pub switches: SwitchSettings,
    /// Waiting.
    pub pace: PaceSettings,
}

/// `[switches]`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SwitchSettings {
    /// What is looked at.
    pub kind: KindName,
    /// Whether there is a way back.
    pub recovery: RecoveryName,
}

/// The switches' names in the file.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum KindName {
    /// Estimates fused over time.
    #[default]
    Fused,
    /// One estimate, as SLING published it.
    Sling,
    /// A model of perception's.
    Learned,
}

/// Names of the ways back.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RecoveryName {
    /// There is one.
    #[default]
    On,
    /// There is none.
    Off,
}

impl From<KindName> for SwitchKind {
    fn from(name: KindName) -> Self {
        match name {
            KindName::Fused => Self::Fused,
            KindName::Sling => Self::Sling,
            KindName::Learned => Self::LEARNED,
        }
    }
}

impl From<RecoveryName> for Recovery {
    fn from(name: RecoveryName) -> Self {
        match name {
            RecoveryName::On => Self::On,
            RecoveryName::Off => Self::Off,
        }
    }
}

/// Goal-discovery policies.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Policy {
    /// Straight ahead, right when blocked (SLING's simplest).
    Straight,
    /// To the edges of what is known.
    #[default]
    Frontier,
    /// To places drawn at random from the map.
    RandomGoal,
}

impl Policy {
    /// A fresh policy.
    pub fn build(self) -> Box<dyn GoalDiscovery> {
        match self {
            Policy::Straight => Box::new(Straight::new()),
            Policy::Frontier => Box::new(Frontier::default()),
            Policy::RandomGoal => Box::new(RandomGoal::new(0)),
        }
    }
}

/// `[map]`.
#[derive(Clone, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MapSettings {
    /// Side of the square map, metres.
    pub side_m: f64,
    /// Side of a cell, metres.
    pub resolution_m: f64,
}

/// `[body]`.
#[derive(Clone, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BodySettings {
    /// Radius of the footprint, metres.
    pub radius_m: f64,
    /// One forward step, metres.
    pub forward_m: f64,
    /// One turn, degrees.
    pub turn_deg: f64,
}

/// `[mission]`.
#[derive(Clone, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MissionSettings {
    /// Decisions per mission.
    pub step_budget: u64,
}

/// `[pace]`.
#[derive(Clone, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PaceSettings {
    /// Longest wait for perception's answer to a frame before going on without it, milliseconds.
    pub answer_ms_max: u64,
    /// A command is sent again after so long without a result, milliseconds.
    pub resend_ms: u64,
    /// A command without a result is given up after so long, milliseconds.
    pub result_ms_max: u64,
    /// A command is void this long after the stamp of the observation it answers, milliseconds.
    pub time_to_live_ms: u64,
}

impl Default for MapSettings {
    fn default() -> Self {
        let defaults = PlannerConfig::default();
        Self { side_m: defaults.map_side_m, resolution_m: defaults.resolution_m }
    }
}

impl Default for BodySettings {
    fn default() -> Self {
        let body = PlannerConfig::default().body;
        Self { radius_m: body.radius_m, forward_m: body.forward_m, turn_deg: body.turn_rad.to_degrees() }
    }
}

impl Default for MissionSettings {
    fn default() -> Self {
        Self { step_budget: PlannerConfig::default().step_budget }
    }
}

impl Default for PaceSettings {
    fn default() -> Self {
        Self { answer_ms_max: 5_000, resend_ms: 250, result_ms_max: 15_000, time_to_live_ms: 3_000 }
    }
}

impl PaceSettings {
    /// Longest wait for perception.
    pub fn answer_max(&self) -> Duration {
        Duration::from_millis(self.answer_ms_max)
    }

    /// Time after which a command is sent again.
    pub fn resend(&self) -> Duration {
        Duration::from_millis(self.resend_ms.max(10))
    }

    /// Time after which a command is given up.
    pub fn result_max(&self) -> Duration {
        Duration::from_millis(self.result_ms_max)
    }

    /// Time after which a command is void.
    pub fn time_to_live(&self) -> Duration {
        Duration::from_millis(self.time_to_live_ms)
    }
}

impl Config {
    /// As the library's configuration.
    pub fn planner(&self) -> PlannerConfig {
        let mut config = PlannerConfig {
            map_side_m: self.map.side_m,
            resolution_m: self.map.resolution_m,
            step_budget: self.mission.step_budget,
            // What is decided on an older one reaches the body expired.
            observation_age_max: self.pace.time_to_live(),
            ..PlannerConfig::default()
        };
        config.switches.kind = self.switches.kind.into();
        config.switches.recovery = self.switches.recovery.into();
        config.body.radius_m = self.body.radius_m;
        config.body.forward_m = self.body.forward_m;
        // An untouched default keeps its bits: degrees would move the last one.
        if self.body.turn_deg != config.body.turn_rad.to_degrees() {
            config.body.turn_rad = self.body.turn_deg.to_radians();
        }
        config
    }
}
