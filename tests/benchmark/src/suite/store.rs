//! Where results are kept: a folder with a header and one file of lines for each shard. A run that is killed goes on
//! where it was: a line is an episode, whole or not there.

use std::collections::BTreeMap;
use std::fs::{self, File, TryLockError};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::record::EpisodeRecord;

const HEADER: &str = "benchmark.json";
/// Of the lines in a shard's file. A reader of another version refuses them.
const VERSION: u32 = 1;

/// What all shards of a run have in common.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Header {
    /// Version of the files.
    pub version: u32,
    /// Every setting that decides a result, by row. Rows may be added later.
    pub rows: BTreeMap<String, serde_json::Value>,
}

impl Header {
    /// For a run with these settings.
    #[must_use]
    pub fn new(rows: BTreeMap<String, serde_json::Value>) -> Self {
        Self { version: VERSION, rows }
    }
}

/// Which part of the work is done by this process.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct Shard {
    /// From 0.
    pub index: u32,
    /// Of so many.
    pub of: u32,
}

impl Shard {
    /// All of it.
    pub const WHOLE: Shard = Shard { index: 0, of: 1 };
}

/// Why results cannot be kept or read.
#[derive(Debug, Error)]
pub enum StoreError {
    /// The system refuses.
    #[error("{what} {}: {source}", path.display())]
    Io {
        /// What was tried.
        what: &'static str,
        /// On which file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// Somebody else writes there.
    #[error("another run is writing to {}: wait for it, or give this one another folder or shard", path.display())]
    Busy {
        /// The shard's file.
        path: PathBuf,
    },
    /// The folder holds results of other settings.
    #[error(
        "{} holds results of other settings (they differ in {key}): give this run a folder of its own, or the same settings",
        folder.display()
    )]
    OtherSettings {
        /// The folder.
        folder: PathBuf,
        /// The first setting that differs.
        key: String,
    },
    /// A file is not what it should be.
    #[error("{}, line {line}: {reason}", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// From 1.
        line: usize,
        /// What is wrong.
        reason: String,
    },
}

fn io_error<'a>(what: &'static str, path: &'a Path) -> impl FnOnce(io::Error) -> StoreError + use<'a> {
    move |source| StoreError::Io { what, path: path.to_owned(), source }
}

/// One shard's file, locked while this lives.
#[derive(Debug)]
pub struct Store {
    path: PathBuf,
    file: Mutex<File>,
}

impl Store {
    /// Opens a shard of a folder for writing, making what is missing, and returns with it all episodes that the folder holds
    /// already, those of other shards included. What a killed run left of a line is cut off.
    ///
    /// # Errors
    /// [`StoreError`] when the folder belongs to other settings, another run writes to the shard, or a file is damaged.
    pub fn open(folder: &Path, header: &Header, shard: Shard) -> Result<(Self, Vec<EpisodeRecord>), StoreError> {
        fs::create_dir_all(folder).map_err(io_error("cannot make the folder", folder))?;
        agree(folder, header)?;
        let path = folder.join(format!("shard-{}-of-{}.jsonl", shard.index, shard.of));
        let mut file = File::options()
            .create(true)
            .truncate(false)
            .read(true)
            .write(true)
            .open(&path)
            .map_err(io_error("cannot open", &path))?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Err(StoreError::Busy { path }),
            Err(TryLockError::Error(source)) => return Err(io_error("cannot lock", &path)(source)),
        }
        cut_torn_line(&mut file).map_err(io_error("cannot mend", &path))?;
        let records = read(folder)?;
        Ok((Self { path, file: Mutex::new(file) }, records))
    }

    /// Keeps an episode: once this returns, it survives a kill.
    ///
    /// # Errors
    /// [`StoreError::Io`], on a full disk for one; the file is then as it was before.
    pub fn keep(&self, record: &EpisodeRecord) -> Result<(), StoreError> {
        let mut line =
            serde_json::to_vec(record).map_err(io::Error::other).map_err(io_error("cannot write", &self.path))?;
        line.push(b'\n');
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        let end = file.seek(SeekFrom::End(0)).map_err(io_error("cannot write", &self.path))?;
        let written = file.write_all(&line).and_then(|()| file.sync_data());
        written.map_err(|source| {
            // Half a line would be cut off by the next run; better that there is none.
            drop(file.set_len(end));
            io_error("cannot write", &self.path)(source)
        })
    }
}

