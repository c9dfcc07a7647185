//! `homing bench perception`: how well the goal's pose is found, and what it costs.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use clap::{Args, ValueEnum};
use homing_benchmark::perception::{
    Class, MeasureOptions, Measured, PairSource, PerceptionReport, ReportPlan, Setup, SimulatedPairs, Unregistered,
    measure, plots, time_stages,
};
use homing_perception::onnx::registry::FOLDER;
use homing_robot::Recording;
use homing_sim::views::{Cameras, ViewSpec};
use indicatif::{ProgressBar, ProgressStyle};

use super::recorded::RecordedPairs;
use super::{can_be_written, configuration, seeds};
use crate::Ended;
use crate::settings::FeatureArgs;

/// Measure the eyes alone: on pairs of images, how well is the goal's pose found, and what does it cost?
///
/// One image of a pair is what the robot sees, with depth; the other is the photo it is shown. The pairs are views of
/// simulated flats or, with --rgbd, recorded frames. Printed for each configuration:
///
/// accuracy by class of pair: area under the curve of the pose error to 5, 10 and 20 degrees; shares within 0.25 m and 10
/// degrees, 0.1 m and 5, 0.1 m and 2, with 95 % intervals; medians. A pair without a pose has failed;
///
/// switches: how often a single estimate decides rightly between exploring and driving to the goal;
///
/// milliseconds per stage; and, beside the first configuration, the difference on the same pairs with its interval.
///
/// A default run estimates some 9,000 pairs of 1,400 views, which takes about four minutes for each configuration on two
/// free cores; --pairs 500 is enough for a first look.
#[derive(Args)]
#[command(after_long_help = EXAMPLES)]
pub struct PerceptionArgs {
    /// A configuration to measure, see below; give several to compare the others with the first.
    #[arg(long = "config", value_name = "CONFIGURATION", conflicts_with_all = ["extractor", "matcher"])]
    configs: Vec<String>,
    #[command(flatten)]
    features: FeatureArgs,
    /// The folder with the models and their manifest.json.
    #[arg(long, default_value = FOLDER)]
    models: PathBuf,
    /// Measure on this recording instead of on flats: a folder in 7-Scenes or Open3D layout.
    #[arg(long, value_name = "DIR")]
    rgbd: Option<PathBuf>,
    /// Calibration of the recording's colour and depth cameras, where depth is not registered to the colour: it will be. For
    /// 7-Scenes: nodes/robot/rigs/kinect_v1.toml
    #[arg(long, value_name = "FILE", requires = "rgbd")]
    rig: Option<PathBuf>,
    /// Of a recording: every tenth frame as start, with the goal so many original frames later.
    #[arg(long, value_name = "50,100", value_delimiter = ',', default_value = "50,100", requires = "rgbd")]
    gaps: Vec<u32>,
    /// Seeds of the flats, as A..B; as many of them as the pairs need.
    #[arg(long, default_value = "300000..302000", value_parser = seeds)]
    seeds: std::ops::Range<u64>,
    /// Pairs with the goal in view, and without, together: half of each. Those half in view come on top, and the last flat
    /// is measured to its end.
    #[arg(long, default_value_t = 6500, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pairs: u32,
    /// Views of each flat.
    #[arg(long, default_value_t = 16, value_parser = clap::value_parser!(u16).range(4..=200))]
    views: u16,
    /// What takes the views.
    #[arg(long, value_enum, default_value_t = CameraKind::Robot)]
    cameras: CameraKind,

    /// Depth as a cheap camera gives it: from a sensor beside the colour camera, with one focal length said for both, as in
    /// 7-Scenes
    #[arg(long, conflicts_with = "rgbd")]
    unregistered: bool,
    /// Flats side by side while accuracy is measured, on one thread each; 0 for one per core.
    #[arg(long, default_value_t = 0)]
    threads: usize,
    /// Threads of models and OpenCV while time is measured; 0 for one per core.
    #[arg(long, default_value_t = 0)]
    timing_threads: u16,
    /// Pairs timed, one after the other, once accuracy has been measured; 0 for none.
    #[arg(long, default_value_t = 60)]
    timing_pairs: usize,
    /// Write the figures here.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Write figures, pictures (SVG) and every single pair (JSON) into this folder.
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
}

