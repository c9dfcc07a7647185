//! `nav_sweep FROM..TO LEVEL EYES [KNOB=VALUE ..]`: navigation over many flats, and where each way was lost.
//!
//! LEVEL: easy, medium, hard, extra, or bench (3 to 10 m). EYES: `own` and `sift` are the real features; `oracle` draws no
//! pictures: depth comes from the floor plan (furniture 0.8 m high), and the goal is found where enough of what the photo
//! shows is in sight from a like distance and direction. It runs an episode a second, for experiments with the planner.
//! Columns: way driven until the goal came into view, until it was first found, and in all; the shortest way from the
//! start, and from where it was found; SPL, and the SPL of a robot that had gone straight to the goal once it was found.
//! KNOB: see [`set`].

mod oracle;

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use homing_benchmark::cause::{is_in_view, right_pose};
use homing_benchmark::{StepRecord, Watch};
use homing_core::{
    Action, Base, Camera, GoalEstimate, GoalPhoto, Mode, Motion, MotionOutcome, Observation, Resettable, RobotBridge,
    Transform,
};
use homing_perception::onnx::FeatureChoice;
use homing_perception::{AnyEstimator, PerceptionConfig};
use homing_planner::{
    Frontier, FrontierConfig, Mission, Perception, Planner, PlannerConfig, PlannerObservation, StepEvent,
};
use homing_sim::arena::{Arena, BodySize, SceneRef};
use homing_sim::episode::{self, Episode, EpisodeSpec, t_world_base};
use homing_sim::flat::Detail;
use homing_sim::geodesic::GeodesicField;
use homing_sim::score::Score;
use homing_sim::simulator::{SimConfig, Simulator};

use oracle::{Likeness, Plan};

type Failure = Box<dyn std::error::Error>;

/// What sees the goal.
#[expect(clippy::large_enum_variant, reason = "there is one of it")]
enum Eyes {
    Oracle(Likeness),
    Real(AnyEstimator),
}

/// What is tried.
#[derive(Clone, Debug, Default)]
struct Trial {
    planner: PlannerConfig,
    frontier: FrontierConfig,
    likeness: Likeness,
}

/// One episode.
struct Row {
    score: Score,
    watch: Watch,
    mode: Mode,
    /// Way until the goal was in view, until it was found.
    view_m: Option<f64>,
    found_m: Option<f64>,
    /// Shortest way from where it was found.
    left_m: f64,
    plan_s: f64,
}

fn main() -> Result<(), Failure> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [seeds, level, eyes, knobs @ ..] = arguments.as_slice() else {
        return Err("nav_sweep FROM..TO LEVEL EYES [KNOB=VALUE ..]".into());
    };
    let (from, to) = seeds.split_once("..").ok_or("seeds are FROM..TO")?;
    let mut trial = Trial::default();
    for knob in knobs {
        let (name, value) = knob.split_once('=').ok_or("a knob is NAME=VALUE")?;
        set(&mut trial, name, value.parse()?)?;
    }
    let mut eyes = match eyes.as_str() {
        "oracle" => Eyes::Oracle(trial.likeness),
        "sift" => Eyes::Real(AnyEstimator::open(one_thread(), &FeatureChoice::default())?),
        _ => {
            let own = FeatureChoice::listed("homing", None, Path::new("nodes/perception/models"))?;
            Eyes::Real(AnyEstimator::open(one_thread(), &own)?)
        }
    };
    let (min_m, max_m) = match level.as_str() {
        "easy" => (1.5, 3.0),
        "medium" => (3.0, 5.0),
        "hard" => (5.0, 10.0),
        "extra" => (10.0, 15.0),
        _ => (3.0, 10.0),
    };
    let spec = EpisodeSpec { min_m, max_m, ..EpisodeSpec::default() };
    println!(" seed won steps turns  view_m found_m path_m short_m left_m   spl  best view found cause");
    let mut rows = Vec::new();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    for seed in from.parse::<u64>()?..to.parse()? {
        let detail = if matches!(eyes, Eyes::Oracle(_)) { Detail::Shape } else { Detail::Full };
        let arena = Arc::new(Arena::load_as(&SceneRef::Flat { seed }, BodySize::default(), detail)?);
        let Ok(episode) = episode::draw(&arena, seed, &spec) else { continue };
        let row = pool.install(|| run(&arena, &episode, &mut eyes, &trial).map_err(|e| e.to_string()))?;
        show(seed, &row);
        rows.push(row);
    }
    total(&rows);
    Ok(())
}

