//! Files, images and stand-ins for networks.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use homing_core::RgbImage;
use homing_perception::onnx::ModelFile;
use homing_perception::onnx::file::sha256_hex;
use homing_perception::{Runtime, find_runtime};

/// ONNX Runtime, or a word that the test is skipped.
pub fn runtime() -> Option<(&'static Runtime, PathBuf)> {
    let beside = || {
        let capi = |lib: PathBuf| lib.join("site-packages/onnxruntime/capi");
        let libs = std::fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../.venv/lib")).ok()?;
        let files = libs.flatten().filter_map(|lib| std::fs::read_dir(capi(lib.path())).ok());
        files.flatten().flatten().map(|f| f.path()).find(|path| path.to_string_lossy().contains("libonnxruntime.so."))
    };
    let Some(library) = find_runtime().or_else(beside) else {
        eprintln!("SKIPPED: no ONNX Runtime; set ORT_DYLIB_PATH to its libonnxruntime.so");
        return None;
    };
    Some((Runtime::load(&library).unwrap(), library))
}

/// A file or folder of the test data, or a word that the test is skipped.
pub fn data(name: &str) -> Option<PathBuf> {
    let default = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let path = std::env::var_os("HOMING_DATA").map_or(default, PathBuf::from).join(name);
    if path.exists() {
        return Some(path);
    }
    eprintln!("SKIPPED: {} is not there; set HOMING_DATA to the folder that holds {name}", path.display());
    None
}

/// A file with its hash as it is.
pub fn trusted(path: PathBuf) -> ModelFile {
    let sha256 = sha256_hex(&std::fs::read(&path).unwrap());
    ModelFile { path, sha256 }
}

/// A folder that goes when the test ends.
pub struct Folder(PathBuf);

impl Folder {
    pub fn new() -> Self {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let name = format!("homing-onnx-{}-{}", std::process::id(), NEXT.fetch_add(1, Ordering::Relaxed));
        let path = std::env::temp_dir().join(name);
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    pub fn path(&self) -> &Path {
        &self.0
    }

    /// Writes a model and trusts it.
    pub fn model(&self, name: &str, bytes: &[u8]) -> ModelFile {
        let path = self.0.join(name);
        std::fs::write(&path, bytes).unwrap();
        trusted(path)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Grey blobs on black, 2 px wide.
pub fn blobs(width: u32, height: u32, centres: &[(f32, f32)]) -> Arc<RgbImage> {
    let grey = |i: u32| {
        let (x, y) = ((i % width) as f32, (i / width) as f32);
        let value: f32 =
            centres.iter().map(|(cx, cy)| 200.0 * (-((x - cx).powi(2) + (y - cy).powi(2)) / 8.0).exp()).sum();
        [value.round().min(255.0) as u8; 3]
    };
    Arc::new(RgbImage::new(width, height, (0..width * height).flat_map(grey).collect()).unwrap())
}
