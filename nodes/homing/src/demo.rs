//! `homing demo`: four processes take a simulated robot to the place of a photo.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use anyhow::{Context, bail};
use clap::{Args, ValueEnum};
use homing_core::PlanarPose;
use homing_privileged::{EPISODE_SUMMARY, GroundTruth};
use homing_protocol::convert::EncodedPhoto;
use homing_protocol::interfaces::homing_msgs::EpisodeSummary;
use homing_protocol::navigate::Outcome;
use homing_protocol::session::DEFAULT_ENDPOINT;
use homing_sim::episode::{self, GoalPlace};
use homing_sim::geodesic::GeodesicField;
use homing_sim::{Arena, BodySize, Episode, EpisodeSpec, NoisePreset, SceneRef};
use indicatif::{ProgressBar, ProgressStyle};

use crate::fleet::Fleet;
use crate::latency::Stopwatch;
use crate::meeting::{all_ready, join};
use crate::mission::{self, Watched};
use crate::run_folder::RunFolder;
use crate::scorer::Scorer;
use crate::settings::{
    FeatureArgs, MonitorFile, Network, PerceptionFile, PlannerFile, PlannerPace, SimFile, TruthFile,
};
use crate::verdict::{About, Verdict};
use crate::{Ended, photo};

/// Drives a simulated robot through a flat it has never seen, to the place of a photo.
///
/// Four processes meet over zenoh: the simulated body, perception, planner and monitor. The goal lies in another room, 5 to
/// 10 m of way from the start. Leaves a recording, a picture and the result in a folder of its own.
#[derive(Args)]
pub struct DemoArgs {
    /// Seed of the flat, the start and the goal.
    #[arg(long, default_value_t = 12)]
    seed: u64,
    /// A glTF 2.0 scene (.glb) instead of a generated flat.
    #[arg(long, value_name = "FILE.glb")]
    scene: Option<PathBuf>,
    /// A photo of your own to drive to; its true place is unknown, so there is no score.
    #[arg(long, value_name = "PHOTO")]
    goal: Option<PathBuf>,
    /// Horizontal field of view of that photo's camera, degrees.
    #[arg(long, requires = "goal", value_parser = photo::field_of_view)]
    hfov_deg: Option<f64>,
    /// How to explore while the goal has not been seen.
    #[arg(long, value_enum, default_value_t = Policy::Frontier)]
    policy: Policy,
    #[command(flatten)]
    features: FeatureArgs,
    /// Noise of the simulated robot: off, pose (odometry that drifts), pose-depth, all (wheels and colour too); published,
    /// published-depth (what the papers call so).
    #[arg(long, default_value_t, value_name = "NAME")]
    noise: NoisePreset,
    /// By the wall clock instead of in lockstep.
    #[arg(long)]
    realtime: bool,
    /// Open the rerun viewer and watch live.
    #[arg(long)]
    view: bool,
    /// Print the result as JSON, and nothing else, on stdout.
    #[arg(long)]
    json: bool,
    /// Where the processes meet.
    #[arg(long, default_value = DEFAULT_ENDPOINT)]
    endpoint: String,
    /// Folder for the results.
    #[arg(long, default_value = "runs")]
    out: PathBuf,
}

/// Goal-discovery policies.
#[derive(Copy, Clone, Debug, PartialEq, Eq, ValueEnum)]
pub enum Policy {
    /// Straight ahead, right when blocked.
    Straight,
    /// To the edges of what is known.
    Frontier,
}

impl Policy {
    pub fn name(self) -> &'static str {
        match self {
            Policy::Straight => "straight",
            Policy::Frontier => "frontier",
        }
    }
}

