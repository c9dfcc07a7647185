//! Means, differences and distances with their intervals.

use serde::Serialize;

use crate::report::{wilson_95, wilson_95_of};

const Z: f64 = 1.959_963_984_540_054;

/// A mean with its interval.
#[derive(Copy, Clone, Debug, PartialEq, Serialize)]
pub struct Mean {
    /// Values.
    pub n: usize,
    /// Their mean.
    pub mean: f64,
    /// 95 % interval.
    pub interval_95: (f64, f64),
}

impl Mean {
    /// Of values from 0 to 1; `None` of none. The interval is the normal one. Values that are all alike have no spread to
    /// judge by: theirs is Wilson's of a share as large as the mean, which no values from 0 to 1 exceed.
    #[must_use]
    pub fn of_shares(values: &[f64]) -> Option<Self> {
        let (mean, half) = mean_and_half(values)?;
        let normal = ((mean - half).max(0.0), (mean + half).min(1.0));
        let interval_95 = if half > 0.0 { normal } else { wilson_95_of(mean.clamp(0.0, 1.0), values.len()) };
        Some(Self { n: values.len(), mean, interval_95 })
    }

    /// Of differences of such values, with the normal interval; `None` of fewer than two.
    #[must_use]
    pub fn of_differences(values: &[f64]) -> Option<Self> {
        let (mean, half) = mean_and_half(values).filter(|_| values.len() > 1)?;
        Some(Self { n: values.len(), mean, interval_95: ((mean - half).max(-1.0), (mean + half).min(1.0)) })
    }
}

fn mean_and_half(values: &[f64]) -> Option<(f64, f64)> {
    let n = values.len() as f64;
    if values.is_empty() {
        return None;
    }
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / (n - 1.0).max(1.0);
    // Below this the spread is that of rounding.
    let sd = if variance > 1e-24 { variance.sqrt() } else { 0.0 };
    Some((mean, Z * sd / n.sqrt()))
}

/// 95 % interval of a paired difference of shares, the other minus the first: Wilson's intervals of both, joined by how
/// alike the outcomes are (Newcombe, "Improved confidence intervals for the difference between binomial proportions based
/// on paired data", Statistics in Medicine 17, 1998, method 10). Of the episodes `both` were won by both, `only_first` and
/// `only_other` by one alone, `neither` by none.
#[must_use]
pub fn paired_share_95(both: usize, only_first: usize, only_other: usize, neither: usize) -> (f64, f64) {
    let n = both + only_first + only_other + neither;
    if n == 0 {
        return (-1.0, 1.0);
    }
    let [a, b, c, d] = [both, only_other, only_first, neither].map(|k| k as f64);
    let total = n as f64;
    let margins = (a + b) * (c + d) * (a + c) * (b + d);
    let product = a * d - b * c;
    let product = if product > 0.0 { (product - 0.5 * total).max(0.0) } else { product };
    let phi = if margins > 0.0 { product / margins.sqrt() } else { 0.0 };
    let (other, first) = ((a + b) / total, (a + c) / total);
    let (other_95, first_95) = (wilson_95(both + only_other, n), wilson_95(both + only_first, n));
    let join = |x: f64, y: f64| (x * x - 2.0 * phi * x * y + y * y).max(0.0).sqrt();
    let difference = other - first;
    let below = join(other - other_95.0, first_95.1 - first);
    let above = join(other_95.1 - other, first - first_95.0);
    ((difference - below).max(-1.0), (difference + above).min(1.0))
}

/// First Wasserstein distance of two samples of one size: the mean distance of their values, each sorted; in their unit.
/// `None` of no values, or of different sizes.
#[must_use]
pub fn wasserstein_1(a: &[f64], b: &[f64]) -> Option<f64> {
    if a.is_empty() || a.len() != b.len() {
        return None;
    }
    let sorted = |values: &[f64]| {
        let mut values = values.to_vec();
        values.sort_by(f64::total_cmp);
        values
    };
    let gaps = sorted(a).into_iter().zip(sorted(b)).map(|(x, y)| (x - y).abs());
    Some(gaps.sum::<f64>() / a.len() as f64)
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test may fail by panicking")]
mod tests {
    use super::*;

    fn near(a: (f64, f64), b: (f64, f64)) -> bool {
        (a.0 - b.0).abs() < 1e-6 && (a.1 - b.1).abs() < 1e-6
    }

    #[test]
    fn a_mean_has_the_normal_interval() {
        // 0, 1, 0.5, 0.5: mean 0.5, variance 0.5 / 3, standard error 0.204124, times 1.959964.
        let m = Mean::of_shares(&[0.0, 1.0, 0.5, 0.5]).unwrap();
        assert!(m.mean == 0.5 && near(m.interval_95, (0.099_924, 0.900_076)), "{m:?}");
        // Ten failures are no proof of impossibility: Wilson's of 0 of 10.
        let none = Mean::of_shares(&[0.0; 10]).unwrap();
        assert!(none.interval_95.0 == 0.0 && (none.interval_95.1 - 0.277_533).abs() < 1e-6, "{none:?}");
        assert_eq!(Mean::of_shares(&[]), None);
        assert_eq!(Mean::of_differences(&[0.5]), None);
        assert!(near(Mean::of_differences(&[-0.5, 0.5]).unwrap().interval_95, (-0.979_982, 0.979_982)));
    }

    #[test]
    fn paired_shares_have_newcombes_interval() {
        // Reference values: the formula worked out apart, in Python.
        assert!(near(paired_share_95(40, 5, 20, 35), (0.053491, 0.241075)), "{:?}", paired_share_95(40, 5, 20, 35));
        // Nothing but agreement still leaves doubt.
        let (low, high) = paired_share_95(50, 0, 0, 50);
        assert!(near((low, high), (-0.019234, 0.019234)), "{low} {high}");
        assert_eq!(paired_share_95(0, 0, 0, 0), (-1.0, 1.0));
        let (low, high) = paired_share_95(3, 1, 4, 2);
        let (low_back, high_back) = paired_share_95(3, 4, 1, 2);
        assert!(near((low, high), (-high_back, -low_back)), "the other way round it is the mirror image");
    }

    #[test]
    fn the_wasserstein_distance_is_the_mean_gap() {
        assert_eq!(wasserstein_1(&[3.0, 1.0], &[1.0, 4.0]), Some(0.5));
        assert_eq!(wasserstein_1(&[1.0, 2.0], &[2.0, 1.0]), Some(0.0), "samples, not pairs");
        assert_eq!(wasserstein_1(&[], &[]), None);
        assert_eq!(wasserstein_1(&[1.0], &[1.0, 2.0]), None);
    }
}
