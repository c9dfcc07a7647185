//! What the tables are made of: areas, quantiles, and intervals of paired differences.

use std::collections::BTreeMap;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::report::wilson_95;

/// Draws of a bootstrap.
const DRAWS: usize = 4000;

/// A share with its interval.
#[derive(Copy, Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Share {
    /// How many.
    pub n_hits: usize,
    /// Of how many.
    pub n: usize,
    /// The share, 0 to 1; 0 of none.
    pub share: f64,
    /// 95 % interval (Wilson, JASA 1927).
    pub interval_95: (f64, f64),
}

impl Share {
    /// `n_hits` of `n`.
    #[must_use]
    pub fn new(n_hits: usize, n: usize) -> Self {
        Self { n_hits, n, share: n_hits as f64 / n.max(1) as f64, interval_95: wilson_95(n_hits, n) }
    }

    /// Of the values for which `hit` holds.
    pub fn of<T>(values: impl IntoIterator<Item = T>, hit: impl Fn(&T) -> bool) -> Self {
        let (n_hits, n) = values.into_iter().fold((0, 0), |(k, n), value| (k + usize::from(hit(&value)), n + 1));
        Self::new(n_hits, n)
    }
}

/// Area under the curve of the share of errors below x, from 0 to `threshold`, divided by `threshold`: 1 if all errors are
/// 0, 0 if none is below it (Sarlin et al., "SuperGlue", CVPR 2020, section 5.2). The curve is linear between the errors;
/// an infinite error is a failure.
#[must_use]
pub fn area_under_curve(errors: &[f64], threshold: f64) -> f64 {
    let mut below: Vec<f64> = errors.iter().copied().filter(|e| *e < threshold).collect();
    below.sort_by(f64::total_cmp);
    let step = 1.0 / errors.len().max(1) as f64;
    let (mut area, mut x, mut y) = (0.0, 0.0, 0.0);
    for error in below {
        area += (error - x) * (y + 0.5 * step);
        (x, y) = (error, y + step);
    }
    (area + (threshold - x) * y) / threshold
}

/// The smallest value that at least `share` of all values do not exceed (nearest rank); `None` of none.
#[must_use]
pub fn quantile(mut values: Vec<f64>, share: f64) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let rank = (share * values.len() as f64).ceil() as usize;
    values.get(rank.clamp(1, values.len().max(1)) - 1).copied()
}

/// Two configurations on the same pairs: how much oftener the other one succeeds.
#[derive(Copy, Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PairedDifference {
    /// Pairs.
    pub n: usize,
    /// Pairs that only the first solves.
    pub n_only_first: usize,
    /// Pairs that only the other solves.
    pub n_only_other: usize,
    /// Share of the other minus share of the first.
    pub difference: f64,
    /// 95 % interval: percentiles of a bootstrap that draws whole clusters.
    pub interval_95: (f64, f64),
    /// Probability of so unequal a split, or a more unequal one, if both were equally good: McNemar's test, exact and
    /// two-sided.
    pub p_mcnemar: f64,
}

/// A pair of images that both configurations were asked about.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct PairedOutcome {
    /// Pairs of one cluster share images or surroundings, and are drawn together.
    pub cluster: u64,
    /// The first configuration solved it.
    pub first: bool,
    /// The other did.
    pub other: bool,
}

impl PairedDifference {
    /// Of all pairs. The draws are the same for equal outcomes.
    #[must_use]
    pub fn of(outcomes: &[PairedOutcome]) -> Self {
        let count = |keep: fn(&PairedOutcome) -> bool| outcomes.iter().filter(|o| keep(o)).count();
        let (n_only_first, n_only_other) = (count(|o| o.first && !o.other), count(|o| o.other && !o.first));
        Self {
            n: outcomes.len(),
            n_only_first,
            n_only_other,
            difference: (n_only_other as f64 - n_only_first as f64) / outcomes.len().max(1) as f64,
            interval_95: bootstrap_95(outcomes),
            p_mcnemar: mcnemar_exact(n_only_first, n_only_other),
        }
    }
}

/// Percentile interval of the difference of shares (Efron and Tibshirani 1993, section 13.3), clusters drawn with
/// replacement: pairs of one flat are not independent.
fn bootstrap_95(outcomes: &[PairedOutcome]) -> (f64, f64) {
    let mut clusters: BTreeMap<u64, (f64, f64)> = BTreeMap::new();
    for o in outcomes {
        let (sum, n) = clusters.entry(o.cluster).or_default();
        *sum += f64::from(i8::from(o.other) - i8::from(o.first));
        *n += 1.0;
    }
    let clusters: Vec<(f64, f64)> = clusters.into_values().collect();
    if clusters.is_empty() {
        return (-1.0, 1.0);
    }
    let rng = &mut ChaCha8Rng::seed_from_u64(0);
    let mut draw = || {
        let drawn = (0..clusters.len()).map(|_| clusters[rng.random_range(0..clusters.len() as u64) as usize]);
        let (sum, n) = drawn.fold((0.0, 0.0), |(sum, n), c| (sum + c.0, n + c.1));
        sum / n
    };
    let draws: Vec<f64> = (0..DRAWS).map(|_| draw()).collect();
    let at = |share| quantile(draws.clone(), share).unwrap_or_default();
    (at(0.025), at(0.975))
}