/// All episodes in a folder, in the order in which they ended in each shard.
///
/// # Errors
/// [`StoreError`] for a folder without results and for damaged files.
pub fn read(folder: &Path) -> Result<Vec<EpisodeRecord>, StoreError> {
    let listing = fs::read_dir(folder).map_err(io_error("cannot read the folder", folder))?;
    let mut paths: Vec<PathBuf> = listing.filter_map(|entry| entry.ok().map(|e| e.path())).collect();
    paths.retain(|p| p.extension().is_some_and(|e| e == "jsonl"));
    paths.sort();
    let mut records = Vec::new();
    for path in paths {
        let text = fs::read_to_string(&path).map_err(io_error("cannot read", &path))?;
        // A line without an end is being written, or was when its run was killed.
        let whole = text.rfind('\n').map_or("", |end| &text[..end]);
        for (k, line) in whole.lines().enumerate() {
            let damaged = |e: serde_json::Error| StoreError::Damaged {
                path: path.clone(),
                line: k + 1,
                reason: format!("{e}; remove the line, and its episode is run again"),
            };
            records.push(serde_json::from_str(line).map_err(damaged)?);
        }
    }
    Ok(records)
}

/// The header of a folder.
///
/// # Errors
/// [`StoreError`] for a folder without results, or of another version.
pub fn header(folder: &Path) -> Result<Header, StoreError> {
    let path = folder.join(HEADER);
    let text = fs::read_to_string(&path).map_err(io_error("cannot read", &path))?;
    let damaged = |reason: String| StoreError::Damaged { path: path.clone(), line: 1, reason };
    let header: Header = serde_json::from_str(&text).map_err(|e| damaged(e.to_string()))?;
    if header.version != VERSION {
        return Err(damaged(format!("its version is {}, and this program reads {VERSION}", header.version)));
    }
    Ok(header)
}

/// Rows that are there already must have the same settings; others are added.
fn agree(folder: &Path, wanted: &Header) -> Result<(), StoreError> {
    let path = folder.join(HEADER);
    let mut there = if path.exists() { header(folder)? } else { Header::new(BTreeMap::new()) };
    let before = there.rows.len();
    for (row, config) in &wanted.rows {
        let known = there.rows.entry(row.clone()).or_insert_with(|| config.clone());
        if let Some(key) = difference(known, config, row.clone()) {
            return Err(StoreError::OtherSettings { folder: folder.to_owned(), key });
        }
    }
    if there.rows.len() > before {
        // Readers see the old file or the new one, never half of it.
        let own = folder.join(format!("{HEADER}.{}", std::process::id()));
        let text = serde_json::to_string_pretty(&there).map_err(io::Error::other);
        let written = text.and_then(|text| fs::write(&own, text)).and_then(|()| fs::rename(&own, &path));
        written.map_err(io_error("cannot write", &path))?;
    }
    Ok(())
}

/// Where two settings differ, as a path of keys.
fn difference(a: &serde_json::Value, b: &serde_json::Value, at: String) -> Option<String> {
    if a == b {
        return None;
    }
    let below = |key: &str| if at.is_empty() { key.to_owned() } else { format!("{at}.{key}") };
    if let (Some(a), Some(b)) = (a.as_object(), b.as_object()) {
        let null = serde_json::Value::Null;
        let keys = a.keys().chain(b.keys().filter(|k| !a.contains_key(*k)));
        return keys
            .map(|k| difference(a.get(k).unwrap_or(&null), b.get(k).unwrap_or(&null), below(k)))
            .find_map(|found| found);
    }
    Some(at)
}

