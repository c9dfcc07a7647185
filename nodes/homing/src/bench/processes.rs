//! The benchmark's episodes through real processes: body, perception and planner meet over zenoh in lockstep, and an
//! onlooker puts together from what they say what the one process would have seen.

use std::collections::BTreeMap;
use std::net::TcpListener;
use std::path::PathBuf;
use std::sync::Arc;

use anyhow::{Context, bail};
use homing_benchmark::ablations::LEARNED_SWITCH;
use homing_benchmark::cause::Moment;
use homing_benchmark::episode::{EpisodeRun, StageSeconds, headings};
use homing_benchmark::suite::{Course, Onlooker, Row};
use homing_benchmark::{GoalPose, LastMile, Policy, RunError, Trial};
use homing_core::{Base, GoalEstimate, Mode, Motion, NavigationState, Odom, Sighting, Stamp, Transform, UnseenReason};
use homing_perception::PoseSolver;
use homing_perception::onnx::SwitchChoice;
use homing_planner::{Recovery, SwitchConfig, SwitchKind};
use homing_privileged::{GROUND_TRUTH, GroundTruth};
use homing_protocol::convert::{EncodedPhoto, ToDomain};
use homing_protocol::interfaces::{homing_msgs, nav_msgs};
use homing_protocol::navigate::Outcome;
use homing_protocol::{Session, Subscription, topics};
use homing_sim::NoisePreset;
use homing_sim::arena::Arena;
use homing_sim::episode::{Episode, in_odom};
use homing_sim::score::Finish;
use indicatif::ProgressBar;
use serde::Serialize;

use crate::fleet::Fleet;
use crate::meeting::{all_ready, fail_on_loss, join};
use crate::mission::{self, Watched};
use crate::run_folder::RunFolder;
use crate::scorer::Scorer;
use crate::settings::{
    BodyTable, FeatureArgs, Network, PerceptionFile, PlannerFile, PlannerPace, PoseTable, SimFile, SwitchesTable,
};

/// More messages than an episode has steps.
const HEARD_MAX: usize = 4000;
/// Names the photo, as in one process.
const GOAL_ID: u64 = 1;

/// A row's episodes, each through processes of its own.
pub struct Processes {
    row: Row,
    features: FeatureArgs,
    out: PathBuf,
}

/// A planner's file with what oracles know beside it.
#[derive(Serialize)]
struct BenchmarkPlannerFile {
    planner: PlannerFile,
    oracle: OracleTable,
}

#[derive(Serialize)]
struct OracleTable {
    episode: PathBuf,
    discovery: &'static str,
    goal_pose: &'static str,
}

impl Processes {
    /// Fails for a row that processes have no settings for: those run in one process only. Run folders go below `out`.
    pub fn new(row: &Row, features: &FeatureArgs, out: PathBuf) -> Result<Self, RunError> {
        let refuse = |what: &str| Err(RunError::Processes(format!("the row {:?} {what}", row.name).into()));
        let Trial { last_mile, .. } = &row.trial;
        if *last_mile != LastMile::Driven {
            return refuse("teleports the robot, which its processes cannot do: run it without --through-processes");
        }
        if !NoisePreset::ALL.iter().any(|preset| preset.config() == row.trial.sim.noise) {
            return refuse("has noise without a name: run it without --through-processes");
        }
        let mut features = features.clone();
        if row.features.extractor.name() == "sift" {
            features = FeatureArgs { extractor: "sift".to_owned(), matcher: None };
        }
        Ok(Self { row: row.clone(), features, out })
    }

