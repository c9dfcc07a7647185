//! One way to one target: look, move, look again, until there is nothing more to do.

use std::sync::Arc;

use homing_core::{
    Base, DepthImage, GoalEstimate, Mode, Odom, PlanarPose, RgbImage, RgbdFrame, Sighting, Stamp, Transform,
    UnseenReason, wrap_angle,
};
use homing_perception::AnyEstimator;
use homing_planner::visual_target::{Approach, Decision, Ending, Look, Refinement};
use homing_sim::arena::Arena;
use homing_sim::episode::{Episode, FloorPose, Shape, Viewpoint};
use homing_sim::geodesic::GeodesicField;
use serde::{Deserialize, Serialize};

use super::methods::{Guide, Way};
use super::pairs::{TargetPair, view};
use crate::RunError;
use crate::Trial;
use crate::episode::{StepRecord, run_episode};

/// Success is ending nearer to the target than this, metres (paper, 3.2), ...
pub const SUCCESS_M: f64 = 0.5;
/// ... and turned to within this of its heading, degrees.
pub const SUCCESS_DEG: f64 = 10.0;
/// Where a robot cannot stand, the next place is tried this much nearer to where it came from, metres.
const STEP_BACK_M: f64 = 0.025;

/// What a robot's camera delivers.
#[derive(Copy, Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Sensor {
    /// Colour and depth.
    RgbD,
    /// Colour alone: depth is withheld.
    Rgb,
}

/// One look.
#[derive(Copy, Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LookRecord {
    /// What was found.
    pub finding: Finding,
    /// Matches before verification.
    pub n_matches: usize,
    /// Matches that agree.
    pub n_inliers: usize,
    /// How far the target was then, metres, ...
    pub distance_m: f64,
    /// ... and turned away by how much, degrees.
    pub heading_deg: f64,
    /// Error of the estimated place, metres; of a direction alone, that of the place at the true distance.
    pub error_m: Option<f64>,
    /// Error of the estimated heading, degrees.
    pub error_deg: Option<f64>,
}

/// What a look found.
#[derive(Copy, Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Finding {
    /// A pose.
    Pose,
    /// A direction alone.
    Bearing,
    /// One of the views has next to no keypoints.
    NoTexture,
    /// Fewer matches than any pose needs.
    TooFewMatches,
    /// No pose that enough matches agree on and the view bears out.
    NoConsensus,
}

/// How one pair ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PairRun {
    /// Near enough, and turned the right way.
    pub success: bool,
    /// Distance to the target at the end, metres.
    pub final_distance_m: f64,
    /// Difference of headings at the end, degrees.
    pub final_heading_deg: f64,
    /// Why it ended.
    pub ending: String,
    /// Where it ended.
    pub end: FloorPose,
    /// Every look, the first from the start; of a run with the planner, that of every step.
    pub looks: Vec<LookRecord>,
}

impl PairRun {
    fn new(pair: &TargetPair, end: FloorPose, ending: String, looks: Vec<LookRecord>) -> Self {
        let (final_distance_m, final_heading_deg) = off(end.into(), pair.target);
        let success = final_distance_m < SUCCESS_M && final_heading_deg < SUCCESS_DEG;
        Self { success, final_distance_m, final_heading_deg, ending, end, looks }
    }
}

/// A robot with a target view in mind.
pub struct Robot<'a> {
    arena: &'a Arc<Arena>,
    camera: Viewpoint,
    estimator: &'a mut AnyEstimator,
    /// What was seen from where: ways that begin alike look alike.
    seen: Vec<(FloorPose, Sensor, GoalEstimate)>,
}

impl<'a> Robot<'a> {
    /// `estimator` knows the target view.
    pub fn new(arena: &'a Arc<Arena>, camera: Viewpoint, estimator: &'a mut AnyEstimator) -> Self {
        Self { arena, camera, estimator, seen: Vec::new() }
    }

    /// Goes from a pair's start towards its target.
    ///
    /// # Errors
    /// [`RunError`] when a part fails; a target that is not reached is none.
    pub fn run(&mut self, pair: &TargetPair, way: &Way) -> Result<PairRun, RunError> {
        match way.guide {
            Guide::Approach(approach) => self.approach(pair, approach, way.sensor),
            Guide::Planner => self.plan(pair),
        }
    }

    /// The body is put where a motion leads; where it cannot stand, at the nearest place on the straight way there at
    /// which it can.
    fn approach(&mut self, pair: &TargetPair, approach: Approach, sensor: Sensor) -> Result<PairRun, RunError> {
        let mut refinement = Refinement::new(approach);
        let mut here = pair.start;
        let mut looks = Vec::new();
        let ending = loop {
            let estimate = self.look(here, sensor)?;
            // The world's frame serves as the odometry's: no decision depends on which it is.
            let t_odom_base: Transform<Odom, Base> = PlanarPose::from(here).to_transform();
            let t_base_camera = self.camera.t_base_camera();
            let look = Look { t_odom_base, t_base_camera, sighting: &estimate.sighting };
            looks.push(record(&look, estimate.n_matches, here, pair.target));
            match refinement.next(&look) {
                Decision::Move(to) => here = put(self.arena, here, to),
                Decision::Done(ending) => break ending,
            }
        };
        Ok(PairRun::new(pair, here, words(ending).to_owned(), looks))
    }

