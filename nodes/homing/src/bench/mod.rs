//! `homing bench`: what is measured in this process, as fast as the machine goes. Without a subcommand: navigation.

mod configuration;
mod navigation;
mod perception;
mod processes;
mod recorded;
mod tables;
mod visual_target;

use std::path::Path;

use anyhow::Context;
use clap::{Args, Subcommand};

use crate::Ended;

/// Runs one curved episode of 3 to 10 m in the flat of each seed, and reports success, SPL and final errors.
///
/// The libraries are those of the processes, called in lockstep without the network: the same decisions, faster. Of each
/// episode, as it ends: won or not, steps, way driven and shortest, SPL, distance and heading left at the end; the steps at
/// which the goal first came into view and was first found; right and wrong estimates, and steps with a wrong goal in mind.
///
/// `homing bench perception` measures the eyes alone, `homing bench visual-target` a robot that has nothing but them.
#[derive(Args)]
#[command(args_conflicts_with_subcommands = true)]
pub struct BenchArgs {
    #[command(subcommand)]
    what: Option<What>,
    #[command(flatten)]
    navigation: navigation::NavigationArgs,
}

#[derive(Subcommand)]
enum What {
    Perception(Box<perception::PerceptionArgs>),
    /// From a view to another view of the same flat, without a map: the table of the paper "Visual Target Navigation".
    VisualTarget(visual_target::VisualTargetArgs),
    Tables(Box<tables::TablesArgs>),
}

pub fn run(args: BenchArgs) -> anyhow::Result<Ended> {
    match args.what {
        None => navigation::run(args.navigation),
        Some(What::Perception(args)) => perception::run(*args),
        Some(What::VisualTarget(args)) => visual_target::run(args),
        Some(What::Tables(args)) => tables::run(*args),
    }
}

pub fn seeds(text: &str) -> Result<std::ops::Range<u64>, String> {
    let parse = || {
        let (from, to) = text.split_once("..")?;
        Some(from.trim().parse().ok()?..to.trim().parse().ok()?)
    };
    match parse() {
        Some(range) if range.start < range.end => Ok(range),
        Some(_) => {
            Err(format!("{text:?} is empty: the last seed is not among them, as in 1000..1001 for seed 1000 alone"))
        }
        _ => Err(format!("{text:?} is not a range of seeds such as 1000..1100")),
    }
}

/// Fails if a file cannot be written: known before the hours are spent.
fn can_be_written(path: &Path) -> anyhow::Result<()> {
    std::fs::File::options()
        .create(true)
        .append(true)
        .open(path)
        .map(drop)
        .with_context(|| format!("cannot write {}", path.display()))
}