const EXAMPLES: &str = "\
A configuration is EXTRACTOR[+MATCHER], and after commas: solver=lo-ransac | gravity |
epnp-ransac | sling-heading, keypoints=N, ratio=R, confidence=C, patches=P, gate=DEGREES, and last label=TEXT.
Extractor and matcher are names as `homing models` lists them, or CONTRACT=FILE.
Without a matcher: the one that goes with the extractor.

  homing bench perception --config sift --config homing --pairs 500
  homing bench perception --config homing --config sift,solver=epnp-ransac,label=papers \\
      --rgbd DIR --gaps 50,100 --out figures";

#[derive(Copy, Clone, Debug, PartialEq, Eq, ValueEnum)]
enum CameraKind {
    /// The robot's own: 640x480, 120 degrees, level, 1.25 m above the floor.
    Robot,
    /// One of its own for each view, 55 to 120 degrees, 0.4 to 1.6 m up, pitched and rolled: what models are trained on.
    Drawn,
}

pub fn run(args: PerceptionArgs) -> anyhow::Result<Ended> {
    args.json.as_deref().map(can_be_written).transpose()?;
    if let Some(folder) = &args.out {
        std::fs::create_dir_all(folder).with_context(|| format!("cannot create {}", folder.display()))?;
    }
    let setups = setups(&args)?;
    let mut task = Task::of(&args)?;
    let bar = ProgressBar::new(task.n_pairs as u64).with_style(style());
    let measured = measure(&*task.source, &setups, &task.options, &|n| bar.inc(n as u64))?;
    bar.set_message("measuring time");
    let stages = match args.timing_pairs {
        0 => Vec::new(),
        n => time_stages(&*task.source, &setups, threads(args.timing_threads)?, n)?,
    };
    bar.finish_and_clear();
    if measured.pairs.is_empty() {
        bail!("there are no pairs to measure: give more seeds or other gaps");
    }
    if args.rgbd.is_none() {
        let flats: BTreeSet<u64> = measured.pairs.iter().map(|p| p.cluster).collect();
        task.plan.set.push_str(&format!(": {} flats", flats.len()));
    }
    let mut report = PerceptionReport::new(&task.plan, &setups, &measured, &stages);
    report.peak_memory_mb = peak_memory_mb();
    print!("{report}");
    if let Some(path) = &args.json {
        write(path, &report.to_json()?)?;
    }
    if let Some(folder) = &args.out {
        write_folder(folder, &task.plan, &report, &measured)?;
    }
    Ok(Ended::Well)
}

fn setups(args: &PerceptionArgs) -> anyhow::Result<Vec<Setup>> {
    let of_features = || {
        let FeatureArgs { extractor, matcher } = &args.features;
        vec![matcher.as_ref().map_or(extractor.clone(), |matcher| format!("{extractor}+{matcher}"))]
    };
    let texts = if args.configs.is_empty() { of_features() } else { args.configs.clone() };
    let setups = texts.iter().map(|text| configuration::setup(text, &args.models)).collect::<Result<Vec<_>, _>>()?;
    for (i, setup) in setups.iter().enumerate() {
        if setups[..i].iter().any(|earlier| earlier.name == setup.name) {
            bail!("two configurations are called {:?}: tell them apart with ,label=TEXT", setup.name);
        }
    }
    Ok(setups)
}

/// What to measure on, and how much.
struct Task {
    source: Box<dyn PairSource>,
    options: MeasureOptions,
    plan: ReportPlan,
    n_pairs: usize,
}

impl Task {
    fn of(args: &PerceptionArgs) -> anyhow::Result<Self> {
        match &args.rgbd {
            Some(folder) => Self::recorded(args, folder),
            None => Self::simulated(args),
        }
    }

