//! Writes the views of many flats to a folder, and goes on where it was interrupted.

use std::fs::{self, File};
use std::io::{self, ErrorKind, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::record::{self, FORMAT, SET_FILE, SetRecord, VIEWS_FILE};
use super::{ViewSpec, ViewsError};

/// Says what a folder is for from the first moment on, so that an interrupted export is told from another one.
const PLAN_FILE: &str = "plan.json";

/// An open folder of an export.
#[derive(Debug)]
pub struct Export {
    path: PathBuf,
    seeds: Range<u64>,
    spec: ViewSpec,
}

/// What was written of one flat.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct FlatReport {
    /// Its seed.
    pub seed: u64,
    /// Views.
    pub n_views: usize,
    /// Pairs that share enough.
    pub n_pairs: usize,
    /// Size of all its files.
    pub bytes: usize,
}

/// Why an export ended. What was written until then stays, and the next run goes on from there.
#[derive(Debug, Error)]
pub enum ExportError {
    /// The folder does not take files.
    #[error("cannot write {path}: {source}; give a folder that can be written")]
    Write {
        /// What was written.
        path: PathBuf,
        /// Why it failed.
        source: io::Error,
    },
    /// No space is left.
    #[error("the disk is full at {path}: free some space and run the same command, it goes on where it stopped")]
    DiskFull {
        /// What was written.
        path: PathBuf,
    },
    /// The folder holds an export with other pictures.
    #[error("{path} holds another export ({found}), not one of {wanted}: give another folder")]
    Another {
        /// The folder.
        path: PathBuf,
        /// What its pictures are.
        found: String,
        /// What was asked for.
        wanted: String,
    },
    /// The folder holds something else.
    #[error("{path} is not empty and holds no export: give a new or empty folder")]
    NotAnExport {
        /// The folder.
        path: PathBuf,
    },
    /// A flat gave no views.
    #[error("flat {seed}: {source}")]
    Views {
        /// Its seed.
        seed: u64,
        /// Why.
        source: ViewsError,
    },
    /// A picture could not be encoded.
    #[error("flat {seed}: {source}")]
    Encode {
        /// The flat's seed.
        seed: u64,
        /// Why.
        source: image::ImageError,
    },
    /// The machine gives no thread to work on.
    #[error("no thread to work on: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}

/// What `plan.json` holds.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Plan {
    format: u32,
    size: [u32; 2],
    n_views: usize,
}

impl Plan {
    fn of(spec: &ViewSpec) -> Self {
        Self { format: FORMAT, size: [spec.width, spec.height], n_views: spec.n_views }
    }

    fn describe(&self) -> String {
        format!("{} views of {}x{} a flat, format {}", self.n_views, self.size[0], self.size[1], self.format)
    }
}

impl Export {
    /// Opens a folder, new or with an interrupted export of the same kind of views; the seeds may differ.
    ///
    /// # Errors
    /// [`ExportError`] when the folder cannot be written or holds something else.
    pub fn open(path: &Path, seeds: Range<u64>, spec: ViewSpec) -> Result<Self, ExportError> {
        let export = Self { path: path.to_owned(), seeds, spec };
        fs::create_dir_all(path).map_err(|e| write_error(path, e))?;
        let plan = Plan::of(&spec);
        match fs::read(path.join(PLAN_FILE)) {
            Ok(bytes) => export.compare(serde_json::from_slice(&bytes).ok(), &plan)?,
            Err(_) => export.require_empty()?,
        }
        write_whole(path, PLAN_FILE, &record::json(&plan))?;
        Ok(export)
    }

    fn compare(&self, found: Option<Plan>, wanted: &Plan) -> Result<(), ExportError> {
        if found.as_ref() == Some(wanted) {
            return Ok(());
        }
        let found = found.map_or_else(|| format!("{PLAN_FILE} cannot be read"), |plan| plan.describe());
        Err(ExportError::Another { path: self.path.clone(), found, wanted: wanted.describe() })
    }

