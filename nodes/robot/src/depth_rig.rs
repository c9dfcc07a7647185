//! A depth camera that sits beside the colour camera: how the two lie to each other, and depth as the colour camera sees it.

use std::path::{Path, PathBuf};

use homing_core::{Camera, DepthImage, Frame, ImageError, Intrinsics, IntrinsicsError, Transform};
use nalgebra::{Matrix3, Matrix4, Vector3};
use serde::Deserialize;
use thiserror::Error;

/// The depth camera's own frame: x right, y down, z forward.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct DepthCamera;

impl Frame for DepthCamera {
    const NAME: &'static str = "depth_optical_frame";
}

/// Two cameras on one bar, calibrated.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthRig {
    /// The colour camera.
    pub colour: Intrinsics,
    /// The depth camera.
    pub depth: Intrinsics,
    /// Where the depth camera sits, seen from the colour camera, metres.
    pub t_camera_depth: Transform<Camera, DepthCamera>,
}

/// Why there is no rig.
#[derive(Debug, Error)]
pub enum DepthRigError {
    /// The file cannot be read.
    #[error("the rig's file {}: cannot be read ({source}); nodes/robot/rigs/kinect_v1.toml is an example", file.display())]
    Unreadable {
        /// The file.
        file: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The file does not hold a rig.
    #[error("the rig's file {}: {what}; nodes/robot/rigs/kinect_v1.toml is an example", file.display())]
    Malformed {
        /// The file.
        file: PathBuf,
        /// What is wrong.
        what: String,
    },
}

/// How far the nine numbers of a rotation may be from one, entry by entry of R^T R.
const ORTHONORMAL_TOLERANCE: f64 = 0.01;
/// Cameras that sit farther apart are no rig, metres.
const BASELINE_M_MAX: f64 = 2.0;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RigFile {
    colour: CameraTable,
    depth: CameraTable,
    t_camera_depth: [[f64; 4]; 3],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CameraTable {
    width: u32,
    height: u32,
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
}

impl CameraTable {
    fn intrinsics(&self) -> Result<Intrinsics, IntrinsicsError> {
        Intrinsics::new(self.width, self.height, self.fx, self.fy, self.cx, self.cy)
    }
}

impl DepthRig {
    /// Reads a rig's TOML file: `[colour]` and `[depth]` with width, height, fx, fy, cx and cy in pixels, and the upper
    /// three rows of the 4x4 matrix `t_camera_depth`, which takes points of the depth camera to the colour camera.
    ///
    /// # Errors
    /// [`DepthRigError`] when the file is missing or holds no rig.
    pub fn read(file: impl AsRef<Path>) -> Result<Self, DepthRigError> {
        let file = file.as_ref();
        let text = std::fs::read_to_string(file)
            .map_err(|source| DepthRigError::Unreadable { file: file.to_owned(), source })?;
        Self::parse(&text).map_err(|what| DepthRigError::Malformed { file: file.to_owned(), what })
    }

    fn parse(text: &str) -> Result<Self, String> {
        let table: RigFile = toml::from_str(text).map_err(|e| e.message().to_owned())?;
        let camera = |name: &str, camera: &CameraTable| camera.intrinsics().map_err(|e| format!("[{name}]: {e}"));
        Ok(Self {
            colour: camera("colour", &table.colour)?,
            depth: camera("depth", &table.depth)?,
            t_camera_depth: rigid(&table.t_camera_depth)?,
        })
    }

    /// Depth of the depth camera's pixels as the colour camera sees it: of several surfaces on one line of sight the nearest;
    /// 0 where nothing was measured, or the depth camera does not see what the colour camera sees.
    ///
    /// # Errors
    /// [`ImageError`] when the image is not of the depth camera's size.
    pub fn register(&self, depth: &DepthImage) -> Result<DepthImage, ImageError> {
        let (columns, rows) = (self.depth.width(), self.depth.height());
        if (depth.width(), depth.height()) != (columns, rows) {
            let (expected, found) = (columns as usize * rows as usize, depth.data().len());
            return Err(ImageError::Length { width: columns, height: rows, expected, found });
        }
        let (width, height) = (self.colour.width(), self.colour.height());
        let mut metres = vec![0.0_f32; width as usize * height as usize];
        for row in 0..rows {
            for column in 0..columns {
                let Some(z_m) = depth.at(column, row) else { continue };
                let seen = self.depth.unproject(f64::from(column), f64::from(row), f64::from(z_m));
                let p_camera = self.t_camera_depth.apply(&seen);
                let Some(pixel) = self.colour.project(&p_camera) else { continue };
                let (x, y) = (pixel.x.round(), pixel.y.round());
                if x >= 0.0 && y >= 0.0 && x < f64::from(width) && y < f64::from(height) {
                    let there = &mut metres[y as usize * width as usize + x as usize];
                    let z_m = p_camera.z as f32;
                    if *there == 0.0 || z_m < *there {
                        *there = z_m;
                    }
                }
            }
        }
        DepthImage::from_metres(width, height, metres)
    }
}

fn rigid(rows: &[[f64; 4]; 3]) -> Result<Transform<Camera, DepthCamera>, String> {
    let m = Matrix4::from_fn(|i, j| rows.get(i).map_or(if i == j { 1.0 } else { 0.0 }, |row| row[j]));
    let r: Matrix3<f64> = m.fixed_view::<3, 3>(0, 0).into();
    let p = Vector3::new(m[(0, 3)], m[(1, 3)], m[(2, 3)]);
    let off = (r.transpose() * r - Matrix3::identity()).amax();
    if off.is_nan() || off > ORTHONORMAL_TOLERANCE || r.determinant() < 0.0 {
        return Err("t_camera_depth: the first three columns are no rotation".into());
    }
    if p.norm().is_nan() || p.norm() > BASELINE_M_MAX {
        return Err(format!("t_camera_depth: the cameras sit {:.2} m apart; the last column is in metres", p.norm()));
    }
    Ok(Transform::from_rotation(&r, p))
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "tests")]
mod tests {
    use super::*;

