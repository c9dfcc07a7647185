//! Visual target navigation: the table of the paper of that name, on generated flats.
//!
//! [`pairs`] draws start and target views at the paper's distances and headings, [`run`] lets a method lead from one to the
//! other, [`bench`] does so for all methods and pairs, [`report`] is the paper's table with its figures beside ours.

pub mod bench;
pub mod methods;
pub mod pairs;
pub mod report;
pub mod run;
mod sheet;

pub use bench::{Method, Options, bench};
pub use methods::{Solver, rows};
pub use pairs::{Difficulty, PairSpec, TargetPair};
pub use report::Report;
pub use run::{PairRun, Sensor};
pub use sheet::contact_sheet;
