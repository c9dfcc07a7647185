//! `homing replay`: real frames through the same topics, processes and perception, compared with the true poses.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{Context, bail};
use clap::Args;
use homing_core::{GoalEstimate, Sighting, StageTimes};
use homing_protocol::convert::{EncodedPhoto, ToDomain, ToMessage};
use homing_protocol::interfaces::homing_msgs;
use homing_protocol::session::{DEFAULT_ENDPOINT, Link, SessionConfig};
use homing_protocol::{Publisher, Session, Subscription, topics};
use homing_robot::{PairScore, PairSummary, Recording};
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;

use crate::fleet::Fleet;
use crate::run_folder::{RunFolder, shown};
use crate::settings::{FeatureArgs, MonitorFile, Network, PerceptionFile, RobotFile};
use crate::{Ended, photo};

/// Plays a recording of real RGB-D frames through the same topics, processes and perception, and compares every estimate
/// with the true relative pose. A frame without a pose counts as failed.
#[derive(Args)]
pub struct ReplayArgs {
    /// Folder in 7-Scenes or Open3D layout.
    dir: PathBuf,
    /// One goal for all frames: the number of the goal's frame.
    #[arg(long, value_name = "FRAME", conflicts_with = "pairs", required_unless_present = "pairs")]
    goal: Option<u32>,
    /// Every tenth frame as start, with the goal so many original frames later: one table for each number.
    #[arg(long, value_name = "50,100", value_delimiter = ',')]
    pairs: Vec<u32>,
    /// Calibration of colour and depth camera, where depth is not registered to the colour: it will be. For 7-Scenes:
    /// nodes/robot/rigs/kinect_v1.toml
    #[arg(long, value_name = "FILE")]
    rig: Option<PathBuf>,
    #[command(flatten)]
    features: FeatureArgs,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
    /// Where the processes meet.
    #[arg(long, default_value = DEFAULT_ENDPOINT)]
    endpoint: String,
    /// Folder for the results.
    #[arg(long, default_value = "runs")]
    out: PathBuf,
}

/// Start frames of pairs are this many original frames apart.
const PAIR_STRIDE: u32 = 10;
/// The photo is sent again after so long.
const AGAIN: Duration = Duration::from_secs(1);
/// A frame without an answer for so long ends the replay.
const ANSWER_MAX: Duration = Duration::from_secs(60);

/// Answers waiting to be read: a new goal brings one for every keyframe that shows it, and none may push out the frame's own.
const ANSWERS_MAX: usize = 128;

/// One frame and what was said about it.
#[derive(Serialize)]
struct Row {
    query: u32,
    goal: u32,
    n_inliers: usize,
    /// Null without a pose.
    distance_m: Option<f64>,
    true_distance_m: f64,
    translation_error_m: Option<f64>,
    rotation_error_deg: Option<f64>,
}

/// One table.
#[derive(Serialize)]
struct Table {
    name: String,
    n: usize,
    n_with_pose: usize,
    share_within_25cm_10deg: f64,
    share_within_10cm_5deg: f64,
    /// Null when half of the frames or more have no pose.
    median_translation_error_m: Option<f64>,
    median_rotation_error_deg: Option<f64>,
    /// From the photo or frame sent to the estimate received, and the stages inside, medians in milliseconds.
    p50_ms: Stages,
    rows: Vec<Row>,
}

#[derive(Serialize)]
struct Stages {
    extract: f64,
    matching: f64,
    pose: f64,
}

#[tokio::main]
pub async fn run(args: ReplayArgs) -> anyhow::Result<Ended> {
    args.features.check()?;
    let recording = Recording::open_with(&args.dir, args.rig.as_deref())?;
    let plans = plans(&args, &recording)?;
    let folder = RunFolder::create(&args.out, "replay")?;
    let mut tables = Vec::new();
    for (name, pairs) in plans {
        let own = folder.sub(&name.replace(' ', "-"))?;
        tables.push(play(&args, &recording, &own, name, &pairs).await?);
    }
    let result = folder.write_json("result.json", &tables)?;
    if args.json {
        println!("{}", serde_json::to_string(&tables)?);
    } else {
        tables.iter().for_each(print);
        println!("  result as JSON       {}", shown(&result));
    }
    Ok(Ended::Well)
}

type Plan = (String, Vec<(u32, u32)>);

fn plans(args: &ReplayArgs, recording: &Recording) -> anyhow::Result<Vec<Plan>> {
    if let Some(goal) = args.goal {
        let numbers: Vec<u32> = recording.numbers().collect();
        if !numbers.contains(&goal) {
            let nearest = numbers.iter().min_by_key(|n| n.abs_diff(goal)).copied().unwrap_or_default();
            bail!("{} has no frame {goal}; the nearest is {nearest}", args.dir.display());
        }
        let pairs = numbers.into_iter().map(|query| (query, goal)).collect();
        return Ok(vec![(format!("all frames to frame {goal}"), pairs)]);
    }
    let plan = |gap: &u32| {
        let pairs = recording.pairs(*gap, PAIR_STRIDE);
        if pairs.is_empty() {
            bail!("{} has no two frames {gap} apart", args.dir.display());
        }
        Ok((format!("{gap} frames apart"), pairs))
    };
    args.pairs.iter().map(plan).collect()
}

