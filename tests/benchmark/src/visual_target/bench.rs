//! All pipelines, in all ways, on all pairs.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use homing_core::GoalPhoto;
use homing_perception::{AnyEstimator, PerceptionError};

use super::methods::{Pipeline, ways};
use super::pairs::{PairSpec, TargetPair, Wanted, draw_pair, plan, view};
use super::report::Report;
use super::run::{PairRun, Robot};
use crate::RunError;

/// What to run.
#[derive(Clone, Debug)]
pub struct Options {
    /// The pairs.
    pub pairs: PairSpec,
    /// Configurations of perception; each is run in all [`ways`].
    pub pipelines: Vec<Pipeline>,
    /// Pairs at a time; 0 for one per core.
    pub threads: usize,
}

/// A pair with what came of it, by pipeline, then by way.
pub type PairRuns = (TargetPair, Vec<PairRun>);

/// Runs every pipeline in every way on every pair. `progress` hears of each pair as it ends, in any order; the report lists them as they
/// were planned, and is the same whatever the number of threads.
///
/// # Errors
/// [`RunError`] of the first pair, in their order, that could not be drawn or run.
pub fn bench(options: &Options, progress: &(dyn Fn(&PairRuns) + Sync)) -> Result<Report, RunError> {
    let wanted = plan(&options.pairs);
    let n_threads = match options.threads {
        0 => std::thread::available_parallelism().map_or(1, usize::from),
        n => n,
    };
    let next = AtomicUsize::new(0);
    let done: Mutex<Vec<(usize, Result<PairRuns, RunError>)>> = Mutex::new(Vec::new());
    let worker = || -> Result<(), RunError> {
        // A pool of its own keeps the renderer's work on this thread.
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
        let mut estimators =
            options.pipelines.iter().map(Pipeline::open).collect::<Result<Vec<AnyEstimator>, PerceptionError>>()?;
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some(wanted_here) = wanted.get(index) else { return Ok(()) };
            let result = pool.install(|| run_pair(wanted_here, wanted.len() as u64, options, &mut estimators));
            if let Ok(runs) = &result {
                progress(runs);
            }
            done.lock().unwrap_or_else(PoisonError::into_inner).push((index, result));
        }
    };
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..n_threads.min(wanted.len().max(1))).map(|_| scope.spawn(worker)).collect();
        workers.into_iter().try_for_each(|w| w.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
    })?;
    let mut done = done.into_inner().unwrap_or_else(PoisonError::into_inner);
    done.sort_by_key(|(index, _)| *index);
    let runs = done.into_iter().map(|(_, result)| result).collect::<Result<Vec<_>, _>>()?;
    Ok(Report::new(options, runs))
}

fn run_pair(
    wanted: &Wanted,
    n_pairs: u64,
    options: &Options,
    estimators: &mut [AnyEstimator],
) -> Result<PairRuns, RunError> {
    let (arena, pair) = draw_pair(wanted, n_pairs, &options.pairs)?;
    let photo = view(&arena, &options.pairs.camera, pair.target)?;
    let mut runs = Vec::new();
    for estimator in estimators {
        estimator.set_goal(GoalPhoto { id: 1, rgb: Arc::new(photo.rgb.clone()), intrinsics: photo.camera })?;
        let mut robot = Robot::new(&arena, options.pairs.camera, estimator);
        for way in ways() {
            runs.push(robot.run(&pair, &way)?);
        }
    }
    Ok((pair, runs))
}
