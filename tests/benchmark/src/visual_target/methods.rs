//! The rows of the table: the paper's three procedures, each with any features and either pose solver.

use homing_perception::onnx::FeatureChoice;
use homing_perception::{AnyEstimator, PerceptionConfig, PerceptionError, PoseSolver};
use homing_planner::visual_target::{Approach, MultiStep, UnitStep};

use super::run::Sensor;

/// What makes a pose of matches.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Solver {
    /// OpenCV's EPnP RANSAC, as in the paper.
    Papers,
    /// Our own, with the tilts of both cameras known: the robot's is level, and so was the one that took the target view.
    Ours,
}

impl Solver {
    fn perception(self) -> PerceptionConfig {
        let level = Some(0.0);
        match self {
            Self::Papers => PerceptionConfig { solver: PoseSolver::EpnpRansac, ..PerceptionConfig::default() },
            Self::Ours => PerceptionConfig {
                solver: PoseSolver::Gravity,
                camera_down_rad: level,
                goal_down_rad: level,
                ..PerceptionConfig::default()
            },
        }
    }
}

/// A row of the table for each pipeline: what the camera delivers, and how sightings become motions.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Way {
    /// For tables.
    pub name: &'static str,
    /// What the camera delivers.
    pub sensor: Sensor,
    /// How sightings become motions.
    pub approach: Approach,
}

/// One step (paper, 2.3 and 3.2), multi-step, and colour alone in unit steps.
#[must_use]
pub fn ways() -> [Way; 3] {
    [
        Way { name: "one step", sensor: Sensor::RgbD, approach: Approach::OneStep },
        Way { name: "multi-step", sensor: Sensor::RgbD, approach: Approach::MultiStep(MultiStep::default()) },
        Way { name: "RGB, unit steps", sensor: Sensor::Rgb, approach: Approach::UnitStep(UnitStep::default()) },
    ]
}

/// One configuration of perception.
#[derive(Clone, Debug)]
pub struct Pipeline {
    /// For tables.
    pub name: String,
    /// What finds keypoints, and what pairs them.
    pub features: FeatureChoice,
    /// What makes a pose of matches.
    pub solver: Solver,
}

impl Pipeline {
    /// # Errors
    /// As [`AnyEstimator::open`].
    pub fn open(&self) -> Result<AnyEstimator, PerceptionError> {
        // OpenCV gets one thread per worker.
        AnyEstimator::open(PerceptionConfig { threads: Some(1), ..self.solver.perception() }, &self.features)
    }
}