#[tokio::main]
pub async fn run(args: DemoArgs) -> anyhow::Result<Ended> {
    args.features.check()?;
    let viewer = args.view.then(viewer).transpose()?;
    let given = args.goal.as_deref().map(|path| photo::read(path, args.hfov_deg)).transpose()?;
    let bar = waiting("preparing the scene");
    let task = tokio::task::block_in_place(|| Task::draw(&args))?;
    let folder = RunFolder::create(&args.out, &format!("demo-seed-{}", args.seed))?;
    let photo = match given {
        Some(photo) => photo,
        None => task.photo()?,
    };
    folder.write(if photo.file.starts_with(&[0xff, 0xd8]) { "goal.jpg" } else { "goal.png" }, &photo.file)?;

    if bar.is_hidden() {
        eprintln!("seed {}; files in {}", args.seed, crate::run_folder::shown(&folder.file("")));
    }
    bar.set_message("starting four processes: body, perception, planner, monitor");
    let mut fleet = start(&args, &task, &folder, viewer)?;
    let session = join(&args.endpoint, &mut fleet).await?;
    let mut scorer = Scorer::open(&session)?;
    let mut stopwatch = Stopwatch::open(&session)?;
    let summary = session.publisher(&EPISODE_SUMMARY)?;
    all_ready(&session, &mut fleet).await?;
    bar.finish_and_clear();

    let bar = mission::bar();
    let watched = mission::drive(&session, &photo, &bar, || {
        scorer.listen();
        stopwatch.listen();
        still_possible(&mut fleet, &bar)
    })
    .await;
    bar.finish_and_clear();
    let report = match watched? {
        Watched::Ended(report) => report,
        Watched::Interrupted | Watched::Unconfirmed => {
            tokio::task::block_in_place(|| leave(&mut fleet));
            let kept = crate::run_folder::shown(&folder.file(""));
            eprintln!("interrupted: the robot stands; what was recorded is in {kept}");
            return Ok(Ended::Interrupted);
        }
    };

    scorer.hear_the_end(report.outcome == Outcome::Arrived).await;
    let score = if args.goal.is_some() { None } else { scorer.score(&task.arena, &task.episode) };
    let about = About {
        scene: task.arena.scene().name.clone(),
        seed: args.seed,
        policy: args.policy.name(),
        recording: folder.file("episode.rrd"),
        picture: folder.file("episode.png"),
    };
    let verdict = Verdict::new(&report, score.as_ref(), stopwatch.p50(), about);
    summary.publish(&message(&verdict))?;
    tokio::time::sleep(Duration::from_millis(500)).await;
    session.close();
    let closing = waiting("closing the recording");
    tokio::task::block_in_place(|| leave(&mut fleet));
    closing.finish_and_clear();
    let result = folder.write_json("result.json", &verdict)?;
    if args.json {
        println!("{}", serde_json::to_string(&verdict)?);
    } else {
        verdict.print(&result);
    }
    Ok(if verdict.success { Ended::Well } else { Ended::Missed })
}

/// The scene and the episode in it.
struct Task {
    arena: Arc<Arena>,
    episode: Episode,
}

impl Task {
    fn draw(args: &DemoArgs) -> anyhow::Result<Self> {
        let scene = match &args.scene {
            Some(path) => {
                let path = path.canonicalize().with_context(|| format!("the scene {}", path.display()))?;
                SceneRef::Glb { path }
            }
            None => SceneRef::Flat { seed: args.seed },
        };
        let arena = Arc::new(Arena::load(&scene, BodySize::default())?);
        let spec = EpisodeSpec { min_m: 5.0, max_m: 10.0, goal_place: GoalPlace::OtherRoom, ..EpisodeSpec::default() };
        let episode = episode::draw(&arena, args.seed, &spec)?;
        Ok(Self { arena, episode })
    }

    fn photo(&self) -> anyhow::Result<EncodedPhoto> {
        let image = self.episode.camera.photo(&self.arena, self.episode.goal)?;
        let file = photo::png(&image)?;
        Ok(EncodedPhoto { id: photo::name_of(&file), file, intrinsics: self.episode.camera.intrinsics()? })
    }

    fn goal_field(&self) -> anyhow::Result<GeodesicField> {
        Ok(GeodesicField::to(self.arena.space(), (self.episode.goal.x_m, self.episode.goal.y_m))?)
    }

    /// Goal and shortest path in the odometry frame, for the monitor.
    fn truth(&self) -> anyhow::Result<TruthFile> {
        let start = PlanarPose::from(self.episode.start);
        let at_start = GroundTruth {
            stamp: Default::default(),
            pose: start,
            start,
            path_length_m: 0.0,
            steps: 0,
            collisions: 0,
            done: false,
        };
        let goal = at_start.in_odom(self.episode.goal.into());
        let path = self.goal_field()?.path(start.x_m, start.y_m).unwrap_or_default();
        let in_odom = |p: &(f64, f64)| {
            let p = at_start.in_odom(PlanarPose { x_m: p.0, y_m: p.1, yaw_rad: 0.0 });
            [p.x_m, p.y_m]
        };
        Ok(TruthFile { goal: [goal.x_m, goal.y_m, goal.yaw_rad], shortest_path: path.iter().map(in_odom).collect() })
    }
}

