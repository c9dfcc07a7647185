//! What became of the episodes, and every one that was lost.

use std::collections::{BTreeMap, BTreeSet};

use homing_sim::episode::Level;
use serde::Serialize;

use super::episodes::Episodes;
use super::info::clip_path;
use crate::cause::Cause;

/// What became of the episodes of one row on one set.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Causes {
    /// The row.
    pub row: String,
    /// The set.
    pub set: String,
    /// Episodes.
    pub n: usize,
    /// Successes by the strict rule.
    pub n_success: usize,
    /// Failures by cause; a failure without one is in none.
    pub causes: BTreeMap<Cause, usize>,
}

/// An episode that was lost.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Failure {
    /// The row.
    pub row: String,
    /// The set.
    pub set: String,
    /// The scene.
    pub scene: String,
    /// The episode.
    pub episode_id: String,
    /// Its level.
    pub level: Level,
    /// What lost it.
    pub cause: Option<Cause>,
    /// The planner's last words.
    pub reason: String,
    /// Actions taken.
    pub steps: u64,
    /// Distance to the goal at the end, metres; `None` if it is no number.
    pub final_distance_m: Option<f64>,
    /// Where its clip lies, relative to the report, if there is one.
    pub clip: Option<String>,
}

/// All causes, in the order in which things go wrong.
pub(super) const CAUSES: [Cause; 6] =
    [Cause::NeverInView, Cause::NotMatched, Cause::BadPose, Cause::WrongStop, Cause::Stuck, Cause::Budget];

pub(super) fn by_cell(episodes: &Episodes<'_>) -> Vec<Causes> {
    let cell = |(row, set): (&str, &str)| {
        let group = episodes.of(row, set);
        let mut causes = BTreeMap::new();
        for cause in group.values().filter(|e| !e.strict.success).filter_map(|e| e.cause) {
            *causes.entry(cause).or_insert(0) += 1;
        }
        let n_success = group.values().filter(|e| e.strict.success).count();
        Causes { row: row.to_owned(), set: set.to_owned(), n: group.len(), n_success, causes }
    };
    episodes.cells().map(cell).collect()
}

/// Of the headline rows alone: an ablation is there to fail.
pub(super) fn failures(episodes: &Episodes<'_>, clips: &BTreeSet<&str>) -> Vec<Failure> {
    let lost = episodes
        .headlines()
        .into_iter()
        .flat_map(|(row, set)| episodes.of(row, set).into_values().filter(|e| !e.strict.success));
    lost.map(|e| Failure {
        row: e.cell.row.clone(),
        set: e.cell.set.clone(),
        scene: e.scene.clone(),
        episode_id: e.episode_id.clone(),
        level: e.level,
        cause: e.cause,
        reason: e.reason.clone(),
        steps: e.strict.steps,
        final_distance_m: Some(e.strict.final_distance_m).filter(|d| d.is_finite()),
        clip: Some(clip_path(e)).filter(|path| clips.contains(path.as_str())),
    })
    .collect()
}
