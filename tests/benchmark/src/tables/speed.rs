//! Time, errors at the end and collisions of every row.

use homing_sim::episode::Level;
use serde::Serialize;

use super::episodes::{Episodes, Group, finite, or_zero};
use super::estimate::Mean;
use crate::episode::StageSeconds;
use crate::record::EpisodeRecord;
use crate::report::median;

/// How fast a row ran on a set, and how it drove.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Speed {
    /// The row.
    pub row: String,
    /// The set.
    pub set: String,
    /// Episodes.
    pub n: usize,
    /// Mean actions of an episode.
    pub steps_mean: f64,
    /// Episodes a minute and worker; `None` if no time was taken.
    pub episodes_per_minute: Option<f64>,
    /// Steps a second and worker.
    pub steps_per_second: Option<f64>,
    /// Mean time of each stage, milliseconds a step.
    pub stage_ms: StageSeconds,
    /// What is left of the time of a step, milliseconds: set-up, physics, records.
    pub other_ms: f64,
    /// Mean SPL with progress in place of success.
    pub soft_spl: Option<Mean>,
    /// Mean distance to the goal at the end, geodesic, all episodes, metres.
    pub final_distance_m_mean: Option<f64>,
    /// Median of the successes, metres.
    pub success_distance_m_median: Option<f64>,
    /// Median difference of headings of the successes, degrees.
    pub success_heading_deg_median: Option<f64>,
    /// Motions that an obstacle cut short, per episode.
    pub collisions_mean: f64,
    /// Of all steps, the share that collided, 0 to 1.
    pub collided_share: f64,
    /// Episodes above 10 m, which are not in the published tables.
    pub n_extra: usize,
}

pub(super) fn by_cell(episodes: &Episodes<'_>) -> Vec<Speed> {
    episodes.cells().map(|(row, set)| of(row, set, &episodes.of(row, set))).collect()
}

fn of(row: &str, set: &str, group: &Group<'_>) -> Speed {
    let all: Vec<&EpisodeRecord> = group.values().copied().collect();
    let sum = |of: &dyn Fn(&EpisodeRecord) -> f64| all.iter().map(|e| or_zero(of(e))).sum::<f64>();
    let (n, steps, wall_s) = (all.len().max(1) as f64, sum(&|e| e.strict.steps as f64), sum(&|e| e.wall_s));
    let a_step_ms = |of: fn(&StageSeconds) -> f64| 1e3 * sum(&|e| of(&e.times)) / steps.max(1.0);
    let stage_ms = StageSeconds {
        observe: a_step_ms(|t| t.observe),
        extract: a_step_ms(|t| t.extract),
        matching: a_step_ms(|t| t.matching),
        pose: a_step_ms(|t| t.pose),
        plan: a_step_ms(|t| t.plan),
    };
    let staged = stage_ms.observe + stage_ms.extract + stage_ms.matching + stage_ms.pose + stage_ms.plan;
    let collisions = sum(&|e| e.strict.collisions as f64);
    let won = || all.iter().filter(|e| e.strict.success);
    let distances = finite(all.iter().map(|e| e.strict.final_distance_m));
    Speed {
        row: row.to_owned(),
        set: set.to_owned(),
        n: all.len(),
        steps_mean: steps / n,
        episodes_per_minute: (wall_s > 0.0).then(|| 60.0 * n / wall_s),
        steps_per_second: (wall_s > 0.0).then(|| steps / wall_s),
        stage_ms,
        other_ms: (1e3 * wall_s / steps.max(1.0) - staged).max(0.0),
        soft_spl: Mean::of_shares(&all.iter().map(|e| or_zero(e.strict.soft_spl)).collect::<Vec<_>>()),
        final_distance_m_mean: (!distances.is_empty()).then(|| distances.iter().sum::<f64>() / distances.len() as f64),
        success_distance_m_median: median(finite(won().map(|e| e.strict.final_distance_m))),
        success_heading_deg_median: median(finite(won().map(|e| e.strict.final_heading_error_deg))),
        collisions_mean: collisions / n,
        collided_share: collisions / steps.max(1.0),
        n_extra: all.iter().filter(|e| e.level == Level::Extra).count(),
    }
}
