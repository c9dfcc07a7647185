//! Episodes: where a robot starts and which photo it is shown, drawn as NRNS draws them.

use homing_core::{Base, Camera, Intrinsics, IntrinsicsError, Odom, PlanarPose, RgbImage, Transform, wrap_angle};
use nalgebra::{Matrix3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::arena::{Arena, SceneRef};
use crate::constants::{
    CAMERA_HEIGHT, CAMERA_HEIGHT_M, CAMERA_HFOV_RAD, CAMERA_WIDTH, CURVED_HEADING_RAD, CURVED_RATIO, GOAL_DEPTH_M_MIN,
    SUCCESS_M,
};
use crate::geodesic::GeodesicField;
use crate::laser::LaserSlice;
use crate::scene::World;

/// Position and heading on the floor, world frame.
#[derive(Copy, Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FloorPose {
    /// Metres.
    pub x_m: f64,
    /// Metres.
    pub y_m: f64,
    /// Counter-clockwise from the x axis, radians.
    pub yaw_rad: f64,
}

impl FloorPose {
    /// The same in decimals that a file gives back.
    pub(crate) fn written(self) -> Self {
        Self { x_m: written(self.x_m), y_m: written(self.y_m), yaw_rad: written(self.yaw_rad) }
    }
}

impl From<FloorPose> for PlanarPose {
    fn from(p: FloorPose) -> Self {
        PlanarPose { x_m: p.x_m, y_m: p.y_m, yaw_rad: p.yaw_rad }
    }
}

/// A camera on a pole: what took the goal photo.
#[derive(Copy, Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Viewpoint {
    /// Above the floor, metres.
    pub height_m: f64,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Horizontal field of view, radians.
    pub hfov_rad: f64,
    /// How far it looks up, radians; negative down. Robots' own cameras are level.
    #[serde(default, skip_serializing_if = "is_level")]
    pub pitch_rad: f64,
}

/// Files keep a pitch only where there is one: those of the frozen benchmark stay as they are.
fn is_level(pitch_rad: &f64) -> bool {
    *pitch_rad == 0.0
}

impl Default for Viewpoint {
    /// The robot's own camera.
    fn default() -> Self {
        Self {
            height_m: CAMERA_HEIGHT_M,
            width: CAMERA_WIDTH,
            height: CAMERA_HEIGHT,
            hfov_rad: CAMERA_HFOV_RAD,
            pitch_rad: 0.0,
        }
    }
}

impl Viewpoint {
    /// The camera's intrinsics.
    ///
    /// # Errors
    /// [`IntrinsicsError`] for sizes and fields of view that no camera has.
    pub fn intrinsics(&self) -> Result<Intrinsics, IntrinsicsError> {
        Intrinsics::from_hfov(self.width, self.height, self.hfov_rad)
    }

    /// Where the camera sits on a body that stands on the floor: looking ahead, tilted by its pitch.
    #[must_use]
    pub fn t_base_camera(&self) -> Transform<Base, Camera> {
        // Columns: the camera's right, down and forward in the base's axes.
        let (s, c) = (libm::sin(self.pitch_rad), libm::cos(self.pitch_rad));
        let r = Matrix3::new(0.0, s, c, -1.0, 0.0, 0.0, 0.0, -c, s);
        Transform::from_rotation(&r, Vector3::new(0.0, 0.0, self.height_m))
    }

    /// The photo that is taken with this camera from a place in an arena.
    ///
    /// # Errors
    /// [`IntrinsicsError`] for a camera that cannot be.
    pub fn photo(&self, arena: &Arena, at: FloorPose) -> Result<RgbImage, IntrinsicsError> {
        let t_world_camera = t_world_base(arena, at.into()) * self.t_base_camera();
        Ok(arena.view(&self.intrinsics()?, &t_world_camera).0)
    }
}

/// Pose of a body that stands on an arena's floor.
#[must_use]
pub fn t_world_base(arena: &Arena, pose: PlanarPose) -> Transform<World, Base> {
    let lift = nalgebra::Isometry3::translation(0.0, 0.0, arena.grid().floor_z_m());
    let on_zero: Transform<World, Base> = pose.to_transform();
    Transform::new(lift * on_zero.isometry())
}

/// A pose of the world frame in the odometry frame that began at `start`. Ground truth.
#[must_use]
pub fn in_odom(arena: &Arena, start: FloorPose, pose: PlanarPose) -> PlanarPose {
    let t_world_odom: Transform<World, Odom> = Transform::new(*t_world_base(arena, start.into()).isometry());
    (t_world_odom.inverse() * t_world_base(arena, pose)).planar()
}

/// One task: everything in the world frame, so robots never see it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Episode {
    /// Where it takes place.
    pub scene: SceneRef,
    /// The seed it was drawn with.
    pub seed: u64,
    /// Where the robot starts.
    pub start: FloorPose,
    /// Where the photo was taken.
    pub goal: FloorPose,
    /// With what it was taken.
    pub camera: Viewpoint,
    /// Geodesic distance from start to goal for this robot, metres.
    pub shortest_path_m: f64,
    /// Straight or curved, by NRNS's rule.
    pub shape: Shape,
    /// What a published set calls it; drawn episodes have none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub id: Option<String>,
    /// Where to stop, world frame, metres: at any of these places. None means where the photo was taken.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub view_points: Vec<(f64, f64)>,
    /// How near to that place is success, metres.
    #[serde(default = "success_m", skip_serializing_if = "is_usual")]
    pub success_m: f64,
}

