//! Any glTF 2.0 scene (.glb or .gltf) as a [`Scene`].
//!
//! glTF is y up, we are z up: (x, y, z) becomes (x, -z, y), so the floor stays at the height it was authored at. Scans that
//! are z up against the standard say so in a file beside them: `up = "z"` in `NAME.toml`, and keep their axes. Light,
//! cameras, animations and skins are not read: without lamps the renderer shows a scene in even, soft light.

mod buffers;
mod images;
mod materials;
mod meshes;
mod normals;
mod up;

use std::path::{Path, PathBuf};

use thiserror::Error;

use crate::scene::Scene;

/// Largest file read, bytes.
pub const FILE_BYTES_MAX: u64 = 1 << 30;
/// Most triangles taken from one scene.
pub const TRIANGLES_MAX: usize = 20_000_000;
/// A scene must lie within this of its origin, metres.
pub const EXTENT_MAX_M: f32 = 2_000.0;

/// Why a file is not a scene.
#[derive(Debug, Error)]
pub enum SceneError {
    /// The file, or one it refers to, cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// Which file.
        path: PathBuf,
        /// Why not.
        source: std::io::Error,
    },
    /// The file beside a scene does not say what it should.
    #[error("{} does not describe a scene: {what}", path.display())]
    Description {
        /// The TOML file.
        path: PathBuf,
        /// What is wrong with it.
        what: String,
    },
    /// Neither a binary glTF nor a glTF in JSON, or a broken one.
    #[error("{name} is not a glTF 2.0 scene: {source}")]
    NotGltf {
        /// Which scene.
        name: String,
        /// What the parser found.
        source: gltf::Error,
    },
    /// The file ends before the data it describes.
    #[error("{name} is cut short: {what} needs {needed} bytes, {found} are there")]
    Truncated {
        /// Which scene.
        name: String,
        /// Which part of it.
        what: String,
        /// Bytes described.
        needed: u64,
        /// Bytes present.
        found: u64,
    },
    /// It says nothing to draw.
    #[error("{name} holds no triangles")]
    NoTriangles {
        /// Which scene.
        name: String,
    },
    /// Larger than anything a robot drives in.
    #[error("{name} is too large: {what} is {found}, at most {allowed} is accepted")]
    TooLarge {
        /// Which scene.
        name: String,
        /// What is too large.
        what: &'static str,
        /// How large.
        found: String,
        /// How large it may be.
        allowed: String,
    },
    /// A texture is neither PNG nor JPEG, or broken.
    #[error("texture {index} of {name} cannot be decoded: {source}")]
    Texture {
        /// Which scene.
        name: String,
        /// Number of the image in the file.
        index: usize,
        /// What the decoder found.
        source: image::ImageError,
    },
    /// An address other than a relative path or base64 data.
    #[error("{name} refers to {uri}, which is neither a file beside it nor embedded data")]
    Address {
        /// Which scene.
        name: String,
        /// The address, shortened.
        uri: String,
    },
}

/// Reads a scene and the files it refers to.
///
/// # Errors
/// [`SceneError`] naming the file and what is wrong with it.
pub fn load(path: &Path) -> Result<Scene, SceneError> {
    let name = path.file_name().map_or_else(|| path.display().to_string(), |n| n.to_string_lossy().into_owned());
    let size = std::fs::metadata(path).map_err(|source| SceneError::Read { path: path.into(), source })?.len();
    check_size(&name, size)?;
    let bytes = std::fs::read(path).map_err(|source| SceneError::Read { path: path.into(), source })?;
    let mut scene = parse(&name, &bytes, path.parent())?;
    up::Up::beside(path)?.apply(&mut scene);
    Ok(scene)
}

/// Reads a scene from memory; it may not refer to other files. `name` is for reports.
///
/// # Errors
/// [`SceneError`] naming what is wrong.
pub fn load_bytes(name: &str, bytes: &[u8]) -> Result<Scene, SceneError> {
    check_size(name, bytes.len() as u64)?;
    parse(name, bytes, None)
}

fn check_size(name: &str, bytes: u64) -> Result<(), SceneError> {
    if bytes > FILE_BYTES_MAX {
        return Err(too_large(name, "the file", format!("{bytes} bytes"), format!("{FILE_BYTES_MAX} bytes")));
    }
    Ok(())
}

fn too_large(name: &str, what: &'static str, found: String, allowed: String) -> SceneError {
    SceneError::TooLarge { name: name.into(), what, found, allowed }
}

fn parse(name: &str, bytes: &[u8], folder: Option<&Path>) -> Result<Scene, SceneError> {
    check_glb_length(name, bytes)?;
    let gltf::Gltf { document, blob } =
        gltf::Gltf::from_slice(bytes).map_err(|source| SceneError::NotGltf { name: name.into(), source })?;
    let buffers = buffers::read(name, &document, blob, folder)?;
    let textures = images::decode(name, &document, &buffers, folder)?;
    let meshes = meshes::read(name, &document, &buffers)?;
    if meshes.iter().all(|mesh| mesh.triangles.is_empty()) {
        return Err(SceneError::NoTriangles { name: name.into() });
    }
    Ok(Scene { name: name.into(), meshes, materials: materials::read(&document), textures, lamps: Vec::new() })
}

/// A binary glTF states its own length (glTF 2.0, section 4.4.2): says "cut short" instead of the parser's "not glTF".
fn check_glb_length(name: &str, bytes: &[u8]) -> Result<(), SceneError> {
    let Some(length) = bytes.strip_prefix(b"glTF").and_then(|rest| rest.get(4..8)) else { return Ok(()) };
    let needed = length.iter().rev().fold(0_u64, |sum, byte| sum << 8 | u64::from(*byte));
    let found = bytes.len() as u64;
    if found < needed {
        return Err(SceneError::Truncated { name: name.into(), what: "the file".into(), needed, found });
    }
    Ok(())
}

#[cfg(test)]
mod tests;
