//! Accuracy, switches and time of perception, for any configuration, on pairs of posed frames.
//!
//! [`PairSource`] gives frames and pairs: [`SimulatedPairs`] renders them, recordings are read by whoever can read files.
//! [`measure()`] extracts features once per frame and estimates a pose per pair; [`time_stages`] times the stages apart.
//! [`PerceptionReport`] makes figures of both, [`plots()`] pictures.

mod accuracy;
mod findings;
mod measure;
mod pairs;
pub(crate) mod plots;
mod report;
mod sensor;
mod simulated;
mod stages;
mod statistics;
mod switch_accuracy;
mod table;
mod workbench;

pub use accuracy::{AUC_DEG, Accuracy, Class, HEADLINE_TURN_DEG, TOLERANCES, Tolerance, angular_error_deg};
pub use findings::{Finding, FoundPose, PoseError};
pub use measure::{MeasureOptions, Measured, measure};
pub use pairs::{IN_VIEW_OVERLAP_MIN, PairFacts, PairKind, PairSource, PlannedPair, PosedFrame, SetWorld, Unit};
pub use plots::{Plot, PlotError, plots};
pub use report::{Comparison, ConfigurationReport, PerceptionReport, ReportPlan};
pub use sensor::Unregistered;
pub use simulated::SimulatedPairs;
pub use stages::{Milliseconds, StageReport, time_stages};
pub use statistics::{PairedDifference, PairedOutcome, Share, area_under_curve, mcnemar_exact, quantile};
pub use switch_accuracy::{Decisions, SwitchAccuracy};
pub use workbench::Setup;
