//! What a report must know of its run beside the episodes.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

use crate::record::EpisodeRecord;
use crate::visual_target;

/// What was run, when and where. Everything is printed as it is given.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct RunInfo {
    /// The command that runs it again.
    pub command: String,
    /// Commit of the code.
    pub commit: String,
    /// Day of the run.
    pub date: String,
    /// Effective settings.
    pub config: serde_json::Value,
    /// What it ran on, in words.
    pub machine: String,
    /// The visual target benchmark, if it was run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub visual_target: Option<visual_target::Report>,
    /// Quality of the link, 0 (nothing arrives) to 1, and the mean SPL with it; empty if not measured.
    pub link: Vec<(f64, f64)>,
    /// Whatever a reader must know.
    pub notes: Vec<String>,
    /// Clips that exist, relative to the report, as [`clip_path`] names them.
    #[serde(skip_serializing_if = "BTreeSet::is_empty")]
    pub clips: BTreeSet<String>,
}

impl RunInfo {
    /// Without what the report shows in its own form; what is no number is left out.
    pub(super) fn header(&self) -> Self {
        let link = self.link.iter().copied().filter(|(q, spl)| q.is_finite() && spl.is_finite()).collect();
        Self { visual_target: None, clips: BTreeSet::new(), link, ..self.clone() }
    }
}

/// Where the clip of an episode lies, relative to the report: `clips/ROW/SET/SCENE-ID.rrd`. What is no letter, digit, dot,
/// hyphen or underscore becomes an underscore, so that any scene's name is a file's name.
#[must_use]
pub fn clip_path(record: &EpisodeRecord) -> String {
    let part = |name: &str| -> String {
        let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
        let part: String = name.chars().map(|c| if plain(c) { c } else { '_' }).collect();
        // No part is hidden or leads upwards.
        part.strip_prefix('.').map_or(part.clone(), |rest| format!("_{rest}"))
    };
    let (row, set) = (part(&record.cell.row), part(&record.cell.set));
    format!("clips/{row}/{set}/{}-{}.rrd", part(&record.scene), part(&record.episode_id))
}
