//! The process's TOML file.

use std::net::SocketAddr;
use std::path::PathBuf;

use homing_protocol::process::SessionSettings;
use serde::Deserialize;

/// `monitor.toml`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// Network.
    pub session: SessionSettings,
    /// Record into this .rrd file.
    pub recording: Option<PathBuf>,
    /// Serve viewers here; `rerun rerun+http://HOST:PORT/proxy` connects.
    pub serve: Option<SocketAddr>,
    /// Start this viewer program.
    pub viewer: Option<PathBuf>,
    /// Draw the episode into this PNG when its summary arrives.
    pub picture: Option<PathBuf>,
    /// What a simulator knows of the episode (JSON, odometry frame); drawn in colours of its own.
    pub truth: Option<PathBuf>,
    /// Radius of the robot on the map, metres; 0 takes the default.
    pub robot_radius_m: f64,
}

/// The file named by `truth`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Truth {
    /// x, y (m) and yaw (rad) of the base where the photo was taken.
    pub goal: [f64; 3],
    /// Points of the shortest path, metres.
    pub shortest_path: Vec<[f64; 2]>,
}
