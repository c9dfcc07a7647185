//! From an episode of a file to one of ours, and back.

use homing_core::IntrinsicsError;
use thiserror::Error;

use super::axes;
use super::goal_yaw::goal_angle_rad;
use super::raw::{EpisodeId, Own, RawEpisode, RawGoal};
use super::scenes::{MAP_FLOOR_M, scene_name, stem};
use crate::arena::{Arena, SceneRef};
use crate::constants::SUCCESS_M;
use crate::episode::{Episode, FloorPose, Shape, Viewpoint, written};
use crate::geodesic::GeodesicField;

/// Points this far outside the free space are moved to it, metres (Habitat's `snap_point`).
pub const SNAP_M: f64 = 0.25;
/// A navigation mesh may lie this far above or below the floor it was made from, metres (NRNS takes as much for one
/// floor).
const MESH_FLOOR_M: f64 = 0.35;

/// A point of an episode.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Point {
    /// Where the agent starts.
    Start,
    /// Where the photo was taken.
    Goal,
}

impl core::fmt::Display for Point {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Point::Start => "start",
            Point::Goal => "goal",
        })
    }
}

/// Why an episode has no place in a scene.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum Refusal {
    /// It belongs elsewhere.
    #[error("it takes place in {wanted}, and this is {here}")]
    OtherScene {
        /// The episode's scene.
        wanted: String,
        /// The scene at hand.
        here: String,
    },
    /// It starts or ends above or below.
    #[error("its {point} is at a height of {height_m:.2} m, and the floor at {floor_m:.2} m: another floor")]
    OtherFloor {
        /// Which point.
        point: Point,
        /// Its height, Habitat's frame, metres.
        height_m: f64,
        /// That of the floor.
        floor_m: f64,
    },
    /// It starts or ends inside something.
    #[error(
        "its {point} ({x_m:.2}, {y_m:.2}) is more than {SNAP_M} m from where an agent of {radius_m} m radius can be"
    )]
    Blocked {
        /// Which point.
        point: Point,
        /// World frame, metres.
        x_m: f64,
        /// World frame, metres.
        y_m: f64,
        /// The agent's radius, metres.
        radius_m: f64,
    },
    /// There is no way.
    #[error("no way leads from its start to its goal")]
    Unreachable,
    /// A number that is none, or a rotation that is none.
    #[error("its {point} has no position or rotation that is one")]
    NotAPose {
        /// Which point.
        point: Point,
    },
    /// A camera that cannot be.
    #[error("its photo has no camera: {0}")]
    Camera(#[from] IntrinsicsError),
}

impl Refusal {
    /// A word for tables of what was skipped.
    #[must_use]
    pub fn reason(&self) -> &'static str {
        match self {
            Refusal::OtherScene { .. } => "other scene",
            Refusal::OtherFloor { .. } => "other floor",
            Refusal::Blocked { point: Point::Start, .. } => "start blocked",
            Refusal::Blocked { point: Point::Goal, .. } => "goal blocked",
            Refusal::Unreachable => "unreachable",
            Refusal::NotAPose { .. } => "no pose",
            Refusal::Camera(_) => "no camera",
        }
    }
}

/// Makes an episode of a file one of ours: world frame, start and goal moved to the free space where they lie at most
/// [`SNAP_M`] outside, shortest path by our own measure. A goal without rotation looks where Habitat would let it look.
/// The photo is taken by the robot's own camera unless the file states another.
///
/// # Errors
/// [`Refusal`] with the reason, for who counts what was skipped.
pub fn place(raw: &RawEpisode, arena: &Arena) -> Result<Episode, Refusal> {
    let (wanted, here) = (stem(&raw.scene_id), scene_name(arena.scene_ref()));
    if wanted != here {
        return Err(Refusal::OtherScene { wanted: wanted.into(), here });
    }
    check_floor(Point::Start, raw.start_position, arena)?;
    let own = raw.own.as_ref();
    let start_yaw_rad = axes::heading(raw.start_rotation).ok_or(Refusal::NotAPose { point: Point::Start })?.0;
    let (x_m, y_m) = snapped(Point::Start, raw.start_position, arena)?;
    let start = FloorPose { x_m, y_m, yaw_rad: own.map_or(start_yaw_rad, |o| o.start_yaw_rad) }.written();
    let (goal, camera) = goal_of(raw, arena)?;
    let goal = FloorPose { yaw_rad: own.map_or(goal.yaw_rad, |o| o.goal_yaw_rad), ..goal };
    let camera = own.map_or(camera, |o| o.camera);
    camera.intrinsics()?;
    let (view_points, measured_m) = ways(raw, arena, start, goal)?;
    let shortest_path_m = written(own.and(raw.geodesic_m).unwrap_or(measured_m));
    Ok(Episode {
        scene: arena.scene_ref().clone(),
        seed: own.map_or(0, |o| o.seed),
        start,
        goal,
        camera,
        shortest_path_m,
        shape: own.map_or_else(|| Shape::of(start, goal, shortest_path_m), |o| o.shape),
        id: own.map_or_else(|| Some(raw.id.to_string()), |o| o.id.clone()),
        view_points,
        success_m: own.map(|o| o.success_m).or(raw.success_m).unwrap_or(SUCCESS_M),
    })
}

