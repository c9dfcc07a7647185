//! The modular paper's table I, and our rows below it.

use super::super::document::{Block, Column, Entry, Kind, Row, Table};
use super::super::published::MODULAR;
use super::super::rows::{self, OurRow};
use super::super::{BASE, Cell, Report};
use super::{NOT_RUN, figures, sets, start};

pub(super) fn section(report: &Report) -> Vec<Block> {
    let mut columns = vec![Column::text("Model")];
    columns.extend(["Easy", "Medium", "Hard", "Overall"].map(|level| Column::number(level, "SR / SPL")));
    columns.push(Column::text("Remark"));
    let mut rows = vec![Row::divider("Published, Gibson scans")];
    rows.extend(MODULAR.rows.iter().map(|r| {
        Row {
            kind: Kind::Published,
            entries: core::iter::once(Entry::text(r.model))
                .chain(r.cells.iter().map(|(sr, spl)| Entry::text(format!("{sr:.2} / {spl:.2}"))))
                .collect(),
        }
    }));
    for set in sets(report) {
        rows.push(Row::divider(format!("Ours, {set}, strict")));
        rows.extend(rows::MODULAR.iter().map(|row| our_row(report, &set, row)));
    }
    vec![
        start("modular", "Modular navigation: Table I"),
        Block::Table(Table { columns, rows }),
        Block::Note(format!("Published: {}. {}.", MODULAR.source, MODULAR.protocol)),
    ]
}

fn our_row(report: &Report, set: &str, row: &OurRow) -> Row {
    let found = row.key().and_then(|key| figures(report, set, key));
    let cells = found.map_or([None; 4], |f| {
        let [overall, easy, medium, hard] = f.sling_order();
        [easy, medium, hard, overall]
    });
    let remark = if found.is_some() { "" } else { NOT_RUN };
    let entries = core::iter::once(Entry::text(row.name)).chain(cells.map(entry)).chain([Entry::quiet(remark)]);
    let kind = match found {
        None => Kind::Missing,
        Some(f) if f.row == BASE => Kind::Base,
        Some(_) => Kind::Ours,
    };
    Row { kind, entries: entries.collect() }
}

fn entry(cell: Option<&Cell>) -> Entry {
    Entry::or_missing(cell, |c| {
        let range = |(low, high): (f64, f64)| format!("{low:.2}\u{2013}{high:.2}");
        Entry {
            interval: Some(format!("{} / {}", range(c.success.interval_95), range(c.spl.interval_95))),
            n: Some(c.n),
            ..Entry::text(format!("{:.2} / {:.2}", c.success.share, c.spl.mean))
        }
    })
}
