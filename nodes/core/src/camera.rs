//! Pinhole camera intrinsics.

use nalgebra::{Point2, Point3, Vector3};
use thiserror::Error;

/// A rectified pinhole camera: size and focal lengths in pixels, principal point in pixels.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Intrinsics {
    width: u32,
    height: u32,
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
}

/// Why numbers do not describe a camera.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum IntrinsicsError {
    /// Width or height is zero or beyond [`Intrinsics::SIDE_MAX`].
    #[error("image size {width}x{height} is outside 1..={max}", max = Intrinsics::SIDE_MAX)]
    Size {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// A focal length is not a positive number.
    #[error("focal lengths ({fx}, {fy}) must be positive and finite")]
    Focal {
        /// Horizontal focal length, pixels.
        fx: f64,
        /// Vertical focal length, pixels.
        fy: f64,
    },
    /// The principal point is outside the image.
    #[error("principal point ({cx}, {cy}) lies outside the {width}x{height} image")]
    Principal {
        /// Horizontal principal point, pixels.
        cx: f64,
        /// Vertical principal point, pixels.
        cy: f64,
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
    },
}

impl Intrinsics {
    /// Largest width or height accepted, pixels.
    pub const SIDE_MAX: u32 = 16_384;

    /// Checked construction. `width`, `height` in pixels, `fx, fy, cx, cy` in pixels.
    ///
    /// # Errors
    /// [`IntrinsicsError`] when the numbers cannot belong to an image of that size.
    pub fn new(width: u32, height: u32, fx: f64, fy: f64, cx: f64, cy: f64) -> Result<Self, IntrinsicsError> {
        let side = 1..=Self::SIDE_MAX;
        if !side.contains(&width) || !side.contains(&height) {
            return Err(IntrinsicsError::Size { width, height });
        }
        if !(fx.is_finite() && fy.is_finite() && fx > 0.0 && fy > 0.0) {
            return Err(IntrinsicsError::Focal { fx, fy });
        }
        let inside = |c: f64, side: u32| c.is_finite() && c >= 0.0 && c <= f64::from(side);
        if !inside(cx, width) || !inside(cy, height) {
            return Err(IntrinsicsError::Principal { cx, cy, width, height });
        }
        Ok(Self { width, height, fx, fy, cx, cy })
    }

    /// Square pixels, centred principal point and the given horizontal field of view (radians, below pi).
    ///
    /// # Errors
    /// [`IntrinsicsError`] for an empty image or a field of view outside (0, pi).
    pub fn from_hfov(width: u32, height: u32, hfov_rad: f64) -> Result<Self, IntrinsicsError> {
        let f = 0.5 * f64::from(width) / nalgebra::ComplexField::tan(0.5 * hfov_rad);
        Self::new(width, height, f, f, 0.5 * (f64::from(width) - 1.0), 0.5 * (f64::from(height) - 1.0))
    }

    /// The same camera with its image resized to `width` x `height` pixels.
    ///
    /// # Errors
    /// [`IntrinsicsError::Size`] for an impossible size.
    pub fn resized(&self, width: u32, height: u32) -> Result<Self, IntrinsicsError> {
        let (sx, sy) = (f64::from(width) / f64::from(self.width), f64::from(height) / f64::from(self.height));
        let shift = |c: f64, s: f64| ((c + 0.5) * s - 0.5).max(0.0);
        Self::new(width, height, self.fx * sx, self.fy * sy, shift(self.cx, sx), shift(self.cy, sy))
    }

    /// Columns.
    #[must_use]
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Rows.
    #[must_use]
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Horizontal focal length, pixels.
    #[must_use]
    pub fn fx(&self) -> f64 {
        self.fx
    }

    /// Vertical focal length, pixels.
    #[must_use]
    pub fn fy(&self) -> f64 {
        self.fy
    }

    /// Horizontal principal point, pixels.
    #[must_use]
    pub fn cx(&self) -> f64 {
        self.cx
    }

    /// Vertical principal point, pixels.
    #[must_use]
    pub fn cy(&self) -> f64 {
        self.cy
    }

    /// Horizontal field of view, radians.
    #[must_use]
    pub fn hfov_rad(&self) -> f64 {
        2.0 * nalgebra::ComplexField::atan(0.5 * f64::from(self.width) / self.fx)
    }

    /// Lifts a pixel at a depth along the optical axis (metres) to the camera frame (SLING eq. 1).
    #[must_use]
    pub fn unproject(&self, x_px: f64, y_px: f64, depth_m: f64) -> Point3<f64> {
        Point3::new((x_px - self.cx) / self.fx * depth_m, (y_px - self.cy) / self.fy * depth_m, depth_m)
    }

    /// Unit ray through a pixel, camera frame.
    #[must_use]
    pub fn ray(&self, x_px: f64, y_px: f64) -> Vector3<f64> {
        self.unproject(x_px, y_px, 1.0).coords.normalize()
    }

    /// Pixel of a point in the camera frame, or `None` if it is not in front of the camera. May lie outside the image.
    #[must_use]
    pub fn project(&self, p_camera: &Point3<f64>) -> Option<Point2<f64>> {
        (p_camera.z > 1e-9).then(|| {
            Point2::new(self.fx * p_camera.x / p_camera.z + self.cx, self.fy * p_camera.y / p_camera.z + self.cy)
        })
    }
}
