//! `homing bench visual-target`: the table of the paper "Visual Target Navigation", by one command.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use anyhow::Context;
use clap::Args;
use homing_benchmark::visual_target::{
    Difficulty, Options, PairRun, PairRuns, PairSpec, Pipeline, Progress, Report, Solver, TargetPair, bench,
    contact_sheet,
};
use homing_perception::onnx::FeatureChoice;
use homing_perception::onnx::registry::FOLDER;
use homing_sim::Viewpoint;
use homing_sim::views::OVERLAP_MIN;
use indicatif::{ProgressBar, ProgressStyle};

use super::can_be_written;
use crate::Ended;
use crate::photo::{field_of_view, png};

const SEED: u64 = 300_000;
const HFOV_DEG: f64 = 120.0;

/// Leads a robot from a view to another view of the same flat, without map or planner, and prints the table of the paper
/// "Visual Target Navigation" with its own figures beside.
///
/// Of each of three difficulties 20 pairs of views are drawn, at the paper's mean distances and headings. From the start
/// view the pose of the target view is estimated, and the robot is put there (one step), or put there and looks again
/// (multi-step); without depth it goes unit steps in the estimated direction. Each is done with R2D2-like, our own and
/// SIFT features. Last the whole planner is let loose with our own: it searches for what it does not see at first.
/// Success is ending within 0.5 m and 10 degrees.
#[derive(Args)]
pub struct VisualTargetArgs {
    /// Pairs of each difficulty.
    #[arg(long, default_value_t = 20, value_parser = clap::value_parser!(u16).range(1..=1000))]
    pairs: u16,
    /// Seed of the first flat; each pair has a flat of its own.
    #[arg(long, default_value_t = SEED)]
    seed: u64,
    /// Horizontal field of view of the camera that takes both views, degrees; the paper does not state its own.
    #[arg(long, default_value_t = HFOV_DEG, value_name = "DEG", value_parser = field_of_view)]
    hfov_deg: f64,
    /// Least share of either view that the other must see; the paper assumes "some overlapping region".
    #[arg(long, default_value_t = OVERLAP_MIN, value_name = "SHARE")]
    overlap_min: f64,
    /// The folder with the models and their manifest.json.
    #[arg(long, default_value = FOLDER)]
    models: PathBuf,
    /// Pairs side by side; 0 for one per core.
    #[arg(long, default_value_t = 0)]
    threads: usize,
    /// Write the whole report here, as JSON.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Write report.json and views.png here: start, target and final view of a success and a failure of each difficulty.
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
}

pub fn run(args: VisualTargetArgs) -> anyhow::Result<Ended> {
    // Known before the minutes are spent: can the report be written?
    if let Some(folder) = &args.out {
        std::fs::create_dir_all(folder).with_context(|| format!("cannot write {}", folder.display()))?;
    }
    for path in args.json.iter().cloned().chain(args.out.iter().map(|folder| folder.join("report.json"))) {
        can_be_written(&path)?;
    }
    let camera = Viewpoint { hfov_rad: args.hfov_deg.to_radians(), ..Viewpoint::default() };
    let pairs = PairSpec { n_each: usize::from(args.pairs), seed: args.seed, camera, overlap_min: args.overlap_min };
    let options = Options { pairs, pipelines: pipelines(&args.models), threads: args.threads };
    let bar = ProgressBar::new(3 * u64::from(args.pairs)).with_style(style()).with_message("drawing pairs");
    let n_drawn = AtomicU64::new(0);
    let report = bench(&options, &|progress| match progress {
        Progress::Drawn(_) => {
            bar.inc(1);
            if n_drawn.fetch_add(1, Ordering::Relaxed) + 1 == 3 * u64::from(args.pairs) {
                bar.reset();
                bar.set_message("looking");
            }
        }
        Progress::Ran(runs) => {
            bar.inc(1);
            // The minutes are not lost with the table: every pair is said as it ends.
            bar.suspend(|| println!("{}", line(&options.pipelines, runs)));
        }
    })?;
    bar.finish_and_clear();
    println!("{report}");
    write(&args, &options, &report)?;
    Ok(Ended::Well)
}

/// The paper's pairs, so many of each difficulty, for whoever wants them beside other tables: the report goes to `json`.
pub fn measure(n_each: u16, models: &Path, threads: usize, json: &Path) -> anyhow::Result<()> {
    let args = VisualTargetArgs {
        pairs: n_each,
        seed: SEED,
        hfov_deg: HFOV_DEG,
        overlap_min: OVERLAP_MIN,
        models: models.to_owned(),
        threads,
        json: Some(json.to_owned()),
        out: None,
    };
    run(args).map(drop)
}

