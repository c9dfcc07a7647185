//! One page that stands alone: no scripts, no fonts, no files beside it.

use super::document::{Align, Block, Document, Entry, Kind, Row, Table, Tone};
use crate::perception::PlotError;

const STYLE: &str = include_str!("page.css");

pub(super) fn render(document: &Document) -> Result<String, PlotError> {
    let mut body = String::new();
    let mut open = false;
    for block in &document.blocks {
        if let Block::Section { id, title } = block {
            if open {
                body.push_str("</section>\n");
            }
            open = true;
            body.push_str(&format!("<section id=\"{id}\">\n<h2>{}</h2>\n", escape(title)));
        } else {
            body.push_str(&self::block(block)?);
        }
    }
    if open {
        body.push_str("</section>\n");
    }
    Ok(format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n\
         <title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n\
         <header>\n<h1>{title}</h1>\n<p>{subtitle}</p>\n{contents}</header>\n<main>\n{body}</main>\n</body>\n</html>\n",
        title = escape(&document.title),
        subtitle = escape(&document.subtitle),
        contents = contents(document),
    ))
}

fn contents(document: &Document) -> String {
    let link = |block: &Block| match block {
        Block::Section { id, title } => Some(format!("<a href=\"#{id}\">{}</a>\n", escape(title))),
        _ => None,
    };
    format!("<nav>\n{}</nav>\n", document.blocks.iter().filter_map(link).collect::<String>())
}

fn block(block: &Block) -> Result<String, PlotError> {
    Ok(match block {
        Block::Section { .. } => String::new(),
        Block::Heading(title) => format!("<h3>{}</h3>\n", escape(title)),
        Block::Text(text) => format!("<p>{}</p>\n", escape(text)),
        Block::Note(text) => format!("<p class=\"note\">{}</p>\n", escape(text)),
        Block::Tiles(tiles) => {
            let tile = |t: &super::document::Tile| {
                format!(
                    "<div class=\"tile\"><span>{}</span><strong>{}</strong><span>{}</span></div>\n",
                    escape(&t.label),
                    escape(&t.value),
                    escape(&t.detail)
                )
            };
            format!("<div class=\"tiles\">\n{}</div>\n", tiles.iter().map(tile).collect::<String>())
        }
        Block::Table(t) => table(t),
        Block::Fold { summary, table: t } => {
            format!("<details>\n<summary>{}</summary>\n{}</details>\n", escape(summary), table(t))
        }
        Block::Code { summary, text } => {
            format!("<details>\n<summary>{}</summary>\n<pre>{}</pre>\n</details>\n", escape(summary), escape(text))
        }
        Block::Pictures(pictures) => {
            let drawn: Result<Vec<String>, PlotError> =
                pictures.iter().map(|p| Ok(format!("<figure>\n{}</figure>\n", p.draw()?))).collect();
            format!("<div class=\"pictures\">\n{}</div>\n", drawn?.concat())
        }
    })
}

fn table(table: &Table) -> String {
    let rows: String = table.rows.iter().map(|r| row(r, table)).collect();
    format!("<div class=\"scroll\">\n<table>\n{}<tbody>\n{rows}</tbody>\n</table>\n</div>\n", head(table))
}

/// One line of names, and one of groups above it where there are any.
fn head(table: &Table) -> String {
    let class = |align: Align| if align == Align::Number { " class=\"number\"" } else { "" };
    let columns = &table.columns;
    if columns.iter().all(|c| c.group.is_empty()) {
        let names: String = columns.iter().map(|c| format!("<th{}>{}</th>", class(c.align), escape(&c.name))).collect();
        return format!("<thead>\n<tr>{names}</tr>\n</thead>\n");
    }
    let (mut groups, mut names) = (String::new(), String::new());
    let mut i = 0;
    while let Some(column) = columns.get(i) {
        if column.group.is_empty() {
            groups.push_str(&format!("<th rowspan=\"2\"{}>{}</th>", class(column.align), escape(&column.name)));
            i += 1;
            continue;
        }
        let of_group = columns[i..].iter().take_while(|c| c.group == column.group);
        let n = of_group.map(|c| names.push_str(&format!("<th class=\"number\">{}</th>", escape(&c.name)))).count();
        groups.push_str(&format!("<th class=\"group\" colspan=\"{n}\">{}</th>", escape(&column.group)));
        i += n;
    }
    format!("<thead>\n<tr>{groups}</tr>\n<tr>{names}</tr>\n</thead>\n")
}

fn row(row: &Row, table: &Table) -> String {
    if row.kind == Kind::Divider {
        let title = row.entries.first().map_or("", |e| &e.text);
        let n = table.columns.len();
        return format!("<tr class=\"divider\"><th colspan=\"{n}\">{}</th></tr>\n", escape(title));
    }
    let class = match row.kind {
        Kind::Divider | Kind::Ours => "ours",
        Kind::Published => "published",
        Kind::Base => "ours base",
        Kind::Missing => "missing",
    };
    let empty = Entry::default();
    let cells: String = table
        .columns
        .iter()
        .enumerate()
        .map(|(i, column)| cell(row.entries.get(i).unwrap_or(&empty), column.align, if i == 0 { "th" } else { "td" }))
        .collect();
    format!("<tr class=\"{class}\">{cells}</tr>\n")
}

fn cell(entry: &Entry, align: Align, tag: &str) -> String {
    let mut classes = Vec::new();
    if align == Align::Number {
        classes.push("number");
    }
    match entry.tone {
        Tone::Plain => {}
        Tone::Quiet => classes.push("quiet"),
        Tone::Good => classes.push("good"),
        Tone::Bad => classes.push("bad"),
    }
    let class = if classes.is_empty() { String::new() } else { format!(" class=\"{}\"", classes.join(" ")) };
    let text = match &entry.link {
        Some(path) => format!("<a href=\"{}\">{}</a>", escape(path), escape(&entry.text)),
        None => escape(&entry.text),
    };
    let interval = entry.interval.as_ref().map_or_else(String::new, |i| format!("<small>{}</small>", escape(i)));
    let n = entry.n.map_or_else(String::new, |n| format!("<small>n {n}</small>"));
    format!("<{tag}{class}>{text}{interval}{n}</{tag}>")
}

/// Text that is no markup, between tags and in quoted attributes.
pub(super) fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            c if c.is_control() && c != '\n' => out.push(' '),
            c => out.push(c),
        }
    }
    out
}
