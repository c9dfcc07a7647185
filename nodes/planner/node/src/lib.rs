//! A planner on the network: observations and goal estimates in, motion commands out. A library, so that a benchmark's
//! planner is this one with an oracle put in.

pub mod config;
mod drive;
mod links;
mod moment;

use std::time::Duration;

use homing_core::{GoalDiscovery, GoalEstimate};
use homing_planner::{Planner, PlannerObservation};
use homing_protocol::Session;
use homing_protocol::navigate::NavigateServer;
use homing_protocol::process::{self, Unusable};

pub use crate::config::Config;
use crate::drive::Driver;
use crate::links::Links;

/// What a benchmark may put in perception's place: a perfect estimate for one that was found.
pub type Correction = Box<dyn Fn(GoalEstimate, &PlannerObservation) -> GoalEstimate + Send>;

/// Plans and drives until the process is told to leave. `correction` sees every estimate of the present moment; a robot has
/// none.
///
/// # Errors
/// [`Unusable`] for a configuration that cannot work; else what the network says.
pub async fn run(
    config: Config,
    discovery: Box<dyn GoalDiscovery>,
    correction: Option<Correction>,
) -> anyhow::Result<()> {
    let planner = Planner::new(config.planner(), discovery).map_err(Unusable::new)?;
    let session = Session::open(&config.session.session("planner"))?;
    let links = Links::open(&session)?;
    let missions = NavigateServer::announce(&session)?;
    let stop = process::termination()?;
    tracing::info!(policy = planner.policy(), "planner is ready");

    let mut driver = Driver::new(planner, config, links, missions, correction);
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
    tokio::time::sleep(Duration::from_millis(150)).await;
    session.close();
    Ok(())
}