    fn start(&self, radius_m: f64, episode: &Episode, folder: &RunFolder, endpoint: &str) -> anyhow::Result<Fleet> {
        let mut fleet = Fleet::default();
        let file = folder.write_json("episode.json", episode)?;
        let noise = NoisePreset::ALL.iter().find(|preset| preset.config() == self.row.trial.sim.noise);
        let noise = noise.map_or("off", |preset| preset.name());
        let body = SimFile {
            pace: "lockstep",
            noise,
            radius_m: Some(radius_m),
            episode: file.clone(),
            session: Network::listen(endpoint),
        };
        fleet.start("body", "homing-sim", &folder.write_toml("body.toml", &body)?, folder)?;
        let mut eyes = PerceptionFile::new(&self.features, Network::connect(endpoint));
        eyes.pose = solver(self.row.perception.solver).map(|solver| PoseTable { solver });
        eyes.features.switch = (self.row.features.switch != SwitchChoice::Geometry).then_some(LEARNED_SWITCH);
        fleet.start("perception", "homing-perception", &folder.write_toml("perception.toml", &eyes)?, folder)?;
        let (policy, discovery) = match self.row.trial.policy {
            Policy::Straight => ("straight", "own"),
            Policy::Frontier => ("frontier", "own"),
            Policy::RandomGoal => ("random_goal", "own"),
            Policy::Oracle => ("frontier", "oracle"),
        };
        let goal_pose = if self.row.trial.goal_pose == GoalPose::Oracle { "oracle" } else { "own" };
        let pace = PlannerPace { answer_ms_max: 60_000 };
        let switches = Some(switches(&self.row.trial.planner.switches));
        let planner = PlannerFile {
            policy,
            switches,
            body: Some(BodyTable { radius_m }),
            session: Network::connect(endpoint),
            pace,
        };
        if (discovery, goal_pose) == ("own", "own") {
            fleet.start("planner", "homing-planner", &folder.write_toml("planner.toml", &planner)?, folder)?;
        } else {
            let file = BenchmarkPlannerFile { planner, oracle: OracleTable { episode: file, discovery, goal_pose } };
            let file = folder.write_toml("benchmark_planner.toml", &file)?;
            fleet.start("planner", "homing-benchmark-planner", &file, folder)?;
        }
        Ok(fleet)
    }

    async fn mission(
        &self,
        arena: &Arc<Arena>,
        episode: &Episode,
        onlooker: &mut Onlooker,
    ) -> anyhow::Result<EpisodeRun> {
        let folder = RunFolder::create(&self.out, &format!("{}-{}", self.row.name, episode.seed))?;
        let endpoint = format!("tcp/127.0.0.1:{}", free_port()?);
        let mut fleet = self.start(arena.size().radius_m, episode, &folder, &endpoint)?;
        let session = join(&endpoint, &mut fleet).await?;
        let mut heard = Heard::open(&session)?;
        let mut scorer = Scorer::open(&session)?;
        all_ready(&session, &mut fleet).await?;
        let photo = photo(arena, episode)?;
        let watched = mission::drive(&session, &photo, &ProgressBar::hidden(), || {
            scorer.listen();
            heard.listen();
            fail_on_loss(&mut fleet)
        })
        .await?;
        let Watched::Ended(report) = watched else { bail!("interrupted") };
        scorer.hear_the_end(report.outcome == Outcome::Arrived).await;
        heard.listen();
        session.close();
        tokio::task::block_in_place(|| drop(fleet));
        let told = heard.tell(arena, episode, &self.row.trial, onlooker)?;
        let ending = scorer.ending(told.last_mile_steps).context("the body never said where it is")?;
        Ok(EpisodeRun {
            finish: Finish::new(arena, episode, &ending),
            mode: told.mode,
            reason: report.message,
            first_heading_rad: told.first_heading_rad,
            times: told.times,
        })
    }
}

impl Course for Processes {
    fn run(&mut self, arena: &Arc<Arena>, episode: &Episode, onlooker: &mut Onlooker) -> Result<EpisodeRun, RunError> {
        let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build();
        let run = runtime.context("no threads").and_then(|r| r.block_on(self.mission(arena, episode, onlooker)));
        run.map_err(|e| RunError::Processes(format!("{e:#}").into()))
    }
}

/// The solver's name in perception's file; `None` for the default.
fn solver(solver: PoseSolver) -> Option<&'static str> {
    match solver {
        PoseSolver::LoRansac => None,
        PoseSolver::Gravity => Some("gravity"),
        PoseSolver::EpnpRansac => Some("epnp_ransac"),
        PoseSolver::SlingHeading => Some("sling_heading"),
    }
}

fn switches(config: &SwitchConfig) -> SwitchesTable {
    let kind = match config.kind {
        SwitchKind::Fused => "fused",
        SwitchKind::Sling => "sling",
        SwitchKind::Learned { .. } => "learned",
    };
    let recovery = if config.recovery == Recovery::On { "on" } else { "off" };
    SwitchesTable { kind, recovery }
}

/// What the processes said, by the stamp of the moment it is about.
struct Heard {
    states: Subscription<homing_msgs::NavigationState>,
    estimates: Subscription<homing_msgs::GoalEstimate>,
    truths: Subscription<homing_msgs::GroundTruth>,
    odometry: Subscription<nav_msgs::Odometry>,
    states_heard: Vec<NavigationState>,
    estimates_heard: BTreeMap<Stamp, GoalEstimate>,
    truths_heard: BTreeMap<Stamp, GroundTruth>,
    odometry_heard: BTreeMap<Stamp, Transform<Odom, Base>>,
}

