//! What was run, and what came of it in a few figures.

use super::super::document::{Block, Tile, percent, percents};
use super::super::{BASE, Report, RowFigures};
use super::start;

pub(super) fn section(report: &Report) -> Vec<Block> {
    let mut blocks = vec![start("summary", "Summary")];
    if report.n_episodes == 0 {
        blocks.push(Block::Text("This run has no episodes: nothing was measured.".to_owned()));
    } else {
        blocks.push(Block::Text(RULES.to_owned()));
        blocks.push(Block::Tiles(tiles(report)));
    }
    blocks.extend(counts(report));
    blocks.push(Block::Note(format!("Run again with: {}", or_unknown(&report.info.command))));
    if !report.info.config.is_null() {
        let text = serde_json::to_string_pretty(&report.info.config).unwrap_or_default();
        blocks.push(Block::Code { summary: "Settings".to_owned(), text });
    }
    blocks
}

const RULES: &str = "A robot is shown a photo and must drive to where it was taken. Our figures are by the strict rule: \
     success is the robot's own stop within 500 steps and within 1 m of the goal, measured along the shortest path. Figures \
     that others published stand beside ours for orientation. They were measured on scans of real houses, and most were \
     counted by looser rules; ours were measured in scenes of our simulator. No figure mixes the two. Intervals hold the true value in 95 % of cases.";

fn counts(report: &Report) -> Vec<Block> {
    let mut notes = Vec::new();
    if report.n_repeated > 0 {
        notes.push(Block::Note(format!("{} records repeat an episode and are not counted.", report.n_repeated)));
    }
    if report.n_not_finite > 0 {
        let n = report.n_not_finite;
        notes.push(Block::Note(format!(
            "{n} episodes have figures that are no numbers: such an SPL counts as 0, others are left out."
        )));
    }
    notes.extend(report.info.notes.iter().cloned().map(Block::Text));
    notes
}

fn or_unknown(text: &str) -> &str {
    if text.is_empty() { "(not stated)" } else { text }
}

fn tiles(report: &Report) -> Vec<Tile> {
    let rows = report.sets.iter().filter_map(|s| Some((s.set.as_str(), s.row(BASE)?)));
    let mut tiles: Vec<Tile> = rows.flat_map(|(set, row)| of_set(set, row)).collect();
    let n_cells: usize = report.sets.iter().map(|s| s.rows.len()).sum();
    tiles.push(Tile {
        label: "Episodes".to_owned(),
        value: report.n_episodes.to_string(),
        detail: format!("{n_cells} rows on {} sets", report.sets.len()),
    });
    tiles
}

fn of_set(set: &str, row: &RowFigures) -> Vec<Tile> {
    let Some(cell) = &row.overall else { return Vec::new() };
    let tile = |label: &str, value: String, interval: (f64, f64)| Tile {
        label: format!("{label}, {set}"),
        value,
        detail: format!("95 %: {}; {} episodes", percents(interval), cell.n),
    };
    vec![
        tile("Success", format!("{} %", percent(cell.success.share)), cell.success.interval_95),
        tile("SPL \u{d7} 100", percent(cell.spl.mean), cell.spl.interval_95),
    ]
}
