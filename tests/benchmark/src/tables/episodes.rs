//! The records by row and set, each episode once.

use std::collections::BTreeMap;

use homing_sim::score::Score;

use super::rows::{HEADLINES, headline_order, row_order, set_order};
use crate::record::EpisodeRecord;

/// The episodes of one row on one set, by scene and name.
pub(super) type Group<'a> = BTreeMap<(&'a str, &'a str), &'a EpisodeRecord>;

/// All records, by set and row.
pub(super) struct Episodes<'a> {
    groups: BTreeMap<(&'a str, &'a str), Group<'a>>,
    pub n_repeated: usize,
    pub n_not_finite: usize,
}

impl<'a> Episodes<'a> {
    /// Of two records of one episode the one that sorts first stays, whatever order they come in.
    pub fn new(records: &'a [EpisodeRecord]) -> Self {
        let mut sorted: Vec<&EpisodeRecord> = records.iter().collect();
        sorted.sort_by(|a, b| rank(a).cmp(&rank(b)).then(a.strict.path_length_m.total_cmp(&b.strict.path_length_m)));
        let mut all = Self { groups: BTreeMap::new(), n_repeated: 0, n_not_finite: 0 };
        for record in sorted {
            let group = all.groups.entry((&record.cell.set, &record.cell.row)).or_default();
            match group.entry((&record.scene, &record.episode_id)) {
                std::collections::btree_map::Entry::Occupied(_) => all.n_repeated += 1,
                std::collections::btree_map::Entry::Vacant(free) => {
                    free.insert(record);
                    all.n_not_finite += usize::from(!is_finite(record));
                }
            }
        }
        all
    }

    pub fn len(&self) -> usize {
        self.groups.values().map(BTreeMap::len).sum()
    }

    /// Sets that have episodes, the published ones' counterparts first.
    pub fn sets(&self) -> Vec<&'a str> {
        let mut sets: Vec<&str> = self.groups.keys().map(|(set, _)| *set).collect();
        sets.dedup();
        sets.sort_by_key(|set| set_order(set));
        sets
    }

    /// Rows that have episodes of a set, in the order of the tables.
    pub fn rows(&self, set: &str) -> Vec<&'a str> {
        let mut rows: Vec<&str> = self.groups.keys().filter(|(s, _)| *s == set).map(|(_, row)| *row).collect();
        rows.sort_by_key(|row| row_order(row));
        rows
    }

    /// Empty if there are none.
    pub fn of(&self, row: &str, set: &str) -> Group<'a> {
        self.groups.get(&(set, row)).cloned().unwrap_or_default()
    }

    /// Cells of the headline rows, set by set, ourselves first.
    pub fn headlines(&self) -> Vec<(&'a str, &'a str)> {
        let mut cells: Vec<_> = self.cells().filter(|(row, _)| HEADLINES.contains(row)).collect();
        cells.sort_by_key(|(row, set)| (set_order(set), *set, headline_order(row)));
        cells
    }

    /// Every cell that has episodes, set by set.
    pub fn cells(&self) -> impl Iterator<Item = (&'a str, &'a str)> {
        self.sets().into_iter().flat_map(|set| self.rows(set).into_iter().map(move |row| (row, set)))
    }
}

type Rank<'a> = (&'a str, &'a str, u64, u64, &'a str);

fn rank(record: &EpisodeRecord) -> Rank<'_> {
    // Wins last: a repeated episode is never counted in our favour.
    let wins = u64::from(record.strict.success);
    (&record.scene, &record.episode_id, wins, record.strict.steps, &record.reason)
}

fn is_finite(record: &EpisodeRecord) -> bool {
    let of = |s: &Score| {
        let figures =
            [s.path_length_m, s.shortest_path_m, s.spl, s.soft_spl, s.final_distance_m, s.final_heading_error_deg];
        figures.iter().all(|x| x.is_finite())
    };
    let t = &record.times;
    let times = [t.observe, t.extract, t.matching, t.pose, t.plan, record.wall_s];
    let heading = record.first_heading_rad.is_none_or(|(a, b)| a.is_finite() && b.is_finite());
    of(&record.strict) && of(&record.published) && heading && times.iter().all(|x| x.is_finite())
}

/// Zero in place of what is no number: no broken figure speaks for us.
pub(super) fn or_zero(x: f64) -> f64 {
    if x.is_finite() { x } else { 0.0 }
}

/// The finite ones.
pub(super) fn finite(values: impl Iterator<Item = f64>) -> Vec<f64> {
    values.filter(|x| x.is_finite()).collect()
}
