//! Episodes in Habitat's file formats: read, placed in our scenes, and written.
//!
//! ```text
//! EpisodeFile::read(path) -> [RawEpisode]      as the file tells them, Habitat's frame
//! find_scene(folder, scene_id, floor) -> SceneRef
//! place(raw, arena) -> Episode | Refusal       ours, world frame
//! to_raw(episode, arena) -> RawEpisode, EpisodeFile::write(path, [RawEpisode])
//! ```

pub mod axes;
mod file;
mod goal_yaw;
mod instance;
mod place;
mod raw;
mod scenes;

pub use file::{EpisodeFile, HabitatError};
pub use goal_yaw::goal_angle_rad;
pub use place::{Point, Refusal, SNAP_M, place, to_raw};
pub use raw::{EpisodeId, Own, RawCamera, RawEpisode, RawGoal};
pub use scenes::{SceneMissing, find_scene, scene_name};

#[cfg(test)]
mod tests;
