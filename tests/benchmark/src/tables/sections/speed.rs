//! First headings, the link, time, collisions and errors.

use super::super::document::{Block, Column, Entry, Kind, Row, Table, percent};
use super::super::published::HEADINGS;
use super::super::rows::{self, BASE};
use super::super::{Headings, Report, Speed, plots};
use super::sling::share;
use super::start;

pub(super) fn section(report: &Report) -> Vec<Block> {
    let mut blocks = vec![start("headings", "First heading to the goal: SLING's Figure 3a")];
    if report.headings.is_empty() {
        blocks.push(Block::Text("No episode got as far as driving to a goal, or headings were not kept.".to_owned()));
    } else {
        let shown = report.headings.iter().filter(|h| h.row == BASE || h.row == "oracle-gd");
        blocks.push(Block::Pictures(shown.map(plots::headings).collect()));
        blocks.push(Block::Table(headings_table(&report.headings)));
    }
    blocks.push(Block::Note(format!(
        "Heading of the goal from the robot when it first drove to one. Published: {}: Wasserstein distance from the true \
         headings {} for NRNS, {} for SLING (unit not stated, so not ours to compare); {} % of the true headings within 15 \
         degrees in training, {} % at test time.",
        HEADINGS.source,
        HEADINGS.wasserstein_nrns,
        HEADINGS.wasserstein_sling,
        percent(HEADINGS.within_15_train),
        percent(HEADINGS.within_15_test)
    )));
    blocks.extend(link(report));
    blocks.push(start("speed", "Speed, collisions and precision"));
    blocks.push(Block::Table(speed_table(&report.speed)));
    blocks.push(Block::Table(quality_table(&report.speed)));
    blocks.push(Block::Note(QUALITY.to_owned()));
    blocks
}

const QUALITY: &str = "Per worker: a core that runs one episode after the other. Other: set-up, motion and records. \
     SoftSPL, times 100: SPL with max(0, 1 - distance left / shortest path) in place of success. Distance left: geodesic, \
     mean of all episodes; medians: of the successes alone. All episodes count, those above 10 m too.";

fn link(report: &Report) -> Vec<Block> {
    let mut blocks = vec![start("link", "SPL by quality of the link")];
    match plots::link(&report.info.link) {
        None => blocks.push(Block::Text("Not measured yet.".to_owned())),
        Some(picture) => {
            let columns = ["Quality, %", "SPL, times 100"].map(|n| Column::number("", n)).into();
            let row = |(quality, spl): &(f64, f64)| Row {
                kind: Kind::Ours,
                entries: [*quality, *spl].map(|x| Entry::text(percent(x))).into(),
            };
            blocks.push(Block::Pictures(vec![picture]));
            blocks.push(Block::Table(Table { columns, rows: report.info.link.iter().map(row).collect() }));
        }
    }
    blocks
}

fn kind(row: &str) -> Kind {
    if row == BASE { Kind::Base } else { Kind::Ours }
}

fn headings_table(all: &[Headings]) -> Table {
    let mut columns = vec![Column::text("Row"), Column::text("Set")];
    let names = ["Episodes", "Wasserstein, deg", "Median error, deg", "True within 15 deg, %", "Believed so, %"];
    columns.extend(names.map(|n| Column::number("", n)));
    let row = |h: &Headings| Row {
        kind: kind(&h.row),
        entries: vec![
            Entry::text(rows::name(&h.row)),
            Entry::text(h.set.clone()),
            Entry::text(h.n.to_string()),
            Entry::text(format!("{:.2}", h.wasserstein_deg)),
            Entry::text(format!("{:.2}", h.error_deg_median)),
            share(h.within_15_true.share, h.within_15_true.interval_95),
            share(h.within_15_believed.share, h.within_15_believed.interval_95),
        ],
    };
    Table { columns, rows: all.iter().map(row).collect() }
}

fn speed_table(all: &[Speed]) -> Table {
    let mut columns = vec![Column::text("Row"), Column::text("Set"), Column::number("", "Episodes")];
    columns.extend(["episodes/min", "steps/s"].map(|n| Column::number("Per worker", n)));
    let stages = ["render", "extract", "match", "pose", "plan", "other"];
    columns.extend(stages.map(|n| Column::number("Milliseconds a step", n)));
    let row = |s: &Speed| {
        let t = &s.stage_ms;
        let mut entries =
            vec![Entry::text(rows::name(&s.row)), Entry::text(s.set.clone()), Entry::text(s.n.to_string())];
        let rate = |x: Option<f64>| Entry::or_missing(x, |x| Entry::text(format!("{x:.1}")));
        entries.extend([rate(s.episodes_per_minute), rate(s.steps_per_second)]);
        let ms = [t.observe, t.extract, t.matching, t.pose, t.plan, s.other_ms];
        entries.extend(ms.map(|x| Entry::text(format!("{x:.1}"))));
        Row { kind: kind(&s.row), entries }
    };
    Table { columns, rows: all.iter().map(row).collect() }
}

fn quality_table(all: &[Speed]) -> Table {
    let mut columns = vec![Column::text("Row"), Column::text("Set")];
    columns.extend(["Steps", "SoftSPL", "Distance left, m"].map(|n| Column::number("All episodes, mean", n)));
    columns.extend(["position, m", "heading, deg"].map(|n| Column::number("Successes, median", n)));
    columns.extend(["per episode", "% of steps"].map(|n| Column::number("Collisions", n)));
    let row = |s: &Speed| {
        let number = |x: Option<f64>| Entry::or_missing(x, |x| Entry::text(format!("{x:.2}")));
        let entries = vec![
            Entry::text(rows::name(&s.row)),
            Entry::text(s.set.clone()),
            Entry::text(format!("{:.0}", s.steps_mean)),
            Entry::or_missing(s.soft_spl, |m| share(m.mean, m.interval_95)),
            number(s.final_distance_m_mean),
            number(s.success_distance_m_median),
            number(s.success_heading_deg_median),
            Entry::text(format!("{:.1}", s.collisions_mean)),
            Entry::text(percent(s.collided_share)),
        ];
        Row { kind: kind(&s.row), entries }
    };
    Table { columns, rows: all.iter().map(row).collect() }
}
