//! Oracles: parts of a navigation system that know the truth, for the upper bounds of SLING's table 2. They stand behind
//! the same seams as the parts they replace. Only benchmarks link them: no node of a robot may name this crate.
//!
//! An oracle knows the episode, and where the odometry began; where the robot is, it takes from the odometry. So it needs
//! no channel that a robot does not have, and decides the same in one process and over the network. With noisy odometry it
//! errs as the odometry does.

mod discovery;
mod last_mile;

use homing_core::{Base, Odom, PlanarPose, Transform};

use crate::episode::Episode;
use crate::scene::World;

pub use discovery::OracleDiscovery;
pub use last_mile::{landing, perfect};

/// A pose of the odometry frame in the world, on the floor.
fn in_world(episode: &Episode, pose_odom: &PlanarPose) -> PlanarPose {
    let t_world_odom: Transform<World, Odom> = PlanarPose::from(episode.start).to_transform();
    let t_odom_base: Transform<Odom, Base> = pose_odom.to_transform();
    (t_world_odom * t_odom_base).planar()
}
