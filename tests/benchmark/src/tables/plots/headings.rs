//! First headings, believed and true, as in SLING's figure 3a.

use super::picture::{Axis, Lines, Mark, Picture};
use crate::perception::plots::style::colour;
use crate::tables::headings::BIN_DEG;
use crate::tables::{Headings, rows};

/// Both histograms, one as bars and one as a line.
pub(in crate::tables) fn headings(of: &Headings) -> Picture {
    let percent = |k: usize| 100.0 * k as f64 / of.n.max(1) as f64;
    let left = |i: usize| BIN_DEG * i as f64 - 180.0;
    let (blue, orange) = (colour(0), colour(5));
    let bar = |(i, k): (usize, &usize)| Mark::Box {
        from: (left(i) + 0.5, 0.0),
        to: (left(i + 1) - 0.5, percent(*k)),
        colour: blue,
        opacity: 0.55,
    };
    let mut marks: Vec<Mark> = of.bins_true.iter().enumerate().map(bar).collect();
    let outline = of.bins_believed.iter().enumerate();
    let points = outline.flat_map(|(i, k)| [(left(i), percent(*k)), (left(i + 1), percent(*k))]).collect();
    marks.push(Mark::Line { points, colour: orange });
    let highest = of.bins_true.iter().chain(&of.bins_believed).map(|k| percent(*k)).fold(0.0, f64::max);
    let step = if highest > 40.0 { 20 } else { 10 };
    let to = ((highest / f64::from(step)).ceil() * f64::from(step)).max(f64::from(step));
    let labels = (0..=100).step_by(step as usize).map(|p| (f64::from(p), p.to_string()));
    Picture {
        title: format!("First heading to the goal: {}, {}", rows::name(&of.row), of.set),
        subtitle: format!("{} episodes; Wasserstein distance {:.2} degrees", of.n, of.wasserstein_deg),
        x: Axis {
            name: "heading of the goal from the robot, degrees, left positive".to_owned(),
            from: -180.0,
            to: 180.0,
            labels: (-3..=3).map(|i| (60.0 * f64::from(i), (60 * i).to_string())).collect(),
            lines: Lines::None,
        },
        y: Axis {
            name: "percent of episodes".to_owned(),
            from: 0.0,
            to,
            labels: labels.filter(|(p, _)| *p <= to).collect(),
            lines: Lines::Drawn,
        },
        legend: vec![("in truth".to_owned(), blue), ("as believed".to_owned(), orange)],
        marks,
    }
}
