//! SLING's table 1, and our rows below it.

use super::super::document::{Block, Column, Entry, Kind, Row, Table, percent, percents};
use super::super::published::{SLING_1, SlingRow};
use super::super::rows::{self, OurRow};
use super::super::{BASE, Cell, Report, RowFigures};
use super::{NEEDS_LEARNED, NOT_RUN, figures, sets, start};

pub(super) fn section(report: &Report) -> Vec<Block> {
    let mut rows = vec![Row::divider("Published, Gibson scans")];
    rows.extend(SLING_1.rows.iter().map(published_row));
    for set in sets(report) {
        rows.push(Row::divider(format!("Ours, {set}, strict")));
        rows.extend(rows::SLING_1.iter().map(|row| our_row(report, &set, row)));
        rows.extend(others(report, &set));
    }
    let mut blocks = vec![
        start("methods", "Image-goal navigation: SLING's Table 1"),
        Block::Table(Table { columns: columns(), rows }),
        Block::Note(format!("Published: {}. {}.", SLING_1.source, SLING_1.protocol)),
        Block::Note(OURS.to_owned()),
    ];
    blocks.extend(unequal(report).map(Block::Note));
    blocks.push(Block::Heading("Success by distance".to_owned()));
    let pictures = sets(report).iter().filter_map(|s| super::super::plots::distances(s, &report.distances)).collect();
    blocks.push(Block::Pictures(pictures));
    blocks.extend(distance_table(report).map(Block::Table));
    blocks
}

const OURS: &str = "Ours: percent of episodes and SPL times 100, easy 1.5 to 3 m, medium 3 to 5 m, hard 5 to 10 m; overall \
     pools the three. Small figures: 95 % interval (success: Wilson; SPL: normal) and episodes. The last two columns count \
     the same episodes of ours as the papers counted theirs: within 1 m in a straight line, walls or not, stopped or not, \
     steps of the last mile free. A dash is a figure that was not measured.";

/// SLING's columns, our own count by the published rules, and a remark.
pub(super) fn columns() -> Vec<Column> {
    let mut columns = vec![Column::text("Method")];
    for group in ["Overall", "Easy", "Medium", "Hard", "Publ. rule"] {
        columns.extend(["Succ", "SPL"].map(|name| Column::number(group, name)));
    }
    columns.push(Column::text("Remark"));
    columns
}

pub(super) fn published_row(row: &SlingRow) -> Row {
    let mut entries = vec![Entry::text(row.method)];
    for (success, spl) in row.cells {
        entries.extend([success, spl].map(|x| Entry::text(format!("{x:.1}"))));
    }
    entries.extend([Entry::default(), Entry::default()]);
    entries.push(Entry::quiet(if row.number > 0 { format!("row {}", row.number) } else { String::new() }));
    Row { kind: Kind::Published, entries }
}

/// A row of ours by the columns of SLING's tables.
pub(super) fn our_row(report: &Report, set: &str, row: &OurRow) -> Row {
    let key = row.key();
    let found = key.and_then(|key| figures(report, set, key));
    let repeats = row.published.map_or_else(String::new, |n| format!("as row {n}"));
    let remark = match (key, found) {
        (None, _) => NEEDS_LEARNED.to_owned(),
        (Some(_), None) => NOT_RUN.to_owned(),
        (Some(_), Some(_)) => repeats,
    };
    figures_row(row.name, found, remark)
}

fn figures_row(name: &str, found: Option<&RowFigures>, remark: String) -> Row {
    let mut entries = vec![Entry::text(name)];
    let cells = found.map_or([None; 4], RowFigures::sling_order);
    entries.extend(cells.into_iter().flat_map(cell_entries));
    let overall = cells[0];
    entries.push(Entry::or_missing(overall, |c| share(c.published_success.share, c.published_success.interval_95)));
    entries.push(Entry::or_missing(overall, |c| share(c.published_spl.mean, c.published_spl.interval_95)));
    entries.push(Entry::quiet(remark));
    let kind = match found {
        None => Kind::Missing,
        Some(f) if f.row == BASE => Kind::Base,
        Some(_) => Kind::Ours,
    };
    Row { kind, entries }
}

/// Success and SPL, percent.
pub(super) fn cell_entries(cell: Option<&Cell>) -> [Entry; 2] {
    let success = |c: &Cell| Entry { n: Some(c.n), ..share(c.success.share, c.success.interval_95) };
    [Entry::or_missing(cell, success), Entry::or_missing(cell, |c| share(c.spl.mean, c.spl.interval_95))]
}

pub(super) fn share(value: f64, interval: (f64, f64)) -> Entry {
    Entry { text: percent(value), interval: Some(percents(interval)), ..Entry::default() }
}

/// Rows that no table knows: nothing that was measured is left out.
fn others(report: &Report, set: &str) -> Vec<Row> {
    let of_set = report.sets.iter().find(|s| s.set == set);
    let unknown = of_set.into_iter().flat_map(|s| &s.rows).filter(|r| rows::row_order(&r.row) == usize::MAX);
    unknown.map(|r| figures_row(&r.name, Some(r), String::new())).collect()
}

/// The papers' overall is the mean of three levels with as many episodes each; where ours pools others, it is said.
fn unequal(report: &Report) -> Option<String> {
    let differs = |row: &&RowFigures| match (&row.overall, row.mean_of_levels) {
        (Some(overall), Some(mean)) => (overall.success.share - mean).abs() > 0.005,
        _ => false,
    };
    let all = report.sets.iter().flat_map(|s| s.rows.iter().filter(differs).map(move |r| (s, r)));
    let words = all.filter_map(|(s, r)| Some(format!("{} on {}: {}", r.name, s.set, percent(r.mean_of_levels?))));
    let words: Vec<String> = words.collect();
    (!words.is_empty()).then(|| {
        format!("Levels of different sizes; overall success as the mean of the three levels: {}.", words.join("; "))
    })
}

fn distance_table(report: &Report) -> Option<Table> {
    let first = report.distances.first()?;
    let mut columns = vec![Column::text("Method"), Column::text("Set")];
    columns.extend(first.bins.iter().map(|b| Column::number("", &b.words())));
    let row = |d: &super::super::Distances| {
        let mut entries = vec![Entry::text(rows::name(&d.row)), Entry::text(d.set.clone())];
        entries.extend(d.bins.iter().map(|b| match b.success.n {
            0 => Entry::missing(),
            n => Entry { n: Some(n), ..share(b.success.share, b.success.interval_95) },
        }));
        Row { kind: if d.row == BASE { Kind::Base } else { Kind::Ours }, entries }
    };
    Some(Table { columns, rows: report.distances.iter().map(row).collect() })
}
