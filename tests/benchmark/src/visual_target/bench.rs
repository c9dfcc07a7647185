//! All methods on all pairs.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use homing_perception::onnx::FeatureChoice;
use homing_perception::{AnyEstimator, PerceptionConfig};
use homing_planner::visual_target::Approach;

use super::pairs::{PairSpec, TargetPair, Wanted, draw_pair, plan};
use super::report::Report;
use super::run::{PairRun, Sensor, run_pair};
use crate::RunError;

/// A row of the table: one configuration of perception, and how its sightings become motions.
#[derive(Clone, Debug)]
pub struct Method {
    /// For tables.
    pub name: String,
    /// What finds keypoints, and what pairs them.
    pub features: FeatureChoice,
    /// Perception's settings. OpenCV gets one thread per worker, whatever they say.
    pub perception: PerceptionConfig,
    /// What the robot's camera delivers.
    pub sensor: Sensor,
    /// How sightings become motions.
    pub approach: Approach,
}

/// What to run.
#[derive(Clone, Debug)]
pub struct Options {
    /// The pairs.
    pub pairs: PairSpec,
    /// The rows.
    pub methods: Vec<Method>,
    /// Pairs at a time; 0 for one per core.
    pub threads: usize,
}

/// A pair with what each method made of it.
pub type PairRuns = (TargetPair, Vec<PairRun>);

/// Runs every method on every pair. `progress` hears of each pair as it ends, in any order; the report lists them as they
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
        let mut estimators = open(&options.methods)?;
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some(wanted_here) = wanted.get(index) else { return Ok(()) };
            let result = pool.install(|| run_methods(wanted_here, wanted.len() as u64, options, &mut estimators));
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

fn open(methods: &[Method]) -> Result<Vec<AnyEstimator>, RunError> {
    let one_thread = |m: &Method| PerceptionConfig { threads: Some(1), ..m.perception };
    methods.iter().map(|m| Ok(AnyEstimator::open(one_thread(m), &m.features)?)).collect()
}

fn run_methods(
    wanted: &Wanted,
    n_pairs: u64,
    options: &Options,
    estimators: &mut [AnyEstimator],
) -> Result<PairRuns, RunError> {
    let (arena, pair) = draw_pair(wanted, n_pairs, &options.pairs)?;
    let camera = &options.pairs.camera;
    let runs = options
        .methods
        .iter()
        .zip(estimators)
        .map(|(method, estimator)| run_pair(&arena, &pair, camera, method.sensor, method.approach, estimator));
    Ok((pair, runs.collect::<Result<_, _>>()?))
}