fn one_thread() -> PerceptionConfig {
    PerceptionConfig { threads: Some(1), ..PerceptionConfig::default() }
}

fn set(trial: &mut Trial, name: &str, value: f64) -> Result<(), Failure> {
    let (f, p) = (&mut trial.frontier, &mut trial.planner);
    match name {
        "range" => f.passes[0].0 = value,
        "half" => f.passes[0].1 = value,
        "look_min" => f.look_min_m2 = value,
        "turn_cost" => f.turn_cost_m = value,
        "gain_min" => f.gain_min_m2 = value,
        "unknown" => f.unknown_worth = value,
        "offset" => f.way_offset_m = value,
        "hope" => f.hope_m = value,
        "patient" => f.patient_steps = value as u64,
        "decay" => f.decay_per_m = value,
        "hysteresis" => f.hysteresis = value,
        "clearance" => p.body.clearance_m = value,
        "margin" => p.body.margin_m = value,
        "distance" => p.switches.distance_max_m = value,
        "far" => p.switches.far_factor = value,
        "n_th" => p.switches.n_inliers_min = value as usize,
        "band_min" => p.mapper.band_min_m = value,
        "toward" => trial.likeness.turn_rad = value,
        "share" => trial.likeness.share = value,
        "scale" => trial.likeness.scale = value,
        "map_range" => p.mapper.range_max_m = value,
        _ => return Err(format!("no knob is called {name}").into()),
    }
    Ok(())
}

fn run(arena: &Arc<Arena>, episode: &Episode, eyes: &mut Eyes, trial: &Trial) -> Result<Row, Failure> {
    let mut robot = Simulator::new(Arc::clone(arena), SimConfig { laser: None, ..SimConfig::default() })?;
    robot.reset(episode)?;
    let plan = Plan::new(arena, episode);
    if let Eyes::Real(estimator) = eyes {
        let rgb = Arc::new(episode.camera.photo(arena, episode.goal)?);
        estimator.set_goal(GoalPhoto { id: 1, rgb, intrinsics: episode.camera.intrinsics()? })?;
    }
    let mut planner = Planner::new(trial.planner.clone(), Box::new(Frontier::new(trial.frontier.clone())))?;
    let goal_odom_truth = (robot.t_world_odom_truth().inverse() * t_world_base(arena, episode.goal.into())).planar();
    let field = GeodesicField::to(arena.space(), (episode.goal.x_m, episode.goal.y_m))?;
    let mut motion = None;
    let mut row = Row {
        score: robot.score_truth(episode),
        watch: Watch::default(),
        mode: Mode::Idle,
        view_m: None,
        found_m: None,
        left_m: 0.0,
        plan_s: 0.0,
    };
    for step in 0..trial.planner.step_budget {
        let (seen, estimate) = look(&plan, arena, episode, &mut robot, eyes)?;
        let t_base_camera = robot.capabilities().t_base_camera;
        let asked = Instant::now();
        let mission = (step == 0).then_some(Mission::Start { goal_id: 1 });
        let action = planner.step(seen.odometry.stamp, &event(mission, &seen, &estimate, t_base_camera, motion.take()));
        row.plan_s += asked.elapsed().as_secs_f64();
        row.mode = planner.state().mode;
        let over = matches!(row.mode, Mode::Arrived | Mode::Failed) || action == Action::Stop;
        let body = &trial.planner.body;
        let asked = match over {
            true => Motion::Stop { done: row.mode == Mode::Arrived },
            false => action.motion(body.forward_m, body.turn_rad),
        };
        let record = StepRecord {
            observation: &seen,
            estimate: &estimate,
            state: planner.state(),
            map: planner.map(),
            action,
            motion: asked,
            t_base_camera,
            pose_truth: robot.pose_truth(),
            goal_odom_truth,
        };
        row.see(arena, episode, &record, robot.path_length_m_truth(), &field);
        motion = Some(robot.apply(asked)?);
        if over {
            break;
        }
    }
    row.score = robot.score_truth(episode);
    Ok(row)
}

