//! The visual target paper's table 1, and ours below it.

use super::super::document::{Block, Column, Entry, Kind, Row, Table, percents};
use super::super::published::VISUAL_TARGET_SOURCE;
use super::super::visual::{MethodCell, MethodRow, PairColumn};
use super::super::{Report, VisualTarget};
use super::start;
use crate::visual_target::Difficulty;

pub(super) fn section(report: &Report) -> Vec<Block> {
    let mut columns = vec![Column::text("")];
    columns.extend(["Moderate", "Hard", "Extreme"].map(|d| Column::number("", d)));
    let mut rows = vec![Row::divider("Published")];
    rows.extend(published());
    let mut blocks = vec![start("visual-target", "Visual target navigation: Table 1")];
    match &report.visual_target {
        Some(ours) => rows.extend(our_rows(ours)),
        None => blocks.push(Block::Text("Ours: not measured in this run.".to_owned())),
    }
    blocks.push(Block::Table(Table { columns, rows }));
    blocks.push(Block::Note(format!(
        "Published: {VISUAL_TARGET_SOURCE}. Final errors count a failure with its initial ones, in the paper and here."
    )));
    blocks
}

fn published() -> Vec<Row> {
    let row = |name: &str, show: &dyn Fn(&crate::visual_target::pairs::Published) -> String| Row {
        kind: Kind::Published,
        entries: core::iter::once(Entry::text(name))
            .chain(Difficulty::ALL.map(|d| Entry::text(show(&d.published()))))
            .collect(),
    };
    vec![
        row("Avg. Init. Dist.", &|p| format!("{:.2} m", p.distance_m)),
        row("Avg. Init. VP Error", &|p| format!("{:.2}\u{b0}", p.heading_deg)),
        row("Avg. Fin. Dist.", &|p| format!("{:.2} m", p.final_distance_m)),
        row("Avg. Fin. VP Error", &|p| format!("{:.2}\u{b0}", p.final_heading_deg)),
        row("Success Rate", &|p| format!("{:.0} %", 100.0 * p.success_rate)),
    ]
}

fn our_rows(ours: &VisualTarget) -> Vec<Row> {
    let pair = |name: &str, show: &dyn Fn(&PairColumn) -> Entry| {
        let cell = |d| Entry::or_missing(ours.pairs.iter().find(|p| p.difficulty == d && p.n > 0), show);
        Row {
            kind: Kind::Ours,
            entries: core::iter::once(Entry::text(name)).chain(Difficulty::ALL.map(cell)).collect(),
        }
    };
    let mut rows = vec![
        Row::divider("Ours: the pairs, in generated flats"),
        pair("Avg. Init. Dist.", &|p| Entry { n: Some(p.n), ..Entry::text(format!("{:.2} m", p.distance_m)) }),
        pair("Avg. Init. VP Error", &|p| Entry::text(format!("{:.2}\u{b0}", p.heading_deg))),
    ];
    for method in &ours.methods {
        rows.push(Row::divider(format!("Ours: {}", method.name)));
        rows.push(method_row(method, "Avg. Fin. Dist.", &|c| Entry::text(format!("{:.2} m", c.final_distance_m))));
        rows.push(method_row(method, "Avg. Fin. VP Error", &|c| {
            Entry::text(format!("{:.2}\u{b0}", c.final_heading_deg))
        }));
        rows.push(method_row(method, "Success Rate", &|c| Entry {
            interval: Some(percents(c.success_rate_95)),
            n: Some(c.n),
            ..Entry::text(format!("{:.0} %", 100.0 * c.success_rate))
        }));
    }
    rows
}

fn method_row(method: &MethodRow, name: &str, show: &dyn Fn(&MethodCell) -> Entry) -> Row {
    let cells = method.cells.iter().map(|c| Entry::or_missing(c.as_ref(), show));
    Row { kind: Kind::Ours, entries: core::iter::once(Entry::text(name)).chain(cells).collect() }
}