/// McNemar's test from the discordant counts: twice the binomial tail with probability one half, at most 1.
#[must_use]
pub fn mcnemar_exact(n_only_first: usize, n_only_other: usize) -> f64 {
    let n = n_only_first + n_only_other;
    let ln_half = -core::f64::consts::LN_2 * n as f64;
    let mut ln_choose = 0.0;
    let mut tail = 0.0;
    for k in 0..=n_only_first.min(n_only_other) {
        if k > 0 {
            ln_choose += ((n + 1 - k) as f64 / k as f64).ln();
        }
        tail += (ln_half + ln_choose).exp();
    }
    (2.0 * tail).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(a: f64, b: f64) -> bool {
        (a - b).abs() < 1e-12
    }

    #[test]
    fn the_area_is_the_one_worked_out_by_hand() {
        // (0, 0), (1, 1/2), (3, 1), (5, 1): 0.25 + 1.5 + 2 of 5.
        assert!(near(area_under_curve(&[3.0, 1.0], 5.0), 0.75));
        // One of four below the threshold: a triangle up to 2, a rectangle to 5: 0.25 + 0.75 of 5.
        assert!(near(area_under_curve(&[7.0, 2.0, f64::INFINITY, 5.0], 5.0), 0.2));
        assert!(near(area_under_curve(&[0.0, 0.0], 5.0), 1.0));
        assert_eq!(area_under_curve(&[f64::INFINITY], 20.0), 0.0);
        assert_eq!(area_under_curve(&[], 20.0), 0.0);
    }

    #[test]
    fn quantiles_are_values_that_occurred() {
        let values: Vec<f64> = (1..=100).map(f64::from).collect();
        assert_eq!(quantile(values.clone(), 0.5), Some(50.0));
        assert_eq!(quantile(values.clone(), 0.95), Some(95.0));
        assert_eq!(quantile(values, 1.0), Some(100.0));
        assert_eq!(quantile(vec![3.0], 0.95), Some(3.0));
        assert_eq!(quantile(vec![], 0.5), None);
    }

    #[test]
    fn mcnemars_test_is_exact() {
        // n = 10: 2 (1 + 10) / 1024.
        assert!(near(mcnemar_exact(1, 9), 22.0 / 1024.0));
        assert!(near(mcnemar_exact(9, 1), 22.0 / 1024.0));
        // n = 6: 2 / 64.
        assert!(near(mcnemar_exact(0, 6), 2.0 / 64.0));
        assert_eq!(mcnemar_exact(5, 5), 1.0);
        assert_eq!(mcnemar_exact(0, 0), 1.0);
        // Where one half to the n is zero in floating point.
        let p = mcnemar_exact(1000, 1100);
        assert!(p > 0.02 && p < 0.04, "{p}");
    }

    #[test]
    fn a_paired_difference_counts_what_only_one_solves() {
        let outcome = |i: u64, first, other| PairedOutcome { cluster: i, first, other };
        let outcomes: Vec<PairedOutcome> = (0..100)
            .map(|i| match i {
                0..40 => outcome(i, true, true),
                40..45 => outcome(i, true, false),
                45..65 => outcome(i, false, true),
                _ => outcome(i, false, false),
            })
            .collect();
        let d = PairedDifference::of(&outcomes);
        assert_eq!((d.n, d.n_only_first, d.n_only_other), (100, 5, 20));
        assert!(near(d.difference, 0.15));
        // The normal approximation: .15 +- 1.96 sqrt((.25 - .15^2) / 100).
        assert!((d.interval_95.0 - 0.056).abs() < 0.02 && (d.interval_95.1 - 0.244).abs() < 0.02, "{d:?}");
        assert!(d.p_mcnemar < 0.005);
        // The same pairs, ten to a cluster that all turn out alike, tell less.
        let alike: Vec<PairedOutcome> =
            outcomes.iter().map(|o| PairedOutcome { cluster: o.cluster / 10, ..*o }).collect();
        let wide = PairedDifference::of(&alike);
        assert!(wide.interval_95.1 - wide.interval_95.0 > 1.3 * (d.interval_95.1 - d.interval_95.0), "{wide:?}");
        assert_eq!(PairedDifference::of(&[]).p_mcnemar, 1.0);
    }
}