async fn play(
    args: &ReplayArgs,
    recording: &Recording,
    folder: &RunFolder,
    name: String,
    pairs: &[(u32, u32)],
) -> anyhow::Result<Table> {
    let one_goal = args.goal.is_some();
    let mut fleet = start(args, folder, pairs, one_goal)?;
    let session = join(args, &mut fleet).await?;
    let mut talk = Talk {
        goals: session.publisher(&topics::GOAL_IMAGE)?,
        estimates: session.subscribe(&topics::GOAL_ESTIMATE, ANSWERS_MAX)?,
    };
    let style = ProgressStyle::with_template("{bar:30} {pos}/{len} frames  [{elapsed}, about {eta} left]  {wide_msg}")
        .unwrap_or_else(|_| ProgressStyle::default_bar());
    let bar = ProgressBar::new(pairs.len() as u64).with_style(style).with_message(name.clone());
    let (mut rows, mut scores, mut times) = (Vec::new(), Vec::new(), Vec::new());
    for (n, &(query, goal)) in pairs.iter().enumerate() {
        let id = if one_goal { 1 } else { n as u64 + 1 };
        let photo = goal_photo(recording, goal, id)?;
        let estimate = talk.ask(&mut fleet, &photo, Recording::stamp(query)).await.with_context(|| {
            let logs = crate::run_folder::shown(&folder.file(""));
            format!("frame {query} of \"{name}\", after {n} of {} pairs; logs and recording are in {logs}", pairs.len())
        })?;
        let truth = recording.relative_pose_truth(query, goal)?;
        let (pose, n_inliers) = match &estimate.sighting {
            Sighting::Pose { t_camera_goal, n_inliers, .. } => (Some(t_camera_goal), *n_inliers),
            Sighting::Bearing { n_inliers, .. } => (None, *n_inliers),
            Sighting::NotSeen { .. } => (None, 0),
        };
        let score = pose.map(|p| PairScore::of(p, &truth));
        rows.push(Row {
            query,
            goal,
            n_inliers,
            distance_m: pose.map(|p| p.translation().norm()),
            true_distance_m: truth.translation().norm(),
            translation_error_m: score.as_ref().map(|s| s.translation_m),
            rotation_error_deg: score.as_ref().map(|s| s.rotation_deg),
        });
        scores.push(score);
        times.push(estimate.times);
        bar.inc(1);
    }
    if let Some(&(_, goal)) = pairs.last().filter(|_| !one_goal) {
        // The last frame, too, is held until a goal after its own shows that its answer was heard.
        talk.goals.publish(&goal_photo(recording, goal, pairs.len() as u64 + 1)?.to_message())?;
    }
    bar.finish_and_clear();
    session.close();
    Ok(table(name, rows, &scores, &times))
}

fn start(args: &ReplayArgs, folder: &RunFolder, pairs: &[(u32, u32)], one_goal: bool) -> anyhow::Result<Fleet> {
    let robot = RobotFile {
        recording: args.dir.canonicalize()?,
        rig: args.rig.as_deref().map(Path::canonicalize).transpose()?,
        frames: pairs.iter().map(|p| p.0).collect(),
        answers: if one_goal { "any_goal" } else { "goal_per_frame" },
        session: Network::listen(&args.endpoint),
    };
    let robot = folder.write_toml("robot.toml", &robot)?;
    let network = || Network::connect(&args.endpoint);
    let perception = folder.write_toml("perception.toml", &PerceptionFile::new(&args.features, network()))?;
    let monitor = MonitorFile {
        recording: folder.file("replay.rrd"),
        viewer: None,
        picture: None,
        truth: None,
        session: network(),
    };
    let monitor = folder.write_toml("monitor.toml", &monitor)?;
    let mut fleet = Fleet::default();
    fleet.start("body", "homing-robot", &robot, folder)?;
    fleet.start("perception", "homing-perception", &perception, folder)?;
    fleet.start("monitor", "homing-monitor", &monitor, folder)?;
    Ok(fleet)
}

async fn join(args: &ReplayArgs, fleet: &mut Fleet) -> anyhow::Result<Session> {
    let mut config = SessionConfig::new("homing", Link::Connect(vec![args.endpoint.clone()]));
    config.connect_timeout = Duration::from_secs(20);
    let session = tokio::task::block_in_place(|| Session::open(&config));
    // Somebody answers: is it our body? One that found its port taken has ended by now.
    tokio::time::sleep(Duration::from_millis(300)).await;
    check(fleet)?;
    Ok(session?)
}

