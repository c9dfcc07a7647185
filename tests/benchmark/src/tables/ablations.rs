//! Every row against the base row on the same episodes, beside what the paper says of the same change.

use serde::Serialize;

use super::episodes::{Episodes, or_zero};
use super::estimate::{Mean, paired_share_95};
use super::published::{SLING_2, SLING_2_BASE};
use super::rows::{self, BASE};
use crate::perception::mcnemar_exact;
use crate::record::EpisodeRecord;

/// The rows of one set against its base row.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AblationSet {
    /// The set.
    pub set: String,
    /// Rows that share episodes with the base row.
    pub differences: Vec<Difference>,
}

/// A row minus the base row, on the episodes that both have.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Difference {
    /// The name it is recorded under.
    pub row: String,
    /// For readers.
    pub name: String,
    /// Episodes that both have.
    pub n: usize,
    /// Of these, won by the base row alone.
    pub n_only_base: usize,
    /// Won by this row alone.
    pub n_only_row: usize,
    /// Share of successes minus that of the base row, strict.
    pub success: f64,
    /// Its 95 % interval (Newcombe 1998, method 10, paired).
    pub success_95: (f64, f64),
    /// McNemar's test, exact and two-sided.
    pub p_mcnemar: f64,
    /// Difference of the SPL; `None` of a single episode.
    pub spl: Option<Mean>,
    /// What the paper reports of the same change; `None` if it does not.
    pub published: Option<PublishedDifference>,
    /// Whether both say the same.
    pub agreement: Agreement,
}

/// A row of SLING's table 2 minus its base row, overall, percentage points.
#[derive(Copy, Clone, Debug, PartialEq, Serialize)]
pub struct PublishedDifference {
    /// Number of the row.
    pub number: u8,
    /// Of success.
    pub success: f64,
    /// Of SPL, times 100.
    pub spl: f64,
    /// Of success, in a word.
    pub direction: Direction,
}

/// Which way success goes.
#[derive(Copy, Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Direction {
    /// More.
    Up,
    /// Less.
    Down,
    /// By less than [`NONE_POINTS`].
    None,
}

/// A published difference below this is none, percentage points: 3,000 episodes tell no smaller ones apart.
pub const NONE_POINTS: f64 = 0.5;
/// An interval within this of zero says that nothing changes, percentage points.
pub const SAME_POINTS: f64 = 5.0;

impl Direction {
    fn of(points: f64) -> Self {
        match points {
            p if p.abs() < NONE_POINTS => Self::None,
            p if p > 0.0 => Self::Up,
            _ => Self::Down,
        }
    }

    /// For tables.
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            Self::Up => "up",
            Self::Down => "down",
            Self::None => "none",
        }
    }
}

/// Whether our difference goes the way of the published one.
#[derive(Copy, Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Agreement {
    /// The interval lies on the published side of zero; where that is none, within [`SAME_POINTS`] of zero.
    Agrees,
    /// The interval excludes zero, and the published side.
    Disagrees,
    /// The interval tells nothing.
    WithinNoise,
    /// The paper does not report it.
    NotReported,
}

impl Agreement {
    /// For tables.
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            Self::Agrees => "agrees",
            Self::Disagrees => "disagrees",
            Self::WithinNoise => "within noise",
            Self::NotReported => "not reported",
        }
    }

    /// `interval` in shares, -1 to 1.
    pub(super) fn of(published: Option<Direction>, (low, high): (f64, f64)) -> Self {
        let ours = match (low > 0.0, high < 0.0) {
            (true, _) => Some(Direction::Up),
            (_, true) => Some(Direction::Down),
            _ => None,
        };
        let same = 0.01 * SAME_POINTS;
        match (published, ours) {
            (None, _) => Self::NotReported,
            (Some(Direction::None), None) if low >= -same && high <= same => Self::Agrees,
            (Some(_), None) => Self::WithinNoise,
            (Some(theirs), Some(ours)) if theirs == ours => Self::Agrees,
            (Some(_), Some(_)) => Self::Disagrees,
        }
    }
}

pub(super) fn by_set(episodes: &Episodes<'_>) -> Vec<AblationSet> {
    let set = |set: &str| {
        let known = rows::SLING_2.iter().filter_map(rows::OurRow::key).filter(|key| *key != BASE);
        AblationSet {
            set: set.to_owned(),
            differences: known.filter_map(|row| difference(episodes, row, set)).collect(),
        }
    };
    episodes.sets().into_iter().map(set).filter(|s| !s.differences.is_empty()).collect()
}

/// `None` if the rows share no episode.
fn difference(episodes: &Episodes<'_>, row: &str, set: &str) -> Option<Difference> {
    let (base, other) = (episodes.of(BASE, set), episodes.of(row, set));
    let pairs: Vec<(&EpisodeRecord, &EpisodeRecord)> =
        other.iter().filter_map(|(key, o)| base.get(key).map(|b| (*b, *o))).collect();
    let n = pairs.len();
    let count =
        |base, other| pairs.iter().filter(|(b, o)| (b.strict.success, o.strict.success) == (base, other)).count();
    let (n_only_base, n_only_row) = (count(true, false), count(false, true));
    let success_95 = paired_share_95(count(true, true), n_only_base, n_only_row, count(false, false));
    let gains: Vec<f64> = pairs.iter().map(|(b, o)| or_zero(o.strict.spl) - or_zero(b.strict.spl)).collect();
    let published = published_difference(row);
    (n > 0).then(|| Difference {
        row: row.to_owned(),
        name: rows::name(row),
        n,
        n_only_base,
        n_only_row,
        success: (n_only_row as f64 - n_only_base as f64) / n as f64,
        success_95,
        p_mcnemar: mcnemar_exact(n_only_base, n_only_row),
        spl: Mean::of_differences(&gains),
        published,
        agreement: Agreement::of(published.map(|p| p.direction), success_95),
    })
}

/// What the paper says of a row of ours.
pub(super) fn published_difference(row: &str) -> Option<PublishedDifference> {
    let number = rows::SLING_2.iter().find(|r| r.key() == Some(row))?.published?;
    let (theirs, base) = (SLING_2.numbered(number)?.cells[0], SLING_2.numbered(SLING_2_BASE)?.cells[0]);
    let success = theirs.0 - base.0;
    let direction = Direction::of(success);
    Some(PublishedDifference { number, success, spl: theirs.1 - base.1, direction })
}
