//! From what the robot sees and what perception says about the goal to the next action.
//!
//! The pipeline of SLING (section 3) on a metric map: [`Planner::step`] remembers odometry, integrates depth into an
//! occupancy grid, marks what blocked the body, fuses goal estimates where their images were taken, switches between
//! goal discovery and last-mile navigation, plans with Fast Marching and picks one discrete action.
//!
//! Everything is a pure function of the events it is told: no clock, no randomness, no threads, no input or output.
//! The same events give the same actions, bit for bit, on every machine.

mod angles;
mod arrival;
mod config;
pub mod discovery;
mod event;
mod evidence;
mod fmm;
mod goal_filter;
mod hypothesis;
mod ladder;
mod local;
mod mapper;
mod planner;
mod progress;
mod projection;
mod route;
mod steering;
mod switches;
mod terrain;
pub mod visual_target;

pub use arrival::ArrivalConfig;
pub use config::{BlindPolicy, BodyConfig, ConfigError, PlannerConfig, UnknownCells};
pub use discovery::{Frontier, FrontierConfig, RandomGoal, Straight};
pub use event::{Mission, Perception, PlannerObservation, StepEvent};
pub use evidence::Evidence;
pub use fmm::{Marcher, Until};
pub use goal_filter::{Doubt, FilterConfig, GoalFilter, Joined, Measurement, Sightline};
pub use hypothesis::Hypothesis;
pub use ladder::{Climb, LadderConfig, Standing};
pub use local::{LocalChoice, LocalPlanner};
pub use mapper::{Integrated, Mapper, MapperConfig};
pub use planner::Planner;
pub use route::{NoPath, Route, RoutePlanner};
pub use switches::{Recovery, SwitchConfig, SwitchKind, Verdict};
pub use terrain::{Room, Terrain, Window};