/// One pair: what it is, and what came of it by pipeline: one step, multi-step, colour alone, planner.
fn line(pipelines: &[Pipeline], (pair, runs): &PairRuns) -> String {
    let mark = |run: &PairRun| if run.success { '+' } else { '-' };
    let mut runs = runs.iter();
    let each = pipelines.iter().map(|pipeline| {
        let marks = runs.by_ref().take(pipeline.ways().len()).map(mark).collect::<String>();
        format!("  {} {marks}", pipeline.name)
    });
    format!(
        "{:8} flat {} {:5.2} m {:4.0} deg, overlap {:3.0} %:{}",
        pair.difficulty.name(),
        pair.flat,
        pair.distance_m(),
        pair.heading_deg(),
        100.0 * pair.overlap,
        each.collect::<String>()
    )
}

/// The rows that are tried with the planner, too.
const OURS: &str = "ours";

/// Features of a row, by what they are called in the manifest.
const FEATURES: [(&str, &str, &str, Solver); 3] = [
    ("R2D2-like, EPnP", "homing-r2d2", "mutual-nearest", Solver::Papers),
    (OURS, "homing-extractor", "homing-matcher-accurate", Solver::Ours),
    ("SIFT", "sift", "mutual-nearest", Solver::Ours),
];

/// All rows; those whose model is missing are left out with a word.
fn pipelines(models: &Path) -> Vec<Pipeline> {
    let mut pipelines = Vec::new();
    for (name, extractor, matcher, solver) in FEATURES {
        match features(extractor, matcher, models) {
            Ok(features) => pipelines.push(Pipeline { name: name.to_owned(), features, solver, planner: name == OURS }),
            Err(cause) => eprintln!("the rows \"{name}\" are left out: {cause:#}"),
        }
    }
    pipelines
}

fn features(extractor: &str, matcher: &str, models: &Path) -> anyhow::Result<FeatureChoice> {
    let mut features = FeatureChoice::listed(extractor, Some(matcher), models)?;
    // Pairs side by side use the cores better than the threads of one.
    features.run.threads = 1;
    if features.uses_models() {
        features.runtime()?;
    }
    Ok(features)
}

fn write(args: &VisualTargetArgs, options: &Options, report: &Report) -> anyhow::Result<()> {
    let json = report.to_json()?;
    if let Some(path) = &args.json {
        std::fs::write(path, &json).with_context(|| format!("cannot write {}", path.display()))?;
    }
    let Some(folder) = &args.out else { return Ok(()) };
    let shown = shown(report);
    let file = png(&contact_sheet(&shown, &options.pairs.camera)?)?;
    for (name, bytes) in [("report.json", json.as_bytes()), ("views.png", &file)] {
        std::fs::write(folder.join(name), bytes)
            .with_context(|| format!("cannot write {name} in {}", folder.display()))?;
    }
    println!("\n{}: start, target and final view, from left to right", folder.join("views.png").display());
    for (pair, run) in shown {
        println!(
            "  {} in flat {}, overlap {:.0} %: {}, ended {:.2} m and {:.1} deg off",
            pair.difficulty.name(),
            pair.flat,
            100.0 * pair.overlap,
            if run.success { "reached" } else { "not reached" },
            run.final_distance_m,
            run.final_heading_deg
        );
    }
    Ok(())
}

/// The first success and the first failure of each difficulty, by the second row of our own features or the last of all.
fn shown(report: &Report) -> Vec<(&TargetPair, &PairRun)> {
    let ours = report.methods.iter().find(|m| m.name.starts_with("ours, multi")).or(report.methods.last());
    let Some(ours) = ours else { return Vec::new() };
    let runs: Vec<(&TargetPair, &PairRun)> = report.pairs.iter().zip(&ours.runs).collect();
    let first = |difficulty: Difficulty, success: bool| {
        runs.iter().find(move |(pair, run)| pair.difficulty == difficulty && run.success == success).copied()
    };
    Difficulty::ALL.into_iter().flat_map(|d| [first(d, true), first(d, false)]).flatten().collect()
}

fn style() -> ProgressStyle {
    ProgressStyle::with_template("{bar:30} {pos}/{len} pairs  [{elapsed}, about {eta} left]  {wide_msg}")
        .unwrap_or_else(|_| ProgressStyle::default_bar())
}
