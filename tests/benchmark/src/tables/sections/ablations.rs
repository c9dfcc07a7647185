//! SLING's table 2, our rows below it, and what each change makes of the same episodes.

use super::super::ablations::{AblationSet, Agreement, Difference, SAME_POINTS};
use super::super::document::{Block, Column, Entry, Kind, Row, Table, Tone, points};
use super::super::published::SLING_2;
use super::super::rows;
use super::super::{CURVED, Report};
use super::sling::{columns, our_row, published_row};
use super::{sets, start};

pub(super) fn section(report: &Report) -> Vec<Block> {
    let mut rows = vec![Row::divider("Published, Gibson scans")];
    for published in SLING_2.rows {
        match published.number {
            8 => rows.push(Row::divider("Published: privileged last-mile navigation")),
            11 => rows.push(Row::divider("Published: privileged goal discovery")),
            _ => {}
        }
        rows.push(published_row(published));
    }
    let measured = |set: &&String| *set == CURVED || report.ablations.iter().any(|a| a.set == **set);
    for set in sets(report).iter().filter(measured) {
        rows.push(Row::divider(format!("Ours, {set}, strict")));
        rows.extend(rows::SLING_2.iter().map(|row| our_row(report, set, row)));
    }
    let mut blocks = vec![
        start("ablations", "Ablations: SLING's Table 2"),
        Block::Table(Table { columns: columns(), rows }),
        Block::Note(format!("Published: {}. {}.", SLING_2.source, SLING_2.protocol)),
    ];
    if report.ablations.is_empty() {
        blocks.push(Block::Text("No ablation shares episodes with the base row: no differences.".to_owned()));
    }
    for set in &report.ablations {
        blocks.push(Block::Heading(format!("What each change does to the same episodes, {}", set.set)));
        blocks.push(Block::Table(differences(set)));
    }
    blocks.push(Block::Note(rules()));
    blocks
}

fn rules() -> String {
    format!(
        "Differences from our base row, percentage points, over the episodes that both rows have, by the strict rule; with \
         95 % interval (success: Newcombe's paired one; SPL: normal) and McNemar's exact test. Paper: rows of SLING's Table 2 \
         minus its row 2. Ours agrees if its interval lies on the paper's side of zero, or, where the paper sees less than \
         half a point, within {SAME_POINTS:.0} points of zero; it disagrees if the interval excludes that; else it is within \
         noise. The paper's Oracle-GD replaces a learned discovery, ours a geometric one."
    )
}

fn differences(set: &AblationSet) -> Table {
    let mut columns = vec![Column::text("Change"), Column::number("", "Episodes")];
    columns.extend(["only base won", "only this won", "Succ", "p", "SPL"].map(|n| Column::number("Ours", n)));
    columns.extend(["Succ", "SPL"].map(|n| Column::number("Paper", n)));
    columns.extend([Column::text("Paper says"), Column::text("Ours")]);
    Table { columns, rows: set.differences.iter().map(difference).collect() }
}

fn difference(d: &Difference) -> Row {
    let success = Entry { interval: Some(points(d.success_95)), ..Entry::text(format!("{:+.1}", 100.0 * d.success)) };
    let spl = Entry::or_missing(d.spl, |m| Entry {
        interval: Some(points(m.interval_95)),
        ..Entry::text(format!("{:+.1}", 100.0 * m.mean))
    });
    let published = |show: &dyn Fn(&super::super::ablations::PublishedDifference) -> String| {
        Entry::or_missing(d.published.as_ref(), |p| Entry::quiet(show(p)))
    };
    let tone = match d.agreement {
        Agreement::Agrees => Tone::Good,
        Agreement::Disagrees => Tone::Bad,
        Agreement::WithinNoise => Tone::Plain,
        Agreement::NotReported => Tone::Quiet,
    };
    let entries = vec![
        Entry::text(d.name.clone()),
        Entry::text(d.n.to_string()),
        Entry::text(d.n_only_base.to_string()),
        Entry::text(d.n_only_row.to_string()),
        success,
        Entry::text(if d.p_mcnemar < 0.001 { "<0.001".to_owned() } else { format!("{:.3}", d.p_mcnemar) }),
        spl,
        published(&|p| signed(p.success)),
        published(&|p| signed(p.spl)),
        published(&|p| p.direction.words().to_owned()),
        Entry { tone, ..Entry::text(d.agreement.words()) },
    ];
    Row { kind: Kind::Ours, entries }
}

/// One digit, and no negative zero.
fn signed(points: f64) -> String {
    format!("{:+.1}", (10.0 * points).round() / 10.0 + 0.0)
}
