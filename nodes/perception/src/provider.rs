//! ONNX Runtime: loading it, and saying plainly what it can run on.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, OnceLock, PoisonError};

use ort::environment::Environment;
use ort::ep::{CPU, CUDA, ExecutionProvider, TensorRT};
use ort::logging::LogLevel;
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
    /// None is named and none is in the usual places.
    #[error("ONNX Runtime was not found: install 1.{minimum} or later (the PyPI wheel `onnxruntime`) and name its libonnxruntime.so in [runtime] library, or set ORT_DYLIB_PATH", minimum = ort::MINOR_VERSION)]
    NotFound,
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

/// ONNX Runtime, loaded. There is one for the life of the process: the library can be neither loaded nor set up twice.
pub struct Runtime {
    environment: Environment,
    report: RuntimeReport,
}

impl Runtime {
    /// Loads ONNX Runtime from a library file the first time; later calls give the same one, whatever the file.
    ///
    /// # Errors
    /// [`RuntimeError`] if the file is missing, not ONNX Runtime, or too old.
    pub fn load(library: &Path) -> Result<&'static Self, RuntimeError> {
        static LOADED: OnceLock<Runtime> = OnceLock::new();
        static LOADING: Mutex<()> = Mutex::new(());
        let _alone = LOADING.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(runtime) = LOADED.get() {
            return Ok(runtime);
        }
        let report = load_runtime(library)?;
        let unusable = |reason: String| RuntimeError::Unusable { path: report.library.clone(), reason };
        let builder = ort::init_from(&report.library).map_err(|e| unusable(e.to_string()))?;
        let environment = builder.with_name("homing").build().map_err(|e| unusable(e.to_string()))?;
        environment.set_log_level(LogLevel::Warning);
        tracing::info!(library = %report.library.display(), "ONNX Runtime {}", report.version);
        Ok(LOADED.get_or_init(|| Self { environment, report }))
    }

    /// What was loaded.
    #[must_use]
    pub fn report(&self) -> &RuntimeReport {
        &self.report
    }

    pub(crate) fn environment(&self) -> &Environment {
        &self.environment
    }
}

/// Where ONNX Runtime is: the file that ORT_DYLIB_PATH names, else the one in the project's own Python environment.
#[must_use]
pub fn find_runtime() -> Option<PathBuf> {
    if let Some(path) = std::env::var_os("ORT_DYLIB_PATH") {
        return Some(PathBuf::from(path));
    }
    let environments = std::fs::read_dir(".venv/lib").ok()?;
    let folders = environments.flatten().map(|e| e.path().join("site-packages/onnxruntime/capi"));
    folders
        .filter_map(|folder| std::fs::read_dir(folder).ok())
        .flat_map(|entries| entries.flatten())
        .map(|entry| entry.path())
        .find(|path| path.file_name().is_some_and(|n| n.to_string_lossy().starts_with("libonnxruntime.so.")))
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
        providers: vec![
            ("TensorRT", available(TensorRT::is_available())?),
            ("CUDA", available(CUDA::is_available())?),
            ("CPU", available(CPU::is_available())?),
        ],
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
