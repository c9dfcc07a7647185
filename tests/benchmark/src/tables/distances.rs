//! Success by how far away the goal is.

use serde::Serialize;

use super::episodes::Episodes;
use crate::perception::Share;

/// Edges of the bins of shortest paths, metres. The last bin is open.
pub(super) const EDGES_M: [f64; 6] = [0.0, 2.0, 3.0, 5.0, 7.0, 10.0];

/// Successes of one row on one set, by length of the shortest path.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Distances {
    /// The row.
    pub row: String,
    /// The set.
    pub set: String,
    /// The nearest first; a bin without episodes has `n` 0. Those beyond the farthest episode are left out.
    pub bins: Vec<Bin>,
}

/// Episodes whose shortest path is so long.
#[derive(Copy, Clone, Debug, PartialEq, Serialize)]
pub struct Bin {
    /// From this length on, metres, ...
    pub from_m: f64,
    /// ... to below this one; `None`: without end.
    pub to_m: Option<f64>,
    /// Successes by the strict rule.
    pub success: Share,
}

impl Bin {
    /// For tables and axes.
    #[must_use]
    pub fn words(&self) -> String {
        match self.to_m {
            Some(to) if self.from_m <= 0.0 => format!("below {to:.0} m"),
            Some(to) => format!("{:.0}\u{2013}{to:.0} m", self.from_m),
            None => format!("over {:.0} m", self.from_m),
        }
    }
}

pub(super) fn by_cell(episodes: &Episodes<'_>) -> Vec<Distances> {
    let cells = episodes.headlines().into_iter();
    let mut all: Vec<Distances> = cells
        .map(|(row, set)| {
            let group = episodes.of(row, set);
            let bin = |i: usize| {
                let (from_m, to_m) = (EDGES_M[i], EDGES_M.get(i + 1).copied());
                let holds = |m: f64| m >= from_m && to_m.is_none_or(|to| m < to);
                let inside = group.values().filter(|e| holds(e.strict.shortest_path_m));
                Bin { from_m, to_m, success: Share::of(inside, |e| e.strict.success) }
            };
            Distances { row: row.to_owned(), set: set.to_owned(), bins: (0..EDGES_M.len()).map(bin).collect() }
        })
        .collect();
    // No column for what no row of any set has.
    let n_bins = all.iter().filter_map(|d| d.bins.iter().rposition(|b| b.success.n > 0)).max().map_or(0, |i| i + 1);
    all.iter_mut().for_each(|d| d.bins.truncate(n_bins));
    all
}