/// One of our episodes in Habitat's frame, as its ImageNav files have them.
#[must_use]
pub fn to_raw(episode: &Episode, arena: &Arena) -> RawEpisode {
    let place = |p: FloorPose| {
        let [x, _, z] = axes::from_world([p.x_m, p.y_m, 0.0]);
        [x, arena.floor_y_m(), z]
    };
    let name = scene_name(&episode.scene);
    RawEpisode {
        id: EpisodeId::Text(episode.id.clone().unwrap_or_else(|| format!("{name}_{}", episode.seed))),
        scene_id: format!("{name}.glb"),
        start_position: place(episode.start),
        start_rotation: axes::rotation(episode.start.yaw_rad, 0.0),
        goal: RawGoal {
            position: place(episode.goal),
            rotation: Some(axes::rotation(episode.goal.yaw_rad, 0.0)),
            camera: None,
        },
        view_points: Vec::new(),
        success_m: None,
        geodesic_m: Some(episode.shortest_path_m),
        own: Some(Own {
            seed: episode.seed,
            start_yaw_rad: episode.start.yaw_rad,
            goal_yaw_rad: episode.goal.yaw_rad,
            shape: episode.shape,
            camera: episode.camera,
            success_m: episode.success_m,
            view_points: episode.view_points.clone(),
            id: episode.id.clone(),
        }),
    }
}

fn check_floor(point: Point, position: [f64; 3], arena: &Arena) -> Result<(), Refusal> {
    let within_m = if matches!(arena.scene_ref(), SceneRef::Layout { .. }) { MAP_FLOOR_M } else { MESH_FLOOR_M };
    if position.iter().any(|v| !v.is_finite()) {
        return Err(Refusal::NotAPose { point });
    }
    let (height_m, floor_m) = (position[1], arena.floor_y_m());
    if (height_m - floor_m).abs() > within_m {
        return Err(Refusal::OtherFloor { point, height_m, floor_m });
    }
    Ok(())
}

fn snapped(point: Point, position: [f64; 3], arena: &Arena) -> Result<(f64, f64), Refusal> {
    let [x_m, y_m, _] = axes::to_world(position);
    let radius_m = arena.size().radius_m;
    arena.space().nearest(x_m, y_m, SNAP_M).ok_or(Refusal::Blocked { point, x_m, y_m, radius_m })
}

/// Where the photo was taken, and with what.
fn goal_of(raw: &RawEpisode, arena: &Arena) -> Result<(FloorPose, Viewpoint), Refusal> {
    let nowhere = Refusal::NotAPose { point: Point::Goal };
    let (yaw_rad, pitch_rad) = match raw.goal.rotation {
        Some(rotation) => axes::heading(rotation).ok_or(nowhere.clone())?,
        None => (axes::to_heading(goal_angle_rad(&raw.id)), 0.0),
    };
    let position = raw.goal.position;
    let Some(camera) = raw.goal.camera else {
        check_floor(Point::Goal, position, arena)?;
        let (x_m, y_m) = snapped(Point::Goal, position, arena)?;
        return Ok((FloorPose { x_m, y_m, yaw_rad }.written(), Viewpoint::default()));
    };
    // A camera in the air may hang over a table: the places to stop at are elsewhere.
    if position.iter().any(|v| !v.is_finite()) {
        return Err(nowhere);
    }
    let [x_m, y_m, _] = axes::to_world(position);
    let viewpoint = Viewpoint {
        height_m: written(position[1] - arena.floor_y_m()),
        width: camera.width,
        height: camera.height,
        hfov_rad: camera.hfov_deg.to_radians(),
        pitch_rad: written(pitch_rad),
    };
    Ok((FloorPose { x_m, y_m, yaw_rad }.written(), viewpoint))
}

/// The places to stop at that can be reached, and the way to the nearest of them, metres.
fn ways(raw: &RawEpisode, arena: &Arena, start: FloorPose, goal: FloorPose) -> Result<(Vec<(f64, f64)>, f64), Refusal> {
    let space = arena.space();
    let of_own = raw.own.iter().flat_map(|o| o.view_points.iter().copied());
    let of_file = raw.view_points.iter().filter(|p| check_floor(Point::Goal, **p, arena).is_ok()).map(|p| {
        let [x, y, _] = axes::to_world(*p);
        (x, y)
    });
    let wanted: Vec<(f64, f64)> = of_own.chain(of_file).collect();
    if wanted.is_empty() && raw.view_points.is_empty() {
        let field = GeodesicField::to(space, (goal.x_m, goal.y_m)).map_err(|_| Refusal::Unreachable)?;
        let way = field.distance_m(start.x_m, start.y_m).ok_or(Refusal::Unreachable)?;
        return Ok((Vec::new(), way));
    }
    let field = GeodesicField::to(space, (start.x_m, start.y_m)).map_err(|_| Refusal::Unreachable)?;
    let reached = |p: (f64, f64)| {
        let (x, y) = space.nearest(p.0, p.1, SNAP_M)?;
        let place = (written(x), written(y));
        Some((place, field.distance_m(place.0, place.1)?))
    };
    let (places, ways): (Vec<(f64, f64)>, Vec<f64>) = wanted.into_iter().filter_map(reached).unzip();
    let way = ways.into_iter().min_by(f64::total_cmp).ok_or(Refusal::Unreachable)?;
    Ok((places, way))
}
