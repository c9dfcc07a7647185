//! How long drawing the test folds takes, and which flats offer no episode of a kind: `fold_cost [TASKS]` prints a line
//! for every fold.

#![expect(clippy::unwrap_used, reason = "a tool for measuring may fail by panicking")]

use std::collections::BTreeMap;
use std::time::Instant;

use homing_sim::flat::Detail;
use homing_sim::folds::{Fold, Split};
use homing_sim::{Arena, BodySize, SceneRef, Viewpoint};

fn main() {
    let n = std::env::args().nth(1).map_or(28, |n| n.parse().unwrap());
    let mut arenas: BTreeMap<u64, Arena> = BTreeMap::new();
    for fold in Fold::all(Split::Test) {
        let (mut times, mut none) = (Vec::new(), BTreeMap::new());
        for task in fold.tasks(n) {
            let load =
                || Arena::load_as(&SceneRef::Flat { seed: task.flat }, BodySize::default(), Detail::Shape).unwrap();
            let arena = arenas.entry(task.flat).or_insert_with(load);
            let start = Instant::now();
            if fold.draw(arena, task, Viewpoint::default()).is_err() {
                *none.entry(task.flat).or_insert(0) += 1;
            }
            times.push(start.elapsed().as_secs_f64());
        }
        times.sort_by(f64::total_cmp);
        let (median, most) = (times[times.len() / 2], times[times.len() - 1]);
        let (shape, level) = (fold.shape, fold.level.name());
        println!("{shape:?} {level}: median {:.0} ms, most {:.1} s, no episode in {none:?}", 1e3 * median, most);
    }
}
