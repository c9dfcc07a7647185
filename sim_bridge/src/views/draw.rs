//! Where the pictures of a flat are taken.

use core::f64::consts::PI;

use homing_core::{Camera, Intrinsics, Transform, wrap_angle};
use nalgebra::{Matrix3, Rotation3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::stage::Stage;
use super::{Cameras, FlatViews, OVERLAP_MIN, View, ViewPair, ViewSpec, ViewsError, overlap};
use crate::scene::World;

/// States of the flat, each of which shows in about as many views.
const VARIANTS: u32 = 2;
/// Horizontal fields of view, radians.
const HFOV_RAD: (f64, f64) = (55.0 * PI / 180.0, 120.0 * PI / 180.0);
/// Heights above the floor, metres.
const HEIGHT_M: (f64, f64) = (0.4, 1.6);
/// Cameras look up and down by up to this, radians.
const PITCH_RAD_MAX: f64 = 15.0 * PI / 180.0;
/// Cameras lean by up to this, radians.
const ROLL_RAD_MAX: f64 = 5.0 * PI / 180.0;
/// Headings in a group differ by up to this, radians.
const YAW_RAD_MAX: f64 = 75.0 * PI / 180.0;
/// Cameras of a group are at most this far apart on the floor, metres.
const DISTANCE_M_MAX: f64 = 4.0;
/// Distance of a camera from the point of interest, metres.
const INTEREST_M: (f64, f64) = (1.0, 6.0);
/// Views of one group.
const GROUP: (u64, u64) = (3, 6);
/// The point of interest is off the middle of the picture by up to this share of the field of view.
const OFF_CENTRE_MAX: f64 = 0.35;
/// How much of the line of sight furniture may hide at its end, metres: the point of interest lies on a surface.
const SIGHT_SLACK_M: f64 = 0.3;
/// Places tried for one picture.
const PLACES_MAX: u32 = 200;
/// Pictures taken for one that is kept, before the group is closed.
const PICTURES_MAX: u32 = 8;
/// Groups opened for one view that is wanted, before fewer are accepted.
const GROUPS_MAX: usize = 8;

/// Takes the views of a flat and pairs them.
///
/// A group begins with a place and a direction drawn uniformly; what lies there is its point of interest. Further views of
/// the group are drawn from all places from which that point is in sight, and must share [`OVERLAP_MIN`] with one that is
/// there already. Heights are uniform in 0.4 to 1.6 m, fields of view in 55 to 120 degrees, pitch in 15 and roll in 5
/// degrees either way.
///
/// Equal arguments give equal bits on every machine.
///
/// # Errors
/// [`ViewsError`] for a size that no image has, and for a flat without floor.
pub fn draw(seed: u64, spec: &ViewSpec) -> Result<FlatViews, ViewsError> {
    draw_with(seed, spec, &Cameras::Drawn)
}

/// The same with other cameras: heights, fields of view, pitch and roll are `cameras`', all else is as in [`draw`].
///
/// # Errors
/// [`ViewsError`] for a size or a field of view that no image has, and for a flat without floor.
pub fn draw_with(seed: u64, spec: &ViewSpec, cameras: &Cameras) -> Result<FlatViews, ViewsError> {
    let hfov_rad = match cameras {
        Cameras::Drawn => HFOV_RAD.1,
        Cameras::Level { hfov_rad, .. } => *hfov_rad,
    };
    Intrinsics::from_hfov(spec.width, spec.height, hfov_rad)?;
    let rng = &mut ChaCha8Rng::seed_from_u64(seed ^ 0x7669_6577_7061_6972);
    let stages = Stage::of_flat(seed, VARIANTS)?;
    let mut views: Vec<View> = Vec::with_capacity(spec.n_views);
    for _ in 0..GROUPS_MAX * spec.n_views {
        if views.len() >= spec.n_views {
            break;
        }
        let size = (rng.random_range(GROUP.0..=GROUP.1) as usize).min(spec.n_views - views.len());
        let group = draw_group(&stages, spec, cameras, size, rng);
        // A picture without a partner is kept only where it completes the set.
        if group.len() > 1 || size == 1 {
            views.extend(group);
        }
    }
    let pairs = pairs_of(&views);
    Ok(FlatViews { seed, views, pairs })
}

/// Up to `size` views around one point of interest.
fn draw_group(stages: &[Stage], spec: &ViewSpec, cameras: &Cameras, size: usize, rng: &mut ChaCha8Rng) -> Vec<View> {
    let mut group: Vec<View> = Vec::with_capacity(size);
    let Some(interest) = point_of_interest(&stages[0], rng) else { return group };
    while group.len() < size {
        let picture = (0..PICTURES_MAX).find_map(|_| {
            let stage = &stages[rng.random_range(0..stages.len() as u64) as usize];
            let (camera, t_world_camera) = draw_camera(stage, spec, cameras, interest, &group, rng)?;
            let view = stage.picture(camera, t_world_camera)?;
            (group.is_empty() || group.iter().any(|other| overlap(other, &view) >= OVERLAP_MIN)).then_some(view)
        });
        match picture {
            Some(view) => group.push(view),
            None => break,
        }
    }
    group
}

/// What lies in a random direction from a random place, world frame (x, y), metres.
fn point_of_interest(stage: &Stage, rng: &mut ChaCha8Rng) -> Option<(f64, f64)> {
    (0..PLACES_MAX).find_map(|_| {
        let from = random_place(stage, rng);
        let direction_rad = rng.random_range(-PI..PI);
        let range_m = stage.range_m(from, direction_rad, INTEREST_M.1).filter(|r| *r >= INTEREST_M.0)?;
        Some((from.0 + range_m * libm::cos(direction_rad), from.1 + range_m * libm::sin(direction_rad)))
    })
}

fn random_place(stage: &Stage, rng: &mut ChaCha8Rng) -> (f64, f64) {
    stage.places()[rng.random_range(0..stage.places().len() as u64) as usize]
}

/// A camera that looks at the point of interest, near enough to the group's others in place and heading.
fn draw_camera(
    stage: &Stage,
    spec: &ViewSpec,
    cameras: &Cameras,
    interest: (f64, f64),
    group: &[View],
    rng: &mut ChaCha8Rng,
) -> Option<(Intrinsics, Transform<World, Camera>)> {
    let hfov_rad = match cameras {
        Cameras::Drawn => rng.random_range(HFOV_RAD.0..HFOV_RAD.1),
        Cameras::Level { hfov_rad, .. } => *hfov_rad,
    };
    let camera = Intrinsics::from_hfov(spec.width, spec.height, hfov_rad).ok()?;
    let (place, yaw_rad) = (0..PLACES_MAX).find_map(|_| {
        let place = random_place(stage, rng);
        let off_rad = hfov_rad * rng.random_range(-OFF_CENTRE_MAX..OFF_CENTRE_MAX);
        let (dx, dy) = (interest.0 - place.0, interest.1 - place.1);
        let (bearing_rad, distance_m) = (libm::atan2(dy, dx), libm::hypot(dx, dy));
        let yaw_rad = wrap_angle(bearing_rad + off_rad);
        let suits = (INTEREST_M.0..=INTEREST_M.1).contains(&distance_m)
            && group.iter().all(|other| is_near(other, place, yaw_rad))
            && stage.range_m(place, bearing_rad, distance_m - SIGHT_SLACK_M).is_none();
        suits.then_some((place, yaw_rad))
    })?;
    let (height_m, pitch_rad, roll_rad) = match cameras {
        Cameras::Drawn => (
            rng.random_range(HEIGHT_M.0..HEIGHT_M.1),
            rng.random_range(-PITCH_RAD_MAX..PITCH_RAD_MAX),
            rng.random_range(-ROLL_RAD_MAX..ROLL_RAD_MAX),
        ),
        Cameras::Level { height_m, .. } => (*height_m, 0.0, 0.0),
    };
    let at = Vector3::new(place.0, place.1, stage.floor_z_m() + height_m);
    Some((camera, looking(at, yaw_rad, pitch_rad, roll_rad)))
}

fn is_near(other: &View, place: (f64, f64), yaw_rad: f64) -> bool {
    let p = other.t_world_camera.translation();
    libm::hypot(place.0 - p.x, place.1 - p.y) <= DISTANCE_M_MAX
        && wrap_angle(other.yaw_rad() - yaw_rad).abs() <= YAW_RAD_MAX
}

/// Pose of a camera: turned left by yaw, then down by pitch, then about its axis by roll, radians.
fn looking(p_world: Vector3<f64>, yaw_rad: f64, pitch_rad: f64, roll_rad: f64) -> Transform<World, Camera> {
    // Columns: the camera's right, down and forward in a body with x forward, y left, z up.
    let r_body_camera = Matrix3::new(0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0);
    let r_world_body = Rotation3::from_euler_angles(roll_rad, pitch_rad, yaw_rad);
    Transform::from_rotation(&(r_world_body.matrix() * r_body_camera), p_world)
}

fn pairs_of(views: &[View]) -> Vec<ViewPair> {
    let both = (0..views.len()).flat_map(|a| (a + 1..views.len()).map(move |b| (a, b)));
    both.filter_map(|(a, b)| {
        let shared = overlap(&views[a], &views[b]);
        (shared >= OVERLAP_MIN).then(|| ViewPair {
            a,
            b,
            overlap: shared,
            yaw_rad: wrap_angle(views[a].yaw_rad() - views[b].yaw_rad()).abs(),
            distance_m: (views[a].t_world_camera.translation() - views[b].t_world_camera.translation()).norm(),
        })
    })
    .collect()
}
