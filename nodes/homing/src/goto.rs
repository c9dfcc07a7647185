//! `homing goto`: a photo for a robot that is running.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use homing_protocol::Session;
use homing_protocol::navigate::Outcome;
use homing_protocol::session::{DEFAULT_ENDPOINT, Link, SessionConfig};
use serde_json::json;

use crate::mission::{self, Watched};
use crate::verdict::outcome_name;
use crate::{Ended, photo};

/// Sends a photo to a running robot and waits until it is there.
#[derive(Args)]
pub struct GotoArgs {
    /// PNG or JPEG.
    photo: PathBuf,
    /// Horizontal field of view of the photo's camera, degrees; default: from the file's EXIF, else 66.
    #[arg(long, value_parser = photo::field_of_view)]
    hfov_deg: Option<f64>,
    /// Where the robot listens.
    #[arg(long, default_value = DEFAULT_ENDPOINT)]
    connect: String,
    /// Namespace of the robot, if it has one.
    #[arg(long, default_value = "")]
    namespace: String,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
}

#[tokio::main]
pub async fn run(args: GotoArgs) -> anyhow::Result<Ended> {
    let photo = photo::read(&args.photo, args.hfov_deg)?;
    let mut config = SessionConfig::new("operator", Link::Connect(vec![args.connect.clone()]));
    config.namespace.clone_from(&args.namespace);
    config.connect_timeout = Duration::from_secs(5);
    let session = Session::open(&config)?;
    let bar = mission::bar();
    let watched = mission::drive(&session, &photo, &bar, || Ok(())).await;
    bar.finish_and_clear();
    session.close();
    let report = match watched? {
        Watched::Ended(report) => report,
        Watched::Interrupted => {
            eprintln!("interrupted: the robot was told to stop");
            return Ok(Ended::Interrupted);
        }
        Watched::Unconfirmed => {
            eprintln!("interrupted: the planner did not confirm, THE ROBOT MAY STILL BE DRIVING");
            return Ok(Ended::Interrupted);
        }
    };
    let success = report.outcome == Outcome::Arrived;
    if args.json {
        println!(
            "{}",
            json!({"success": success, "planner": outcome_name(&report.outcome), "steps": report.steps,
            "path_length_m": report.path_length_m, "reason": report.message})
        );
    } else {
        println!(
            "{}: {} ({} steps, {:.2} m driven)",
            if success { "Arrived" } else { "Not reached" },
            report.message,
            report.steps,
            report.path_length_m
        );
    }
    Ok(if success { Ended::Well } else { Ended::Missed })
}
