//! Success and SPL by level: what the published tables have in their columns.

use std::collections::{BTreeMap, BTreeSet};

use homing_sim::episode::Level;
use serde::Serialize;

use super::episodes::{Episodes, Group, or_zero};
use super::estimate::Mean;
use super::rows::{self, BASE, LAYOUTS};
use crate::perception::Share;
use crate::record::EpisodeRecord;

/// Episodes of one row on one level.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Cell {
    /// Episodes.
    pub n: usize,
    /// Successes by the strict rule.
    pub success: Share,
    /// SPL by the strict rule.
    pub spl: Mean,
    /// Successes as the papers counted.
    pub published_success: Share,
    /// SPL as the papers counted.
    pub published_spl: Mean,
}

impl Cell {
    /// `None` without episodes: what was not measured is not zero.
    pub(super) fn of(episodes: &[&EpisodeRecord]) -> Option<Self> {
        let spl = |of: fn(&EpisodeRecord) -> f64| {
            Mean::of_shares(&episodes.iter().map(|e| or_zero(of(e))).collect::<Vec<_>>())
        };
        Some(Self {
            n: episodes.len(),
            success: Share::of(episodes, |e| e.strict.success),
            spl: spl(|e| e.strict.spl)?,
            published_success: Share::of(episodes, |e| e.published.success),
            published_spl: spl(|e| e.published.spl)?,
        })
    }
}

/// One row of a table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RowFigures {
    /// The name it is recorded under; of a table by scene, the scene.
    pub row: String,
    /// For readers.
    pub name: String,
    /// Easy, medium and hard together.
    pub overall: Option<Cell>,
    /// Easy, medium, hard, extra. The published tables have the first three.
    pub levels: [Option<Cell>; 4],
    /// Mean of the success shares of easy, medium and hard, 0 to 1: what the papers' overall is. `None` if one is missing.
    pub mean_of_levels: Option<f64>,
}

impl RowFigures {
    pub(super) fn of(row: &str, name: String, episodes: &Group<'_>) -> Self {
        let of = |keep: &dyn Fn(Level) -> bool| {
            Cell::of(&episodes.values().copied().filter(|e| keep(e.level)).collect::<Vec<_>>())
        };
        let levels = Level::ALL.map(|level| of(&|l| l == level));
        let shares: Vec<f64> = levels[..3].iter().flatten().map(|c| c.success.share).collect();
        Self {
            row: row.to_owned(),
            name,
            overall: of(&|l| l != Level::Extra),
            mean_of_levels: (shares.len() == 3).then(|| shares.iter().sum::<f64>() / 3.0),
            levels,
        }
    }

    /// Overall, easy, medium, hard: the order of SLING's tables.
    pub(super) fn sling_order(&self) -> [Option<&Cell>; 4] {
        let [easy, medium, hard, _] = &self.levels;
        [self.overall.as_ref(), easy.as_ref(), medium.as_ref(), hard.as_ref()]
    }
}

/// All rows on one set.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SetFigures {
    /// The set.
    pub set: String,
    /// Its rows, in the order of the tables; those that no table knows last.
    pub rows: Vec<RowFigures>,
}

impl SetFigures {
    pub(super) fn row(&self, key: &str) -> Option<&RowFigures> {
        self.rows.iter().find(|r| r.row == key)
    }
}

/// One row of a set by scene.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SceneFigures {
    /// The row.
    pub row: String,
    /// The set.
    pub set: String,
    /// By scene, in alphabetical order.
    pub scenes: Vec<RowFigures>,
}

pub(super) fn by_set(episodes: &Episodes<'_>) -> Vec<SetFigures> {
    let set = |set: &str| SetFigures {
        set: set.to_owned(),
        rows: episodes
            .rows(set)
            .into_iter()
            .map(|row| RowFigures::of(row, rows::name(row), &episodes.of(row, set)))
            .collect(),
    };
    episodes.sets().into_iter().map(set).collect()
}

/// The curved flats have a scene to each episode: only the layouts are worth a table.
pub(super) fn by_scene(episodes: &Episodes<'_>) -> Vec<SceneFigures> {
    let all = episodes.of(BASE, LAYOUTS);
    if all.is_empty() {
        return Vec::new();
    }
    let names: BTreeSet<&str> = all.keys().map(|(scene, _)| *scene).collect();
    let of_scene = |name: &str| -> Group<'_> {
        all.iter().filter(|((s, _), _)| *s == name).map(|(k, v)| (*k, *v)).collect::<BTreeMap<_, _>>()
    };
    let scenes = names.into_iter().map(|name| RowFigures::of(name, name.to_owned(), &of_scene(name)));
    vec![SceneFigures { row: BASE.to_owned(), set: LAYOUTS.to_owned(), scenes: scenes.collect() }]
}
