//! One episode of the benchmark as it is kept: a line of JSON in a shard's file, and all that a report is made from.

use homing_sim::episode::{Level, Shape};
use homing_sim::score::Score;
use serde::{Deserialize, Serialize};

use crate::cause::{Cause, Watch};
use crate::episode::StageSeconds;

/// What is compared with the published tables: one row of a table, on one set of episodes.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct CellKey {
    /// The system under test, by the name of its row: `frontier`, `straight`, `oracle-gd`, `no-recovery` ...
    pub row: String,
    /// The episodes, by the name of their set: `flats-curved`, `flats-straight`, `layouts` ...
    pub set: String,
}

/// One episode that is over.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EpisodeRecord {
    /// Row and set.
    #[serde(flatten)]
    pub cell: CellKey,
    /// The scene's name: `flat seed 300000`, `Avonia_0.16`.
    pub scene: String,
    /// Names the episode within its set.
    pub episode_id: String,
    /// By the length of the shortest path.
    pub level: Level,
    /// Straight or curved, by NRNS's rule.
    pub shape: Shape,
    /// The score that is quoted.
    pub strict: Score,
    /// The score as the papers counted.
    pub published: Score,
    /// What lost it by the strict score; `None` for a success.
    pub cause: Option<Cause>,
    /// The planner's last words.
    pub reason: String,
    /// What really happened, step by step.
    pub watch: Watch,
    /// Heading of the goal's place from the robot when it first drove to a goal, left positive, radians: as the planner
    /// believed, and in truth (SLING, figure 3a). `None` if it never did.
    pub first_heading_rad: Option<(f64, f64)>,
    /// Time spent in each part, seconds.
    pub times: StageSeconds,
    /// From start to end, seconds.
    pub wall_s: f64,
    /// The program's commit, `+` behind it if the sources were changed since.
    #[serde(default)]
    pub commit: String,
}
