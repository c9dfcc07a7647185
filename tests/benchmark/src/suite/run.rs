//! Runs what is left, on several threads, and keeps every episode as it ends.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use homing_sim::Score;
use homing_sim::arena::Arena;
use homing_sim::episode::DrawError;
use thiserror::Error;

use super::plan::{Plan, Task};
use super::rows::Row;
use super::store::{Store, StoreError};
use crate::clip::{Clip, ClipError, ClipFolder};
use crate::record::{CellKey, EpisodeRecord};
use crate::suite::course::{Course, LayCourse, Onlooker};
use crate::{RunError, Watch};

/// How to run.
#[derive(Clone, Debug)]
pub struct RunOptions {
    /// Episodes side by side; 0 for one per core.
    pub threads: usize,
    /// The program's commit, kept with every episode.
    pub commit: String,
    /// Where clips of failed episodes go, if anywhere.
    pub clips: Option<ClipFolder>,
}

/// Why a run ended before its end. What was done is kept.
#[derive(Debug, Error)]
pub enum SuiteError {
    /// An episode could not be run.
    #[error("{row}, {set}, {scene}, episode {id}: {source}")]
    Episode {
        /// The row.
        row: String,
        /// The set.
        set: String,
        /// The scene.
        scene: String,
        /// The episode.
        id: String,
        /// Why not.
        source: Box<RunError>,
    },
    /// A result could not be kept.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// A clip could not be written.
    #[error(transparent)]
    Clip(#[from] ClipError),
    /// No worker threads.
    #[error("no worker threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}

/// Runs a plan. `lay` says where episodes take place: in this process, or through others. `progress` hears of every episode once it is kept; it says whether to go on.
///
/// # Errors
/// [`SuiteError`] of the first thing that went wrong; other threads end their episode first.
pub fn run(
    plan: &Plan,
    rows: &[Row],
    store: &Store,
    options: &RunOptions,
    lay: LayCourse<'_>,
    progress: &(dyn Fn(&EpisodeRecord) -> GoOn + Sync),
) -> Result<(), SuiteError> {
    let n_threads = match options.threads {
        0 => std::thread::available_parallelism().map_or(1, usize::from),
        n => n,
    };
    let next = AtomicUsize::new(0);
    let failed: Mutex<Option<SuiteError>> = Mutex::new(None);
    let worker = || {
        while let Some(group) = plan.groups.get(next.fetch_add(1, Ordering::Relaxed)) {
            let ended = run_group(group, &rows[group[0].row], store, options, lay, progress);
            if !matches!(ended, Ok(GoOn::Yes)) {
                next.store(usize::MAX / 2, Ordering::Relaxed);
            }
            if let Err(error) = ended {
                failed.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
            }
        }
    };
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..n_threads.clamp(1, plan.groups.len().max(1))).map(|_| scope.spawn(worker)).collect();
        for w in workers {
            w.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        }
    });
    failed.into_inner().unwrap_or_else(PoisonError::into_inner).map_or(Ok(()), Err)
}

/// Whether a run goes on after an episode.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum GoOn {
    /// It does.
    Yes,
    /// It ends, and can be gone on with later.
    No,
}

fn run_group(
    group: &[Task],
    row: &Row,
    store: &Store,
    options: &RunOptions,
    lay: LayCourse<'_>,
    progress: &(dyn Fn(&EpisodeRecord) -> GoOn + Sync),
) -> Result<GoOn, SuiteError> {
    // A pool of its own keeps the renderer's work on this thread: whole episodes side by side use the cores better.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let failed = |task: &Task| {
        let (set, id) = (task.set.clone(), task.episode.id.clone());
        let scene = format!("{:?}", task.episode.scene);
        move |source: RunError| SuiteError::Episode {
            row: row.name.to_owned(),
            set,
            scene,
            id,
            source: Box::new(source),
        }
    };
    let first = &group[0];
    let mut course = lay(row).map_err(failed(first))?;
    let loaded = pool.install(|| Arena::load(&first.episode.scene, first.episode.body)).map_err(RunError::from);
    let arena = Arc::new(loaded.map_err(failed(first))?);
    for task in group {
        let ended = pool.install(|| run_task(task, row, &arena, course.as_mut(), options));
        // Few flats have a straight way of 5 to 10 m: such a fold is short of episodes, as the papers' is.
        if let Err(RunError::Draw(DrawError::NoneFound { .. })) = ended {
            continue;
        }
        let (record, clip) = ended.map_err(failed(task))?;
        if let (Some(folder), Some(clip), Some(cause)) = (&options.clips, clip, record.cause) {
            clip.write(folder, &record, cause)?;
        }
        store.keep(&record)?;
        if progress(&record) == GoOn::No {
            return Ok(GoOn::No);
        }
    }
    Ok(GoOn::Yes)
}

fn run_task(
    task: &Task,
    row: &Row,
    arena: &Arc<Arena>,
    course: &mut dyn Course,
    options: &RunOptions,
) -> Result<(EpisodeRecord, Option<Clip>), RunError> {
    let start = Instant::now();
    let episode = task.episode.episode(arena)?;
    let clip = options.clips.as_ref().map(|_| Clip::begin(arena, &episode)).transpose()?;
    let mut onlooker = Onlooker { arena: Arc::clone(arena), episode, watch: Watch::default(), clip };
    let run = course.run(arena, &onlooker.episode.clone(), &mut onlooker)?;
    let Onlooker { episode, watch, clip, .. } = onlooker;
    let strict = Score::strict(&run.finish);
    let record = EpisodeRecord {
        cell: CellKey { row: row.name.to_owned(), set: task.set.clone() },
        scene: arena.scene().name.clone(),
        episode_id: task.episode.id.clone(),
        level: task.episode.level,
        shape: episode.shape,
        strict,
        published: Score::published(&run.finish),
        cause: (!strict.success).then(|| watch.cause(run.mode)),
        reason: run.reason,
        watch,
        first_heading_rad: run.first_heading_rad,
        times: run.times,
        wall_s: start.elapsed().as_secs_f64(),
        commit: options.commit.clone(),
    };
    Ok((record, clip))
}
