//! A recorded body: plays RGB-D frames on the topics of a robot, in lockstep with perception.

mod config;
mod play;

use std::process::ExitCode;

use clap::Parser;
use homing_protocol::Session;
use homing_protocol::process::{self, ProcessArgs};
use homing_robot::replay::{Recording, ReplayBody};

use crate::config::Config;

/// Plays a recording as if a robot were driving: the same topics, real images, nothing to drive.
#[derive(Parser)]
#[command(name = "homing-robot", version)]
struct Args {
    #[command(flatten)]
    process: ProcessArgs,
}

fn main() -> ExitCode {
    process::run(&Args::parse().process, run)
}

#[tokio::main]
async fn run(config: Config) -> anyhow::Result<()> {
    let stop = process::termination()?;
    let session = Session::open(&config.session.body())?;
    let recording = Recording::open_with(&config.recording, config.rig.as_deref())?;
    let frames = if config.frames.is_empty() { recording.numbers().collect() } else { config.frames };
    let body = ReplayBody::with_playlist(recording, frames)?;
    tokio::select! {
        played = play::run(&session, body, config.answers) => played?,
        () = stop => {}
    }
    session.close();
    Ok(())
}
