//! Is a goal that was seen long ago found again? A robot is led through a flat without a goal; then photos are shown that
//! were taken on the way, out of sight of where it stands now, and perception looks for them in its memory alone.

use std::sync::Arc;
use std::time::Instant;

use homing_core::{
    GoalEstimate, GoalPhoto, PlanarPose, Resettable, RobotBridge, Sighting, Stamp, Transform, wrap_angle,
};
use homing_perception::Registration;
use homing_sim::arena::{Arena, BodySize, SceneRef};
use homing_sim::episode::{Episode, EpisodeSpec, FloorPose, draw, in_sight, t_world_base};
use homing_sim::follower::next_motion;
use homing_sim::geodesic::GeodesicField;
use homing_sim::scene::World;
use homing_sim::simulator::{SimConfig, Simulator};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use crate::RunError;

/// A goal is found if the estimate with the most inliers lies within this, metres, ...
pub const FOUND_M: f64 = 0.5;
/// ... and this, radians.
pub const FOUND_RAD: f64 = 10.0 / 180.0 * core::f64::consts::PI;
/// Photos are taken within this of a place the robot passed, metres, ...
const ASIDE_M: f64 = 1.0;
/// ... and turned by up to this from how it looked there, radians.
const ASIDE_RAD: f64 = 40.0 / 180.0 * core::f64::consts::PI;
/// Steps of a tour at most.
const STEPS_MAX: usize = 400;
/// Places tried for a photo.
const TRIES_MAX: usize = 200;

/// What is asked of memory in one flat.
#[derive(Copy, Clone, Debug)]
pub struct RecallSpec {
    /// Places the tour leads to, one after the other.
    pub n_places: usize,
    /// Photos shown afterwards.
    pub n_photos: usize,
}

impl Default for RecallSpec {
    fn default() -> Self {
        Self { n_places: 3, n_photos: 10 }
    }
}

/// What memory knew in one flat.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct RecallRow {
    /// The flat.
    pub seed: u64,
    /// Frames seen on the tour.
    pub n_frames: usize,
    /// Keyframes remembered of them.
    pub n_keyframes: usize,
    /// Photos shown.
    pub n_photos: usize,
    /// Photos whose best estimate is right.
    pub n_right: usize,
    /// Photos whose best estimate is wrong.
    pub n_wrong: usize,
    /// Seconds each photo took: its own keypoints, retrieval, geometry.
    pub seconds: Vec<f64>,
}

/// Leads a robot through the flat of `seed`, then asks. The same seed gives the same photos.
///
/// # Errors
/// [`RunError`] when a part cannot be set up or fails.
pub fn recall(seed: u64, spec: &RecallSpec, registration: &mut Registration) -> Result<RecallRow, RunError> {
    let arena = Arc::new(Arena::load(&SceneRef::Flat { seed }, BodySize::default())?);
    let episode = draw(&arena, seed, &EpisodeSpec::default())?;
    let rng = &mut ChaCha8Rng::seed_from_u64(seed ^ 0x7265_6361_6c6c);
    let mut robot = Simulator::new(Arc::clone(&arena), SimConfig::default())?;
    robot.reset(&episode)?;
    let tour = tour(&mut robot, &arena, spec, registration, rng)?;
    let mut row =
        RecallRow { seed, n_frames: tour.len(), n_keyframes: registration.memory().len(), ..RecallRow::default() };
    for id in 1..=spec.n_photos as u64 {
        let Some(place) = photo_place(&arena, &tour, robot.pose_truth(), rng) else { break };
        let rgb = Arc::new(episode.camera.photo(&arena, place)?);
        let photo = GoalPhoto { id, rgb, intrinsics: episode.camera.intrinsics()? };
        let start = Instant::now();
        let found = registration.set_goal(photo)?;
        row.seconds.push(start.elapsed().as_secs_f64());
        row.n_photos += 1;
        if let Some(right) = best_is_right(&found, &tour, &arena, &episode, place) {
            row.n_right += usize::from(right);
            row.n_wrong += usize::from(!right);
        }
    }
    Ok(row)
}

/// Where the robot really was when each frame was taken.
type Tour = Vec<(Stamp, PlanarPose)>;

