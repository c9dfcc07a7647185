//! The report of the benchmark: the published tables, and what we measured beside them.
//!
//! [`Report::new`] sums up episodes; [`Report::to_html`] is one page that stands alone, [`Report::to_markdown`] the same
//! for a terminal, [`Report::to_json`] the figures. [`published`] holds every figure that is not ours, with its source.
//!
//! Published figures were measured on scans of real houses and counted by the loose rules of their time, ours in other
//! scenes and by the strict rule. They stand in one table and never in one mean.

mod ablations;
mod causes;
mod distances;
mod document;
mod episodes;
mod estimate;
mod figures;
mod headings;
mod html;
mod info;
mod markdown;
mod plots;
pub mod published;
mod rows;
mod sections;
mod speed;
mod visual;

#[cfg(test)]
mod tests;

use std::collections::BTreeSet;

use serde::Serialize;

pub use crate::perception::PlotError;
pub use ablations::{AblationSet, Agreement, Difference};
pub use causes::{Causes, Failure};
pub use distances::{Bin, Distances};
pub use estimate::{Mean, paired_share_95, wasserstein_1};
pub use figures::{Cell, RowFigures, SceneFigures, SetFigures};
pub use headings::Headings;
pub use info::{RunInfo, clip_path};
pub use rows::{BASE, CURVED, HEADLINES, LAYOUTS};
pub use speed::Speed;
pub use visual::VisualTarget;

use crate::record::EpisodeRecord;
use episodes::Episodes;
use published::Published;

/// What a run of the benchmark came to.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// What was run, and where.
    pub info: RunInfo,
    /// Episodes summed up.
    pub n_episodes: usize,
    /// Records of an episode that was there already; they are not counted.
    pub n_repeated: usize,
    /// Episodes with a figure that is no number. Such an SPL counts as 0, other such figures are left out.
    pub n_not_finite: usize,
    /// Success and SPL of every row, by set.
    pub sets: Vec<SetFigures>,
    /// Rows against [`BASE`] on the same episodes, by set.
    pub ablations: Vec<AblationSet>,
    /// Success and SPL by scene, of [`BASE`] on [`LAYOUTS`].
    pub scenes: Vec<SceneFigures>,
    /// Success by length of the shortest path.
    pub distances: Vec<Distances>,
    /// First headings, believed and true.
    pub headings: Vec<Headings>,
    /// What became of the episodes.
    pub causes: Vec<Causes>,
    /// Every episode that a headline row lost.
    pub failures: Vec<Failure>,
    /// Time, errors and collisions of every row.
    pub speed: Vec<Speed>,
    /// The visual target benchmark, if it was run.
    pub visual_target: Option<VisualTarget>,
    /// Everything that is not ours.
    pub published: Published,
    /// Errors at the end, for plots; too many for the file.
    #[serde(skip)]
    errors: Vec<plots::FinalErrors>,
}

impl Report {
    /// Sums up. The order of the records does not matter.
    #[must_use]
    pub fn new(info: &RunInfo, records: &[EpisodeRecord]) -> Self {
        let episodes = Episodes::new(records);
        let clips: BTreeSet<&str> = info.clips.iter().map(String::as_str).collect();
        Self {
            info: info.header(),
            n_episodes: episodes.len(),
            n_repeated: episodes.n_repeated,
            n_not_finite: episodes.n_not_finite,
            sets: figures::by_set(&episodes),
            ablations: ablations::by_set(&episodes),
            scenes: figures::by_scene(&episodes),
            distances: distances::by_cell(&episodes),
            headings: headings::by_cell(&episodes),
            causes: causes::by_cell(&episodes),
            failures: causes::failures(&episodes, &clips),
            speed: speed::by_cell(&episodes),
            visual_target: info.visual_target.as_ref().map(VisualTarget::of),
            published: Published::ALL,
            errors: plots::final_errors(&episodes),
        }
    }

    /// For a terminal, and for any reader of Markdown.
    #[must_use]
    pub fn to_markdown(&self) -> String {
        markdown::render(&sections::document(self))
    }

    /// The figures as JSON, indented.
    ///
    /// # Errors
    /// None that its own types can cause; the serialiser's are handed on.
    pub fn to_json(&self) -> serde_json::Result<String> {
        serde_json::to_string_pretty(self)
    }

    /// One page with style sheet and pictures in it, without scripts: it can be sent as it is.
    ///
    /// # Errors
    /// [`PlotError`] when a picture cannot be drawn.
    pub fn to_html(&self) -> Result<String, PlotError> {
        html::render(&sections::document(self))
    }
}
