//! The pairs of views: 20 for each of the paper's three difficulties, drawn by seed in generated flats.

use core::f64::consts::PI;
use std::sync::Arc;

use homing_core::wrap_angle;
use homing_sim::arena::{Arena, BodySize, SceneRef};
use homing_sim::episode::{FloorPose, Viewpoint, t_world_base};
use homing_sim::laser::LaserSlice;
use homing_sim::views::{View, seen_share};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::RunError;

/// The paper's difficulties, by its own names.
#[derive(Copy, Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Difficulty {
    /// 2.23 m apart on average.
    Moderate,
    /// 5.28 m.
    Hard,
    /// 8.39 m.
    Extreme,
}

/// A column of the paper's table 1.
#[derive(Copy, Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Published {
    /// Mean distance from start to target, metres.
    pub distance_m: f64,
    /// Mean difference of their headings, degrees.
    pub heading_deg: f64,
    /// Mean distance to the target at the end, failures at their initial one, metres.
    pub final_distance_m: f64,
    /// Mean difference of headings at the end, failures at their initial one, degrees.
    pub final_heading_deg: f64,
    /// Share of successes, 0 to 1.
    pub success_rate: f64,
}

impl Difficulty {
    /// All of them, as the paper lists them.
    pub const ALL: [Self; 3] = [Self::Moderate, Self::Hard, Self::Extreme];

    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Moderate => "moderate",
            Self::Hard => "hard",
            Self::Extreme => "extreme",
        }
    }

    /// What the paper states.
    #[must_use]
    pub fn published(self) -> Published {
        let column = |distance_m, heading_deg, final_distance_m, final_heading_deg, success_rate| Published {
            distance_m,
            heading_deg,
            final_distance_m,
            final_heading_deg,
            success_rate,
        };
        match self {
            Self::Moderate => column(2.23, 42.75, 0.71, 16.64, 0.85),
            Self::Hard => column(5.28, 55.69, 3.99, 43.35, 0.40),
            Self::Extreme => column(8.39, 49.50, 7.96, 45.23, 0.30),
        }
    }
}

/// Two views of one flat.
#[derive(Copy, Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TargetPair {
    /// Its column.
    pub difficulty: Difficulty,
    /// Seed of the flat.
    pub flat: u64,
    /// Where the robot starts.
    pub start: FloorPose,
    /// Where the target view was taken.
    pub target: FloorPose,
    /// The smaller of the two shares below: what [`homing_sim::views::overlap`] says.
    pub overlap: f64,
    /// Share of the target view that the start view sees, 0 to 1.
    pub target_seen: f64,
    /// Share of the start view that the target view sees, 0 to 1.
    pub start_seen: f64,
}

impl TargetPair {
    /// From start to target, metres.
    #[must_use]
    pub fn distance_m(&self) -> f64 {
        libm::hypot(self.target.x_m - self.start.x_m, self.target.y_m - self.start.y_m)
    }

    /// Difference of the headings, degrees, 0 to 180.
    #[must_use]
    pub fn heading_deg(&self) -> f64 {
        wrap_angle(self.target.yaw_rad - self.start.yaw_rad).abs().to_degrees()
    }

    /// Direction of the target seen from the start, degrees from straight ahead, 0 to 180.
    #[must_use]
    pub fn bearing_deg(&self) -> f64 {
        let direction = libm::atan2(self.target.y_m - self.start.y_m, self.target.x_m - self.start.x_m);
        wrap_angle(direction - self.start.yaw_rad).abs().to_degrees()
    }
}

/// How pairs are drawn.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct PairSpec {
    /// Pairs of each difficulty.
    pub n_each: usize,
    /// Seed of the first flat; every pair is drawn in a flat of its own.
    pub seed: u64,
    /// What takes both views.
    pub camera: Viewpoint,
    /// Views that share less have nothing in common that could be matched, and are no pair.
    pub overlap_min: f64,
}

