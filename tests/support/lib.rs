//! What the tests across crates share: where things are, and real processes on a network of their own.
#![expect(clippy::unwrap_used, reason = "test support may fail by panicking")]

use std::path::{Path, PathBuf};

/// Root of the repository.
pub fn repository() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap()
}

/// The data sets, where they are: HOMING_DATA, or beside the repository.
pub fn data() -> Option<PathBuf> {
    let folder = std::env::var_os("HOMING_DATA").map_or_else(|| repository().join("../shared/data"), PathBuf::from);
    folder.is_dir().then_some(folder)
}
