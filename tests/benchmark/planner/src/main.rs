//! The planning process of a benchmark: a robot's, in which oracles may stand for goal discovery and for the goal's pose.
//! The only process that links them.

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;

use anyhow::Context;
use clap::Parser;
use homing_core::GoalDiscovery;
use homing_planner_node::{Config as PlannerFile, Correction};
use homing_protocol::process::{self, ProcessArgs, Unusable};
use homing_sim::arena::{Arena, BodySize};
use homing_sim::episode::Episode;
use homing_sim::flat::Detail;
use homing_sim::oracle::{OracleDiscovery, perfect};
use serde::Deserialize;

/// Drives a simulated robot with the help of oracles, for a benchmark's upper bounds.
#[derive(Parser)]
#[command(name = "homing-benchmark-planner", version)]
struct Args {
    #[command(flatten)]
    process: ProcessArgs,
}

/// `benchmark_planner.toml`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Config {
    /// A planner's own file.
    #[serde(default)]
    planner: PlannerFile,
    /// What the oracles know and do.
    oracle: OracleSettings,
}

/// `[oracle]`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct OracleSettings {
    /// The episode, as JSON.
    episode: PathBuf,
    /// Oracle-GD explores.
    #[serde(default)]
    discovery: Part,
    /// Oracle-LM-Pose says where a goal is that perception has found.
    #[serde(default)]
    goal_pose: Part,
}

/// Who plays a part.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Part {
    /// What a robot has.
    #[default]
    Own,
    /// An oracle.
    Oracle,
}

fn main() -> ExitCode {
    process::run(&Args::parse().process, run)
}

#[tokio::main]
async fn run(config: Config) -> anyhow::Result<()> {
    let Config { planner, oracle } = config;
    let episode = read(&oracle.episode).map_err(|e| Unusable::new(std::io::Error::other(format!("{e:#}"))))?;
    let discovery: Box<dyn GoalDiscovery> = match oracle.discovery {
        Part::Own => planner.policy.build(),
        Part::Oracle => {
            let body = BodySize { radius_m: planner.body.radius_m, ..BodySize::default() };
            let arena = Arc::new(Arena::load_as(&episode.scene, body, Detail::Shape)?);
            Box::new(OracleDiscovery::new(&arena, &episode)?)
        }
    };
    let correction = (oracle.goal_pose == Part::Oracle).then(|| -> Correction {
        Box::new(move |estimate, seen| {
            perfect(estimate, &episode, &seen.odometry.t_odom_base.planar(), &seen.t_base_camera)
        })
    });
    homing_planner_node::run(planner, discovery, correction).await
}

fn read(path: &std::path::Path) -> anyhow::Result<Episode> {
    let text = std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    serde_json::from_str(&text).with_context(|| format!("{} is not an episode", path.display()))
}