/// Distances are spread evenly by this share about the mean, either way; the paper states the mean alone.
const DISTANCE_SPREAD: f64 = 0.25;
/// Differences of headings likewise.
const HEADING_SPREAD: f64 = 0.5;
/// Places tried in one flat.
const PLACES_MAX: u32 = 4000;
/// Pairs of pictures taken in one flat.
const PICTURES_MAX: u32 = 150;
/// Flats tried for one pair.
const FLATS_MAX: u64 = 40;
/// Columns of the pictures with which overlaps are tried.
const TRIAL_WIDTH: u32 = 160;

/// Rays of a horizon.
const RAYS: u32 = 96;
/// Nothing is farther than this, metres.
const HORIZON_M: f64 = 60.0;
/// Two points nearer than this on one line of sight are one, metres.
const SLACK_M: f64 = 0.1;

/// What a pair is to be like.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Wanted {
    /// Its column.
    pub difficulty: Difficulty,
    /// Index among all pairs.
    pub index: u64,
    /// From start to target, metres.
    pub distance_m: f64,
    /// From the start's heading to the target's, radians, left positive.
    pub heading_rad: f64,
}

/// Distances and headings of all pairs: evenly spread about the paper's means, so that the means are the paper's exactly;
/// which heading goes with which distance, and its sign, are drawn.
#[must_use]
pub fn plan(spec: &PairSpec) -> Vec<Wanted> {
    let rng = &mut ChaCha8Rng::seed_from_u64(spec.seed ^ 0x7461_7267_6574_7061);
    let n = spec.n_each;
    let evenly = |k: usize, spread: f64| 1.0 + spread * (2.0 * (k as f64 + 0.5) / n as f64 - 1.0);
    let mut all = Vec::with_capacity(3 * n);
    for (column, difficulty) in Difficulty::ALL.into_iter().enumerate() {
        let published = difficulty.published();
        let mut order: Vec<usize> = (0..n).collect();
        for i in (1..n).rev() {
            order.swap(i, rng.random_range(0..=i));
        }
        all.extend(order.iter().enumerate().map(|(k, &of_heading)| {
            let sign = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
            Wanted {
                difficulty,
                index: (column * n + k) as u64,
                distance_m: published.distance_m * evenly(k, DISTANCE_SPREAD),
                heading_rad: sign * (published.heading_deg * evenly(of_heading, HEADING_SPREAD)).to_radians(),
            }
        }));
    }
    all
}

/// Draws one pair: start uniform over the free floor of a flat, heading and direction of the target uniform. Nothing is
/// asked of a pair but what geometry asks: start and target stand free, and the views share `overlap_min`. A flat that
/// offers none is followed by another.
///
/// # Errors
/// [`RunError::NoPair`] if no flat offers one, [`RunError::Camera`] for a camera that cannot be.
pub fn draw_pair(wanted: &Wanted, n_pairs: u64, spec: &PairSpec) -> Result<(Arc<Arena>, TargetPair), RunError> {
    spec.camera.intrinsics()?;
    for attempt in 0..FLATS_MAX {
        let flat = spec.seed + wanted.index + attempt * n_pairs;
        let arena = Arena::load(&SceneRef::Flat { seed: flat }, BodySize::default())?;
        let rng = &mut ChaCha8Rng::seed_from_u64(flat ^ 0x7669_7375_616c_7461);
        if let Some(pair) = pair_in(&arena, flat, wanted, spec, rng)? {
            return Ok((Arc::new(arena), pair));
        }
    }
    Err(RunError::NoPair {
        distance_m: wanted.distance_m,
        heading_deg: wanted.heading_rad.to_degrees(),
        flats: FLATS_MAX,
    })
}