/// The success distance of episodes that state none.
fn success_m() -> f64 {
    SUCCESS_M
}

/// NRNS's two kinds of episode.
#[derive(Copy, Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Shape {
    /// The way is hardly longer than the straight line, and the headings agree.
    Straight,
    /// The rest.
    Curved,
}

impl Shape {
    /// The shape of an episode whose shortest path is so long, metres.
    #[must_use]
    pub fn of(start: FloorPose, goal: FloorPose, shortest_path_m: f64) -> Self {
        let straight_m = libm::hypot(goal.x_m - start.x_m, goal.y_m - start.y_m);
        let turned = wrap_angle(goal.yaw_rad - start.yaw_rad).abs() >= CURVED_HEADING_RAD;
        if shortest_path_m >= CURVED_RATIO * straight_m || turned { Shape::Curved } else { Shape::Straight }
    }
}

fn is_usual(distance_m: &f64) -> bool {
    *distance_m == SUCCESS_M
}

/// Difficulty by the length of the shortest path (NRNS; "extra" after Mezghani et al.).
#[derive(Copy, Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Level {
    /// 1.5 to 3 m.
    Easy,
    /// 3 to 5 m.
    Medium,
    /// 5 to 10 m.
    Hard,
    /// Above 10 m.
    Extra,
}

impl Level {
    /// All levels, the easiest first.
    pub const ALL: [Level; 4] = [Level::Easy, Level::Medium, Level::Hard, Level::Extra];

    /// The level of a shortest path, metres.
    #[must_use]
    pub fn of(shortest_path_m: f64) -> Self {
        match shortest_path_m {
            m if m < 3.0 => Level::Easy,
            m if m < 5.0 => Level::Medium,
            m if m <= 10.0 => Level::Hard,
            _ => Level::Extra,
        }
    }

    /// Least and greatest shortest path, metres.
    #[must_use]
    pub fn range_m(self) -> (f64, f64) {
        match self {
            Level::Easy => (1.5, 3.0),
            Level::Medium => (3.0, 5.0),
            Level::Hard => (5.0, 10.0),
            Level::Extra => (10.0, 15.0),
        }
    }

    /// For tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Level::Easy => "easy",
            Level::Medium => "medium",
            Level::Hard => "hard",
            Level::Extra => "extra",
        }
    }
}

/// Where the goal may lie.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub enum GoalPlace {
    /// Anywhere.
    #[default]
    Anywhere,
    /// In another room than the start; in scenes that do not know their rooms, out of its sight.
    OtherRoom,
}

/// What kind of episode is wanted.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct EpisodeSpec {
    /// Least geodesic distance, metres.
    pub min_m: f64,
    /// Greatest geodesic distance, metres.
    pub max_m: f64,
    /// Straight, curved, or either.
    pub shape: Option<Shape>,
    /// Where the goal may lie.
    pub goal_place: GoalPlace,
    /// What takes the photo.
    pub camera: Viewpoint,
}

impl Default for EpisodeSpec {
    /// The benchmark: curved, 3 to 10 m, the robot's own camera.
    fn default() -> Self {
        Self {
            min_m: 3.0,
            max_m: 10.0,
            shape: Some(Shape::Curved),
            goal_place: GoalPlace::Anywhere,
            camera: Viewpoint::default(),
        }
    }
}

/// Why no episode was drawn.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum DrawError {
    /// The scene is too small or too simple for what is wanted.
    #[error("{scene} offers no episode of {min_m} to {max_m} m as asked for, after {tries} tries")]
    NoneFound {
        /// The scene's name.
        scene: String,
        /// Least distance asked for, metres.
        min_m: f64,
        /// Greatest distance asked for, metres.
        max_m: f64,
        /// Goals tried.
        tries: u32,
    },
    /// The goal camera cannot be.
    #[error(transparent)]
    Camera(#[from] IntrinsicsError),
}

/// Goals tried before giving up.
const GOALS_MAX: u32 = 60;
/// Starts tried for each goal.
const STARTS_MAX: u32 = 80;
/// The arrival direction is taken over the last stretch of the path, metres: a follower's last steps.
const ARRIVAL_M: f64 = 0.5;
/// Nothing is farther than this, metres.
const HORIZON_M: f64 = 60.0;

