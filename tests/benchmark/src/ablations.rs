//! The papers' ablations (SLING table 2) on our system: one row, one change.

use std::path::Path;

use homing_perception::onnx::{ChoiceError, FeatureChoice, ModelName, SwitchChoice};
use homing_perception::{PerceptionConfig, PoseSolver};
use homing_planner::{PlannerConfig, Recovery, SwitchKind};

use crate::BenchOptions;

/// Names of the rows, and what each changes.
pub const ABLATIONS: [(&str, &str); 8] = [
    ("frontier", "nothing: our own features, solver and switches, Frontier"),
    ("sift", "SIFT instead of our own features (\"w/o Neural Features\")"),
    ("epnp", "OpenCV's EPnP + RANSAC, as the papers have it"),
    ("sling-heading", "the same, with SLING's published formula for the heading"),
    ("sling-switch", "SLING's switches as published: one estimate decides, nothing is fused"),
    ("no-recovery", "our switches without a way back (\"w/o Recovery\")"),
    ("mlp-switch", "the learned switch for the way in, SLING's for the way back (\"w/ MLP Switch\")"),
    ("mlp-switch-no-recovery", "the learned switch without a way back (\"w/ MLP Switch w/o Recovery\")"),
];

/// The learned switch that comes with Homing.
pub const LEARNED_SWITCH: &str = "homing-switch";

/// How to configure a row.
#[derive(Clone, Debug, PartialEq)]
pub struct Ablation {
    /// Features, and the learned switch where it is used.
    pub features: FeatureChoice,
    /// Perception.
    pub perception: PerceptionConfig,
    /// Planner.
    pub planner: PlannerConfig,
}

/// The row of a name, one of [`ABLATIONS`]; `None` for any other. `models` is the folder of the models.
///
/// # Errors
/// [`ChoiceError`] where a model is not listed in that folder.
pub fn ablation(name: &str, models: &Path) -> Result<Option<Ablation>, ChoiceError> {
    let mut row = Ablation {
        features: FeatureChoice::listed("homing", None, models)?,
        perception: PerceptionConfig::default(),
        planner: PlannerConfig::default(),
    };
    let switches = &mut row.planner.switches;
    match name {
        "frontier" => {}
        "sift" => row.features = FeatureChoice::default(),
        "epnp" => row.perception.solver = PoseSolver::EpnpRansac,
        "sling-heading" => row.perception.solver = PoseSolver::SlingHeading,
        "sling-switch" => switches.kind = SwitchKind::Sling,
        "no-recovery" => switches.recovery = Recovery::Off,
        "mlp-switch" | "mlp-switch-no-recovery" => {
            switches.kind = SwitchKind::LEARNED;
            if name == "mlp-switch-no-recovery" {
                switches.recovery = Recovery::Off;
            }
            row.features.switch = SwitchChoice::resolve(&ModelName::Listed(LEARNED_SWITCH.to_owned()), models)?;
        }
        _ => return Ok(None),
    }
    Ok(Some(row))
}

impl Ablation {
    /// As a benchmark's options, one thread for all of it.
    #[must_use]
    pub fn options(self) -> BenchOptions {
        let Self { mut features, perception, planner } = self;
        features.run.threads = 1;
        BenchOptions { threads: 1, features, perception, planner, ..BenchOptions::default() }
    }
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test may fail by panicking")]
mod tests {
    use super::*;

    #[test]
    fn every_row_changes_what_it_says_and_nothing_else() {
        let models = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../nodes/perception/models"));
        let row = |name: &str| ablation(name, models).unwrap().unwrap();
        let base = row("frontier");
        assert_eq!((&base.perception, &base.planner), (&PerceptionConfig::default(), &PlannerConfig::default()));
        let changes = |name: &str| {
            let row = row(name);
            let switches = (row.planner.switches.kind, row.planner.switches.recovery);
            let mut planner = row.planner;
            planner.switches = base.planner.switches;
            assert_eq!(planner, base.planner, "{name} changes more of the planner than its switches");
            (row.features != base.features, row.perception != base.perception, switches)
        };
        let fused = (SwitchKind::Fused, Recovery::On);
        assert_eq!(changes("sift"), (true, false, fused));
        assert_eq!(changes("epnp"), (false, true, fused));
        assert_eq!(changes("sling-heading"), (false, true, fused));
        assert_eq!(changes("sling-switch"), (false, false, (SwitchKind::Sling, Recovery::On)));
        assert_eq!(changes("no-recovery"), (false, false, (SwitchKind::Fused, Recovery::Off)));
        assert_eq!(changes("mlp-switch"), (true, false, (SwitchKind::LEARNED, Recovery::On)));
        assert_eq!(changes("mlp-switch-no-recovery"), (true, false, (SwitchKind::LEARNED, Recovery::Off)));
        let learned = row("mlp-switch").features;
        assert_eq!(FeatureChoice { switch: SwitchChoice::Geometry, ..learned }, base.features);
        assert_eq!(ablation("oracle", models).unwrap(), None);
        let names: std::collections::BTreeSet<&str> = ABLATIONS.iter().map(|(name, _)| *name).collect();
        assert_eq!(names.len(), ABLATIONS.len());
        assert!(ABLATIONS.iter().all(|(name, _)| ablation(name, models).unwrap().is_some()));
    }
}
