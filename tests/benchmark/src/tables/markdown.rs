//! Markdown whose tables are aligned, so that they read as well in a terminal.

use super::document::{Align, Block, Document, Entry, Kind, Row, Table};

/// Rows of a folded table that are shown.
const FOLDED_ROWS: usize = 25;

pub(super) fn render(document: &Document) -> String {
    let mut out = format!("# {}\n\n{}\n", plain(&document.title), plain(&document.subtitle));
    for block in &document.blocks {
        let text = self::block(block);
        if !text.is_empty() {
            out.push('\n');
            out.push_str(&text);
        }
    }
    out
}

fn block(block: &Block) -> String {
    match block {
        Block::Section { title, .. } => format!("## {title}\n"),
        Block::Heading(title) => format!("### {}\n", plain(title)),
        Block::Text(text) | Block::Note(text) => format!("{}\n", plain(text)),
        Block::Tiles(tiles) => {
            let line = |t: &super::document::Tile| {
                format!("- {}: {} ({})\n", plain(&t.label), plain(&t.value), plain(&t.detail))
            };
            tiles.iter().map(line).collect()
        }
        Block::Table(t) => table(t, usize::MAX),
        Block::Fold { summary, table: t } => {
            let rest = t.rows.len().saturating_sub(FOLDED_ROWS);
            let more =
                if rest > 0 { format!("\n{rest} more are in the page and in the JSON.\n") } else { String::new() };
            format!("{}\n\n{}{more}", plain(summary), table(t, FOLDED_ROWS))
        }
        Block::Code { .. } | Block::Pictures(_) => String::new(),
    }
}

fn table(table: &Table, rows_max: usize) -> String {
    let head = table.columns.iter().map(|c| plain(format!("{} {}", c.group, c.name).trim())).collect();
    let mut lines: Vec<Vec<String>> = vec![head];
    for row in table.rows.iter().take(rows_max) {
        lines.extend(row_lines(row, table.columns.len()));
    }
    let width = |i: usize| lines.iter().map(|l| l[i].chars().count()).max().unwrap_or(0).max(3);
    let widths: Vec<usize> = (0..table.columns.len()).map(width).collect();
    let line = |cells: &[String]| {
        let cells = cells.iter().zip(&widths).zip(&table.columns).map(|((text, width), column)| match column.align {
            Align::Text => format!(" {text:width$} "),
            Align::Number => format!(" {text:>width$} "),
        });
        format!("|{}|\n", cells.collect::<Vec<_>>().join("|"))
    };
    let rule = |i: usize| match table.columns[i].align {
        Align::Text => "-".repeat(widths[i] + 2),
        Align::Number => format!("{}:", "-".repeat(widths[i] + 1)),
    };
    let rules: Vec<String> = (0..widths.len()).map(rule).collect();
    let body: String = lines.iter().skip(1).map(|l| line(l)).collect();
    format!("{}|{}|\n{body}", line(&lines[0]), rules.join("|"))
}

/// The row, and below it its intervals and its episodes if it has any.
fn row_lines(row: &Row, n_columns: usize) -> Vec<Vec<String>> {
    let cells = |label: Option<&str>, of: &dyn Fn(&Entry) -> String| {
        let mut cells: Vec<String> = row.entries.iter().map(of).collect();
        cells.resize(n_columns, String::new());
        if let (Some(label), Some(first)) = (label, cells.first_mut()) {
            *first = label.to_owned();
        }
        cells
    };
    if row.kind == Kind::Divider {
        return vec![cells(None, &|e| format!("**{}**", plain(&e.text)))];
    }
    let mut lines = vec![cells(None, &shown)];
    if row.entries.iter().any(|e| e.interval.is_some()) {
        lines.push(cells(Some("  95 %"), &|e| e.interval.clone().unwrap_or_default()));
    }
    if row.entries.iter().any(|e| e.n.is_some()) {
        lines.push(cells(Some("  n"), &|e| e.n.map_or_else(String::new, |n| n.to_string())));
    }
    lines
}

fn shown(entry: &Entry) -> String {
    match &entry.link {
        Some(path) => format!("[{}]({path})", plain(&entry.text)),
        None => plain(&entry.text),
    }
}

/// Text that Markdown takes for nothing else, on one line.
fn plain(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut rest = text.chars().peekable();
    while let Some(c) = rest.next() {
        match c {
            '|' | '`' => out.extend(['\\', c]),
            // A tag begins so; "<0.001" is none.
            '<' if rest.peek().is_some_and(|c| c.is_ascii_alphabetic() || "/!?".contains(*c)) => out.push_str("\\<"),
            c if c.is_control() => out.push(' '),
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_no_markup_and_figures_stay_as_they_are() {
        assert_eq!(plain("a|b <i> `c` <0.001 < 2\n</i>"), "a\\|b \\<i> \\`c\\` <0.001 < 2 \\</i>");
    }
}
