//! The rows of the table: the paper's three procedures with any features and either pose solver.

use homing_perception::onnx::FeatureChoice;
use homing_perception::{PerceptionConfig, PoseSolver};
use homing_planner::visual_target::{Approach, MultiStep, UnitStep};

use super::bench::Method;
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

/// One step (paper, 2.3 and 3.2), multi-step, and colour alone in unit steps.
#[must_use]
pub fn rows(name: &str, features: &FeatureChoice, solver: Solver) -> [Method; 3] {
    let row = |how: &str, sensor, approach| Method {
        name: format!("{name}, {how}"),
        features: features.clone(),
        perception: solver.perception(),
        sensor,
        approach,
    };
    [
        row("one step", Sensor::RgbD, Approach::OneStep),
        row("multi-step", Sensor::RgbD, Approach::MultiStep(MultiStep::default())),
        row("RGB, unit steps", Sensor::Rgb, Approach::UnitStep(UnitStep::default())),
    ]
}