    const RIG: &str = "t_camera_depth = [[1, 0, 0, -0.025], [0, 1, 0, 0], [0, 0, 1, 0]]\n\
        [colour]\nwidth = 640\nheight = 480\nfx = 525\nfy = 525\ncx = 320\ncy = 240\n\
        [depth]\nwidth = 640\nheight = 480\nfx = 585\nfy = 585\ncx = 320\ncy = 240\n";

    /// What a depth camera at `at_m` to the left of the wall's origin sees: a wall 3 m away and, before it, a plate.
    fn scene(camera: &Intrinsics, at_m: f64) -> DepthImage {
        let z = |row: u32, column: u32| {
            let ray = camera.ray(f64::from(column), f64::from(row));
            let on_plate = (at_m + ray.x / ray.z * 1.2).abs() < 0.2 && (ray.y / ray.z * 1.2).abs() < 0.2;
            if on_plate { 1.2 } else { 3.0 }
        };
        let (w, h) = (camera.width(), camera.height());
        let metres = (0..h).flat_map(|row| (0..w).map(move |column| z(row, column) as f32)).collect();
        DepthImage::from_metres(w, h, metres).unwrap()
    }

    #[test]
    fn registered_depth_is_what_the_colour_camera_would_measure() {
        let rig = DepthRig::parse(RIG).unwrap();
        // The depth camera sits 2.5 cm to the left of the colour camera.
        let registered = rig.register(&scene(&rig.depth, -0.025)).unwrap();
        let expected = scene(&rig.colour, 0.0);
        let (mut n_known, mut n_wrong, mut n_inside) = (0, 0, 0);
        for (row, column) in (0..480).flat_map(|row| (0..640).map(move |column| (row, column))) {
            // The depth camera's picture is narrower by a tenth.
            if !(40..600).contains(&column) || !(30..450).contains(&row) {
                continue;
            }
            n_inside += 1;
            if let Some(z_m) = registered.at(column, row) {
                n_known += 1;
                n_wrong += u32::from((z_m - expected.at(column, row).unwrap()).abs() > 1e-3);
            }
        }
        // Unknown is the strip of wall that the plate hides from the depth camera alone; wrong is at most the plate's rim.
        assert!(n_known * 100 > n_inside * 97, "{n_known} of {n_inside}");
        assert!(n_wrong < 1200, "{n_wrong}");
        // In the depth camera's picture the plate's edge lies some twenty pixels beside its place.
        let beside = (320 + 100, 240);
        assert_eq!(scene(&rig.depth, -0.025).at(beside.0, beside.1), Some(1.2));
        assert_eq!((registered.at(beside.0, beside.1), expected.at(beside.0, beside.1)), (Some(3.0), Some(3.0)));
    }

    #[test]
    fn what_is_no_rig_is_refused_by_name() {
        let without = |line: &str| RIG.replace(line, "");
        for (text, named) in [
            (without("fx = 525\n"), "fx"),
            (RIG.replace("[1, 0, 0, -0.025]", "[2, 0, 0, -0.025]"), "no rotation"),
            (RIG.replace("-0.025", "-25.0"), "25.00 m apart"),
            (RIG.replace("fx = 585", "fx = -585"), "[depth]"),
            (RIG.replace("cx = 320\ncy = 240\n[depth]", "cx = 320\ncy = 240\nk1 = 0.1\n[depth]"), "k1"),
        ] {
            let error = DepthRig::parse(&text).unwrap_err();
            assert!(error.contains(named), "'{error}' should name {named}");
        }
        let rig = DepthRig::parse(RIG).unwrap();
        assert!(rig.register(&DepthImage::from_metres(2, 1, vec![1.0, 2.0]).unwrap()).is_err());
    }
}
