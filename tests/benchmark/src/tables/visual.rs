//! The visual target benchmark, as its paper's table has it.

use serde::Serialize;

use crate::visual_target::report::{Cell, Column, MethodReport};
use crate::visual_target::{Difficulty, Report};

/// The pairs and what each method came to.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct VisualTarget {
    /// The pairs of each difficulty.
    pub pairs: Vec<PairColumn>,
    /// Method by method.
    pub methods: Vec<MethodRow>,
}

/// The pairs of one difficulty.
#[derive(Copy, Clone, Debug, PartialEq, Serialize)]
pub struct PairColumn {
    /// Which.
    pub difficulty: Difficulty,
    /// Pairs.
    pub n: usize,
    /// Mean distance from start to target, metres.
    pub distance_m: f64,
    /// Mean difference of headings, degrees.
    pub heading_deg: f64,
}

/// One method.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MethodRow {
    /// Its name.
    pub name: String,
    /// Difficulty by difficulty; `None` without pairs.
    pub cells: Vec<Option<MethodCell>>,
}

/// One method on one difficulty. Failures count with their initial errors, as in the paper.
#[derive(Copy, Clone, Debug, PartialEq, Serialize)]
pub struct MethodCell {
    /// Pairs.
    pub n: usize,
    /// Share of successes, 0 to 1.
    pub success_rate: f64,
    /// Its 95 % interval (Wilson 1927).
    pub success_rate_95: (f64, f64),
    /// Mean distance at the end, metres.
    pub final_distance_m: f64,
    /// Mean difference of headings at the end, degrees.
    pub final_heading_deg: f64,
}

impl VisualTarget {
    /// Sums up the benchmark's own report.
    #[must_use]
    pub fn of(report: &Report) -> Self {
        let pairs = |c: &Column| PairColumn {
            difficulty: c.difficulty,
            n: c.n_pairs,
            distance_m: c.distance_m,
            heading_deg: c.heading_deg,
        };
        let method = |m: &MethodReport| MethodRow {
            name: m.name.clone(),
            cells: Difficulty::ALL
                .map(|d| m.cells.iter().find(|c| c.difficulty == d).and_then(MethodCell::of))
                .to_vec(),
        };
        Self {
            pairs: report.columns.iter().filter(|c| c.distance_m.is_finite()).map(pairs).collect(),
            methods: report.methods.iter().map(method).collect(),
        }
    }
}

impl MethodCell {
    fn of(cell: &Cell) -> Option<Self> {
        let finite = [cell.success_rate, cell.final_distance_m, cell.final_heading_deg].iter().all(|x| x.is_finite());
        (cell.n_pairs > 0 && finite).then_some(Self {
            n: cell.n_pairs,
            success_rate: cell.success_rate,
            success_rate_95: cell.success_rate_95,
            final_distance_m: cell.final_distance_m,
            final_heading_deg: cell.final_heading_deg,
        })
    }
}
