//! Coordinate frames as types, so that composing transforms whose frames do not meet does not compile.

/// A coordinate frame. Implemented by zero-sized markers only.
pub trait Frame: Copy + Clone + core::fmt::Debug + Send + Sync + 'static {
    /// The frame's name on the wire (REP-105).
    const NAME: &'static str;
}

macro_rules! frame {
    ($(#[$doc:meta])* $name:ident, $wire:literal) => {
        $(#[$doc])*
        #[derive(Copy, Clone, Debug, PartialEq, Eq)]
        pub struct $name;
        impl Frame for $name {
            const NAME: &'static str = $wire;
        }
    };
}

frame!(
    /// Continuous, drifting frame in which the robot plans. Identity where the robot was switched on.
    Odom, "odom");
frame!(
    /// The robot's body: x forward, y left, z up, on the floor below the centre of rotation.
    Base, "base_link");
frame!(
    /// The robot's camera: x right, y down, z forward.
    Camera, "camera_optical_frame");
frame!(
    /// The camera that took the goal photo: x right, y down, z forward.
    Goal, "goal_optical_frame");
