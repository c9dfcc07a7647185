//! `homing bench tables`: the papers' tables, beside ours.

mod report;

use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::{Context, bail};
use clap::{Args, ValueEnum};
use homing_benchmark::clip::ClipFolder;
use homing_benchmark::suite::run::GoOn;
use homing_benchmark::suite::{
    self, Amounts, Course, EpisodeRef, Header, InProcess, LayCourse, Plan, Row, RunOptions, Shard, Store,
};
use homing_benchmark::tables::LAYOUTS;
use homing_benchmark::{EpisodeRecord, RunError};
use homing_perception::onnx::FeatureChoice;
use homing_perception::onnx::registry::FOLDER;
use homing_sim::episode::Level;
use homing_sim::folds::Split;
use indicatif::{ProgressBar, ProgressStyle};

use super::processes::Processes;
use super::visual_target;
use crate::Ended;
use crate::settings::FeatureArgs;

/// Runs what SLING's, modular image-goal navigation's and visual target navigation's tables ask for, on episodes of our own
/// and on real layouts, and writes the report: published figures beside ours.
///
/// Every episode is kept as it ends. A run that is interrupted or killed goes on where it was when it is started again.
#[derive(Args)]
pub struct TablesArgs {
    /// One episode for each cell of the tables: some minutes.
    #[arg(long)]
    quick: bool,
    /// Where results and report are kept; a run with the same settings goes on there.
    #[arg(long, default_value = "runs/tables", value_name = "FOLDER")]
    out: PathBuf,
    /// Episodes for each level of the headline rows.
    #[arg(long, value_name = "N")]
    headline: Option<usize>,
    /// Episodes for each level of the other rows.
    #[arg(long, value_name = "N")]
    others: Option<usize>,
    /// Habitat episode files (ImageNav, InstanceImageNav or NRNS; .json or .json.gz) to run, too, as the set "layouts".
    #[arg(long, value_name = "FOLDER")]
    episodes: Option<PathBuf>,
    /// Where their scenes are, .glb files or navigability maps, if not beside them.
    #[arg(long, value_name = "FOLDER", requires = "episodes")]
    scenes: Option<PathBuf>,
    /// Episodes of each of their scenes and levels; all without it.
    #[arg(long, value_name = "N", requires = "episodes")]
    per_scene: Option<usize>,
    /// Only these rows (see the report for their names); may be given several times.
    #[arg(long = "row", value_name = "NAME")]
    rows: Vec<String>,
    /// Do only part I of N, from 0: the other parts run in other processes, on this folder.
    #[arg(long, value_name = "I/N", value_parser = shard, default_value = "0/1")]
    shard: Shard,
    #[command(flatten)]
    features: FeatureArgs,
    /// The folder with the models and their manifest.json.
    #[arg(long, default_value = FOLDER)]
    models: PathBuf,
    /// Episodes side by side; 0 for one per core.
    #[arg(long, default_value_t = 0)]
    threads: usize,
    /// On the 72 training flats instead of the 14 test flats: to see what is lost, and mend it, without spoiling the test.
    #[arg(long)]
    train: bool,
    /// Through body, perception and planner as processes of their own over zenoh, instead of in this one: the same actions
    /// and scores, slower.
    #[arg(long)]
    through_processes: bool,
    /// Only this difficulty; may be given several times.
    #[arg(long = "level", value_enum, value_name = "LEVEL")]
    levels: Vec<LevelName>,
    /// Only this set of episodes; may be given several times.
    #[arg(long = "set", value_name = "NAME")]
    sets: Vec<String>,
    /// No recordings of failed episodes.
    #[arg(long)]
    no_clips: bool,
    /// Run nothing; write the report of what there is.
    #[arg(long)]
    report: bool,
    /// Write no report.
    #[arg(long, conflicts_with = "report")]
    no_report: bool,
    /// Print the report as JSON instead of Markdown.
    #[arg(long)]
    json: bool,
}

/// Difficulties.
#[derive(Copy, Clone, Debug, PartialEq, Eq, ValueEnum)]
enum LevelName {
    /// Shortest path 1.5 to 3 m.
    Easy,
    /// 3 to 5 m.
    Medium,
    /// 5 to 10 m.
    Hard,
    /// Above 10 m.
    Extra,
}

