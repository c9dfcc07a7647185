//! True poses of a 7-Scenes folder (frame-XXXXXX.pose.txt).

use std::path::Path;

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};

use crate::support::Fallible;

/// The 4x4 camera-to-world matrix of a frame, its rotation projected to SO(3).
pub fn t_world_camera(folder: &Path, number: u64) -> Fallible<Isometry3<f64>> {
    let path = folder.join(format!("frame-{number:06}.pose.txt"));
    let text = std::fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
    let m = text.split_whitespace().map(str::parse).collect::<Result<Vec<f64>, _>>()?;
    if m.len() != 16 {
        return Err(format!("{}: {} numbers instead of 16", path.display(), m.len()).into());
    }
    let rotation = Matrix3::new(m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]);
    let svd = rotation.svd(true, true);
    let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else { return Err("no SVD".into()) };
    let proper = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(u * v_t));
    Ok(Isometry3::from_parts(Translation3::from(Vector3::new(m[3], m[7], m[11])), proper))
}
