//! What a run came to.

use serde::{Deserialize, Serialize};

use super::accuracy::{Accuracy, Class, TOLERANCES, Tolerance};
use super::findings::Finding;
use super::measure::Measured;
use super::pairs::PairFacts;
use super::stages::StageReport;
use super::statistics::{PairedDifference, PairedOutcome};
use super::switch_accuracy::SwitchAccuracy;
use super::workbench::Setup;

/// All figures.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PerceptionReport {
    /// What was measured on, in words.
    pub set: String,
    /// Pairs estimated.
    pub n_pairs: usize,
    /// Of these, pairs that accuracy is measured on: each two views once.
    pub n_for_accuracy: usize,
    /// Units side by side while accuracy was measured.
    pub threads: usize,
    /// By configuration, in the order asked for.
    pub configurations: Vec<ConfigurationReport>,
    /// The first configuration beside each other one.
    pub comparisons: Vec<Comparison>,
    /// Most memory this process held at a time (VmHWM), all configurations, images and the simulator included, megabytes.
    pub peak_memory_mb: Option<f64>,
}

/// Figures of one configuration.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ConfigurationReport {
    /// As asked for.
    pub name: String,
    /// Finds keypoints.
    pub extractor: String,
    /// Pairs them.
    pub matcher: String,
    /// By class of pair.
    pub accuracy: Vec<Accuracy>,
    /// Where pairs without the goal in view were measured, too.
    pub switches: Option<SwitchAccuracy>,
    /// Time per stage, measured apart.
    pub stages: Option<StageReport>,
}

/// Two configurations on the same pairs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    /// The first configuration.
    pub first: String,
    /// The other.
    pub other: String,
    /// Which pairs.
    pub class: String,
    /// What counts as success.
    pub tolerance: Tolerance,
    /// Other minus first.
    #[serde(flatten)]
    pub difference: PairedDifference,
}

/// What to report on.
#[derive(Clone, Debug)]
pub struct ReportPlan {
    /// What was measured on, in words.
    pub set: String,
    /// Classes of the tables.
    pub classes: Vec<Class>,
    /// Classes on which configurations are compared.
    pub compared: Vec<Class>,
    /// Whether the set has pairs without the goal in view.
    pub with_switches: bool,
    /// Units side by side.
    pub threads: usize,
}

impl PerceptionReport {
    /// From findings, and from times where they were measured.
    #[must_use]
    pub fn new(plan: &ReportPlan, setups: &[Setup], measured: &Measured, stages: &[StageReport]) -> Self {
        let configuration = |(i, setup): (usize, &Setup)| {
            let findings = &measured.findings[i];
            let accuracy = |class: &Class| Accuracy::of(class, &of_class(&measured.pairs, findings, class));
            let switches = || SwitchAccuracy::of(&measured.pairs, findings);
            ConfigurationReport {
                name: setup.name.clone(),
                extractor: setup.features.extractor.name().to_owned(),
                matcher: setup.features.matcher.name().to_owned(),
                accuracy: plan.classes.iter().map(accuracy).collect(),
                switches: plan.with_switches.then(switches),
                stages: stages.get(i).copied(),
            }
        };
        Self {
            set: plan.set.clone(),
            n_pairs: measured.pairs.len(),
            n_for_accuracy: measured.pairs.iter().filter(|p| p.is_for_accuracy()).count(),
            threads: plan.threads,
            configurations: setups.iter().enumerate().map(configuration).collect(),
            comparisons: comparisons(plan, setups, measured),
            peak_memory_mb: None,
        }
    }

    /// As JSON, indented.
    ///
    /// # Errors
    /// None that its own types can cause; the serialiser's are handed on.
    pub fn to_json(&self) -> serde_json::Result<String> {
        serde_json::to_string_pretty(self)
    }
}

/// Findings for the pairs of a class that accuracy is measured on.
pub(super) fn of_class(pairs: &[PairFacts], findings: &[Finding], class: &Class) -> Vec<Finding> {
    let both = pairs.iter().zip(findings);
    both.filter(|(p, _)| p.is_for_accuracy() && class.holds(p)).map(|(_, f)| *f).collect()
}

fn comparisons(plan: &ReportPlan, setups: &[Setup], measured: &Measured) -> Vec<Comparison> {
    let mut all = Vec::new();
    for (i, other) in setups.iter().enumerate().skip(1) {
        for class in &plan.compared {
            for tolerance in TOLERANCES {
                let outcomes = measured.pairs.iter().enumerate().filter(|(_, p)| p.is_for_accuracy() && class.holds(p));
                let outcome = |(n, p): (usize, &PairFacts)| PairedOutcome {
                    cluster: p.cluster,
                    first: tolerance.holds(&measured.findings[0][n]),
                    other: tolerance.holds(&measured.findings[i][n]),
                };
                all.push(Comparison {
                    first: setups[0].name.clone(),
                    other: other.name.clone(),
                    class: class.words(),
                    tolerance,
                    difference: PairedDifference::of(&outcomes.map(outcome).collect::<Vec<_>>()),
                });
            }
        }
    }
    all
}
