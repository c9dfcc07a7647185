//! The best figures on Gibson-curved since SLING, for orientation.

use super::super::document::{Block, Column, Row, Table};
use super::super::published::{FIELD, SLING_1};
use super::super::rows::{self, BASE};
use super::super::{CURVED, Report};
use super::sling::{columns, our_row, published_row};
use super::start;

pub(super) fn section(report: &Report) -> Vec<Block> {
    let mut rows = vec![Row::divider("Published, Gibson scans")];
    rows.extend(SLING_1.numbered(11).map(published_row));
    rows.extend(FIELD.rows.iter().map(published_row));
    rows.push(Row::divider(format!("Ours, {CURVED}, strict")));
    rows.extend(rows::SLING_1.iter().filter(|r| r.key() == Some(BASE)).map(|r| our_row(report, CURVED, r)));
    let columns: Vec<Column> = columns();
    vec![
        start("field", "Best published on these episodes"),
        Block::Table(Table { columns, rows }),
        Block::Note(format!(
            "Published: {}; SLING + OVRL-GD: {}. Other scenes and other rules than ours.",
            FIELD.source, SLING_1.source
        )),
    ]
}
