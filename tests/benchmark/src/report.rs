//! What a benchmark run came to: figures, JSON and a table.

use core::fmt;
use std::collections::BTreeMap;

use homing_sim::score::Score;
use serde::{Deserialize, Serialize};

use crate::bench::BenchOptions;
use crate::cause::{Cause, Watch};
use crate::episode::StageSeconds;
use crate::trial::Policy;

/// One episode.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EpisodeRow {
    /// Seed of the flat and of the episode in it.
    pub seed: u64,
    /// The strict score.
    #[serde(flatten)]
    pub score: Score,
    /// What lost it; `None` for a success.
    pub cause: Option<Cause>,
    /// The planner's last words.
    pub reason: String,
    /// What really happened.
    pub watch: Watch,
}

/// All episodes and what they come to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BenchReport {
    /// Goal discovery.
    pub policy: Policy,
    /// Extractor and matcher.
    pub features: String,
    /// Least and greatest geodesic distance of the episodes asked for, metres.
    pub distance_m: (f64, f64),
    /// Episodes.
    pub n_episodes: usize,
    /// Share that succeeded by the strict score, 0 to 1.
    pub success_rate: f64,
    /// 95 % interval of the success rate (Wilson, "Probable inference", JASA 1927).
    pub success_rate_95: (f64, f64),
    /// Mean success weighted by path length.
    pub spl: f64,
    /// Mean steps of all episodes.
    pub steps_mean: f64,
    /// Median steps of the successes.
    pub steps_median_success: Option<f64>,
    /// Median distance to the goal at the end of the successes, metres.
    pub final_distance_m_median: Option<f64>,
    /// Median difference of headings at the end of the successes, degrees.
    pub final_heading_error_deg_median: Option<f64>,
    /// Failures by cause.
    pub causes: BTreeMap<Cause, usize>,
    /// Mean time of each stage, milliseconds a step.
    pub stage_ms: StageSeconds,
    /// The rest of an episode's time: making flat, episode and score, milliseconds a step.
    pub rest_ms: f64,
    /// Whole episodes that one core runs in a minute, while the others run theirs.
    pub episodes_per_minute_core: f64,
    /// Steps that one core runs in a second, everything included.
    pub steps_per_second_core: f64,
    /// Every episode, by seed.
    pub episodes: Vec<EpisodeRow>,
}

