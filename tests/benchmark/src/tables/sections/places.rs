//! Success by scene.

use super::super::document::{Block, Column, Entry, Kind, Row, Table};
use super::super::{LAYOUTS, Report, RowFigures, rows};
use super::sling::cell_entries;
use super::start;

pub(super) fn section(report: &Report) -> Vec<Block> {
    let mut blocks = vec![start("scenes", "Scene by scene")];
    if report.scenes.is_empty() {
        blocks.push(Block::Text(format!("No episodes on {LAYOUTS} in this run.")));
    }
    for figures in &report.scenes {
        let mut columns = vec![Column::text("Scene")];
        for group in ["Overall", "Easy", "Medium", "Hard", "Extra"] {
            columns.extend(["Succ", "SPL"].map(|name| Column::number(group, name)));
        }
        blocks.push(Block::Heading(format!("{}, {}", rows::name(&figures.row), figures.set)));
        blocks.push(Block::Table(Table { columns, rows: figures.scenes.iter().map(row).collect() }));
    }
    blocks.push(Block::Note("By the strict rule. Extra: above 10 m, not part of overall.".to_owned()));
    blocks
}

fn row(scene: &RowFigures) -> Row {
    let cells = scene.sling_order().into_iter().chain([scene.levels[3].as_ref()]);
    let entries = core::iter::once(Entry::text(scene.name.clone())).chain(cells.flat_map(cell_entries));
    Row { kind: Kind::Ours, entries: entries.collect() }
}