    /// The body drives, step by step, within the planner's budget.
    fn plan(&mut self, pair: &TargetPair) -> Result<PairRun, RunError> {
        let at = |p: FloorPose| (p.x_m, p.y_m);
        let way = GeodesicField::to(self.arena.space(), at(pair.target)).ok();
        let way_m = way.and_then(|field| field.distance_m(pair.start.x_m, pair.start.y_m));
        let episode = Episode {
            scene: self.arena.scene_ref().clone(),
            seed: pair.flat,
            start: pair.start,
            goal: pair.target,
            camera: self.camera,
            shortest_path_m: way_m.unwrap_or_else(|| pair.distance_m()),
            shape: Shape::Curved,
            id: None,
            view_points: Vec::new(),
            success_m: homing_sim::constants::SUCCESS_M,
        };
        let (mut end, mut looks) = (pair.start, Vec::new());
        let mut follow = |step: &StepRecord<'_>| {
            end = FloorPose { x_m: step.pose_truth.x_m, y_m: step.pose_truth.y_m, yaw_rad: step.pose_truth.yaw_rad };
            let (t_base_camera, sighting) = (step.t_base_camera, &step.estimate.sighting);
            let look = Look { t_odom_base: step.pose_truth.to_transform(), t_base_camera, sighting };
            looks.push(record(&look, step.estimate.n_matches, end, pair.target));
        };
        let run = run_episode(self.arena, &episode, self.estimator, &Trial::default(), &mut follow)?;
        // A robot that stands there without knowing has not arrived.
        let arrived = run.mode == Mode::Arrived;
        let ended = PairRun::new(pair, end, run.reason, looks);
        Ok(PairRun { success: ended.success && arrived, ..ended })
    }

    fn look(&mut self, at: FloorPose, sensor: Sensor) -> Result<GoalEstimate, RunError> {
        if let Some((.., estimate)) = self.seen.iter().find(|(place, with, _)| (*place, *with) == (at, sensor)) {
            return Ok(estimate.clone());
        }
        let estimate = self.estimator.estimate(&frame(self.arena, &self.camera, sensor, at)?)?;
        self.seen.push((at, sensor, estimate.clone()));
        Ok(estimate)
    }
}

/// What the robot's camera delivers at a place.
fn frame(arena: &Arena, camera: &Viewpoint, sensor: Sensor, at: FloorPose) -> Result<RgbdFrame, RunError> {
    let seen = view(arena, camera, at)?;
    let depth = match sensor {
        Sensor::RgbD => seen.depth,
        Sensor::Rgb => no_depth(&seen.rgb)?,
    };
    Ok(RgbdFrame::new(Stamp(0), Arc::new(seen.rgb), Arc::new(depth), seen.camera)?)
}

fn no_depth(rgb: &RgbImage) -> Result<DepthImage, RunError> {
    let n = rgb.width() as usize * rgb.height() as usize;
    DepthImage::from_metres(rgb.width(), rgb.height(), vec![0.0; n]).map_err(RunError::Image)
}

/// The wanted pose, or the nearest to it on the straight way from `from` at which the body can stand.
fn put(arena: &Arena, from: FloorPose, wanted: PlanarPose) -> FloorPose {
    let (dx, dy) = (wanted.x_m - from.x_m, wanted.y_m - from.y_m);
    let length_m = libm::hypot(dx, dy);
    let n = (length_m / STEP_BACK_M).ceil().clamp(1.0, 1e5) as u32;
    let at = |k: u32| {
        let share = f64::from(k) / f64::from(n);
        (from.x_m + share * dx, from.y_m + share * dy)
    };
    let (x_m, y_m) = (0..=n).rev().map(at).find(|&(x, y)| arena.space().contains(x, y)).unwrap_or((from.x_m, from.y_m));
    FloorPose { x_m, y_m, yaw_rad: wanted.yaw_rad }
}

fn record(look: &Look<'_>, n_matches: usize, here: FloorPose, target: FloorPose) -> LookRecord {
    let (distance_m, heading_deg) = off(here.into(), target);
    let (finding, n_inliers, estimated) = match *look.sighting {
        Sighting::Pose { n_inliers, .. } => (Finding::Pose, n_inliers, look.target_pose()),
        Sighting::Bearing { bearing_rad, heading_rad, n_inliers, .. } => {
            let direction_rad = here.yaw_rad + bearing_rad;
            let at_distance = PlanarPose {
                x_m: here.x_m + distance_m * libm::cos(direction_rad),
                y_m: here.y_m + distance_m * libm::sin(direction_rad),
                yaw_rad: wrap_angle(here.yaw_rad + heading_rad),
            };
            (Finding::Bearing, n_inliers, Some(at_distance))
        }
        Sighting::NotSeen { reason: UnseenReason::NoTexture } => (Finding::NoTexture, 0, None),
        Sighting::NotSeen { reason: UnseenReason::TooFewMatches } => (Finding::TooFewMatches, 0, None),
        Sighting::NotSeen { .. } => (Finding::NoConsensus, 0, None),
    };
    let errors = estimated.map(|pose| off(pose, target));
    LookRecord {
        finding,
        n_matches,
        n_inliers,
        distance_m,
        heading_deg,
        error_m: errors.map(|e| e.0),
        error_deg: errors.map(|e| e.1),
    }
}

/// Distance (metres) and difference of headings (degrees) between a pose and the target.
fn off(pose: PlanarPose, target: FloorPose) -> (f64, f64) {
    (pose.distance_to(target.x_m, target.y_m), wrap_angle(pose.yaw_rad - target.yaw_rad).abs().to_degrees())
}

fn words(ending: Ending) -> &'static str {
    match ending {
        Ending::Spent => "all motions made",
        Ending::Settled => "settled",
        Ending::NoParallax => "parallax too small",
        Ending::NotSeen => "never seen",
        Ending::Lost => "lost from sight",
    }
}
