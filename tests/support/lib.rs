//! What the tests across crates share: where things are, and real processes on a network of their own.
#![expect(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "test support may fail by panicking")]

use std::net::TcpListener;
use std::path::{Path, PathBuf};

pub mod mission;
pub mod processes;

/// Root of the repository.
pub fn repository() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap()
}

/// The data sets, where they are: HOMING_DATA, or beside the repository.
pub fn data() -> Option<PathBuf> {
    let folder = std::env::var_os("HOMING_DATA").map_or_else(|| repository().join("../shared/data"), PathBuf::from);
    folder.is_dir().then_some(folder)
}

/// A TCP port nobody listens on.
pub fn free_port() -> u16 {
    TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port()
}

/// The Python of the private environment that `deploy/` makes, or what HOMING_PYTHON names. Says so where there is none.
pub fn python() -> Option<PathBuf> {
    let python = std::env::var_os("HOMING_PYTHON").map_or_else(|| repository().join(".venv/bin/python"), PathBuf::from);
    if !python.is_file() {
        println!("SKIPPED: {} is not there; ./deploy/test makes it", python.display());
        return None;
    }
    Some(python)
}