fn start(args: &DemoArgs, task: &Task, folder: &RunFolder, viewer: Option<PathBuf>) -> anyhow::Result<Fleet> {
    let network = || Network::connect(&args.endpoint);
    let episode = folder.write_json("episode.json", &task.episode)?;
    let (pace, answer_ms_max) = if args.realtime { ("real_time", 500) } else { ("lockstep", 5_000) };
    let truth = match args.goal {
        Some(_) => None,
        None => Some(folder.write_json("truth.json", &task.truth()?)?),
    };
    let (noise, session) = (args.noise.name(), Network::listen(&args.endpoint));
    let sim = folder.write_toml("sim.toml", &SimFile { pace, noise, radius_m: None, episode, session })?;
    let perception = folder.write_toml("perception.toml", &PerceptionFile::new(&args.features, network()))?;
    let planner = PlannerFile {
        policy: args.policy.name(),
        switches: None,
        body: None,
        session: network(),
        pace: PlannerPace { answer_ms_max },
    };
    let planner = folder.write_toml("planner.toml", &planner)?;
    let monitor = MonitorFile {
        recording: folder.file("episode.rrd"),
        viewer,
        picture: Some(folder.file("episode.png")),
        truth,
        session: network(),
    };
    let monitor = folder.write_toml("monitor.toml", &monitor)?;
    let mut fleet = Fleet::default();
    fleet.start("body", "homing-sim", &sim, folder)?;
    fleet.start("monitor", "homing-monitor", &monitor, folder)?;
    fleet.start("perception", "homing-perception", &perception, folder)?;
    fleet.start("planner", "homing-planner", &planner, folder)?;
    Ok(fleet)
}

/// The rerun viewer: the project's own Python environment has one.
fn viewer() -> anyhow::Result<PathBuf> {
    if ["DISPLAY", "WAYLAND_DISPLAY"].iter().all(|name| std::env::var_os(name).is_none()) {
        bail!("--view needs a display, and there is none here: leave it out, and open the recording elsewhere");
    }
    let own = Path::new(".venv/bin/rerun");
    if own.is_file() {
        return Ok(own.canonicalize()?);
    }
    let paths = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&paths)
        .map(|folder| folder.join("rerun"))
        .find(|program| program.is_file())
        .context("no rerun viewer found: run ./deploy/demo once, or pip install rerun-sdk==0.36.3")
}

/// Without perception the planner explores on; without body or planner there is nothing to wait for.
fn still_possible(fleet: &mut Fleet, bar: &ProgressBar) -> anyhow::Result<()> {
    let Some(loss) = fleet.loss() else { return Ok(()) };
    match loss.name {
        "perception" | "monitor" => {
            bar.suspend(|| {
                eprintln!("{} is gone ({}); the robot goes on without it\n{}", loss.name, loss.status, loss.last_words)
            });
            Ok(())
        }
        name => bail!("{name} is gone ({}):\n{}", loss.status, loss.last_words),
    }
}

/// Commanders first, so that the robot stands; the body last, because it is the router of the others.
fn leave(fleet: &mut Fleet) {
    fleet.stop("planner", Duration::from_secs(3));
    fleet.stop("perception", Duration::from_secs(3));
    fleet.stop("monitor", Duration::from_secs(25));
    fleet.stop("body", Duration::from_secs(3));
}

fn message(verdict: &Verdict) -> EpisodeSummary {
    let facts: Vec<String> = verdict.facts().iter().map(|(name, value)| format!("{name}\t{value}")).collect();
    EpisodeSummary { title: verdict.title(), success: verdict.success, facts: facts.join("\n") }
}

fn waiting(message: &'static str) -> ProgressBar {
    let style =
        ProgressStyle::with_template("{spinner} {wide_msg}").unwrap_or_else(|_| ProgressStyle::default_spinner());
    let bar = ProgressBar::new_spinner().with_style(style).with_message(message);
    bar.enable_steady_tick(Duration::from_millis(100));
    bar
}