fn tour(
    robot: &mut Simulator,
    arena: &Arena,
    spec: &RecallSpec,
    registration: &mut Registration,
    rng: &mut impl Rng,
) -> Result<Tour, RunError> {
    let mut seen = Vec::new();
    for _ in 0..spec.n_places {
        let cell = rng.random_range(0..arena.space().len().max(1) as u64) as usize;
        let Some(field) = arena.space().nth(cell).and_then(|to| GeodesicField::to(arena.space(), to).ok()) else {
            continue;
        };
        while seen.len() < STEPS_MAX {
            let observation = robot.observe()?;
            registration.look(&observation.frame)?;
            seen.push((observation.frame.stamp, robot.pose_truth()));
            let Some(motion) = next_motion(robot.body_truth(), arena.grid(), &field) else { break };
            robot.apply(motion)?;
        }
    }
    Ok(seen)
}

/// A place beside the way, in sight of it, and out of sight of where the robot stands.
fn photo_place(arena: &Arena, tour: &Tour, here: PlanarPose, rng: &mut impl Rng) -> Option<FloorPose> {
    for _ in 0..TRIES_MAX {
        let (_, passed) = tour.get(rng.random_range(0..tour.len().max(1) as u64) as usize)?;
        let aside = |rng: &mut dyn Rng, most: f64| rng.random_range(-most..=most);
        let at = FloorPose {
            x_m: passed.x_m + aside(rng, ASIDE_M),
            y_m: passed.y_m + aside(rng, ASIDE_M),
            yaw_rad: wrap_angle(passed.yaw_rad + aside(rng, ASIDE_RAD)),
        };
        let place = (at.x_m, at.y_m);
        let seen_on_the_way =
            arena.space().contains(at.x_m, at.y_m) && in_sight(arena, (passed.x_m, passed.y_m), place);
        if seen_on_the_way && !in_sight(arena, (here.x_m, here.y_m), place) {
            return Some(at);
        }
    }
    None
}

/// Whether the estimate with the most inliers names the place; `None` without one.
fn best_is_right(
    found: &[GoalEstimate],
    tour: &Tour,
    arena: &Arena,
    episode: &Episode,
    place: FloorPose,
) -> Option<bool> {
    let inliers = |estimate: &&GoalEstimate| match estimate.sighting {
        Sighting::Pose { n_inliers, .. } => n_inliers,
        _ => 0,
    };
    let best = found.iter().max_by_key(inliers)?;
    let Sighting::Pose { t_camera_goal, .. } = &best.sighting else { return None };
    let (_, from) = tour.iter().find(|(stamp, _)| *stamp == best.stamp)?;
    let t_base_camera = episode.camera.t_base_camera();
    let goal = t_world_base(arena, *from).isometry()
        * t_base_camera.isometry()
        * t_camera_goal.isometry()
        * t_base_camera.inverse().isometry();
    let named = Transform::<World, homing_core::Base>::new(goal).planar();
    let turned = wrap_angle(named.yaw_rad - place.yaw_rad).abs();
    Some(named.distance_to(place.x_m, place.y_m) <= FOUND_M && turned <= FOUND_RAD)
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "tests")]
mod tests {
    use homing_perception::memory::MemoryConfig;
    use homing_perception::onnx::FeatureChoice;
    use homing_perception::{PerceptionConfig, Registration};

    use super::*;

    #[test]
    fn a_place_passed_long_ago_is_found_in_memory() {
        let open = |memory| Registration::open(PerceptionConfig::default(), memory, &FeatureChoice::default()).unwrap();
        let spec = RecallSpec { n_places: 2, n_photos: 6 };
        let row = recall(7, &spec, &mut open(MemoryConfig::default())).unwrap();
        assert_eq!(row.n_photos, 6);
        assert!(row.n_right >= 3 && row.n_wrong <= 1, "{row:?}");
        assert!(row.n_keyframes < row.n_frames, "{row:?}");
        let forgetful = MemoryConfig { keyframes_max: 0, ..MemoryConfig::default() };
        assert_eq!(recall(7, &spec, &mut open(forgetful)).unwrap().n_right, 0);
    }
}
