//! Poses as text: rows of a 4x4 camera-to-world matrix.

use std::path::Path;

use homing_core::{Camera, Transform};
use nalgebra::{Matrix3, Matrix4, Vector3};

use super::error::RecordingError;
use super::recording::World;

// Text files of a recording are small; a larger one is something else.
const TEXT_BYTES_MAX: u64 = 64 * 1024 * 1024;
// How far a recorded rotation may be from a rotation, entry by entry of R^T R. Kinect Fusion's are 4e-4 off.
const ORTHONORMAL_TOLERANCE: f64 = 0.02;

/// Reads a text file of sensible size.
pub(super) fn read_text(file: &Path) -> Result<String, RecordingError> {
    let bytes = std::fs::metadata(file).map_err(|source| RecordingError::unreadable(file, source))?.len();
    if bytes > TEXT_BYTES_MAX {
        return Err(RecordingError::malformed(file, 1, format!("{bytes} bytes are too many for a text file")));
    }
    std::fs::read_to_string(file).map_err(|source| RecordingError::unreadable(file, source))
}

/// The numbers of one line, exactly `N` of them, all finite. `line` counts from 1.
pub(super) fn numbers<const N: usize>(file: &Path, line: usize, text: &str) -> Result<[f64; N], RecordingError> {
    let mut row = [0.0; N];
    let words: Vec<&str> = text.split_whitespace().collect();
    if words.len() != N {
        return Err(RecordingError::malformed(file, line, format!("expected {N} numbers, found {}", words.len())));
    }
    for (value, word) in row.iter_mut().zip(words) {
        *value = word
            .parse()
            .ok()
            .filter(|v: &f64| v.is_finite())
            .ok_or_else(|| RecordingError::malformed(file, line, format!("'{word}' is not a finite number")))?;
    }
    Ok(row)
}

/// A pose from four (line number, text) rows; the rotation is projected to SO(3), since recorded ones are rounded.
pub(super) fn pose(file: &Path, rows: [(usize, &str); 4]) -> Result<Transform<World, Camera>, RecordingError> {
    let mut m = Matrix4::zeros();
    for (i, (line, text)) in rows.into_iter().enumerate() {
        m.set_row(i, &nalgebra::RowVector4::from(numbers::<4>(file, line, text)?));
    }
    let line = rows[0].0;
    if (m.row(3) - nalgebra::RowVector4::new(0.0, 0.0, 0.0, 1.0)).amax() > 1e-6 {
        return Err(RecordingError::malformed(file, rows[3].0, "the last row must be 0 0 0 1"));
    }
    let r: Matrix3<f64> = m.fixed_view::<3, 3>(0, 0).into();
    let off = (r.transpose() * r - Matrix3::identity()).amax();
    if off > ORTHONORMAL_TOLERANCE || r.determinant() < 0.0 {
        return Err(RecordingError::malformed(file, line, format!("not a rotation (off by {off:.3})")));
    }
    let r = nearest_rotation(&r).ok_or_else(|| RecordingError::malformed(file, line, "not a rotation"))?;
    Ok(Transform::from_rotation(&r, Vector3::new(m[(0, 3)], m[(1, 3)], m[(2, 3)])))
}

// Orthogonal Procrustes: with R = U S V^T the nearest rotation is U V^T (Schoenemann 1966).
fn nearest_rotation(r: &Matrix3<f64>) -> Option<Matrix3<f64>> {
    let svd = r.svd(true, true);
    Some(svd.u? * svd.v_t?)
}