fn look(
    plan: &Plan,
    arena: &Arena,
    episode: &Episode,
    robot: &mut Simulator,
    eyes: &mut Eyes,
) -> Result<(Observation, GoalEstimate), Failure> {
    match eyes {
        Eyes::Oracle(likeness) => Ok((plan.observe(arena, robot)?, plan.estimate(arena, episode, robot, likeness))),
        Eyes::Real(estimator) => {
            let seen = robot.observe()?;
            let estimate = estimator.estimate(&seen.frame)?;
            Ok((seen, estimate))
        }
    }
}

fn event(
    mission: Option<Mission>,
    seen: &Observation,
    estimate: &GoalEstimate,
    t_base_camera: Transform<Base, Camera>,
    motion: Option<MotionOutcome>,
) -> StepEvent {
    StepEvent {
        mission,
        observation: Some(PlannerObservation {
            odometry: seen.odometry,
            depth: Arc::clone(&seen.frame.depth),
            intrinsics: seen.frame.intrinsics,
            t_base_camera,
        }),
        estimate: Some(estimate.clone()),
        remembered: Vec::new(),
        motion,
        perception: Perception::Present,
    }
}

impl Row {
    fn see(&mut self, arena: &Arena, episode: &Episode, record: &StepRecord<'_>, way_m: f64, field: &GeodesicField) {
        self.watch.see(arena, episode, &record.moment());
        let pose = record.pose_truth;
        if is_in_view(arena, episode, pose) {
            self.view_m.get_or_insert(way_m);
        }
        if self.found_m.is_none() && right_pose(&record.moment()) == Some(true) {
            self.found_m = Some(way_m);
            self.left_m = field.distance_m(pose.x_m, pose.y_m).unwrap_or(f64::NAN);
        }
    }

    /// SPL of a robot that goes the shortest way once the goal was found.
    fn spl_best(&self) -> f64 {
        let l = self.score.shortest_path_m;
        self.found_m.map_or(0.0, |found| l / l.max(found + self.left_m))
    }
}

fn show(seed: u64, row: &Row) {
    let (s, w) = (&row.score, &row.watch);
    let or_never = |n: Option<u64>| n.map_or("-".to_owned(), |n| n.to_string());
    let or_none = |m: Option<f64>| m.map_or("-".to_owned(), |m| format!("{m:.1}"));
    println!(
        "{seed:5} {} {:5} {:5} {:>7} {:>7} {:6.1} {:7.1} {:6.1} {:5.2} {:5.2} {:>4} {:>4} {}",
        if s.success { "yes" } else { "-  " },
        s.steps,
        w.n_turns,
        or_none(row.view_m),
        or_none(row.found_m),
        s.path_length_m,
        s.shortest_path_m,
        row.left_m,
        s.spl,
        row.spl_best(),
        or_never(w.first_in_view),
        or_never(w.first_right),
        if s.success { "" } else { w.cause(row.mode).words() },
    );
}

fn total(rows: &[Row]) {
    let n = rows.len().max(1) as f64;
    let mean = |of: &dyn Fn(&Row) -> f64| rows.iter().map(of).sum::<f64>() / n;
    let steps: u64 = rows.iter().map(|r| r.watch.n_steps).sum();
    println!(
        "n {} success {:.3} SPL {:.4} soft {:.4} best {:.4} steps {:.0} turns {:.0} view_m {:.2} found_m {:.2} left_m {:.2} \
         path_m {:.2} short_m {:.2} wrong {:.1} collisions {:.2} plan {:.1} ms",
        rows.len(),
        mean(&|r| f64::from(u8::from(r.score.success))),
        mean(&|r| r.score.spl),
        mean(&|r| r.score.soft_spl),
        mean(&Row::spl_best),
        mean(&|r| r.score.steps as f64),
        mean(&|r| r.watch.n_turns as f64),
        mean(&|r| r.view_m.unwrap_or(r.score.path_length_m)),
        mean(&|r| r.found_m.unwrap_or(r.score.path_length_m)),
        mean(&|r| r.left_m),
        mean(&|r| r.score.path_length_m),
        mean(&|r| r.score.shortest_path_m),
        mean(&|r| r.watch.n_wrong as f64),
        mean(&|r| r.score.collisions as f64),
        1e3 * rows.iter().map(|r| r.plan_s).sum::<f64>() / steps.max(1) as f64,
    );
}