/// Draws an episode after NRNS (`generate_test_instances.py`): start and goal uniform over the free space, start
/// heading uniform, goal heading that in which a follower of the shortest path arrives, the photo taken there. One
/// thing is added: goal views whose median depth along the horizon is at most [`GOAL_DEPTH_M_MIN`] are drawn again,
/// because a photo of bare wall names no place.
///
/// Equal arguments give equal episodes on every machine.
///
/// # Errors
/// [`DrawError`] when the scene offers none.
pub fn draw(arena: &Arena, seed: u64, spec: &EpisodeSpec) -> Result<Episode, DrawError> {
    let rng = &mut ChaCha8Rng::seed_from_u64(seed ^ 0x6570_6973_6f64_6573);
    spec.camera.intrinsics()?;
    let horizon = LaserSlice::new(arena.scene(), arena.grid().floor_z_m() + spec.camera.height_m);
    for _ in 0..GOALS_MAX {
        let Some(goal) = random_place(arena, rng) else { continue };
        let Ok(field) = GeodesicField::to(arena.space(), goal) else { continue };
        for _ in 0..STARTS_MAX {
            let candidate = candidate(arena, &field, goal, seed, spec, rng);
            if let Some(episode) = candidate
                && horizon_m(&horizon, episode.goal, &spec.camera) > GOAL_DEPTH_M_MIN
            {
                return Ok(episode);
            }
        }
    }
    let scene = arena.scene().name.clone();
    Err(DrawError::NoneFound { scene, min_m: spec.min_m, max_m: spec.max_m, tries: GOALS_MAX })
}

fn random_place(arena: &Arena, rng: &mut ChaCha8Rng) -> Option<(f64, f64)> {
    arena.space().nth(rng.random_range(0..arena.space().len() as u64) as usize)
}

fn candidate(
    arena: &Arena,
    field: &GeodesicField,
    goal: (f64, f64),
    seed: u64,
    spec: &EpisodeSpec,
    rng: &mut ChaCha8Rng,
) -> Option<Episode> {
    let start = random_place(arena, rng)?;
    let yaw_rad = rng.random_range(-core::f64::consts::PI..core::f64::consts::PI);
    let shortest_path_m = field.distance_m(start.0, start.1)?;
    if !(spec.min_m..=spec.max_m).contains(&shortest_path_m) || !is_elsewhere(arena, start, goal, spec.goal_place) {
        return None;
    }
    let goal_yaw_rad = arrival_yaw(&field.path(start.0, start.1)?);
    // A uniform heading that must agree with the goal's is uniform over those that do: no need to draw until one does.
    let yaw_rad = match spec.shape {
        Some(Shape::Straight) => wrap_angle(goal_yaw_rad + yaw_rad / core::f64::consts::PI * CURVED_HEADING_RAD),
        _ => yaw_rad,
    };
    let start = FloorPose { x_m: start.0, y_m: start.1, yaw_rad };
    let goal = FloorPose { x_m: goal.0, y_m: goal.1, yaw_rad: goal_yaw_rad };
    let shape = Shape::of(start, goal, shortest_path_m);
    (spec.shape.is_none_or(|s| s == shape)).then(|| Episode {
        scene: arena.scene_ref().clone(),
        seed,
        start: start.written(),
        goal: goal.written(),
        camera: spec.camera,
        shortest_path_m: written(shortest_path_m),
        shape,
        id: None,
        view_points: Vec::new(),
        success_m: SUCCESS_M,
    })
}

/// To the micrometre and microradian: decimals that JSON gives back bit for bit.
pub(crate) fn written(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
}

fn is_elsewhere(arena: &Arena, start: (f64, f64), goal: (f64, f64), place: GoalPlace) -> bool {
    match place {
        GoalPlace::Anywhere => true,
        GoalPlace::OtherRoom if arena.has_rooms() => arena.room_at(start.0, start.1) != arena.room_at(goal.0, goal.1),
        GoalPlace::OtherRoom => !in_sight(arena, start, goal),
    }
}

/// True if nothing at the laser's height lies between two points of the world frame, metres.
#[must_use]
pub fn in_sight(arena: &Arena, from: (f64, f64), to: (f64, f64)) -> bool {
    let (dx, dy) = (to.0 - from.0, to.1 - from.1);
    arena.laser().range_m(from, libm::atan2(dy, dx), libm::hypot(dx, dy)).is_none()
}

/// Direction of the last [`ARRIVAL_M`] of a path, radians.
fn arrival_yaw(path: &[(f64, f64)]) -> f64 {
    let Some(&end) = path.last() else { return 0.0 };
    let mut from = end;
    for &p in path.iter().rev() {
        from = p;
        if libm::hypot(end.0 - p.0, end.1 - p.1) >= ARRIVAL_M {
            break;
        }
    }
    libm::atan2(end.1 - from.1, end.0 - from.0)
}

/// Median depth along the horizon of the goal view: what the triangles cut at the camera's height are away.
fn horizon_m(horizon: &LaserSlice, goal: FloorPose, camera: &Viewpoint) -> f64 {
    let half_width = libm::tan(0.5 * camera.hfov_rad);
    let depth = |k: u32| {
        let across = libm::atan(half_width * (f64::from(k) - 31.5) / 31.5);
        let range = horizon.range_m((goal.x_m, goal.y_m), goal.yaw_rad - across, HORIZON_M);
        range.unwrap_or(HORIZON_M) * libm::cos(across)
    };
    let mut depths: Vec<f64> = (0..64).map(depth).collect();
    depths.sort_by(f64::total_cmp);
    depths[32]
}
