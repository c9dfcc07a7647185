//! Rigid transforms between named frames, and their planar shadow.

use core::marker::PhantomData;
use core::ops::Mul;

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

use crate::frames::Frame;

/// `T_a_b`: the pose of frame `B` in frame `A`. Maps coordinates in `B` to coordinates in `A`.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Transform<A: Frame, B: Frame> {
    isometry: Isometry3<f64>,
    frames: PhantomData<(A, B)>,
}

impl<A: Frame, B: Frame> Transform<A, B> {
    /// Wraps an isometry that maps `B` coordinates to `A` coordinates.
    #[must_use]
    pub fn new(isometry: Isometry3<f64>) -> Self {
        Self { isometry, frames: PhantomData }
    }

    /// The two frames coincide.
    #[must_use]
    pub fn identity() -> Self {
        Self::new(Isometry3::identity())
    }

    /// From a rotation matrix (projected to SO(3)) and the origin of `B` in `A`, in metres.
    #[must_use]
    pub fn from_rotation(r_a_b: &Matrix3<f64>, p_a: Vector3<f64>) -> Self {
        let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix(r_a_b));
        Self::new(Isometry3::from_parts(Translation3::from(p_a), rotation))
    }

    /// The underlying isometry.
    #[must_use]
    pub fn isometry(&self) -> &Isometry3<f64> {
        &self.isometry
    }

    /// Origin of `B` in `A`, metres.
    #[must_use]
    pub fn translation(&self) -> Vector3<f64> {
        self.isometry.translation.vector
    }

    /// Rotation from `B` axes to `A` axes.
    #[must_use]
    pub fn rotation(&self) -> UnitQuaternion<f64> {
        self.isometry.rotation
    }

    /// `T_b_a`.
    #[must_use]
    pub fn inverse(&self) -> Transform<B, A> {
        Transform::new(self.isometry.inverse())
    }

    /// A point given in `B`, expressed in `A`.
    #[must_use]
    pub fn apply(&self, p_b: &Point3<f64>) -> Point3<f64> {
        self.isometry * p_b
    }

    /// True if every number is finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.isometry.translation.vector.iter().all(|v| v.is_finite())
            && self.isometry.rotation.coords.iter().all(|v| v.is_finite())
    }

    /// The motion on the floor: x, y and yaw of `B` in `A`. For frames whose z axes point up.
    #[must_use]
    pub fn planar(&self) -> PlanarPose {
        let p = self.translation();
        let x_axis = self.isometry.rotation * Vector3::x();
        PlanarPose { x_m: p.x, y_m: p.y, yaw_rad: libm_atan2(x_axis.y, x_axis.x) }
    }
}

impl<A: Frame, B: Frame, C: Frame> Mul<Transform<B, C>> for Transform<A, B> {
    type Output = Transform<A, C>;

    fn mul(self, t_b_c: Transform<B, C>) -> Transform<A, C> {
        Transform::new(self.isometry * t_b_c.isometry)
    }
}

/// Position and heading on the floor, in a frame with z up.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct PlanarPose {
    /// Forward of the frame's origin, metres.
    pub x_m: f64,
    /// Left of the frame's origin, metres.
    pub y_m: f64,
    /// Counter-clockwise from the x axis, radians in (-pi, pi].
    pub yaw_rad: f64,
}

impl PlanarPose {
    /// As a transform with z = 0 and no roll or pitch.
    #[must_use]
    pub fn to_transform<A: Frame, B: Frame>(self) -> Transform<A, B> {
        Transform::new(Isometry3::from_parts(
            Translation3::new(self.x_m, self.y_m, 0.0),
            UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.yaw_rad),
        ))
    }

    /// Distance on the floor to a point, metres.
    #[must_use]
    pub fn distance_to(&self, x_m: f64, y_m: f64) -> f64 {
        ((x_m - self.x_m).powi(2) + (y_m - self.y_m).powi(2)).sqrt()
    }

    /// Direction to a point relative to the heading, radians in (-pi, pi], left positive.
    #[must_use]
    pub fn bearing_to(&self, x_m: f64, y_m: f64) -> f64 {
        wrap_angle(libm_atan2(y_m - self.y_m, x_m - self.x_m) - self.yaw_rad)
    }
}

/// The same angle in (-pi, pi].
#[must_use]
pub fn wrap_angle(angle_rad: f64) -> f64 {
    let turn = core::f64::consts::TAU;
    let wrapped = angle_rad - turn * (angle_rad / turn).round();
    if wrapped <= -core::f64::consts::PI { wrapped + turn } else { wrapped }
}

// The platform's atan2 differs in its last bit between C libraries; nalgebra's (libm-force) is the same everywhere.
fn libm_atan2(y: f64, x: f64) -> f64 {
    nalgebra::RealField::atan2(y, x)
}
