//! The simulated body: a scene and a robot behind the topics a robot has.

mod config;
mod lockstep;
mod outgoing;
mod real_time;
mod world;

use std::process::ExitCode;
use std::time::Duration;

use clap::Parser;
use homing_protocol::Session;
use homing_protocol::process::{self, ProcessArgs};

use crate::config::{Config, Pace};
use crate::world::World;

/// Stands in for a robot: the same topics, a simulated body.
#[derive(Parser)]
#[command(name = "homing-sim", version)]
struct Args {
    #[command(flatten)]
    process: ProcessArgs,
}

fn main() -> ExitCode {
    process::run(&Args::parse().process, run)
}

#[tokio::main]
async fn run(config: Config) -> anyhow::Result<()> {
    // The port first: a taken one is known at once, before a scene is built.
    let session = Session::open(&config.session.body())?;
    let world = tokio::task::block_in_place(|| World::open(&config))?;
    match config.pace {
        Pace::Lockstep => lockstep::run(&session, world).await?,
        Pace::RealTime => {
            let period = Duration::from_secs_f64(1.0 / config.frame_rate_hz.clamp(0.1, 60.0));
            real_time::run(&session, world, period).await?;
        }
    }
    session.close();
    Ok(())
}
