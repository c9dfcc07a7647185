//! Time per stage, measured apart: one thing at a time, and the configurations in turn, so that whatever else the machine
//! does falls on all of them alike.

use std::time::{Duration, Instant};

use homing_core::StageTimes;
use serde::{Deserialize, Serialize};

use super::pairs::PairSource;
use super::statistics::quantile;
use super::workbench::{Setup, Workbench};
use crate::RunError;

/// Milliseconds of one stage.
#[derive(Copy, Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Milliseconds {
    /// Median.
    pub p50: f64,
    /// 95 in 100 take no longer.
    pub p95: f64,
}

/// Time per stage of one configuration, for one frame with the photo's features at hand.
#[derive(Copy, Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StageReport {
    /// Frames timed.
    pub n: usize,
    /// Threads of each model and of OpenCV; pose search uses one.
    pub threads: u16,
    /// Keypoints and descriptors.
    pub extract_ms: Milliseconds,
    /// Matching.
    pub match_ms: Milliseconds,
    /// Lifting, pose, covariance.
    pub pose_ms: Milliseconds,
    /// All three.
    pub total_ms: Milliseconds,
}

/// Times `n_pairs` pairs of a source that accuracy is measured on; with `threads` for models and OpenCV.
///
/// # Errors
/// [`RunError`] when a unit or a configuration fails.
pub fn time_stages(
    source: &dyn PairSource,
    setups: &[Setup],
    threads: u16,
    n_pairs: usize,
) -> Result<Vec<StageReport>, RunError> {
    let mut bench = Workbench::open(setups, threads)?;
    let mut times: Vec<Vec<StageTimes>> = vec![Vec::with_capacity(n_pairs); setups.len()];
    for i in 0..source.n_units() {
        let unit = source.unit(i)?;
        let wanted = n_pairs - times.first().map_or(n_pairs, Vec::len);
        for pair in unit.pairs.iter().filter(|p| p.facts.is_for_accuracy()).take(wanted) {
            for (probe, times) in bench.probes.iter_mut().zip(&mut times) {
                let photo = probe.extract(&unit.frames[pair.goal].frame.rgb)?;
                probe.show(&unit, pair.goal, &photo)?;
                let start = Instant::now();
                let seen = probe.extract(&unit.frames[pair.query].frame.rgb)?;
                let extract = start.elapsed();
                let estimate = probe.estimate(&unit, pair.query, &seen)?;
                times.push(StageTimes { extract, ..estimate.times });
            }
        }
        if times.first().is_none_or(|t| t.len() >= n_pairs) {
            break;
        }
    }
    Ok(times.iter().map(|times| StageReport::of(times, threads)).collect())
}

impl StageReport {
    /// Quantiles of the times of single frames.
    #[must_use]
    pub fn of(times: &[StageTimes], threads: u16) -> Self {
        let stage = |of: fn(&StageTimes) -> Duration| {
            let ms: Vec<f64> = times.iter().map(|t| of(t).as_secs_f64() * 1e3).collect();
            let at = |share| quantile(ms.clone(), share).unwrap_or_default();
            Milliseconds { p50: at(0.5), p95: at(0.95) }
        };
        Self {
            n: times.len(),
            threads,
            extract_ms: stage(|t| t.extract),
            match_ms: stage(|t| t.matching),
            pose_ms: stage(|t| t.pose),
            total_ms: stage(|t| t.extract + t.matching + t.pose),
        }
    }
}
