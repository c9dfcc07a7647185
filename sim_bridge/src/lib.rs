//! The simulator that stands in for the robot's body: scenes, renderer, kinematics, episodes. Pure: no network, no clock.

pub mod flat;
pub mod gltf_scene;
pub mod render;
pub mod scene;
pub mod textures;
