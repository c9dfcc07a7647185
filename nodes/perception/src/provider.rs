//! ONNX Runtime: loading it, and saying plainly what it can run on.

use std::path::{Path, PathBuf};

use ort::ep::{CPU, CUDA, ExecutionProvider};
use thiserror::Error;

/// What `doctor` says about ONNX Runtime.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RuntimeReport {
    /// The library asked for.
    pub library: PathBuf,
    /// Version of that library, "1.31".
    pub version: String,
    /// The description of the build in use: commit, flags.
    pub build: String,
    /// Execution providers, best first, and whether the library was built with each. Built with does not mean that the
    /// machine has the device: only opening a model on it tells.
    pub providers: Vec<(&'static str, bool)>,
}

/// Why ONNX Runtime cannot be used.
#[derive(Debug, Error)]
pub enum RuntimeError {
    /// There is no such file.
    #[error("{} does not exist: install ONNX Runtime 1.{minimum} or later (the PyPI wheel `onnxruntime` holds libonnxruntime.so) and give its path", path.display(), minimum = ort::MINOR_VERSION)]
    Missing {
        /// The path asked for.
        path: PathBuf,
    },
    /// The file is not a usable ONNX Runtime.
    #[error("{} cannot be used as ONNX Runtime: {reason}", path.display())]
    Unusable {
        /// The path asked for.
        path: PathBuf,
        /// The loader's words.
        reason: String,
    },
}

/// Loads ONNX Runtime from a library file, and reports its build and execution providers.
///
/// The first library loaded stays for the life of the process; a later call reports on that one.
///
/// # Errors
/// [`RuntimeError`] if the file is missing, not ONNX Runtime, or too old.
pub fn load_runtime(library: &Path) -> Result<RuntimeReport, RuntimeError> {
    let unusable = |reason: String| RuntimeError::Unusable { path: library.to_owned(), reason };
    if !library.is_file() {
        return Err(RuntimeError::Missing { path: library.to_owned() });
    }
    // An absolute path: a relative one would be looked for beside the executable first.
    let absolute = std::path::absolute(library).map_err(|e| unusable(e.to_string()))?;
    let _environment = ort::init_from(&absolute).map_err(|e| unusable(e.to_string()))?;
    let minor = ort::util::probe(&absolute).ok_or_else(|| unusable("it is not of version 1".to_owned()))?;
    let available = |found: ort::Result<bool>| found.map_err(|e| unusable(e.to_string()));
    Ok(RuntimeReport {
        library: absolute.clone(),
        version: format!("1.{minor}"),
        build: ort::info().to_owned(),
        providers: vec![("CUDA", available(CUDA::is_available())?), ("CPU", available(CPU::is_available())?)],
    })
}

/// Version of the OpenCV library in use, "4.6.0".
///
/// # Errors
/// OpenCV's own error when the library does not answer.
pub fn opencv_version() -> Result<String, opencv::Error> {
    opencv::core::get_version_string()
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "a failing test should say where")]

    use super::*;

    #[test]
    fn a_library_that_is_none_is_an_error_that_says_what_to_do() {
        let missing = load_runtime(Path::new("/nowhere/libonnxruntime.so")).unwrap_err();
        assert!(missing.to_string().contains("install ONNX Runtime"), "{missing}");
        let text = std::env::temp_dir().join(format!("homing-not-a-library-{}", std::process::id()));
        std::fs::write(&text, "text").unwrap();
        let unusable = load_runtime(&text).unwrap_err();
        std::fs::remove_file(&text).unwrap();
        assert!(matches!(unusable, RuntimeError::Unusable { .. }), "{unusable}");
    }
}
