//! Many flats, one episode each.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use homing_perception::onnx::FeatureChoice;
use homing_perception::{AnyEstimator, PerceptionConfig};
use homing_planner::PlannerConfig;
use homing_sim::Score;
use homing_sim::arena::{Arena, BodySize, SceneRef};
use homing_sim::episode::{self, EpisodeSpec};

use crate::episode::{StageSeconds, run_episode};
use crate::report::{BenchReport, EpisodeRow};
use crate::{Policy, RunError, Trial, Watch};

/// What to run.
#[derive(Clone, Debug)]
pub struct BenchOptions {
    /// Goal discovery.
    pub policy: Policy,
    /// Kind of episode.
    pub spec: EpisodeSpec,
    /// Episodes at a time; 0 for one per core.
    pub threads: usize,
    /// What finds keypoints, and what pairs them.
    pub features: FeatureChoice,
    /// Perception's settings. OpenCV gets one thread per episode, whatever they say.
    pub perception: PerceptionConfig,
    /// The planner's settings.
    pub planner: PlannerConfig,
}

impl Default for BenchOptions {
    /// The benchmark: Frontier, curved episodes of 3 to 10 m.
    fn default() -> Self {
        Self {
            policy: Policy::default(),
            spec: EpisodeSpec::default(),
            threads: 0,
            features: FeatureChoice::default(),
            perception: PerceptionConfig::default(),
            planner: PlannerConfig::default(),
        }
    }
}

/// Runs the episode of each seed in the flat of that seed. `progress` hears of every episode as it ends, in any order;
/// the report lists them by seed, and but for its times is the same whatever the number of threads.
///
/// # Errors
/// [`RunError`] of the first seed, in their order, whose episode could not be run.
pub fn bench(
    seeds: &[u64],
    options: &BenchOptions,
    progress: &(dyn Fn(&EpisodeRow) + Sync),
) -> Result<BenchReport, RunError> {
    let n_threads = match options.threads {
        0 => std::thread::available_parallelism().map_or(1, usize::from),
        n => n,
    };
    let next = AtomicUsize::new(0);
    let done = Mutex::new(Vec::new());
    let worker = || -> Result<(), RunError> {
        // A pool of its own keeps the renderer's work on this thread: whole episodes side by side use the cores better
        // than the tiles of one picture, and a thread that waits for tiles must not begin another episode.
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
        let perception = PerceptionConfig { threads: Some(1), ..options.perception };
        let mut estimator = AnyEstimator::open(perception, &options.features)?;
        while let Some(&seed) = seeds.get(next.fetch_add(1, Ordering::Relaxed)) {
            let begin = Instant::now();
            let result = pool.install(|| run_seed(seed, options, &mut estimator));
            let seconds = begin.elapsed().as_secs_f64();
            if let Ok((row, _)) = &result {
                progress(row);
            }
            done.lock().unwrap_or_else(PoisonError::into_inner).push((seed, seconds, result));
        }
        Ok(())
    };
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..n_threads.min(seeds.len().max(1))).map(|_| scope.spawn(worker)).collect();
        workers.into_iter().try_for_each(|w| w.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
    })?;
    let mut done = done.into_inner().unwrap_or_else(PoisonError::into_inner);
    done.sort_by_key(|(seed, ..)| *seed);
    let seconds = done.iter().map(|(_, seconds, _)| seconds).sum();
    let rows: Vec<(EpisodeRow, StageSeconds)> = done.into_iter().map(|(.., r)| r).collect::<Result<_, _>>()?;
    Ok(BenchReport::new(options, rows, seconds))
}

fn run_seed(
    seed: u64,
    options: &BenchOptions,
    estimator: &mut AnyEstimator,
) -> Result<(EpisodeRow, StageSeconds), RunError> {
    let arena = Arc::new(Arena::load(&SceneRef::Flat { seed }, BodySize::default())?);
    let episode = episode::draw(&arena, seed, &options.spec)?;
    let mut watch = Watch::default();
    let trial = Trial { policy: options.policy, planner: options.planner.clone(), ..Trial::default() };
    let run =
        run_episode(&arena, &episode, estimator, &trial, &mut |record| watch.see(&arena, &episode, &record.moment()))?;
    let score = Score::strict(&run.finish);
    let row =
        EpisodeRow { seed, cause: (!score.success).then(|| watch.cause(run.mode)), score, reason: run.reason, watch };
    Ok((row, run.times))
}
