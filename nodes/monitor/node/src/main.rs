//! The monitoring process: hears everything, shows and records it, delays nobody.

mod config;
mod hear;
mod still;

use std::process::ExitCode;
use std::time::Duration;

use anyhow::Context;
use clap::Parser;
use homing_core::PlanarPose;
use homing_monitor::{Recorder, RecorderConfig, Update};
use homing_protocol::Session;
use homing_protocol::process::{self, ProcessArgs};

use crate::config::{Config, Truth};
use crate::hear::Ears;
use crate::still::Still;

/// Shows a robot's way to a photo, live and recorded.
#[derive(Parser)]
#[command(name = "homing-monitor", version)]
struct Args {
    #[command(flatten)]
    process: ProcessArgs,
}

/// The longest wait for the recording to reach the disk.
const FINISH_MAX: Duration = Duration::from_secs(20);

fn main() -> ExitCode {
    process::run(&Args::parse().process, run)
}

#[tokio::main]
async fn run(config: Config) -> anyhow::Result<()> {
    let recorder = Recorder::new(recorder_config(&config))?;
    if let Some(url) = recorder.url() {
        tracing::info!(url, "viewers connect here");
    }
    let session = Session::open(&config.session.session("monitor"))?;
    let mut still = Still::new(config.picture.clone());
    if let Some(truth) = config.truth.as_deref().map(read_truth).transpose()? {
        let [x_m, y_m, yaw_rad] = truth.goal;
        let shortest: Vec<(f64, f64)> = truth.shortest_path.iter().map(|p| (p[0], p[1])).collect();
        recorder.offer(Update::TruthGoal(PlanarPose { x_m, y_m, yaw_rad }));
        recorder.offer(Update::ShortestPath(shortest.clone()));
        still.truth(PlanarPose { x_m, y_m, yaw_rad }, shortest);
    }
    let mut ears = Ears::open(&session)?;
    let stop = process::termination()?;
    tracing::info!("the monitor is ready");

    tokio::pin!(stop);
    loop {
        tokio::select! {
            () = &mut stop => break,
            heard = ears.hear(&recorder, &mut still) => if let Err(cause) = heard { tracing::warn!("ignored: {cause:#}") },
        }
    }
    let status = tokio::task::block_in_place(|| recorder.finish(FINISH_MAX));
    for (kind, dropped) in &status.dropped {
        tracing::info!(?kind, dropped, "updates gave way");
    }
    session.close();
    match status.error() {
        Some(error) => anyhow::bail!("the recording is incomplete: {error}"),
        None => Ok(()),
    }
}

fn recorder_config(config: &Config) -> RecorderConfig {
    let mut recorder = RecorderConfig {
        recording: config.recording.clone(),
        serve: config.serve,
        viewer: config.viewer.clone(),
        ..RecorderConfig::default()
    };
    if config.robot_radius_m > 0.0 {
        recorder.robot_radius_m = config.robot_radius_m;
    }
    recorder
}

fn read_truth(path: &std::path::Path) -> anyhow::Result<Truth> {
    let text = std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    serde_json::from_str(&text).with_context(|| format!("{} is not a truth file", path.display()))
}