/// What came of all steps.
struct Told {
    mode: Mode,
    last_mile_steps: u64,
    first_heading_rad: Option<(f64, f64)>,
    times: StageSeconds,
}

impl Heard {
    fn open(session: &Session) -> anyhow::Result<Self> {
        Ok(Self {
            states: session.subscribe(&topics::NAVIGATION_STATE, HEARD_MAX)?,
            estimates: session.subscribe(&topics::GOAL_ESTIMATE, HEARD_MAX)?,
            truths: session.subscribe(&GROUND_TRUTH, HEARD_MAX)?,
            odometry: session.subscribe(&topics::ODOM, HEARD_MAX)?,
            states_heard: Vec::new(),
            estimates_heard: BTreeMap::new(),
            truths_heard: BTreeMap::new(),
            odometry_heard: BTreeMap::new(),
        })
    }

    fn listen(&mut self) {
        while let Some(Ok(state)) = self.states.try_recv() {
            if let Ok(state) = state.message.to_domain() {
                self.states_heard.push(state);
            }
        }
        while let Some(Ok(estimate)) = self.estimates.try_recv() {
            match estimate.message.to_domain() {
                // "No goal yet" is no answer: the photo was still on its way.
                Ok(e) if e.sighting == (Sighting::NotSeen { reason: UnseenReason::NoGoal }) => {}
                Ok(e) => drop(self.estimates_heard.insert(e.stamp, e)),
                Err(_) => {}
            }
        }
        while let Some(Ok(truth)) = self.truths.try_recv() {
            if let Ok(truth) = truth.message.to_domain() {
                self.truths_heard.insert(truth.stamp, truth);
            }
        }
        while let Some(Ok(odometry)) = self.odometry.try_recv() {
            if let Ok(odometry) = odometry.message.to_domain() {
                self.odometry_heard.insert(odometry.stamp, odometry.t_odom_base);
            }
        }
    }

    /// Shows every step to the onlooker, in order.
    fn tell(self, arena: &Arena, episode: &Episode, trial: &Trial, onlooker: &mut Onlooker) -> anyhow::Result<Told> {
        let body = &trial.planner.body;
        let t_base_camera = trial.sim.camera.t_base_camera();
        let goal_odom_truth = in_odom(arena, episode.start, episode.goal.into());
        let mut told =
            Told { mode: Mode::Idle, last_mile_steps: 0, first_heading_rad: None, times: StageSeconds::default() };
        let n_steps = self.states_heard.len();
        for (k, state) in self.states_heard.iter().enumerate() {
            let missing = |what| format!("{what} of step {} was lost on the way", state.step);
            let truth = self.truths_heard.get(&state.stamp).with_context(|| missing("the truth"))?;
            let estimate = self.estimates_heard.get(&state.stamp).with_context(|| missing("the estimate"))?;
            let t_odom_base = *self.odometry_heard.get(&state.stamp).with_context(|| missing("the odometry"))?;
            let mut motion = state.action.motion(body.forward_m, body.turn_rad);
            if k + 1 == n_steps {
                motion = Motion::Stop { done: state.mode == Mode::Arrived };
            }
            let pose_truth = truth.pose;
            onlooker.see(&Moment { t_odom_base, t_base_camera, estimate, state, motion, pose_truth, goal_odom_truth });
            told.mode = state.mode;
            if matches!(state.mode, Mode::Exploit | Mode::Align) {
                told.last_mile_steps += 1;
                told.first_heading_rad = told.first_heading_rad.or_else(|| headings(state, &pose_truth, episode));
            }
            told.times.extract += estimate.times.extract.as_secs_f64();
            told.times.matching += estimate.times.matching.as_secs_f64();
            told.times.pose += estimate.times.pose.as_secs_f64();
        }
        if told.mode == Mode::Idle {
            bail!("the planner took no step");
        }
        Ok(told)
    }
}

fn photo(arena: &Arena, episode: &Episode) -> anyhow::Result<EncodedPhoto> {
    let rgb = episode.camera.photo(arena, episode.goal)?;
    let file = crate::photo::png(&rgb)?;
    Ok(EncodedPhoto { id: GOAL_ID, file, intrinsics: episode.camera.intrinsics()? })
}

fn free_port() -> anyhow::Result<u16> {
    Ok(TcpListener::bind("127.0.0.1:0").context("no free port")?.local_addr()?.port())
}