impl BenchReport {
    /// From all episodes, by seed, with the time each spent, and the seconds that all took, one after the other.
    #[must_use]
    pub fn new(options: &BenchOptions, rows: Vec<(EpisodeRow, StageSeconds)>, seconds: f64) -> Self {
        let n_steps: u64 = rows.iter().map(|(row, _)| row.watch.n_steps).sum();
        let stage =
            |of: fn(&StageSeconds) -> f64| 1e3 * rows.iter().map(|(_, t)| of(t)).sum::<f64>() / n_steps.max(1) as f64;
        let stage_ms = StageSeconds {
            observe: stage(|t| t.observe),
            extract: stage(|t| t.extract),
            matching: stage(|t| t.matching),
            pose: stage(|t| t.pose),
            plan: stage(|t| t.plan),
        };
        let staged_ms = stage(|t| t.observe + t.extract + t.matching + t.pose + t.plan);
        let rest_ms = 1e3 * seconds / n_steps.max(1) as f64 - staged_ms;
        let episodes: Vec<EpisodeRow> = rows.into_iter().map(|(row, _)| row).collect();
        let n = episodes.len();
        let won: Vec<&Score> = episodes.iter().map(|e| &e.score).filter(|s| s.success).collect();
        let mean = |of: fn(&Score) -> f64| episodes.iter().map(|e| of(&e.score)).sum::<f64>() / n.max(1) as f64;
        let typical = |of: fn(&Score) -> f64| median(won.iter().map(|s| of(s)).collect());
        let mut causes = BTreeMap::new();
        for cause in episodes.iter().filter_map(|e| e.cause) {
            *causes.entry(cause).or_insert(0) += 1;
        }
        Self {
            policy: options.policy,
            features: format!("{} + {}", options.features.extractor.name(), options.features.matcher.name()),
            distance_m: (options.spec.min_m, options.spec.max_m),
            n_episodes: n,
            success_rate: won.len() as f64 / n.max(1) as f64,
            success_rate_95: wilson_95(won.len(), n),
            spl: mean(|s| s.spl),
            steps_mean: mean(|s| s.steps as f64),
            steps_median_success: typical(|s| s.steps as f64),
            final_distance_m_median: typical(|s| s.final_distance_m),
            final_heading_error_deg_median: typical(|s| s.final_heading_error_deg),
            causes,
            stage_ms,
            rest_ms,
            episodes_per_minute_core: 60.0 * n as f64 / seconds,
            steps_per_second_core: n_steps as f64 / seconds,
            episodes,
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

/// Interval that holds the true rate in 95 % of cases (Wilson 1927, equation 4 with z = 1.96).
#[must_use]
pub fn wilson_95(n_success: usize, n: usize) -> (f64, f64) {
    wilson_95_of(n_success as f64 / n.max(1) as f64, n)
}

/// The same of a rate, 0 to 1, observed on `n`. For the mean of any values from 0 to 1 it is too wide rather than too
/// narrow: none of that mean spread wider than zeros and ones do.
pub(crate) fn wilson_95_of(rate: f64, n: usize) -> (f64, f64) {
    if n == 0 {
        return (0.0, 1.0);
    }
    const Z: f64 = 1.959_963_984_540_054;
    let n = n as f64;
    let centre = (rate + Z * Z / (2.0 * n)) / (1.0 + Z * Z / n);
    let half = Z / (1.0 + Z * Z / n) * (rate * (1.0 - rate) / n + Z * Z / (4.0 * n * n)).sqrt();
    ((centre - half).max(0.0), (centre + half).min(1.0))
}

/// The middle value, or the mean of the two middle ones.
pub(crate) fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let (low, high) = (values.len().checked_sub(1)? / 2, values.len() / 2);
    Some(0.5 * (values[low] + values[high]))
}

impl fmt::Display for EpisodeRow {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let s = &self.score;
        let step = |at: Option<u64>| at.map_or("-".to_owned(), |n| n.to_string());
        write!(
            f,
            "{:5} {} {:5} {:7.1} {:7.1} {:5.2} {:7.2} {:6.1} {:>7} {:>6} {:5} {:6} {:6}  {}",
            self.seed,
            if s.success { "yes" } else { "-  " },
            s.steps,
            s.path_length_m,
            s.shortest_path_m,
            s.spl,
            s.final_distance_m,
            s.final_heading_error_deg,
            step(self.watch.first_in_view),
            step(self.watch.first_right),
            self.watch.n_right,
            self.watch.n_wrong,
            self.watch.n_misled,
            self.cause.map_or("", Cause::words),
        )
    }
}

impl EpisodeRow {
    /// Heads the columns of its `Display`.
    pub const HEADER: &str = " seed won steps  path_m short_m   spl final_m  deg  in_view  found right  wrong misled";
}

impl fmt::Display for BenchReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let percent = |x: f64| 100.0 * x;
        let or_none = |x: Option<f64>| x.map_or("-".to_owned(), |v| format!("{v:.2}"));
        writeln!(
            f,
            "{:?}, {}: success {:.1} % (95 %: {:.1} to {:.1}) of {} episodes, SPL {:.3}",
            self.policy,
            self.features,
            percent(self.success_rate),
            percent(self.success_rate_95.0),
            percent(self.success_rate_95.1),
            self.n_episodes,
            self.spl
        )?;
        writeln!(
            f,
            "successes, medians: {} steps, {} m and {} degrees from the goal; all episodes: {:.0} steps on average",
            self.steps_median_success.map_or("-".to_owned(), |steps| format!("{steps:.0}")),
            or_none(self.final_distance_m_median),
            or_none(self.final_heading_error_deg_median),
            self.steps_mean
        )?;
        for (cause, n) in &self.causes {
            writeln!(f, "  failed {n:3}: {}", cause.words())?;
        }
        let t = &self.stage_ms;
        writeln!(
            f,
            "ms a step: render {:.1}, extract {:.1}, match {:.1}, pose {:.1}, plan {:.1}, all else {:.1}",
            t.observe, t.extract, t.matching, t.pose, t.plan, self.rest_ms
        )?;
        writeln!(
            f,
            "on one core: {:.1} episodes a minute, {:.1} steps a second, everything included",
            self.episodes_per_minute_core, self.steps_per_second_core
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_interval_is_wilsons() {
        // Reference values: the formula in 30-digit decimal arithmetic.
        let (low, high) = wilson_95(70, 100);
        assert!((low - 0.604_151_5).abs() < 1e-6 && (high - 0.781_051_1).abs() < 1e-6, "{low} {high}");
        assert_eq!(wilson_95(0, 0), (0.0, 1.0));
        assert_eq!(wilson_95(0, 10).0, 0.0);
        assert!(wilson_95(10, 10).1 <= 1.0);
    }

    #[test]
    fn a_median_is_the_middle() {
        assert_eq!(median(vec![]), None);
        assert_eq!(median(vec![3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(vec![4.0, 1.0, 2.0, 3.0]), Some(2.5));
    }
}
