//! What is tried in an episode: a goal-discovery policy, the planner's settings, and what an oracle does in their stead.

use std::sync::Arc;

use homing_core::GoalDiscovery;
use homing_planner::{Frontier, PlannerConfig, RandomGoal, Straight};
use homing_sim::arena::Arena;
use homing_sim::episode::Episode;
use homing_sim::oracle::OracleDiscovery;
use homing_sim::simulator::SimConfig;
use serde::{Deserialize, Serialize};

use crate::RunError;

/// Goal-discovery policies.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Policy {
    /// Straight ahead, right when blocked (SLING's simplest).
    Straight,
    /// To where most of what was never looked at comes into sight.
    #[default]
    Frontier,
    /// To places drawn at random from the map (modular image-goal navigation's Ours-RP).
    RandomGoal,
    /// Along the shortest path, which it knows (SLING's Oracle-GD).
    Oracle,
}

impl Policy {
    /// A fresh policy for one episode.
    ///
    /// # Errors
    /// [`RunError::Goal`] when an oracle is to lead to a goal that cannot be reached.
    pub fn build(self, arena: &Arc<Arena>, episode: &Episode) -> Result<Box<dyn GoalDiscovery>, RunError> {
        Ok(match self {
            Policy::Straight => Box::new(Straight::new()),
            Policy::Frontier => Box::new(Frontier::default()),
            Policy::RandomGoal => Box::new(RandomGoal::new(0)),
            Policy::Oracle => Box::new(OracleDiscovery::new(arena, episode)?),
        })
    }
}

/// Who says where the goal is, once perception has found it.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum GoalPose {
    /// Perception.
    #[default]
    Estimated,
    /// The truth (SLING's Oracle-LM-Pose).
    Oracle,
}

/// Who drives the last mile.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LastMile {
    /// The planner.
    #[default]
    Driven,
    /// The robot is put where the planner believes the goal (SLING's Oracle-LP).
    Teleported,
}

/// What is tried.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trial {
    /// Goal discovery.
    pub policy: Policy,
    /// The planner's settings.
    pub planner: PlannerConfig,
    /// The robot, its sensors and their faults.
    pub sim: SimConfig,
    /// Oracle-LM-Pose.
    pub goal_pose: GoalPose,
    /// Oracle-LP.
    pub last_mile: LastMile,
}
