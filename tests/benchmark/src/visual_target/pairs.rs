//! The pairs of views: 20 for each of the paper's three difficulties, drawn by seed in generated flats.

use core::f64::consts::PI;
use homing_core::wrap_angle;
use homing_sim::arena::{Arena, BodySize, SceneRef};
use homing_sim::episode::{FloorPose, Viewpoint, t_world_base};
use homing_sim::flat::Detail;
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

/// Distances are spread evenly by this share about the mean, either way; the paper states the mean alone, and few flats are
/// long enough for much more than its greatest.
const DISTANCE_SPREAD: f64 = 0.1;
/// Differences of headings likewise.
const HEADING_SPREAD: f64 = 0.5;
/// Places tried in one flat.
const PLACES_MAX: u32 = 20_000;
/// Pairs of pictures taken in one flat.
const PICTURES_MAX: u32 = 60;
/// Flats tried for one pair.
const FLATS_MAX: u64 = 200;
/// Columns of the pictures with which overlaps are tried.
const TRIAL_WIDTH: u32 = 96;

/// Rays of a horizon.
const RAYS: u32 = 64;
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
pub fn draw_pair(wanted: &Wanted, n_pairs: u64, spec: &PairSpec) -> Result<TargetPair, RunError> {
    for attempt in 0..FLATS_MAX {
        let flat = spec.seed + wanted.index + attempt * n_pairs;
        if let Some(pair) = Search::new(flat, spec)?.pair(wanted)? {
            return Ok(pair);
        }
    }
    let (distance_m, heading_deg) = (wanted.distance_m, wanted.heading_rad.to_degrees());
    Err(RunError::NoPair { distance_m, heading_deg, flats: FLATS_MAX })
}

/// The search for a pair in one flat.
struct Search<'a> {
    spec: &'a PairSpec,
    flat: u64,
    arena: Arena,
    horizon: LaserSlice,
    /// Where a robot can stand, metres.
    places: Vec<(f64, f64)>,
    rng: ChaCha8Rng,
}

impl<'a> Search<'a> {
    fn new(flat: u64, spec: &'a PairSpec) -> Result<Self, RunError> {
        // Shapes tell what views share.
        let arena = Arena::load_as(&SceneRef::Flat { seed: flat }, BodySize::default(), Detail::Shape)?;
        let horizon = LaserSlice::new(arena.scene(), arena.grid().floor_z_m() + spec.camera.height_m);
        let (space, g) = (arena.space(), arena.space().geometry());
        let free = (0..g.len()).filter(|i| space.cells()[*i]);
        let places = free.map(|i| g.centre(i % g.width, i / g.width)).collect();
        let rng = ChaCha8Rng::seed_from_u64(flat ^ 0x7669_7375_616c_7461);
        Ok(Self { spec, flat, arena, horizon, places, rng })
    }

    fn pair(&mut self, wanted: &Wanted) -> Result<Option<TargetPair>, RunError> {
        let camera = self.spec.camera;
        let trial = Viewpoint { width: TRIAL_WIDTH, height: TRIAL_WIDTH * camera.height / camera.width, ..camera };
        let overlap_min = self.spec.overlap_min;
        let mut n_pictures = 0;
        for _ in 0..PLACES_MAX {
            let Some((start, target)) = self.free_places(wanted) else { continue };
            // Rays, then few pixels, tell roughly; all pixels decide.
            if horizon_overlap(&self.horizon, camera.hfov_rad, start, target) < 0.5 * overlap_min {
                continue;
            }
            n_pictures += 1;
            if n_pictures > PICTURES_MAX {
                break;
            }
            let (rough, _) = self.shares(&trial, start, target)?;
            if rough < 0.5 * overlap_min {
                continue;
            }
            let (overlap, (start_seen, target_seen)) = self.shares(&camera, start, target)?;
            if overlap >= overlap_min {
                let (difficulty, flat) = (wanted.difficulty, self.flat);
                return Ok(Some(TargetPair { difficulty, flat, start, target, overlap, target_seen, start_seen }));
            }
        }
        Ok(None)
    }

    /// Start and target at the wanted distance and headings, if both stand free.
    fn free_places(&mut self, wanted: &Wanted) -> Option<(FloorPose, FloorPose)> {
        let (x_m, y_m) = self.places[self.rng.random_range(0..self.places.len() as u64) as usize];
        let yaw_rad = self.rng.random_range(-PI..PI);
        let direction_rad = self.rng.random_range(-PI..PI);
        let target = FloorPose {
            x_m: x_m + wanted.distance_m * libm::cos(direction_rad),
            y_m: y_m + wanted.distance_m * libm::sin(direction_rad),
            yaw_rad: wrap_angle(yaw_rad + wanted.heading_rad),
        };
        self.arena.space().contains(target.x_m, target.y_m).then_some((FloorPose { x_m, y_m, yaw_rad }, target))
    }

