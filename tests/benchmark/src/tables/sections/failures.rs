//! Why episodes were lost, where robots ended, and every episode that was lost.

use super::super::causes::CAUSES;
use super::super::document::{Align, Block, Column, Entry, Kind, Row, Table};
use super::super::rows::{self, BASE, HEADLINES};
use super::super::{Causes, Failure, Report, plots};
use super::{sets, start};
use crate::cause::Cause;

pub(super) fn section(report: &Report) -> Vec<Block> {
    let mut headline: Vec<&Causes> = report.causes.iter().filter(|c| HEADLINES.contains(&c.row.as_str())).collect();
    headline.sort_by_key(|c| (rows::set_order(&c.set), &c.set, rows::headline_order(&c.row)));
    let named: Vec<(String, &Causes)> =
        headline.iter().map(|c| (format!("{}, {}", rows::name(&c.row), c.set), *c)).collect();
    let mut blocks = vec![start("failures", "What was lost, and why")];
    blocks.push(Block::Pictures(plots::causes("What became of the episodes", &named).into_iter().collect()));
    blocks.push(Block::Table(causes_table(&report.causes)));
    blocks.push(Block::Heading("Where the robots ended".to_owned()));
    let ends = sets(report)
        .into_iter()
        .flat_map(|set| [plots::positions(&set, &report.errors), plots::heading_errors(&set, &report.errors)]);
    blocks.push(Block::Pictures(ends.flatten().collect()));
    blocks.push(Block::Heading("Episodes that were lost".to_owned()));
    let mut n_listed = 0;
    for c in &headline {
        let lost: Vec<&Failure> = report.failures.iter().filter(|f| f.row == c.row && f.set == c.set).collect();
        if lost.is_empty() {
            continue;
        }
        n_listed += lost.len();
        let summary = format!("{}, {}: {} of {} lost", rows::name(&c.row), c.set, lost.len(), c.n);
        blocks.push(Block::Fold { summary, table: failures_table(&lost) });
    }
    if n_listed == 0 {
        blocks.push(Block::Text("None.".to_owned()));
    }
    blocks
}

fn causes_table(all: &[Causes]) -> Table {
    let mut columns = vec![Column::text("Row"), Column::text("Set")];
    columns.extend(["Episodes", "Success"].map(|n| Column::number("", n)));
    columns.extend(CAUSES.map(|c| Column::number("Lost", Cause::words(c))));
    let row = |c: &Causes| {
        let mut entries = vec![Entry::text(rows::name(&c.row)), Entry::text(c.set.clone())];
        entries.extend([c.n, c.n_success].map(|n| Entry::text(n.to_string())));
        entries.extend(CAUSES.map(|cause| Entry::text(c.causes.get(&cause).copied().unwrap_or(0).to_string())));
        Row { kind: if c.row == BASE { Kind::Base } else { Kind::Ours }, entries }
    };
    Table { columns, rows: all.iter().map(row).collect() }
}

fn failures_table(lost: &[&Failure]) -> Table {
    let text = Column::text;
    let number = |name: &str| Column { align: Align::Number, ..Column::text(name) };
    let columns = vec![
        text("Scene"),
        text("Episode"),
        text("Level"),
        text("Cause"),
        number("Steps"),
        number("Left, m"),
        text("Last words"),
        text("Clip"),
    ];
    let row = |f: &&Failure| Row {
        kind: Kind::Ours,
        entries: vec![
            Entry::text(f.scene.clone()),
            Entry::text(f.episode_id.clone()),
            Entry::text(f.level.name()),
            Entry::or_missing(f.cause, |c| Entry::text(c.words())),
            Entry::text(f.steps.to_string()),
            Entry::or_missing(f.final_distance_m, |d| Entry::text(format!("{d:.2}"))),
            Entry::text(f.reason.clone()),
            Entry::or_missing(f.clip.clone(), |path| Entry { link: Some(path), ..Entry::text("clip") }),
        ],
    };
    Table { columns, rows: lost.iter().map(row).collect() }
}
