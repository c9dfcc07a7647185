//! The simulator that stands in for the robot's body: scenes, renderer, kinematics, episodes. Pure: no network, no clock.

pub mod arena;
pub mod body;
pub mod constants;
pub mod episode;
pub mod flat;
pub mod folds;
pub mod follower;
pub mod free_space;
pub mod geodesic;
pub mod gltf_scene;
pub mod habitat;
pub mod laser;
pub mod nav_grid;
pub mod noise;
pub mod oracle;
mod raster;
pub mod render;
pub mod scene;
pub mod score;
pub mod simulator;
pub mod textures;
pub mod views;

pub use arena::{Arena, ArenaError, BodySize, SceneRef};
pub use episode::{Episode, EpisodeSpec, Viewpoint};
pub use laser::LaserConfig;
pub use noise::{NoiseConfig, NoisePreset};
pub use score::{Ending, Finish, Score};
pub use simulator::{SimConfig, Simulator};