    /// The smaller of the two shares, and the shares: of the start view that the target view sees, and of the target view.
    fn shares(&self, camera: &Viewpoint, start: FloorPose, target: FloorPose) -> Result<(f64, (f64, f64)), RunError> {
        let (a, b) = (view(&self.arena, camera, start)?, view(&self.arena, camera, target)?);
        let shares = (seen_share(&a, &b), seen_share(&b, &a));
        Ok((shares.0.min(shares.1), shares))
    }
}

/// The smaller of the two shares of the horizon that each of two views sees of the other's. Rays are faster than pictures,
/// and what lies above and below the horizon shares less where the views are far apart.
fn horizon_overlap(horizon: &LaserSlice, hfov_rad: f64, a: FloorPose, b: FloorPose) -> f64 {
    seen_of_horizon(horizon, hfov_rad, a, b).min(seen_of_horizon(horizon, hfov_rad, b, a))
}

/// Share of what lies on the horizon of `from` that `to` sees.
fn seen_of_horizon(horizon: &LaserSlice, hfov_rad: f64, from: FloorPose, to: FloorPose) -> f64 {
    let half_width = libm::tan(0.5 * hfov_rad);
    let is_seen = |k: &u32| {
        // Evenly over the columns of the picture.
        let across = libm::atan(half_width * (2.0 * (f64::from(*k) + 0.5) / f64::from(RAYS) - 1.0));
        let direction_rad = from.yaw_rad + across;
        let Some(range_m) = horizon.range_m((from.x_m, from.y_m), direction_rad, HORIZON_M) else { return false };
        let x_m = from.x_m + range_m * libm::cos(direction_rad);
        let y_m = from.y_m + range_m * libm::sin(direction_rad);
        let (dx, dy) = (x_m - to.x_m, y_m - to.y_m);
        let bearing_rad = libm::atan2(dy, dx);
        let way_m = (libm::hypot(dx, dy) - SLACK_M).max(0.0);
        wrap_angle(bearing_rad - to.yaw_rad).abs() <= 0.5 * hfov_rad
            && horizon.range_m((to.x_m, to.y_m), bearing_rad, way_m).is_none()
    };
    (0..RAYS).filter(is_seen).count() as f64 / f64::from(RAYS)
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

#[cfg(test)]
mod tests {
    use super::*;

    fn spec(n_each: usize) -> PairSpec {
        PairSpec { n_each, seed: 300_000, camera: Viewpoint::default(), overlap_min: 0.1 }
    }

    #[test]
    fn the_plan_has_the_papers_means() {
        for n in [1, 4, 20] {
            let all = plan(&spec(n));
            assert_eq!(all.len(), 3 * n);
            for difficulty in Difficulty::ALL {
                let of: Vec<&Wanted> = all.iter().filter(|w| w.difficulty == difficulty).collect();
                let mean = |value: fn(&Wanted) -> f64| of.iter().map(|w| value(w)).sum::<f64>() / of.len() as f64;
                let published = difficulty.published();
                assert!((mean(|w| w.distance_m) - published.distance_m).abs() < 1e-9);
                assert!((mean(|w| w.heading_rad.abs().to_degrees()) - published.heading_deg).abs() < 1e-9);
            }
        }
        assert_eq!(plan(&spec(20)), plan(&spec(20)));
    }

    #[test]
    fn pairs_are_what_was_asked_for_and_the_same_each_time() -> Result<(), RunError> {
        let spec = PairSpec { camera: Viewpoint { width: 160, height: 120, ..Viewpoint::default() }, ..spec(1) };
        let wanted = plan(&spec)[0];
        let pair = draw_pair(&wanted, 3, &spec)?;
        let arena = Arena::load_as(&SceneRef::Flat { seed: pair.flat }, BodySize::default(), Detail::Shape)?;
        assert!((pair.distance_m() - wanted.distance_m).abs() < 1e-9);
        assert!((pair.heading_deg() - wanted.heading_rad.abs().to_degrees()).abs() < 1e-9);
        assert!(pair.overlap >= spec.overlap_min && pair.overlap == pair.start_seen.min(pair.target_seen));
        assert!([pair.start, pair.target].iter().all(|p| arena.space().contains(p.x_m, p.y_m)));
        assert_eq!(draw_pair(&wanted, 3, &spec)?, pair);
        Ok(())
    }
}
