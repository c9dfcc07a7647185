//! `homing bench`: many episodes in this process.

use std::path::PathBuf;

use anyhow::{Context, bail};
use clap::Args;
use homing_benchmark::{BenchOptions, EpisodeRow, bench};
use homing_perception::onnx::FeatureChoice;
use homing_perception::onnx::registry::FOLDER;
use indicatif::{ProgressBar, ProgressStyle};

use super::{can_be_written, seeds};
use crate::Ended;
use crate::demo::Policy;
use crate::settings::FeatureArgs;

#[derive(Args)]
pub struct NavigationArgs {
    /// Seeds, as A..B: from A to B without B.
    #[arg(long, default_value = "1000..1100", value_parser = seeds)]
    seeds: std::ops::Range<u64>,
    /// How to explore while the goal has not been seen.
    #[arg(long, value_enum, default_value_t = Policy::Frontier)]
    policy: Policy,
    #[command(flatten)]
    features: FeatureArgs,
    /// The folder with the models and their manifest.json.
    #[arg(long, default_value = FOLDER)]
    models: PathBuf,
    /// Episodes side by side; 0 for one per core.
    #[arg(long, default_value_t = 0)]
    threads: usize,
    /// Write the whole report here.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

pub fn run(args: NavigationArgs) -> anyhow::Result<Ended> {
    if let Some(path) = &args.json {
        can_be_written(path)?;
    }
    let policy = match args.policy {
        Policy::Straight => homing_benchmark::Policy::Straight,
        Policy::Frontier => homing_benchmark::Policy::Frontier,
    };
    let mut features = FeatureChoice::listed(&args.features.extractor, args.features.matcher.as_deref(), &args.models)?;
    // Episodes side by side use the cores better than the threads of one.
    features.run.threads = 1;
    let options = BenchOptions { policy, features, threads: args.threads, ..BenchOptions::default() };
    let seeds: Vec<u64> = args.seeds.collect();
    if seeds.len() > 100_000 {
        bail!("{} episodes are more than 100000", seeds.len());
    }
    let style =
        ProgressStyle::with_template("{bar:30} {pos}/{len} episodes  [{elapsed}, about {eta} left]  {wide_msg}")
            .unwrap_or_else(|_| ProgressStyle::default_bar());
    let bar = ProgressBar::new(seeds.len() as u64).with_style(style);
    println!("{}", EpisodeRow::HEADER);
    let reached = std::sync::atomic::AtomicUsize::new(0);
    let report = bench(&seeds, &options, &|row: &EpisodeRow| {
        let n = reached.fetch_add(usize::from(row.score.success), std::sync::atomic::Ordering::Relaxed);
        bar.inc(1);
        // Hours of work are not lost with the report: every episode is said as it ends.
        bar.suspend(|| println!("{row}"));
        bar.set_message(format!("{} reached the goal", n + usize::from(row.score.success)));
    })?;
    bar.finish_and_clear();
    println!("\n{report}");
    if let Some(path) = &args.json {
        std::fs::write(path, report.to_json()?).with_context(|| format!("cannot write {}", path.display()))?;
    }
    Ok(Ended::Well)
}
