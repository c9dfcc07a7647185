//! A ROS 2 robot as a body: what its topics say about it, as [`Capabilities`].

use homing_core::{Base, Camera, Capabilities, Intrinsics, IntrinsicsError, Transform};
use thiserror::Error;

/// What a `sensor_msgs/CameraInfo` says.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraInfo {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// K, row-major: fx 0 cx, 0 fy cy, 0 0 1. Pixels.
    pub k: [f64; 9],
    /// Distortion coefficients; all zero, or none, for a rectified image.
    pub d: Vec<f64>,
}

/// What topics do not say of a robot and its configuration must.
#[derive(Clone, Debug, PartialEq)]
pub struct Ros2Base {
    /// Name for reports.
    pub name: String,
    /// Radius of the circle that holds the footprint, metres.
    pub radius_m: f64,
    /// Height of the body, metres.
    pub height_m: f64,
    /// Fastest forward speed, m/s.
    pub linear_m_s_max: f64,
    /// Fastest turn, rad/s.
    pub angular_rad_s_max: f64,
    /// True if it publishes `scan`.
    pub has_scan: bool,
}

/// Why a robot cannot be described.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum Ros2BaseError {
    /// Not the matrix of a pinhole camera.
    #[error("camera_info: K = {k:?} is not fx 0 cx 0 fy cy 0 0 1; is the camera calibrated?")]
    NotPinhole {
        /// The matrix.
        k: [f64; 9],
    },
    /// The image is not rectified.
    #[error("camera_info: distortion {d:?} is not zero; give the rectified image and its camera_info (image_proc)")]
    Distorted {
        /// The coefficients.
        d: Vec<f64>,
    },
    /// Numbers that no camera has.
    #[error("camera_info: {0}")]
    Intrinsics(#[from] IntrinsicsError),
    /// The static transform is not finite.
    #[error("transform base_link <- camera_optical_frame is not finite; is tf_static published?")]
    Transform,
    /// A measure that no body has.
    #[error("{name} = {value} must be positive and finite; correct the robot's configuration")]
    Measure {
        /// Which.
        name: &'static str,
        /// Its value.
        value: f64,
    },
}

impl Ros2Base {
    /// The robot's capabilities from its configuration, its camera_info and the static transform of its camera.
    ///
    /// # Errors
    /// [`Ros2BaseError`] for an uncalibrated or unrectified camera, and for measures that are not positive.
    pub fn capabilities(
        &self,
        camera: &CameraInfo,
        t_base_camera: Transform<Base, Camera>,
    ) -> Result<Capabilities, Ros2BaseError> {
        let [fx, skew, cx, zero_a, fy, cy, zero_b, zero_c, one] = camera.k;
        if [skew, zero_a, zero_b, zero_c] != [0.0; 4] || one != 1.0 {
            return Err(Ros2BaseError::NotPinhole { k: camera.k });
        }
        if camera.d.iter().any(|&coefficient| coefficient != 0.0) {
            return Err(Ros2BaseError::Distorted { d: camera.d.clone() });
        }
        if !t_base_camera.is_finite() {
            return Err(Ros2BaseError::Transform);
        }
        for (name, value) in [
            ("radius_m", self.radius_m),
            ("height_m", self.height_m),
            ("linear_m_s_max", self.linear_m_s_max),
            ("angular_rad_s_max", self.angular_rad_s_max),
        ] {
            if !(value.is_finite() && value > 0.0) {
                return Err(Ros2BaseError::Measure { name, value });
            }
        }
        Ok(Capabilities {
            name: self.name.clone(),
            drivable: true,
            has_scan: self.has_scan,
            intrinsics: Intrinsics::new(camera.width, camera.height, fx, fy, cx, cy)?,
            t_base_camera,
            radius_m: self.radius_m,
            height_m: self.height_m,
            linear_m_s_max: self.linear_m_s_max,
            angular_rad_s_max: self.angular_rad_s_max,
        })
    }
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "tests")]
mod tests {
    use super::*;
    use crate::replay::level_camera;

    fn base() -> Ros2Base {
        Ros2Base {
            name: "robot".into(),
            radius_m: 0.2,
            height_m: 1.0,
            linear_m_s_max: 0.5,
            angular_rad_s_max: 1.0,
            has_scan: true,
        }
    }

    fn camera() -> CameraInfo {
        let k = [600.0, 0.0, 320.0, 0.0, 601.0, 240.0, 0.0, 0.0, 1.0];
        CameraInfo { width: 640, height: 480, k, d: vec![0.0; 5] }
    }

    #[test]
    fn reads_a_rectified_camera() {
        let capabilities = base().capabilities(&camera(), level_camera(0.9)).unwrap();
        assert!(capabilities.drivable && capabilities.has_scan);
        assert_eq!((capabilities.intrinsics.fx(), capabilities.intrinsics.fy()), (600.0, 601.0));
    }

    #[test]
    fn refuses_what_would_drive_badly() {
        let refused = |camera: &CameraInfo, base: &Ros2Base| base.capabilities(camera, level_camera(0.9)).unwrap_err();
        let distorted = CameraInfo { d: vec![0.1, 0.0], ..camera() };
        assert!(matches!(refused(&distorted, &base()), Ros2BaseError::Distorted { .. }));
        let empty = CameraInfo { k: [0.0; 9], ..camera() };
        assert!(matches!(refused(&empty, &base()), Ros2BaseError::NotPinhole { .. }));
        let other_size = CameraInfo { width: 100, ..camera() };
        assert!(matches!(refused(&other_size, &base()), Ros2BaseError::Intrinsics(_)));
        let endless = Ros2Base { linear_m_s_max: f64::INFINITY, ..base() };
        assert!(matches!(refused(&camera(), &endless), Ros2BaseError::Measure { name: "linear_m_s_max", .. }));
    }
}
