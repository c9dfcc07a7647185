//! The benchmark: whole episodes in one process, in lockstep, and what came of them.
//!
//! [`episode::run_episode`] is the distributed system's loop without its network: the same events, so the same actions.
//! [`bench::bench`] runs one episode in each of many generated flats, scores it strictly and says why it failed if it did.
//! [`recall::recall`] asks for goals that were seen long ago.
//! [`perception`] measures the eyes alone, on pairs of images.
//! [`tables`] sets the records of many episodes beside the published tables.

pub mod ablations;
pub mod bench;
pub mod cause;
pub mod clip;
pub mod episode;
mod error;
pub mod perception;
pub mod recall;
pub mod record;
pub mod report;
pub mod suite;
pub mod tables;
pub mod trial;
pub mod visual_target;

pub use ablations::{ABLATIONS, Ablation, ablation};
pub use bench::{BenchOptions, bench};
pub use cause::{Cause, Moment, Watch};
pub use episode::{EpisodeRun, StepRecord, run_episode};
pub use error::RunError;
pub use record::{CellKey, EpisodeRecord};
pub use report::{BenchReport, EpisodeRow};
pub use trial::{GoalPose, LastMile, Policy, Trial};
