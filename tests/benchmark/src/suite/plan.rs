//! What is run, and in which order: the cells of the tables fill evenly, so that a report can be made at any time.

use std::collections::HashSet;

use homing_sim::arena::SceneRef;
use homing_sim::episode::{Level, Shape};
use homing_sim::folds::{Fold, Split};

use super::rows::{Headline, Row};
use super::sets::{self, EpisodeRef, Photographer};
use super::store::Shard;
use crate::record::{CellKey, EpisodeRecord};
use crate::tables::CURVED;

/// Episodes for each cell.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct Amounts {
    /// Of a headline row, for each level.
    pub headline: usize,
    /// Of the other rows.
    pub others: usize,
}

impl Amounts {
    /// Enough for a report.
    pub const FULL: Amounts = Amounts { headline: 100, others: 30 };
    /// Enough to see that it works.
    pub const QUICK: Amounts = Amounts { headline: 1, others: 1 };
}

/// One episode to run: the row by index, the set by name.
#[derive(Clone, Debug, PartialEq)]
pub struct Task {
    /// Index into the rows.
    pub row: usize,
    /// The set's name.
    pub set: String,
    /// The episode.
    pub episode: EpisodeRef,
}

/// Everything to run, in order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Plan {
    /// Tasks that share row and scene stand together: a scene is made ready once for them.
    pub groups: Vec<Vec<Task>>,
}

/// The sets on generated flats: NRNS's curved and straight episodes, and curved ones with photos taken by people.
fn set_names(split: Split) -> [&'static str; 3] {
    match split {
        Split::Test => [CURVED, "flats-straight", "flats-free-view"],
        Split::Train => ["train-curved", "train-straight", "train-free-view"],
    }
}

impl Plan {
    /// For every row the curved folds on flats; for the first row besides them the straight folds, photos taken by people, and
    /// the sets of `more`.
    #[must_use]
    pub fn new(rows: &[Row], amounts: Amounts, split: Split, more: &[(String, Vec<EpisodeRef>)]) -> Self {
        let fold = |shape, n, photographer| -> Vec<EpisodeRef> {
            let of = |level: &Level| sets::flats(Fold { split, shape, level: *level }, n, photographer);
            Level::ALL[..3].iter().flat_map(of).collect()
        };
        let [curved, straight, free_view] = set_names(split);
        let mut cells: Vec<(usize, String, Vec<EpisodeRef>)> = Vec::new();
        for (index, row) in rows.iter().enumerate() {
            let n = match row.headline {
                Headline::Yes => amounts.headline,
                Headline::No => amounts.others,
            };
            cells.push((index, curved.to_owned(), fold(Shape::Curved, n, Photographer::Robot)));
            if index == 0 {
                cells.extend(more.iter().map(|(set, episodes)| (index, set.clone(), episodes.clone())));
                let n = amounts.others;
                cells.push((index, straight.to_owned(), fold(Shape::Straight, n, Photographer::Robot)));
                cells.push((index, free_view.to_owned(), fold(Shape::Curved, n, Photographer::Person)));
            }
        }
        // What the report stands on first; then the beginning of everything, then its rest.
        let (base, others): (Vec<_>, Vec<_>) = cells.iter().partition(|(row, set, _)| *row == 0 && set == curved);
        let whole = base.iter().map(|cell| (cell, Part::All));
        let parts = [Part::First, Part::Rest].into_iter().flat_map(|part| others.iter().map(move |cell| (cell, part)));
        let groups = whole.chain(parts).flat_map(|((row, set, all), part)| by_scene(*row, set, part.of(all))).collect();
        Self { groups }
    }

    /// Only the tasks that are wanted.
    pub fn keep(&mut self, is_wanted: impl Fn(&Task) -> bool) {
        self.groups.retain_mut(|group| {
            group.retain(&is_wanted);
            !group.is_empty()
        });
    }