    fn require_empty(&self) -> Result<(), ExportError> {
        let mut entries = fs::read_dir(&self.path).map_err(|e| write_error(&self.path, e))?;
        // What an export leaves that was interrupted in its first moment.
        let begun = unfinished(PLAN_FILE);
        let foreign = entries.any(|entry| entry.map_or(true, |e| e.file_name() != begun.as_str()));
        if foreign { Err(ExportError::NotAnExport { path: self.path.clone() }) } else { Ok(()) }
    }

    /// Seeds of the flats that are still to be written, ascending.
    #[must_use]
    pub fn pending(&self) -> Vec<u64> {
        self.seeds.clone().filter(|seed| !self.folder(*seed).join(VIEWS_FILE).is_file()).collect()
    }

    fn folder(&self, seed: u64) -> PathBuf {
        self.path.join(seed.to_string())
    }

    /// Draws and writes all flats that are missing on so many threads (at least one), and then `set.json`. `on_flat` is
    /// called after each flat, by the thread that wrote it. Memory grows with the number of threads, not of flats.
    ///
    /// # Errors
    /// The first [`ExportError`]; flats already begun on other threads are finished.
    pub fn run(&self, threads: usize, on_flat: &(dyn Fn(&FlatReport) + Sync)) -> Result<(), ExportError> {
        let pending = self.pending();
        let (next, failed) = (AtomicUsize::new(0), AtomicBool::new(false));
        let first_error: Mutex<Option<ExportError>> = Mutex::new(None);
        let work = || {
            while !failed.load(Ordering::Relaxed)
                && let Some(seed) = pending.get(next.fetch_add(1, Ordering::Relaxed))
            {
                match self.write_flat(*seed) {
                    Ok(report) => on_flat(&report),
                    Err(error) => {
                        failed.store(true, Ordering::Relaxed);
                        first_error.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
                    }
                }
            }
        };
        // One flat a thread: a pool of its own for each keeps the renderer from spreading over the others.
        let one_thread = || rayon::ThreadPoolBuilder::new().num_threads(1).build();
        let pools = (0..threads.max(1)).map(|_| one_thread()).collect::<Result<Vec<_>, _>>()?;
        std::thread::scope(|scope| {
            for pool in &pools {
                scope.spawn(move || pool.install(work));
            }
        });
        match first_error.into_inner().unwrap_or_else(PoisonError::into_inner) {
            Some(error) => Err(error),
            None => self.finish(),
        }
    }

    fn write_flat(&self, seed: u64) -> Result<FlatReport, ExportError> {
        let flat = super::draw(seed, &self.spec).map_err(|source| ExportError::Views { seed, source })?;
        let files = record::files(&flat).map_err(|source| ExportError::Encode { seed, source })?;
        let folder = self.folder(seed);
        fs::create_dir_all(&folder).map_err(|e| write_error(&folder, e))?;
        for file in &files {
            write_whole(&folder, &file.name, &file.bytes)?;
        }
        let bytes = files.iter().map(|f| f.bytes.len()).sum();
        Ok(FlatReport { seed, n_views: flat.views.len(), n_pairs: flat.pairs.len(), bytes })
    }

    fn finish(&self) -> Result<(), ExportError> {
        let set = SetRecord {
            format: FORMAT,
            scenes: self.seeds.clone().collect(),
            size: [self.spec.width, self.spec.height],
            n_views: self.spec.n_views,
        };
        write_whole(&self.path, SET_FILE, &record::json(&set))
    }
}

/// Writes a file under another name first: whoever finds it finds it whole.
fn write_whole(folder: &Path, name: &str, bytes: &[u8]) -> Result<(), ExportError> {
    let (path, unfinished) = (folder.join(name), folder.join(unfinished(name)));
    let write = || {
        let mut file = File::create(&unfinished)?;
        file.write_all(bytes)?;
        drop(file);
        fs::rename(&unfinished, &path)
    };
    write().map_err(|e| write_error(&path, e))
}

fn unfinished(name: &str) -> String {
    format!("{name}.part")
}

fn write_error(path: &Path, source: io::Error) -> ExportError {
    match source.kind() {
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => ExportError::DiskFull { path: path.to_owned() },
        _ => ExportError::Write { path: path.to_owned(), source },
    }
}