fn cut_torn_line(file: &mut File) -> io::Result<()> {
    let mut bytes = Vec::new();
    file.seek(SeekFrom::Start(0))?;
    file.read_to_end(&mut bytes)?;
    let whole = bytes.iter().rposition(|b| *b == b'\n').map_or(0, |end| end + 1);
    if whole < bytes.len() {
        file.set_len(whole as u64)?;
    }
    Ok(())
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test may fail by panicking")]
mod tests {
    use homing_sim::episode::{Level, Shape};
    use homing_sim::score::{Finish, Score};
    use serde_json::json;

    use super::*;
    use crate::cause::Watch;
    use crate::episode::StageSeconds;
    use crate::record::CellKey;

    fn record(id: &str) -> EpisodeRecord {
        let finish = Finish {
            success_m: 1.0,
            stopped: true,
            steps: 9,
            last_mile_steps: 3,
            path_length_m: 2.5,
            shortest_path_m: 2.0,
            final_distance_m: Some(0.1),
            final_straight_m: 0.1,
            final_heading_error_rad: 0.0,
            collisions: 0,
        };
        EpisodeRecord {
            cell: CellKey { row: "frontier".to_owned(), set: "flats-curved".to_owned() },
            scene: "flat seed 1".to_owned(),
            episode_id: id.to_owned(),
            level: Level::Easy,
            shape: Shape::Curved,
            strict: Score::strict(&finish),
            published: Score::published(&finish),
            cause: None,
            reason: "arrived".to_owned(),
            watch: Watch::default(),
            first_heading_rad: Some((0.1, 0.2)),
            times: StageSeconds::default(),
            wall_s: 1.0,
            commit: "0".to_owned(),
        }
    }

    fn header_of(n: u32) -> Header {
        Header::new(BTreeMap::from([("frontier".to_owned(), json!({"planner": {"budget": n}}))]))
    }

    #[test]
    fn a_killed_run_loses_only_the_line_it_was_writing() {
        let folder = tempfile::tempdir().unwrap();
        let (store, before) = Store::open(folder.path(), &header_of(500), Shard::WHOLE).unwrap();
        assert!(before.is_empty());
        store.keep(&record("a")).unwrap();
        store.keep(&record("b")).unwrap();
        drop(store);
        let path = folder.path().join("shard-0-of-1.jsonl");
        let whole = fs::read(&path).unwrap();
        let half = serde_json::to_vec(&record("c")).unwrap();
        fs::write(&path, [&whole[..], &half[..half.len() / 2]].concat()).unwrap();
        assert_eq!(read(folder.path()).unwrap().len(), 2, "a reader beside a run sees whole lines");

        let (store, before) = Store::open(folder.path(), &header_of(500), Shard::WHOLE).unwrap();
        assert_eq!(before, [record("a"), record("b")]);
        store.keep(&record("c")).unwrap();
        assert_eq!(read(folder.path()).unwrap(), [record("a"), record("b"), record("c")]);
    }

    #[test]
    fn two_runs_do_not_write_to_one_shard_but_may_to_two() {
        let folder = tempfile::tempdir().unwrap();
        let one = Store::open(folder.path(), &header_of(500), Shard { index: 0, of: 2 }).unwrap();
        let again = Store::open(folder.path(), &header_of(500), Shard { index: 0, of: 2 }).err().unwrap();
        assert!(again.to_string().contains("another run is writing"), "{again}");
        one.0.keep(&record("a")).unwrap();
        let (two, before) = Store::open(folder.path(), &header_of(500), Shard { index: 1, of: 2 }).unwrap();
        assert_eq!(before, [record("a")], "a shard knows what the others have done");
        two.keep(&record("b")).unwrap();
        assert_eq!(read(folder.path()).unwrap().len(), 2);
    }

    #[test]
    fn other_settings_need_another_folder() {
        let folder = tempfile::tempdir().unwrap();
        drop(Store::open(folder.path(), &header_of(500), Shard::WHOLE).unwrap());
        let refused = Store::open(folder.path(), &header_of(300), Shard::WHOLE).err().unwrap().to_string();
        let mut more = header_of(500);
        more.rows.insert("straight".to_owned(), json!({}));
        drop(Store::open(folder.path(), &more, Shard::WHOLE).unwrap());
        assert_eq!(header(folder.path()).unwrap(), more, "another row may be added");
        assert!(refused.contains("differ in frontier.planner.budget"), "{refused}");
    }

    #[test]
    fn a_damaged_line_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let (store, _) = Store::open(folder.path(), &header_of(500), Shard::WHOLE).unwrap();
        store.keep(&record("a")).unwrap();
        drop(store);
        let path = folder.path().join("shard-0-of-1.jsonl");
        let whole = fs::read_to_string(&path).unwrap();
        fs::write(&path, format!("{whole}{{\"row\":\"x\"}}\n{whole}")).unwrap();
        let refused = Store::open(folder.path(), &header_of(500), Shard::WHOLE).err().unwrap().to_string();
        assert!(refused.contains("line 2") && refused.contains("run again"), "{refused}");
    }

    #[test]
    fn a_full_disk_leaves_whole_lines() {
        // Linux has a file that is always full.
        let full = File::options().write(true).open("/dev/full");
        let Ok(full) = full else { return };
        let store = Store { path: "/dev/full".into(), file: Mutex::new(full) };
        let refused = store.keep(&record("a")).err().unwrap().to_string();
        assert!(refused.contains("cannot write /dev/full"), "{refused}");
    }

    #[test]
    fn a_folder_without_results_says_so() {
        let folder = tempfile::tempdir().unwrap();
        assert!(header(folder.path()).err().unwrap().to_string().contains("benchmark.json"));
    }
}
