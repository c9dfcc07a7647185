//! The benchmark's own folds: straight and curved, easy to hard, as NRNS divides its episodes, over generated flats.
//!
//! Gibson as the papers use it has 72 scenes to learn from and 14 to be tested in. So have these folds; their flats
//! appear nowhere else, and in particular in no training set of ours.

use core::ops::Range;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::arena::Arena;
use crate::episode::{self, DrawError, Episode, EpisodeSpec, GoalPlace, Level, Shape, Viewpoint, written};

/// Which flats.
#[derive(Copy, Clone, Debug, PartialEq, Eq, Hash)]
pub enum Split {
    /// 72 flats to tune and learn on.
    Train,
    /// 14 flats that only count.
    Test,
}

impl Split {
    /// The seeds of its flats.
    #[must_use]
    pub fn flats(self) -> Range<u64> {
        match self {
            Split::Train => 200_000..200_072,
            Split::Test => 300_100..300_114,
        }
    }
}

/// One kind of episode, as the published tables have columns.
#[derive(Copy, Clone, Debug, PartialEq, Eq, Hash)]
pub struct Fold {
    /// Which flats.
    pub split: Split,
    /// Straight or curved.
    pub shape: Shape,
    /// By the length of the shortest path.
    pub level: Level,
}

/// One episode of a fold, not drawn yet.
#[derive(Copy, Clone, Debug, PartialEq, Eq, Hash)]
pub struct Task {
    /// Seed of the flat.
    pub flat: u64,
    /// Seed of the episode in it.
    pub episode: u64,
}

impl Fold {
    /// The columns of the published tables in their order: straight easy to hard, then curved easy to hard.
    #[must_use]
    pub fn all(split: Split) -> [Fold; 6] {
        let levels = [Level::Easy, Level::Medium, Level::Hard];
        core::array::from_fn(|k| Fold {
            split,
            shape: if k < 3 { Shape::Straight } else { Shape::Curved },
            level: levels[k % 3],
        })
    }

    /// `n` tasks, one flat after the other and round again, each with a seed that no other task of any fold has.
    pub fn tasks(self, n: u64) -> impl Iterator<Item = Task> {
        let flats = self.split.flats();
        let number = u64::from(self.shape == Shape::Curved) * 4 + self.level as u64;
        (0..n).map(move |k| Task {
            flat: flats.start + k % (flats.end - flats.start),
            // The flat's seed makes tasks of the two splits differ; the fold's number those of one flat.
            episode: flats.start << 32 | (number + 1) << 24 | k,
        })
    }

    /// What its episodes are like, with the photo taken by that camera.
    #[must_use]
    pub fn spec(self, camera: Viewpoint) -> EpisodeSpec {
        let (min_m, max_m) = self.level.range_m();
        EpisodeSpec { min_m, max_m, shape: Some(self.shape), goal_place: GoalPlace::Anywhere, camera }
    }

    /// Draws the episode of a task in its flat.
    ///
    /// # Errors
    /// [`DrawError`] where the flat offers none: few have a straight way of 5 to 10 m, and the papers' straight and
    /// hard fold is short of episodes, too. Who fills a fold goes on to the next task.
    pub fn draw(self, arena: &Arena, task: Task, camera: Viewpoint) -> Result<Episode, DrawError> {
        episode::draw(arena, task.episode, &self.spec(camera))
    }
}

/// A camera held by a person rather than the robot, drawn from a seed as IGL-Nav draws its free-view goals: 0.8 to 1.5
/// m above the floor, 60 to 120 degrees wide, tilted by up to 15 degrees, in one of four picture sizes.
#[must_use]
pub fn free_viewpoint(seed: u64) -> Viewpoint {
    const SIZES: [(u32, u32); 4] = [(640, 480), (640, 360), (512, 512), (480, 640)];
    let rng = &mut ChaCha8Rng::seed_from_u64(seed ^ 0x6672_6565_7669_6577);
    let (width, height) = SIZES[rng.random_range(0..SIZES.len() as u32) as usize];
    Viewpoint {
        height_m: written(rng.random_range(0.8..1.5)),
        width,
        height,
        hfov_rad: written(rng.random_range(60.0_f64..120.0).to_radians()),
        pitch_rad: written(rng.random_range(-15.0_f64..15.0).to_radians()),
    }
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test may fail by panicking")]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::arena::{BodySize, SceneRef};
    use crate::flat::Detail;

    #[test]
    fn folds_have_flats_and_seeds_of_their_own() {
        let mut seeds = BTreeSet::new();
        for split in [Split::Train, Split::Test] {
            for fold in Fold::all(split) {
                let tasks: Vec<Task> = fold.tasks(1000).collect();
                assert!(tasks.iter().all(|t| split.flats().contains(&t.flat)));
                assert_eq!(tasks, fold.tasks(1000).collect::<Vec<_>>());
                seeds.extend(tasks.iter().map(|t| t.episode));
            }
        }
        assert_eq!(seeds.len(), 12 * 1000);
        assert_eq!(Split::Train.flats().count() + Split::Test.flats().count(), 72 + 14);
        assert_eq!(Fold::all(Split::Test)[2].tasks(15).last().unwrap().flat, 300_100, "after 14 flats round again");
    }

    #[test]
    fn drawn_episodes_are_of_their_fold() {
        for flat in [300_100, 300_101] {
            let arena = Arena::load_as(&SceneRef::Flat { seed: flat }, BodySize::default(), Detail::Shape).unwrap();
            for fold in Fold::all(Split::Test) {
                let task = Task { flat, episode: fold.tasks(1).next().unwrap().episode };
                let drawn = fold.draw(&arena, task, Viewpoint::default());
                let Ok(episode) = drawn else {
                    assert_eq!((fold.shape, fold.level), (Shape::Straight, Level::Hard), "flat {flat}: {drawn:?}");
                    continue;
                };
                assert_eq!(episode.shape, fold.shape);
                assert_eq!(Shape::of(episode.start, episode.goal, episode.shortest_path_m), fold.shape);
                let (min_m, max_m) = fold.level.range_m();
                assert!((min_m..=max_m).contains(&episode.shortest_path_m));
                assert_eq!(episode, fold.draw(&arena, task, Viewpoint::default()).unwrap());
            }
        }
    }

    #[test]
    fn free_viewpoints_are_cameras_that_people_hold() {
        let all: Vec<Viewpoint> = (0..200).map(free_viewpoint).collect();
        for v in &all {
            assert!((0.8..=1.5).contains(&v.height_m) && v.pitch_rad.abs() <= 15_f64.to_radians() + 1e-6);
            assert!((60.0..=120.0).contains(&v.hfov_rad.to_degrees()) && v.intrinsics().is_ok());
            let back: Viewpoint = serde_json::from_str(&serde_json::to_string(v).unwrap()).unwrap();
            assert_eq!(back, *v);
        }
        assert!(all.iter().any(|v| v.pitch_rad > 0.2) && all.iter().any(|v| v.pitch_rad < -0.2));
        assert_eq!(all.iter().map(|v| (v.width, v.height)).collect::<BTreeSet<_>>().len(), 4);
        assert_eq!(all[7], free_viewpoint(7));
    }
}
