//! The planning process: observations and goal estimates in, motion commands out.

mod config;
mod drive;
mod links;
mod moment;

use std::process::ExitCode;

use clap::Parser;
use homing_planner::Planner;
use homing_protocol::Session;
use homing_protocol::navigate::NavigateServer;
use homing_protocol::process::{self, ProcessArgs, Unusable};

use crate::config::Config;
use crate::drive::Driver;
use crate::links::Links;

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
    let planner = Planner::new(config.planner(), config.policy.build()).map_err(Unusable::new)?;
    let session = Session::open(&config.session.session("planner"))?;
    let links = Links::open(&session)?;
    let missions = NavigateServer::announce(&session)?;
    let stop = process::termination()?;
    tracing::info!(policy = planner.policy(), "planner is ready");

    let mut driver = Driver::new(planner, config, links, missions);
    tokio::pin!(stop);
    loop {
        tokio::select! {
            () = &mut stop => break,
            () = driver.hear() => {}
        }
        tokio::task::block_in_place(|| driver.act(&session))?;
    }
    // The robot stands before its planner leaves.
    driver.leave();
    tokio::time::sleep(std::time::Duration::from_millis(150)).await;
    session.close();
    Ok(())
}
