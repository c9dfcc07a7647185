//! The report as a sequence of blocks, from which the page and the Markdown are made.

use super::plots::Picture;

/// A whole report.
pub(super) struct Document {
    pub title: String,
    pub subtitle: String,
    pub blocks: Vec<Block>,
}

/// A part of it. All text is plain; who renders it escapes it.
pub(super) enum Block {
    /// Starts a section; `id` is its anchor.
    Section {
        id: &'static str,
        title: &'static str,
    },
    /// Starts a part of a section.
    Heading(String),
    Text(String),
    /// Small print: sources and rules.
    Note(String),
    /// The most important figures.
    Tiles(Vec<Tile>),
    Table(Table),
    /// Closed on the page; of a table, Markdown shows the first rows.
    Fold {
        summary: String,
        table: Table,
    },
    /// Closed on the page, left out of Markdown.
    Code {
        summary: String,
        text: String,
    },
    /// Left out of Markdown.
    Pictures(Vec<Picture>),
}

/// One important figure.
pub(super) struct Tile {
    pub label: String,
    pub value: String,
    pub detail: String,
}

pub(super) struct Table {
    pub columns: Vec<Column>,
    pub rows: Vec<Row>,
}

pub(super) struct Column {
    /// Heads all neighbours of the same group; empty: none.
    pub group: String,
    pub name: String,
    pub align: Align,
}

#[derive(Copy, Clone, PartialEq, Eq)]
pub(super) enum Align {
    Text,
    Number,
}

/// What a row is.
#[derive(Copy, Clone, PartialEq, Eq)]
pub(super) enum Kind {
    /// Heads the rows below it; has one entry.
    Divider,
    /// Somebody else's figures.
    Published,
    /// Measured by us.
    Ours,
    /// The row of ours that matters most.
    Base,
    /// Of ours, and not measured.
    Missing,
}

pub(super) struct Row {
    pub kind: Kind,
    /// The first is the row's name. Entries that are left out at the end are empty.
    pub entries: Vec<Entry>,
}

/// How an entry looks.
#[derive(Copy, Clone, Default, PartialEq, Eq)]
pub(super) enum Tone {
    #[default]
    Plain,
    Quiet,
    Good,
    Bad,
}

#[derive(Clone, Default)]
pub(super) struct Entry {
    pub text: String,
    /// 95 % interval, in the unit of the text.
    pub interval: Option<String>,
    /// Episodes.
    pub n: Option<usize>,
    /// Relative path that the text leads to.
    pub link: Option<String>,
    pub tone: Tone,
}

impl Entry {
    pub fn text(text: impl Into<String>) -> Self {
        Self { text: text.into(), ..Self::default() }
    }

    pub fn quiet(text: impl Into<String>) -> Self {
        Self { text: text.into(), tone: Tone::Quiet, ..Self::default() }
    }

    /// Nothing was measured.
    pub fn missing() -> Self {
        Self::quiet("-")
    }

    pub fn or_missing<T>(value: Option<T>, show: impl FnOnce(T) -> Self) -> Self {
        value.map_or_else(Self::missing, show)
    }
}

impl Column {
    pub fn text(name: &str) -> Self {
        Self { group: String::new(), name: name.to_owned(), align: Align::Text }
    }

    pub fn number(group: &str, name: &str) -> Self {
        Self { group: group.to_owned(), name: name.to_owned(), align: Align::Number }
    }
}

impl Row {
    pub fn divider(title: impl Into<String>) -> Self {
        Self { kind: Kind::Divider, entries: vec![Entry::text(title)] }
    }
}

/// A share, 0 to 1, as percent with one digit.
pub(super) fn percent(share: f64) -> String {
    format!("{:.1}", 100.0 * share)
}

/// An interval of shares as percent.
pub(super) fn percents((low, high): (f64, f64)) -> String {
    format!("{:.1}\u{2013}{:.1}", 100.0 * low, 100.0 * high)
}

/// An interval of differences of shares as percentage points, with signs.
pub(super) fn points((low, high): (f64, f64)) -> String {
    format!("{:+.1} to {:+.1}", 100.0 * low, 100.0 * high)
}
