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
    pub guide: Guide,
}

/// What turns sightings into motions.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Guide {
    /// The paper's own: straight to where the target was seen; what is not seen is not reached.
    Approach(Approach),
    /// The whole planner, as in `homing bench`: map, search, approach, stop.
    Planner,
}

const ONE_STEP: Way = Way { name: "one step", sensor: Sensor::RgbD, guide: Guide::Approach(Approach::OneStep) };
const MULTI_STEP: Way =
    Way { name: "multi-step", sensor: Sensor::RgbD, guide: Guide::Approach(Approach::MultiStep(MultiStep::DEFAULT)) };
const UNIT_STEPS: Way =
    Way { name: "RGB, unit steps", sensor: Sensor::Rgb, guide: Guide::Approach(Approach::UnitStep(UnitStep::DEFAULT)) };
const PLANNER: Way = Way { name: "with map and search", sensor: Sensor::RgbD, guide: Guide::Planner };

/// One configuration of perception.
#[derive(Clone, Debug)]
pub struct Pipeline {
    /// For tables.
    pub name: String,
    /// What finds keypoints, and what pairs them.
    pub features: FeatureChoice,
    /// What makes a pose of matches.
    pub solver: Solver,
    /// Is the whole planner tried with it, too? Minutes a pair where the target is not found.
    pub planner: bool,
}

impl Pipeline {
    /// One step (paper, 2.3 and 3.2), multi-step, colour alone in unit steps, and the planner where it is asked for.
    #[must_use]
    pub fn ways(&self) -> &'static [Way] {
        const ALL: [Way; 4] = [ONE_STEP, MULTI_STEP, UNIT_STEPS, PLANNER];
        if self.planner { &ALL } else { &ALL[..3] }
    }

    /// # Errors
    /// As [`AnyEstimator::open`].
    pub fn open(&self) -> Result<AnyEstimator, PerceptionError> {
        // OpenCV gets one thread per worker.
        AnyEstimator::open(PerceptionConfig { threads: Some(1), ..self.solver.perception() }, &self.features)
    }
}
