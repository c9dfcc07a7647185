//! A scene made ready for a robot: its free space, its outline for the laser, its renderer.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use homing_core::{Camera, DepthImage, Intrinsics, RgbImage, Transform};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::constants::{HEIGHT_M, LASER_HEIGHT_M, RADIUS_M};
use crate::flat::mapped::{self, MapError, NavMap};
use crate::flat::{self, Detail, Rect};
use crate::free_space::FreeSpace;
use crate::gltf_scene::{self, SceneError};
use crate::laser::LaserSlice;
use crate::nav_grid::{NavGrid, NavGridError};
use crate::render::{Render, Renderer};
use crate::scene::{Scene, World};

/// Which scene.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum SceneRef {
    /// A generated flat.
    Flat {
        /// Its seed.
        seed: u64,
    },
    /// A glTF 2.0 file.
    Glb {
        /// Where it is.
        path: PathBuf,
    },
    /// Walls and furniture raised on a navigability map.
    Layout {
        /// Where the map is: an 8-bit PNG, see [`crate::flat::mapped`].
        map: PathBuf,
    },
}

impl SceneRef {
    /// The scene in a file: a map if it is a PNG, else glTF.
    #[must_use]
    pub fn of_file(path: PathBuf) -> Self {
        match path.extension() {
            Some(ending) if ending.eq_ignore_ascii_case("png") => Self::Layout { map: path },
            _ => Self::Glb { path },
        }
    }

    /// The body that the benchmark drives there: our robot, and on a map the agent that the map was made for.
    #[must_use]
    pub fn body_size(&self) -> BodySize {
        match self {
            Self::Layout { .. } => BodySize { radius_m: mapped::AGENT_RADIUS_M, height_m: mapped::AGENT_HEIGHT_M },
            _ => BodySize::default(),
        }
    }
}

/// Size of a robot's body.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct BodySize {
    /// Radius of the disc it stands on, metres.
    pub radius_m: f64,
    /// Metres.
    pub height_m: f64,
}

impl Default for BodySize {
    fn default() -> Self {
        Self { radius_m: RADIUS_M, height_m: HEIGHT_M }
    }
}

/// Why a scene cannot be used.
#[derive(Debug, Error)]
pub enum ArenaError {
    /// The file is not a scene.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// Nobody can drive in it.
    #[error(transparent)]
    Floor(#[from] NavGridError),
    /// The file is no navigability map.
    #[error(transparent)]
    Map(#[from] MapError),
}

/// A scene with everything derived from it for a robot of one size.
#[derive(Debug)]
pub struct Arena {
    scene_ref: SceneRef,
    scene: Arc<Scene>,
    rooms: Vec<Rect>,
    size: BodySize,
    grid: NavGrid,
    space: Arc<FreeSpace>,
    floor_y_m: f64,
    laser: LaserSlice,
    renderer: OnceLock<Mutex<Renderer>>,
}

impl Arena {
    /// Generates or reads a scene.
    ///
    /// # Errors
    /// [`ArenaError`] when the file cannot be read or has no floor.
    pub fn load(scene_ref: &SceneRef, size: BodySize) -> Result<Self, ArenaError> {
        Self::load_as(scene_ref, size, Detail::Full)
    }

    /// Generates or reads a scene; a generated one in the detail asked for.
    ///
    /// # Errors
    /// [`ArenaError`] when the file cannot be read or has no floor.
    pub fn load_as(scene_ref: &SceneRef, size: BodySize, detail: Detail) -> Result<Self, ArenaError> {
        let (scene, rooms) = match scene_ref {
            SceneRef::Flat { seed } => {
                let flat = flat::generate_as(*seed, detail);
                (flat.scene, flat.rooms.iter().map(|r| r.cell).collect())
            }
            SceneRef::Glb { path } => (gltf_scene::load(path)?, Vec::new()),
            SceneRef::Layout { map } => {
                let map = NavMap::read(map)?;
                let arena = Self::of_scene(scene_ref.clone(), mapped::build(&map, detail)?, Vec::new(), size)?;
                return Ok(Self { floor_y_m: map.floor_y_m, ..arena });
            }
        };
        Self::of_scene(scene_ref.clone(), scene, rooms, size)
    }

    /// Makes a scene ready. `rooms` are the cells of its rooms, none if they are not known.
    ///
    /// # Errors
    /// [`ArenaError::Floor`] when the scene has no floor.
    pub fn of_scene(scene_ref: SceneRef, scene: Scene, rooms: Vec<Rect>, size: BodySize) -> Result<Self, ArenaError> {
        let grid = NavGrid::new(&scene, size.height_m)?;
        let space = Arc::new(grid.free_space(&scene.name, size.radius_m)?);
        let laser = LaserSlice::new(&scene, grid.floor_z_m() + LASER_HEIGHT_M);
        let (scene, floor_y_m) = (Arc::new(scene), grid.floor_z_m());
        Ok(Self { scene_ref, scene, rooms, size, grid, space, floor_y_m, laser, renderer: OnceLock::new() })
    }

    /// Which scene it is.
    #[must_use]
    pub fn scene_ref(&self) -> &SceneRef {
        &self.scene_ref
    }

    /// The scene.
    #[must_use]
    pub fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    /// Size of the robot it was made for.
    #[must_use]
    pub fn size(&self) -> BodySize {
        self.size
    }

    /// Obstacles.
    #[must_use]
    pub fn grid(&self) -> &NavGrid {
        &self.grid
    }

    /// Where the robot can be.
    #[must_use]
    pub fn space(&self) -> &Arc<FreeSpace> {
        &self.space
    }

    /// Height of the floor in the frame of the scene's own episodes, metres (Habitat's y): that of the world frame, unless a
    /// map says otherwise.
    #[must_use]
    pub fn floor_y_m(&self) -> f64 {
        self.floor_y_m
    }

    /// The outline at the laser's height.
    #[must_use]
    pub fn laser(&self) -> &LaserSlice {
        &self.laser
    }

    /// Index of the room at a point of the world frame, `None` outside or where rooms are not known.
    #[must_use]
    pub fn room_at(&self, x_m: f64, y_m: f64) -> Option<usize> {
        self.rooms.iter().position(|r| r.contains(x_m, y_m))
    }

    /// True if the scene knows its rooms.
    #[must_use]
    pub fn has_rooms(&self) -> bool {
        !self.rooms.is_empty()
    }

    /// What a camera sees. The renderer is prepared at the first call: whoever never looks does not pay for it.
    #[must_use]
    pub fn view(&self, camera: &Intrinsics, t_world_camera: &Transform<World, Camera>) -> (RgbImage, DepthImage) {
        let renderer = self.renderer.get_or_init(|| Mutex::new(Renderer::new(self.scene.clone())));
        renderer.lock().unwrap_or_else(PoisonError::into_inner).render(camera, t_world_camera)
    }
}