    /// Without what is done, and without what other shards do.
    #[must_use]
    pub fn left(mut self, rows: &[Row], done: &[EpisodeRecord], shard: Shard) -> Self {
        let done: HashSet<(&CellKey, &str)> = done.iter().map(|r| (&r.cell, r.episode_id.as_str())).collect();
        let is_left = |task: &Task| {
            let cell = CellKey { row: rows[task.row].name.to_owned(), set: task.set.clone() };
            !done.contains(&(&cell, task.episode.id.as_str()))
        };
        let mut index = 0;
        self.groups.retain_mut(|group| {
            let mine = index % shard.of.max(1) == shard.index;
            index += 1;
            group.retain(is_left);
            mine && !group.is_empty()
        });
        self
    }

    /// Episodes.
    #[must_use]
    pub fn len(&self) -> usize {
        self.groups.iter().map(Vec::len).sum()
    }

    /// Nothing to do.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.groups.is_empty()
    }
}

/// Which episodes of a cell.
#[derive(Copy, Clone)]
enum Part {
    All,
    /// Every third.
    First,
    /// The others.
    Rest,
}

impl Part {
    fn of(self, episodes: &[EpisodeRef]) -> Vec<EpisodeRef> {
        let is_in = |k: usize| match self {
            Part::All => true,
            Part::First => k.is_multiple_of(3),
            Part::Rest => !k.is_multiple_of(3),
        };
        episodes.iter().enumerate().filter(|(k, _)| is_in(*k)).map(|(_, e)| e.clone()).collect()
    }
}

fn by_scene(row: usize, set: &str, episodes: Vec<EpisodeRef>) -> Vec<Vec<Task>> {
    let mut groups: Vec<(SceneRef, Vec<Task>)> = Vec::new();
    for episode in episodes {
        let scene = episode.scene.clone();
        let task = Task { row, set: set.to_owned(), episode };
        match groups.iter_mut().find(|(s, _)| *s == scene) {
            Some((_, tasks)) => tasks.push(task),
            None => groups.push((scene, vec![task])),
        }
    }
    groups.into_iter().map(|(_, tasks)| tasks).collect()
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test may fail by panicking")]
mod tests {
    use std::path::Path;

    use homing_perception::onnx::FeatureChoice;

    use super::*;
    use crate::suite::rows::rows;

    fn plan(amounts: Amounts) -> (Vec<Row>, Plan) {
        let models = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../nodes/perception/models"));
        let rows = rows(&FeatureChoice::default(), models).unwrap();
        let plan = Plan::new(&rows, amounts, Split::Test, &[]);
        (rows, plan)
    }

    #[test]
    fn every_cell_gets_its_episodes_once() {
        let (rows, plan) = plan(Amounts { headline: 9, others: 5 });
        let tasks: Vec<&Task> = plan.groups.iter().flatten().collect();
        let of = |row: &str, set: &str, level: Level| {
            let index = rows.iter().position(|r| r.name == row).unwrap();
            tasks.iter().filter(|t| t.row == index && t.set == set && t.episode.level == level).count()
        };
        assert_eq!(of("frontier", "flats-curved", Level::Hard), 9);
        assert_eq!(of("frontier", "flats-straight", Level::Easy), 5);
        assert_eq!(of("frontier", "flats-free-view", Level::Easy), 5);
        assert_eq!(of("straight", "flats-curved", Level::Medium), 5);
        assert_eq!(of("straight", "flats-straight", Level::Medium), 0);
        let mut names: Vec<String> = tasks.iter().map(|t| format!("{} {} {}", t.row, t.set, t.episode.id)).collect();
        names.sort();
        let n = names.len();
        names.dedup();
        assert_eq!(names.len(), n, "an episode is planned twice");
        for group in &plan.groups {
            assert!(group.iter().all(|t| (t.row, &t.episode.scene) == (group[0].row, &group[0].episode.scene)));
        }
    }

    #[test]
    fn shards_share_the_work_and_leave_nothing() {
        let (rows, whole) = plan(Amounts { headline: 9, others: 5 });
        let parts: Vec<Plan> = (0..3).map(|index| whole.clone().left(&rows, &[], Shard { index, of: 3 })).collect();
        assert_eq!(parts.iter().map(Plan::len).sum::<usize>(), whole.len());
        assert!(parts.iter().all(|p| p.len() > whole.len() / 5));
    }
}