impl LevelName {
    fn level(self) -> Level {
        match self {
            LevelName::Easy => Level::Easy,
            LevelName::Medium => Level::Medium,
            LevelName::Hard => Level::Hard,
            LevelName::Extra => Level::Extra,
        }
    }
}

fn shard(text: &str) -> Result<Shard, String> {
    let parse = || {
        let (index, of) = text.split_once('/')?;
        Some(Shard { index: index.parse().ok()?, of: of.parse().ok()? })
    };
    match parse() {
        Some(shard) if shard.index < shard.of => Ok(shard),
        _ => Err(format!("{text:?} is not a part such as 0/2 or 1/2")),
    }
}

pub fn run(args: TablesArgs) -> anyhow::Result<Ended> {
    let rows = chosen_rows(&args)?;
    if !args.report {
        if let Ended::Interrupted = run_episodes(&args, &rows)? {
            return Ok(Ended::Interrupted);
        }
        visual_targets(&args)?;
    }
    if !args.no_report {
        let (markdown, json) = report::write(&args.out, command(), notes())?;
        println!("{}", if args.json { json } else { markdown });
        eprintln!("written to {} as report.html, report.md and report.json", args.out.display());
    }
    Ok(Ended::Well)
}

/// Visual target navigation's pairs, unless they are there or were not asked for.
fn visual_targets(args: &TablesArgs) -> anyhow::Result<()> {
    let file = args.out.join(report::VISUAL_TARGET);
    let partial = !(args.rows.is_empty() && args.levels.is_empty() && args.sets.is_empty());
    if partial || file.exists() || args.shard != Shard::WHOLE {
        return Ok(());
    }
    let n_each = if args.quick { 1 } else { 20 };
    let part = args.out.join(format!("{}.part", report::VISUAL_TARGET));
    visual_target::measure(n_each, &args.models, args.threads, &part)?;
    std::fs::rename(&part, &file).with_context(|| format!("cannot write {}", file.display()))
}

fn command() -> String {
    let words: Vec<String> = std::env::args().skip(1).collect();
    format!("homing {}", words.join(" "))
}

fn notes() -> Vec<String> {
    let flats = Split::Test.flats();
    vec![
        format!(
            "Flats are generated; the {} test flats (seeds {} to {}) were never used to train or to tune.",
            flats.end - flats.start,
            flats.start,
            flats.end - 1
        ),
        "Robot: radius 0.18 m, camera 640x480, 120 degrees, 1.25 m high, level; steps of 0.25 m and 15 degrees; no sliding; 500 steps."
            .to_owned(),
    ]
}

fn chosen_rows(args: &TablesArgs) -> anyhow::Result<Vec<Row>> {
    let own = FeatureChoice::listed(&args.features.extractor, args.features.matcher.as_deref(), &args.models)?;
    let mut rows = suite::rows(&own, &args.models)?;
    if let Some(unknown) = args.rows.iter().find(|name| rows.iter().all(|r| r.name != name.as_str())) {
        let names: Vec<&str> = rows.iter().map(|r| r.name).collect();
        bail!("there is no row {unknown:?}; the rows are {}", names.join(", "));
    }
    rows.retain(|r| args.rows.is_empty() || args.rows.iter().any(|name| name == r.name));
    Ok(rows)
}

