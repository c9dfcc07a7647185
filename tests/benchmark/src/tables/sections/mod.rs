//! The report's sections, in order: what a reader asks first comes first.

mod ablations;
mod failures;
mod field;
mod modular;
mod places;
mod sling;
mod speed;
mod summary;
mod visual;

use super::Report;
use super::document::{Block, Document};

const NEEDS_LEARNED: &str = "not measured: needs a learned policy";
const NOT_RUN: &str = "no episodes in this run";

/// The whole report.
pub(super) fn document(report: &Report) -> Document {
    let info = &report.info;
    let known = |label: &str, value: &str| (!value.is_empty()).then(|| format!("{label}{value}"));
    let parts = [known("", &info.date), known("commit ", &info.commit), known("", &info.machine)];
    let mut blocks = summary::section(report);
    if report.n_episodes > 0 {
        blocks.extend(sling::section(report));
        blocks.extend(ablations::section(report));
        blocks.extend(modular::section(report));
    }
    blocks.extend(visual::section(report));
    if report.n_episodes > 0 {
        blocks.extend(field::section(report));
        blocks.extend(places::section(report));
        blocks.extend(failures::section(report));
        blocks.extend(speed::section(report));
    }
    Document {
        title: "Homing: image-goal navigation, measured".to_owned(),
        subtitle: parts.into_iter().flatten().collect::<Vec<_>>().join(", "),
        blocks,
    }
}

fn start(id: &'static str, title: &'static str) -> Block {
    Block::Section { id, title }
}

/// Sets that tables are made for: the published ones' counterparts, measured or not, then whatever else was measured.
fn sets(report: &Report) -> Vec<String> {
    let mut sets = vec![super::CURVED.to_owned(), super::LAYOUTS.to_owned()];
    sets.extend(report.sets.iter().map(|s| s.set.clone()).filter(|s| s != super::CURVED && s != super::LAYOUTS));
    sets
}

/// Figures of a row on a set.
fn figures<'a>(report: &'a Report, set: &str, key: &str) -> Option<&'a super::RowFigures> {
    report.sets.iter().find(|s| s.set == set)?.row(key)
}