fn check(fleet: &mut Fleet) -> anyhow::Result<()> {
    match fleet.loss() {
        // The body ends by itself after the last frame.
        Some(loss) if loss.status.success() => Ok(()),
        Some(loss) => bail!("{} ended ({}):\n{}", loss.name, loss.status, loss.last_words),
        None => Ok(()),
    }
}

/// Stands in the planner's place: shows photos, hears estimates.
struct Talk {
    goals: Publisher<homing_msgs::GoalPhoto>,
    estimates: Subscription<homing_msgs::GoalEstimate>,
}

impl Talk {
    async fn ask(
        &mut self,
        fleet: &mut Fleet,
        photo: &EncodedPhoto,
        stamp: homing_core::Stamp,
    ) -> anyhow::Result<GoalEstimate> {
        let (began, mut other) = (Instant::now(), None);
        while began.elapsed() < ANSWER_MAX {
            check(fleet)?;
            self.goals.publish(&photo.to_message())?;
            let sent = tokio::time::Instant::now();
            while let Ok(estimate) = tokio::time::timeout_at(sent + AGAIN, self.estimates.recv()).await {
                let estimate = estimate?.message.to_domain()?;
                if estimate.stamp == stamp && estimate.goal_id == photo.id {
                    return Ok(estimate);
                }
                other = Some((estimate.goal_id, estimate.stamp.seconds()));
            }
        }
        let last = other.map_or("there was no other".to_owned(), |(goal, seconds)| {
            format!("the last was about goal {goal} and the frame at {seconds:.3} s")
        });
        bail!(
            "no answer of perception about goal {} and the frame at {:.3} s within {ANSWER_MAX:?}; {last}",
            photo.id,
            stamp.seconds()
        )
    }
}

fn goal_photo(recording: &Recording, goal: u32, id: u64) -> anyhow::Result<EncodedPhoto> {
    Ok(EncodedPhoto { id, file: photo::png(&recording.colour(goal)?)?, intrinsics: recording.intrinsics() })
}

fn table(name: String, rows: Vec<Row>, scores: &[Option<PairScore>], times: &[StageTimes]) -> Table {
    let summary = PairSummary::of(scores);
    let finite = |value: f64| value.is_finite().then_some(value);
    let p50 = |stage: fn(&StageTimes) -> Duration| {
        let mut ms: Vec<f64> = times.iter().map(|t| stage(t).as_secs_f64() * 1e3).collect();
        ms.sort_by(f64::total_cmp);
        ms.get(ms.len() / 2).copied().unwrap_or_default()
    };
    Table {
        name,
        n: summary.n_pairs,
        n_with_pose: summary.n_posed,
        share_within_25cm_10deg: summary.within_25cm_10deg,
        share_within_10cm_5deg: summary.within_10cm_5deg,
        median_translation_error_m: finite(summary.translation_m_median),
        median_rotation_error_deg: finite(summary.rotation_deg_median),
        p50_ms: Stages { extract: p50(|t| t.extract), matching: p50(|t| t.matching), pose: p50(|t| t.pose) },
        rows,
    }
}

fn print(table: &Table) {
    println!("\n{}\n", table.name);
    println!("  frame   goal  inliers  estimated      true     error    error");
    println!("                          distance  distance  position  heading");
    for row in &table.rows {
        let metres = |value: Option<f64>| value.map_or("       -".to_owned(), |m| format!("{m:6.2} m"));
        let degrees = row.rotation_error_deg.map_or("       -".to_owned(), |d| format!("{d:4.1} deg"));
        println!(
            "  {:>5}  {:>5}  {:>7}   {}  {}  {}  {}",
            row.query,
            row.goal,
            row.n_inliers,
            metres(row.distance_m),
            metres(Some(row.true_distance_m)),
            metres(row.translation_error_m),
            degrees
        );
    }
    let median = |value: Option<f64>, unit: &str| {
        value.map_or("none: half of the frames have no pose".to_owned(), |v| format!("{v:.3} {unit}"))
    };
    println!();
    println!("  frames               {} ({} with a pose; the others count as failed)", table.n, table.n_with_pose);
    let of_posed = |share: f64| share * table.n as f64 / table.n_with_pose.max(1) as f64;
    for (bounds, share) in
        [("0.25 m, 10 deg", table.share_within_25cm_10deg), ("0.10 m, 5 deg ", table.share_within_10cm_5deg)]
    {
        println!("  within {bounds}  {share:.3} of all frames, {:.3} of those with a pose", of_posed(share));
    }
    println!("  median position error  {}", median(table.median_translation_error_m, "m"));
    println!("  median rotation error  {}", median(table.median_rotation_error_deg, "deg"));
    println!(
        "  p50 per frame          extract {:.0} ms, match {:.0} ms, pose {:.0} ms",
        table.p50_ms.extract, table.p50_ms.matching, table.p50_ms.pose
    );
}
