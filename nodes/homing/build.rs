//! Writes the sources' commit into the program: every result says what made it.

use std::process::Command;

fn main() {
    let git = |args: &[&str]| -> Option<String> {
        let said = Command::new("git").args(args).output().ok().filter(|said| said.status.success())?;
        Some(String::from_utf8_lossy(&said.stdout).trim().to_owned())
    };
    // "+": the sources were changed since.
    let commit = git(&["describe", "--always", "--dirty=+", "--abbrev=10", "--exclude", "*"]);
    println!("cargo::rustc-env=HOMING_COMMIT={}", commit.unwrap_or_else(|| "unknown".to_owned()));
    for file in ["HEAD", "index"] {
        if let Some(path) = git(&["rev-parse", "--git-path", file]) {
            println!("cargo::rerun-if-changed={path}");
        }
    }
}
