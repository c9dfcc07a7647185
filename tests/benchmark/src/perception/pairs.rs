//! Pairs of posed frames: one is what the robot sees, the other is the photo it is shown.

use homing_core::{Camera, Frame, Goal, RgbdFrame, Transform};
use homing_planner::SwitchConfig;
use homing_sim::views::OVERLAP_MIN;
use serde::{Deserialize, Serialize};

use crate::RunError;

/// The frame in which a set gives its camera poses.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct SetWorld;

impl Frame for SetWorld {
    const NAME: &'static str = "set_world";
}

/// A colour and depth image with its true pose.
#[derive(Clone, Debug)]
pub struct PosedFrame {
    /// The images. Stamps of a unit's frames differ: the pose search draws by them.
    pub frame: RgbdFrame,
    /// Where the camera was, metres.
    pub t_world_camera: Transform<SetWorld, Camera>,
}

/// Frames that are held in memory together, and the pairs to form among them.
#[derive(Clone, Debug, Default)]
pub struct Unit {
    /// The frames; features of each are extracted once.
    pub frames: Vec<PosedFrame>,
    /// The pairs.
    pub pairs: Vec<PlannedPair>,
}

/// A pair before it is measured.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct PlannedPair {
    /// Index of what the robot sees.
    pub query: usize,
    /// Index of the photo.
    pub goal: usize,
    /// What is known about the two.
    pub facts: PairFacts,
}

/// What a pair is for.
#[derive(Copy, Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PairKind {
    /// The two share at least a tenth, or were recorded so many frames apart: accuracy is measured here.
    Seen,
    /// The same two with their roles changed. For the switch alone: accuracy counts two views once.
    Turned,
    /// Of one flat, sharing less than a tenth.
    Unseen,
    /// Of two flats.
    Elsewhere,
}

/// What is known about a pair. Ground truth throughout.
#[derive(Copy, Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PairFacts {
    /// What it is for.
    pub kind: PairKind,
    /// Pairs of one cluster depend on each other: the seed of the robot's flat, the number of the robot's frame.
    pub cluster: u64,
    /// Number of the robot's view in its flat, or in its recording.
    pub query: u32,
    /// Number of the photo's.
    pub goal: u32,
    /// What they share, 0 to 1 ([`homing_sim::views::overlap`]); 0 of two flats.
    pub overlap: f64,
    /// Simulated: difference of the headings. Recorded: angle between the optical axes. Degrees; `None` of two flats.
    pub turn_deg: Option<f64>,
    /// Between the two cameras, metres; `None` of two flats.
    pub distance_m: Option<f64>,
    /// Same light, and furniture in the same places.
    pub same_state: bool,
    /// Of a recording: frames between the two.
    pub frames_apart: Option<u32>,
}

/// Sharing this much, a goal that is near enough is in view.
pub const IN_VIEW_OVERLAP_MIN: f64 = 0.3;

impl PairFacts {
    /// Whether the goal is in view and nearer than the planner's d_th: true if the two share at least
    /// [`IN_VIEW_OVERLAP_MIN`], false if they share less than [`OVERLAP_MIN`] or it is farther away. In between a goal is
    /// half in view, and either answer is right: `None`.
    #[must_use]
    pub fn goal_in_view(&self) -> Option<bool> {
        let near = self.distance_m.is_some_and(|m| m < SwitchConfig::default().distance_max_m);
        match (near, self.overlap) {
            (true, shared) if shared >= IN_VIEW_OVERLAP_MIN => Some(true),
            (true, shared) if shared >= OVERLAP_MIN => None,
            _ => Some(false),
        }
    }

    /// True of the pairs that accuracy is measured on.
    #[must_use]
    pub fn is_for_accuracy(&self) -> bool {
        self.kind == PairKind::Seen
    }
}

impl Unit {
    /// Pose of the photo's camera in the robot's, `None` of two flats.
    #[must_use]
    pub fn truth(&self, pair: &PlannedPair) -> Option<Transform<Camera, Goal>> {
        pair.facts.distance_m?;
        let (query, goal) = (&self.frames[pair.query], &self.frames[pair.goal]);
        // The goal camera is a camera of the set, too: the type changes, the numbers do not.
        let t_world_goal: Transform<SetWorld, Goal> = Transform::new(*goal.t_world_camera.isometry());
        Some(query.t_world_camera.inverse() * t_world_goal)
    }
}

/// Gives pairs, unit by unit, the same ones whenever asked.
pub trait PairSource: Sync {
    /// How many units there are.
    fn n_units(&self) -> usize;
    /// Renders or reads one.
    ///
    /// # Errors
    /// [`RunError`] when it cannot.
    fn unit(&self, i: usize) -> Result<Unit, RunError>;
}

#[cfg(test)]
impl PairFacts {
    /// Of two simulated views in one state of their flat, turned alike.
    pub(super) fn seen(overlap: f64, distance_m: Option<f64>) -> Self {
        Self {
            kind: PairKind::Seen,
            cluster: 0,
            query: 0,
            goal: 1,
            overlap,
            turn_deg: None,
            distance_m,
            same_state: true,
            frames_apart: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_goal_is_in_view_only_near_and_seen() {
        let facts = PairFacts::seen;
        assert_eq!(facts(0.5, Some(2.0)).goal_in_view(), Some(true));
        assert_eq!(facts(0.5, Some(4.5)).goal_in_view(), Some(false));
        assert_eq!(facts(0.2, Some(2.0)).goal_in_view(), None);
        assert_eq!(facts(0.05, Some(2.0)).goal_in_view(), Some(false));
        assert_eq!(facts(0.0, None).goal_in_view(), Some(false));
    }
}
