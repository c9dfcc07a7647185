//! Our rows: the names they are recorded under, and the published rows they stand beside.

/// The row that is us; ablations are taken from it.
pub const BASE: &str = "frontier";
/// Rows whose failures and curves are shown.
pub const HEADLINES: [&str; 3] = [BASE, "random", "straight"];
/// Generated flats with NRNS's curved episodes.
pub const CURVED: &str = "flats-curved";
/// Rooms raised on the floor plans of real houses.
pub const LAYOUTS: &str = "layouts";

/// What a row of a published table is with us.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(super) enum Source {
    /// Measured, and recorded under this name.
    Measured(&'static str),
    /// Cannot be measured without what the authors trained.
    NeedsLearned,
}

/// A row of ours in a table.
#[derive(Copy, Clone, Debug)]
pub(super) struct OurRow {
    pub source: Source,
    pub name: &'static str,
    /// Number of the published row that it repeats.
    pub published: Option<u8>,
}

const fn measured(key: &'static str, name: &'static str, published: Option<u8>) -> OurRow {
    OurRow { source: Source::Measured(key), name, published }
}

const fn learned(name: &'static str, published: u8) -> OurRow {
    OurRow { source: Source::NeedsLearned, name, published: Some(published) }
}

pub(super) const SLING_1: [OurRow; 6] = [
    measured("straight", "SLING + Straight-GD", Some(8)),
    measured("random", "SLING + random goal", None),
    measured(BASE, "Homing (frontier)", None),
    learned("SLING + DDPPO-GD", 9),
    learned("SLING + NRNS-GD", 10),
    learned("SLING + OVRL-GD", 11),
];

pub(super) const SLING_2: [OurRow; 17] = [
    learned("NRNS", 1),
    measured(BASE, "Homing (frontier)", Some(2)),
    measured("mlp-switch", "w/ MLP Switch", Some(3)),
    measured("mlp-switch-no-recovery", "w/ MLP Switch w/o Recovery", Some(4)),
    measured("sift", "w/o Neural Features (SIFT)", Some(5)),
    measured("pose-noise", "w/ Pose Noise", Some(6)),
    measured("pose-depth-noise", "w/ Pose & Depth Noise", Some(7)),
    measured("all-noise", "w/ all noise (wheels, blur, JPEG too)", None),
    measured("oracle-lp", "w/ Oracle-LP", Some(8)),
    measured("oracle-lm-pose", "w/ Oracle-LM-Pose", Some(9)),
    measured("oracle-lm-pose-lp", "w/ Oracle-LM-Pose & Oracle-LP", Some(10)),
    learned("NRNS + Oracle-GD", 11),
    measured("oracle-gd", "w/ Oracle-GD", Some(12)),
    measured("epnp", "w/ EPnP", None),
    measured("sling-heading", "w/ published heading formula", None),
    measured("no-recovery", "w/o Recovery", None),
    measured("sling-switch", "w/ switch on one estimate", None),
];

pub(super) const MODULAR: [OurRow; 3] = [
    measured("random-agent", "Random agent", None),
    measured("random", "Random goal (as Ours-RP)", None),
    measured(BASE, "Homing (frontier)", None),
];

impl OurRow {
    /// The name it is recorded under; `None` if it cannot be measured.
    pub fn key(&self) -> Option<&'static str> {
        match self.source {
            Source::Measured(key) => Some(key),
            Source::NeedsLearned => None,
        }
    }
}

fn known() -> impl Iterator<Item = &'static OurRow> {
    const ALL: [&[OurRow]; 3] = [&SLING_1, &SLING_2, &MODULAR];
    ALL.into_iter().flatten()
}

/// The name of a row in tables; its key where no table knows it.
pub(super) fn name(key: &str) -> String {
    known().find(|r| r.key() == Some(key)).map_or(key, |r| r.name).to_owned()
}

/// Where a row stands among others; rows that no table knows come last.
pub(super) fn row_order(key: &str) -> usize {
    known().position(|r| r.key() == Some(key)).unwrap_or(usize::MAX)
}

/// Where a headline row stands among others, ourselves first.
pub(super) fn headline_order(key: &str) -> usize {
    HEADLINES.iter().position(|row| *row == key).unwrap_or(HEADLINES.len())
}

/// Where a set stands among others.
pub(super) fn set_order(set: &str) -> usize {
    [CURVED, LAYOUTS].iter().position(|s| *s == set).unwrap_or(usize::MAX)
}
