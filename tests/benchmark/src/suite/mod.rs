//! The whole benchmark: every row of the tables on every set of episodes, in shards that survive a kill.
//!
//! [`rows`] says what is tried, [`sets`] on which episodes, [`plan`] how many of each and in which order. [`run`] runs what
//! a [`store`] does not hold yet; [`crate::tables`] makes the report of what it holds.

pub mod course;
pub mod plan;
pub mod rows;
pub mod run;
pub mod sets;
pub mod store;

pub use course::{Course, InProcess, LayCourse, Onlooker};
pub use plan::{Amounts, Plan, Task};
pub use rows::{Row, rows};
pub use run::{RunOptions, run};
pub use sets::{EpisodeRef, EpisodeSource, SetError};
pub use store::{Header, Shard, Store, StoreError};
