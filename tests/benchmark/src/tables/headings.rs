//! The heading of the goal when the robot first drove to it: as believed and in truth (SLING, figure 3a).

use homing_core::wrap_angle;
use serde::Serialize;

use super::episodes::Episodes;
use super::estimate::wasserstein_1;
use super::rows::HEADLINES;
use crate::perception::Share;
use crate::report::median;

/// Width of a bar of the histogram, degrees.
pub(super) const BIN_DEG: f64 = 15.0;
/// Bars from -180 to 180 degrees.
const BINS: usize = 24;

/// First headings of one row on one set.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Headings {
    /// The row.
    pub row: String,
    /// The set.
    pub set: String,
    /// Episodes in which the robot drove to a goal.
    pub n: usize,
    /// First Wasserstein distance of the believed from the true headings, degrees.
    pub wasserstein_deg: f64,
    /// Median of the absolute difference, episode by episode, degrees.
    pub error_deg_median: f64,
    /// Believed within 15 degrees of straight ahead.
    pub within_15_believed: Share,
    /// Truly so.
    pub within_15_true: Share,
    /// Histogram of the believed ones, bars of 15 degrees from -180 on.
    pub bins_believed: Vec<usize>,
    /// Of the true ones.
    pub bins_true: Vec<usize>,
}

/// Rows whose headings are shown: those of the tables' head, and the one that the paper's figure was made with.
fn is_shown(row: &str) -> bool {
    HEADLINES.contains(&row) || row == "oracle-gd" || row == "sling-heading"
}

pub(super) fn by_cell(episodes: &Episodes<'_>) -> Vec<Headings> {
    episodes.cells().filter(|(row, _)| is_shown(row)).filter_map(|(row, set)| of(episodes, row, set)).collect()
}

/// `None` if no episode came that far.
fn of(episodes: &Episodes<'_>, row: &str, set: &str) -> Option<Headings> {
    let group = episodes.of(row, set);
    let pairs = group.values().filter_map(|e| e.first_heading_rad).filter(|(a, b)| a.is_finite() && b.is_finite());
    let (believed, truth): (Vec<f64>, Vec<f64>) =
        pairs.map(|(a, b)| (wrap_angle(a).to_degrees(), wrap_angle(b).to_degrees())).unzip();
    let errors = believed.iter().zip(&truth).map(|(a, b)| wrap_angle((a - b).to_radians()).abs().to_degrees());
    Some(Headings {
        row: row.to_owned(),
        set: set.to_owned(),
        n: truth.len(),
        wasserstein_deg: wasserstein_1(&believed, &truth)?,
        error_deg_median: median(errors.collect())?,
        within_15_believed: Share::of(&believed, |h| h.abs() <= BIN_DEG),
        within_15_true: Share::of(&truth, |h| h.abs() <= BIN_DEG),
        bins_believed: histogram(&believed),
        bins_true: histogram(&truth),
    })
}

fn histogram(headings_deg: &[f64]) -> Vec<usize> {
    let mut bins = vec![0; BINS];
    for heading in headings_deg {
        let bin = ((heading + 180.0) / BIN_DEG).floor().max(0.0) as usize;
        bins[bin.min(BINS - 1)] += 1;
    }
    bins
}
