//! Visual target navigation: the table of the paper of that name, on generated flats.
//!
//! [`pairs`] draws start and target views at the paper's distances and headings, [`run`] goes from one to the other,
//! [`bench`] does so with all features of [`methods`] on all pairs, [`report`] is the paper's table with its figures beside ours.

pub mod bench;
pub mod methods;
pub mod pairs;
pub mod report;
pub mod run;
mod sheet;

pub use bench::{Options, bench};
pub use methods::{Pipeline, Solver};
pub use pairs::{Difficulty, PairSpec, TargetPair};
pub use report::Report;
pub use run::{PairRun, Sensor};
pub use sheet::contact_sheet;
