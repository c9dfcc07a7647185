//! An episode as a file tells it, in Habitat's frame (see [`super::axes`]).

use core::fmt;

use serde::{Deserialize, Serialize};

use crate::episode::{Shape, Viewpoint};

/// What a file calls an episode: its goal's heading may depend on which of the two it is.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum EpisodeId {
    /// A whole number.
    Number(i64),
    /// A text.
    Text(String),
}

impl fmt::Display for EpisodeId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(n) => write!(f, "{n}"),
            Self::Text(text) => f.write_str(text),
        }
    }
}

/// One episode of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct RawEpisode {
    /// Its name in the file.
    pub id: EpisodeId,
    /// Its scene: a path like `gibson/Avonia.glb`.
    pub scene_id: String,
    /// Where the agent starts, metres.
    pub start_position: [f64; 3],
    /// Quaternion (x, y, z, w).
    pub start_rotation: [f64; 4],
    /// The goal.
    pub goal: RawGoal,
    /// Places where success is counted, metres; none means at the goal.
    pub view_points: Vec<[f64; 3]>,
    /// How near is success, metres; `None` where the file does not say.
    pub success_m: Option<f64>,
    /// Geodesic distance that the file states, metres.
    pub geodesic_m: Option<f64>,
    /// What the file keeps of one of our own episodes beyond Habitat's.
    pub own: Option<Own>,
}

/// Where a goal is and, if known, which way its photo looks and with which camera it was taken.
#[derive(Clone, Debug, PartialEq)]
pub struct RawGoal {
    /// On the floor; of a photo with a camera of its own that camera's position. Metres.
    pub position: [f64; 3],
    /// Quaternion (x, y, z, w).
    pub rotation: Option<[f64; 4]>,
    /// The camera of its photo, if it is not the agent's.
    pub camera: Option<RawCamera>,
}

/// A camera of InstanceImageNav.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct RawCamera {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Horizontal field of view, degrees.
    pub hfov_deg: f64,
}

/// What one of our own episodes has that Habitat's format does not.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Own {
    /// The seed it was drawn with.
    pub seed: u64,
    /// Heading at the start, world frame, radians: a quaternion does not give back every decimal.
    pub start_yaw_rad: f64,
    /// Heading of the photo, world frame, radians.
    pub goal_yaw_rad: f64,
    /// Straight or curved.
    pub shape: Shape,
    /// What took its photo.
    pub camera: Viewpoint,
    /// How near is success, metres.
    pub success_m: f64,
    /// Where to stop, world frame, metres.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub view_points: Vec<(f64, f64)>,
    /// What a published set calls it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub id: Option<String>,
}