fn run_episodes(args: &TablesArgs, rows: &[Row]) -> anyhow::Result<Ended> {
    let preset = if args.quick { Amounts::QUICK } else { Amounts::FULL };
    let amounts =
        Amounts { headline: args.headline.unwrap_or(preset.headline), others: args.others.unwrap_or(preset.others) };
    let split = if args.train { Split::Train } else { Split::Test };
    let header = Header::new(rows.iter().map(|r| (r.name.to_owned(), r.config())).collect());
    let (store, done) = Store::open(&args.out, &header, args.shard)?;
    let mut whole = Plan::new(rows, amounts, split, &given(args)?);
    whole.keep(|task| {
        (args.levels.is_empty() || args.levels.iter().any(|l| l.level() == task.episode.level))
            && (args.sets.is_empty() || args.sets.contains(&task.set))
    });
    let n_whole = whole.len();
    let plan = whole.left(rows, &done, args.shard);
    eprintln!("{} of {n_whole} episodes to run; results are kept in {}", plan.len(), args.out.display());
    let style =
        ProgressStyle::with_template("{bar:30} {pos}/{len} episodes  [{elapsed}, about {eta} left]  {wide_msg}")
            .unwrap_or_else(|_| ProgressStyle::default_bar());
    let bar = ProgressBar::new(plan.len() as u64).with_style(style);
    let interrupted = interruption()?;
    let options = RunOptions {
        // Processes side by side would take each other's cores, and lockstep waits for the slowest.
        threads: if args.through_processes { 1 } else { args.threads },
        commit: env!("HOMING_COMMIT").to_owned(),
        clips: (!args.no_clips).then(|| ClipFolder(args.out.join("clips"))),
    };
    let tally = Mutex::new((0_usize, 0_usize));
    let processes = |row: &Row| -> Result<Box<dyn Course>, RunError> {
        Ok(Box::new(Processes::new(row, &args.features, args.out.join("processes"))?))
    };
    let in_process = |row: &Row| -> Result<Box<dyn Course>, RunError> { Ok(Box::new(InProcess::new(row)?)) };
    let lay: LayCourse<'_> = if args.through_processes { &processes } else { &in_process };
    suite::run(&plan, rows, &store, &options, lay, &|record| {
        say(&bar, &tally, record);
        if interrupted.load(Ordering::Relaxed) { GoOn::No } else { GoOn::Yes }
    })?;
    bar.finish_and_clear();
    if interrupted.load(Ordering::Relaxed) {
        eprintln!("interrupted; the same command goes on where this one stopped");
        return Ok(Ended::Interrupted);
    }
    Ok(Ended::Well)
}

/// The sets that the user gave.
fn given(args: &TablesArgs) -> anyhow::Result<Vec<(String, Vec<EpisodeRef>)>> {
    let Some(folder) = &args.episodes else { return Ok(Vec::new()) };
    let set = suite::sets::from_files(folder, args.scenes.as_ref().unwrap_or(folder))?;
    eprintln!("{}: {} episodes", folder.display(), set.episodes.len());
    for (reason, n) in &set.refused {
        eprintln!("  {n} left out: {reason}");
    }
    let per_scene = args.per_scene.or(args.quick.then_some(1)).unwrap_or(usize::MAX);
    Ok(vec![(LAYOUTS.to_owned(), suite::sets::thinned(&set.episodes, per_scene))])
}

fn say(bar: &ProgressBar, tally: &Mutex<(usize, usize)>, record: &EpisodeRecord) {
    let mut tally = tally.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    tally.0 += usize::from(record.strict.success);
    tally.1 += 1;
    bar.inc(1);
    let cause = record.cause.map_or("", |c| c.words());
    bar.suspend(|| {
        eprintln!(
            "{:<17} {:<14} {:<16} {:<10} {} {:3} steps, SPL {:.2}, {:.2} m {:.1} deg left, {:.0} s  {cause}",
            record.cell.row,
            record.cell.set,
            record.scene,
            record.episode_id,
            if record.strict.success { "won " } else { "lost" },
            record.strict.steps,
            record.strict.spl,
            record.strict.final_distance_m,
            record.strict.final_heading_error_deg,
            record.wall_s,
        );
    });
    bar.set_message(format!("{} of {} won", tally.0, tally.1));
}

/// True once the user wants it to end: the episodes that are under way end first.
fn interruption() -> anyhow::Result<&'static AtomicBool> {
    static ASKED: AtomicBool = AtomicBool::new(false);
    let runtime =
        tokio::runtime::Builder::new_current_thread().enable_all().build().context("cannot listen to signals")?;
    std::thread::spawn(move || {
        if runtime.block_on(tokio::signal::ctrl_c()).is_ok() {
            ASKED.store(true, Ordering::Relaxed);
            eprintln!("ending after the episodes that are under way; once more ends at once");
            if runtime.block_on(tokio::signal::ctrl_c()).is_ok() {
                std::process::exit(130);
            }
        }
    });
    Ok(&ASKED)
}
