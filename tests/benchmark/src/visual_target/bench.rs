//! All pipelines, in all ways, on all pairs.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use homing_core::GoalPhoto;
use homing_perception::{AnyEstimator, PerceptionError};
use homing_sim::arena::{Arena, BodySize, SceneRef};

use super::methods::Pipeline;
use super::pairs::{PairSpec, TargetPair, draw_pair, plan, view};
use super::report::Report;
use super::run::{PairRun, Robot};
use crate::RunError;

/// What to run.
#[derive(Clone, Debug)]
pub struct Options {
    /// The pairs.
    pub pairs: PairSpec,
    /// Configurations of perception; each is run in all of its [`Pipeline::ways`].
    pub pipelines: Vec<Pipeline>,
    /// Pairs at a time; 0 for one per core.
    pub threads: usize,
}

/// A pair with what came of it, by pipeline, then by way.
pub type PairRuns = (TargetPair, Vec<PairRun>);

/// How far a run is.
#[derive(Copy, Clone, Debug)]
pub enum Progress<'a> {
    /// A pair was drawn.
    Drawn(&'a TargetPair),
    /// Everything was run on a pair.
    Ran(&'a PairRuns),
}

/// Draws all pairs, then runs every pipeline in every way on each. `progress` hears of each pair twice, in any order; the
/// report lists them as they were planned, and is the same whatever the number of threads.
///
/// # Errors
/// [`RunError`] of the first pair, in their order, that could not be drawn or run.
pub fn bench(options: &Options, progress: &(dyn Fn(Progress<'_>) + Sync)) -> Result<Report, RunError> {
    let wanted = plan(&options.pairs);
    let n_pairs = wanted.len() as u64;
    let pairs = side_by_side(
        &wanted,
        options.threads,
        || Ok(()),
        |wanted, ()| {
            let pair = draw_pair(wanted, n_pairs, &options.pairs)?;
            progress(Progress::Drawn(&pair));
            Ok(pair)
        },
    )?;
    let open = || options.pipelines.iter().map(Pipeline::open).collect::<Result<Vec<AnyEstimator>, PerceptionError>>();
    let runs = side_by_side(
        &pairs,
        options.threads,
        || Ok(open()?),
        |pair, estimators| {
            let runs = (*pair, run_pair(pair, options, estimators)?);
            progress(Progress::Ran(&runs));
            Ok(runs)
        },
    )?;
    Ok(Report::new(options, runs))
}

/// Works on all items, so many at a time, and gives the results in the items' order. Each worker makes its tools once.
fn side_by_side<Item: Sync, Tools: Send, Done: Send>(
    items: &[Item],
    threads: usize,
    tools: impl Fn() -> Result<Tools, RunError> + Sync,
    work: impl Fn(&Item, &mut Tools) -> Result<Done, RunError> + Sync,
) -> Result<Vec<Done>, RunError> {
    let n_threads = match threads {
        0 => std::thread::available_parallelism().map_or(1, usize::from),
        n => n,
    };
    let next = AtomicUsize::new(0);
    let done: Mutex<Vec<(usize, Result<Done, RunError>)>> = Mutex::new(Vec::new());
    let worker = || -> Result<(), RunError> {
        // A pool of its own keeps the renderer's work on this thread.
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
        let mut tools = tools()?;
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some(item) = items.get(index) else { return Ok(()) };
            let result = pool.install(|| work(item, &mut tools));
            if result.is_err() {
                // The rest would be for nothing.
                next.store(items.len(), Ordering::Relaxed);
            }
            done.lock().unwrap_or_else(PoisonError::into_inner).push((index, result));
        }
    };
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..n_threads.min(items.len().max(1))).map(|_| scope.spawn(worker)).collect();
        workers.into_iter().try_for_each(|w| w.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
    })?;
    let mut done = done.into_inner().unwrap_or_else(PoisonError::into_inner);
    done.sort_by_key(|(index, _)| *index);
    done.into_iter().map(|(_, result)| result).collect()
}

fn run_pair(pair: &TargetPair, options: &Options, estimators: &mut [AnyEstimator]) -> Result<Vec<PairRun>, RunError> {
    let arena = Arc::new(Arena::load(&SceneRef::Flat { seed: pair.flat }, BodySize::default())?);
    let photo = view(&arena, &options.pairs.camera, pair.target)?;
    let rgb = Arc::new(photo.rgb);
    let mut runs = Vec::new();
    for (pipeline, estimator) in options.pipelines.iter().zip(estimators) {
        estimator.set_goal(GoalPhoto { id: 1, rgb: Arc::clone(&rgb), intrinsics: photo.camera })?;
        let mut robot = Robot::new(&arena, options.pairs.camera, estimator);
        for way in pipeline.ways() {
            runs.push(robot.run(pair, way)?);
        }
    }
    Ok(runs)
}
