//! Where a run leaves its files.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use anyhow::Context;
use serde::Serialize;

/// A folder of its own for every run, so that nothing is overwritten.
pub struct RunFolder {
    path: PathBuf,
}

impl RunFolder {
    /// Makes `base/name-N` with the first N that is free; N counts from the second it was made in.
    pub fn create(base: &Path, name: &str) -> anyhow::Result<Self> {
        let seconds = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |d| d.as_secs());
        fs::create_dir_all(base).with_context(|| format!("cannot make the folder {}", base.display()))?;
        for n in seconds..seconds + 1000 {
            let path = base.join(format!("{name}-{n}"));
            match fs::create_dir(&path) {
                Ok(()) => {
                    let path = path.canonicalize().unwrap_or(path);
                    return Ok(Self { path });
                }
                Err(e) if e.kind() == std::io::ErrorKind::AlreadyExists => {}
                Err(e) => return Err(e).with_context(|| format!("cannot make the folder {}", path.display())),
            }
        }
        anyhow::bail!("no free folder for the run below {}", base.display())
    }

    /// A folder in it.
    pub fn sub(&self, name: &str) -> anyhow::Result<Self> {
        let path = self.path.join(name);
        fs::create_dir_all(&path).with_context(|| format!("cannot make the folder {}", path.display()))?;
        Ok(Self { path })
    }

    /// A file in it.
    pub fn file(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    pub fn write(&self, name: &str, bytes: &[u8]) -> anyhow::Result<PathBuf> {
        let path = self.file(name);
        fs::write(&path, bytes).with_context(|| format!("cannot write {}", path.display()))?;
        Ok(path)
    }

    pub fn write_toml(&self, name: &str, value: &impl Serialize) -> anyhow::Result<PathBuf> {
        self.write(name, toml::to_string(value)?.as_bytes())
    }

    pub fn write_json(&self, name: &str, value: &impl Serialize) -> anyhow::Result<PathBuf> {
        self.write(name, serde_json::to_string_pretty(value)?.as_bytes())
    }
}

/// The path as a person would type it from here.
pub fn shown(path: &Path) -> String {
    let here = std::env::current_dir().unwrap_or_default();
    path.strip_prefix(&here).unwrap_or(path).display().to_string()
}
