//! Success by how far away the goal is.

use super::picture::{Axis, Mark, Picture};
use crate::perception::plots::style::colour;
use crate::tables::{Distances, rows};

/// Share of a group's width that its bars take.
const FILLED: f64 = 0.76;

/// Bars of all rows on one set; `None` if there are none.
pub(in crate::tables) fn distances(set: &str, all: &[Distances]) -> Option<Picture> {
    let shown: Vec<&Distances> = all.iter().filter(|d| d.set == set).collect();
    let first = shown.first()?;
    let width = FILLED / shown.len() as f64;
    let mut marks = Vec::new();
    for (i, row) in shown.iter().enumerate() {
        for (group, bin) in row.bins.iter().enumerate().filter(|(_, b)| b.success.n > 0) {
            let from = group as f64 + 0.5 * (1.0 - FILLED) + i as f64 * width;
            let (s, middle) = (&bin.success, from + 0.47 * width);
            let (high, low) = (100.0 * s.interval_95.1, 100.0 * s.interval_95.0);
            let to = (from + 0.94 * width, 100.0 * s.share);
            marks.push(Mark::Box { from: (from, 0.0), to, colour: colour(i), opacity: 1.0 });
            marks.push(Mark::Whisker { x: middle, low, high });
            marks.push(Mark::Above { at: (middle, high), text: format!("{:.0}", 100.0 * s.share) });
        }
    }
    Some(Picture {
        title: format!("Success by distance, {set}"),
        subtitle: "strict rule; lines: 95 % interval (Wilson)".to_owned(),
        x: Axis::names("length of the shortest path", first.bins.iter().map(super::super::Bin::words).collect()),
        y: Axis::percent("percent of episodes"),
        legend: shown.iter().enumerate().map(|(i, d)| (rows::name(&d.row), colour(i))).collect(),
        marks,
    })
}
