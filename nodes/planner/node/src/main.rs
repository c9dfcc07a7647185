//! The planning process of a robot.

use std::process::ExitCode;

use clap::Parser;
use homing_planner_node::Config;
use homing_protocol::process::{self, ProcessArgs};

/// Drives a robot to the place where a photo was taken.
#[derive(Parser)]
#[command(name = "homing-planner", version)]
struct Args {
    #[command(flatten)]
    process: ProcessArgs,
}

fn main() -> ExitCode {
    process::run(&Args::parse().process, run)
}

#[tokio::main]
async fn run(config: Config) -> anyhow::Result<()> {
    let discovery = config.policy.build();
    homing_planner_node::run(config, discovery, None).await
}
