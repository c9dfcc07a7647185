//! Goal-discovery policies, one file each (SLING 3.2). The seam is [`homing_core::GoalDiscovery`].

mod coverage;
mod frontier;
mod random_goal;
mod straight;

pub use frontier::{Frontier, FrontierConfig};
pub use random_goal::RandomGoal;
pub use straight::Straight;