fn pair_in(
    arena: &Arena,
    flat: u64,
    wanted: &Wanted,
    spec: &PairSpec,
    rng: &mut ChaCha8Rng,
) -> Result<Option<TargetPair>, RunError> {
    let trial =
        Viewpoint { width: TRIAL_WIDTH, height: TRIAL_WIDTH * spec.camera.height / spec.camera.width, ..spec.camera };
    let horizon = LaserSlice::new(arena.scene(), arena.grid().floor_z_m() + spec.camera.height_m);
    let mut n_pictures = 0;
    for _ in 0..PLACES_MAX {
        let Some((start, target)) = free_places(arena, wanted, rng) else { continue };
        if !share_horizon(&horizon, spec.camera.hfov_rad, start, target) {
            continue;
        }
        n_pictures += 1;
        if n_pictures > PICTURES_MAX {
            break;
        }
        // Few pixels tell roughly; all of them decide.
        let (a, b) = (view(arena, &trial, start)?, view(arena, &trial, target)?);
        if seen_share(&a, &b).min(seen_share(&b, &a)) < 0.5 * spec.overlap_min {
            continue;
        }
        let (a, b) = (view(arena, &spec.camera, start)?, view(arena, &spec.camera, target)?);
        let (start_seen, target_seen) = (seen_share(&a, &b), seen_share(&b, &a));
        let overlap = start_seen.min(target_seen);
        if overlap >= spec.overlap_min {
            return Ok(Some(TargetPair {
                difficulty: wanted.difficulty,
                flat,
                start,
                target,
                overlap,
                target_seen,
                start_seen,
            }));
        }
    }
    Ok(None)
}

/// Start and target at the wanted distance and headings, if both stand free.
fn free_places(arena: &Arena, wanted: &Wanted, rng: &mut ChaCha8Rng) -> Option<(FloorPose, FloorPose)> {
    let (x_m, y_m) = arena.space().nth(rng.random_range(0..arena.space().len() as u64) as usize)?;
    let yaw_rad = rng.random_range(-PI..PI);
    let direction_rad = rng.random_range(-PI..PI);
    let target = FloorPose {
        x_m: x_m + wanted.distance_m * libm::cos(direction_rad),
        y_m: y_m + wanted.distance_m * libm::sin(direction_rad),
        yaw_rad: wrap_angle(yaw_rad + wanted.heading_rad),
    };
    arena.space().contains(target.x_m, target.y_m).then_some((FloorPose { x_m, y_m, yaw_rad }, target))
}

/// False if nothing at the height of the cameras is seen by both: such views share next to nothing, and rays are faster
/// than pictures.
fn share_horizon(horizon: &LaserSlice, hfov_rad: f64, start: FloorPose, target: FloorPose) -> bool {
    let seen = |k: u32| {
        let direction_rad = target.yaw_rad + hfov_rad * (f64::from(k) / f64::from(RAYS - 1) - 0.5);
        let range_m = horizon.range_m((target.x_m, target.y_m), direction_rad, HORIZON_M)?;
        let (x_m, y_m) =
            (target.x_m + range_m * libm::cos(direction_rad), target.y_m + range_m * libm::sin(direction_rad));
        let (dx, dy) = (x_m - start.x_m, y_m - start.y_m);
        let bearing_rad = libm::atan2(dy, dx);
        let inside = wrap_angle(bearing_rad - start.yaw_rad).abs() <= 0.5 * hfov_rad;
        let way_m = libm::hypot(dx, dy) - SLACK_M;
        Some(inside && horizon.range_m((start.x_m, start.y_m), bearing_rad, way_m.max(0.0)).is_none())
    };
    (0..RAYS).any(|k| seen(k) == Some(true))
}

/// What the camera sees from a place.
///
/// # Errors
/// [`RunError::Camera`] for a camera that cannot be.
pub fn view(arena: &Arena, camera: &Viewpoint, at: FloorPose) -> Result<View, RunError> {
    let t_world_camera = t_world_base(arena, at.into()) * camera.t_base_camera();
    let intrinsics = camera.intrinsics()?;
    let (rgb, depth) = arena.view(&intrinsics, &t_world_camera);
    Ok(View { camera: intrinsics, t_world_camera, rgb, depth, variant: 0 })
}