    fn simulated(args: &PerceptionArgs) -> anyhow::Result<Self> {
        let n_views = usize::from(args.views);
        let (cameras, words) = match args.cameras {
            CameraKind::Robot => (Cameras::ROBOT, "the robot's camera (640x480, 120 deg, level, 1.25 m up)"),
            CameraKind::Drawn => (Cameras::Drawn, "drawn cameras (640x480, 55 to 120 deg, pitched, rolled)"),
        };
        let pairs = SimulatedPairs { seeds: args.seeds.clone(), spec: ViewSpec::of_robot(n_views), cameras };
        let (source, depth): (Box<dyn PairSource>, _) = match args.unregistered {
            true => (Box::new(Unregistered(pairs)), ", depth not registered to colour"),
            false => (Box::new(pairs), ""),
        };
        let mut classes = vec![Class::Headline, Class::All];
        classes.extend(Class::by_overlap());
        classes.extend(Class::by_turn());
        classes.extend([Class::State { same: true }, Class::State { same: false }]);
        let n_pairs = args.pairs as usize;
        let threads = side_by_side(args.threads)?;
        Ok(Self {
            source,
            options: MeasureOptions { threads, n_decided: Some(n_pairs) },
            plan: ReportPlan {
                set: format!(
                    "simulated flats from seed {} on, {n_views} views each by {words}{depth}",
                    args.seeds.start
                ),
                classes,
                compared: vec![Class::Headline],
                with_switches: true,
                threads,
            },
            n_pairs,
        })
    }

    fn recorded(args: &PerceptionArgs, folder: &Path) -> anyhow::Result<Self> {
        /// Start frames are this many original frames apart, as in `homing replay`.
        const STRIDE: u32 = 10;
        let recording = Recording::open_with(folder, args.rig.as_deref())?;
        let source = RecordedPairs::new(recording, &args.gaps, STRIDE);
        let n_pairs = source.len();
        let gaps: Vec<Class> = args.gaps.iter().map(|&frames| Class::Apart(frames)).collect();
        let mut classes = gaps.clone();
        classes.push(Class::Headline);
        classes.extend(Class::by_overlap());
        classes.extend(Class::by_turn());
        let threads = side_by_side(args.threads)?;
        Ok(Self {
            source: Box::new(source),
            options: MeasureOptions { threads, n_decided: None },
            plan: ReportPlan {
                set: format!(
                    "recorded frames in {}{}",
                    folder.display(),
                    if args.rig.is_some() { ", depth registered to the colour" } else { "" }
                ),
                classes,
                compared: gaps,
                with_switches: false,
                threads,
            },
            n_pairs,
        })
    }
}

fn side_by_side(asked: usize) -> anyhow::Result<usize> {
    Ok(if asked > 0 { asked } else { std::thread::available_parallelism()?.get() })
}

fn threads(asked: u16) -> anyhow::Result<u16> {
    Ok(u16::try_from(side_by_side(asked.into())?)?)
}

fn write_folder(
    folder: &Path,
    plan: &ReportPlan,
    report: &PerceptionReport,
    measured: &Measured,
) -> anyhow::Result<()> {
    write(&folder.join("report.json"), &report.to_json()?)?;
    write(&folder.join("report.txt"), &report.to_string())?;
    write(&folder.join("pairs.json"), &serde_json::to_string(measured)?)?;
    for plot in plots(report, measured, &plan.compared[0])? {
        write(&folder.join(plot.name), &plot.svg)?;
    }
    println!("\nfigures, pictures and pairs are in {}", folder.display());
    Ok(())
}

fn write(path: &Path, text: &str) -> anyhow::Result<()> {
    std::fs::write(path, text).with_context(|| format!("cannot write {}", path.display()))
}

/// The most this process has held, as the kernel counts it.
fn peak_memory_mb() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    let kib: f64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kib * 1024.0 * 1e-6)
}

fn style() -> ProgressStyle {
    ProgressStyle::with_template("{bar:30} {pos}/{len} pairs  [{elapsed}, about {eta} left]  {wide_msg}")
        .unwrap_or_else(|_| ProgressStyle::default_bar())
}
