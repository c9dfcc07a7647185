//! From what is kept in a folder to the report.

use std::collections::BTreeSet;
use std::path::Path;

use anyhow::Context;
use homing_benchmark::EpisodeRecord;
use homing_benchmark::suite::store;
use homing_benchmark::tables::{Report, RunInfo, clip_path};
use homing_benchmark::visual_target;

/// Kept beside the episodes: visual target navigation's pairs.
pub const VISUAL_TARGET: &str = "visual-target.json";

/// Writes `report.md`, `report.json` and `report.html` into a folder of results, and returns the first two as text.
pub fn write(folder: &Path, command: String, notes: Vec<String>) -> anyhow::Result<(String, String)> {
    let records = store::read(folder)?;
    let header = store::header(folder)?;
    let info = RunInfo {
        command,
        commit: commits(&records),
        date: jiff::Timestamp::now().strftime("%Y-%m-%d").to_string(),
        config: serde_json::to_value(&header.rows)?,
        machine: machine(),
        visual_target: visual_target(folder)?,
        clips: clips(folder, &records),
        notes,
        ..RunInfo::default()
    };
    let report = Report::new(&info, &records);
    let (markdown, json) = (report.to_markdown(), report.to_json()?);
    for (name, text) in [("report.md", &markdown), ("report.json", &json), ("report.html", &report.to_html()?)] {
        let path = folder.join(name);
        std::fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))?;
    }
    Ok((markdown, json))
}

fn visual_target(folder: &Path) -> anyhow::Result<Option<visual_target::Report>> {
    let path = folder.join(VISUAL_TARGET);
    if !path.exists() {
        return Ok(None);
    }
    let text = std::fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))?;
    let report = serde_json::from_str(&text);
    report.map(Some).with_context(|| format!("{} is no report: remove it, and it is made anew", path.display()))
}

/// Every commit that ran an episode, the one that ran most first.
fn commits(records: &[EpisodeRecord]) -> String {
    let names: BTreeSet<&str> = records.iter().map(|r| r.commit.as_str()).collect();
    let mut counted: Vec<(usize, &str)> =
        names.into_iter().map(|name| (records.iter().filter(|r| r.commit == name).count(), name)).collect();
    counted.sort_by_key(|(n, _)| core::cmp::Reverse(*n));
    counted.into_iter().map(|(n, name)| format!("{name} ({n} episodes)")).collect::<Vec<_>>().join(", ")
}

fn clips(folder: &Path, records: &[EpisodeRecord]) -> BTreeSet<String> {
    records.iter().filter(|r| r.cause.is_some()).map(clip_path).filter(|clip| folder.join(clip).is_file()).collect()
}

fn machine() -> String {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = info.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    let model = model.map_or("unknown processor", |(_, name)| name.trim());
    format!("{cores} cores of {model}, no GPU used")
}
