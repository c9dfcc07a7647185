//! Domain values survive the way over ROS 2 messages bit for bit.
#![expect(clippy::unwrap_used, reason = "a test may fail by panicking")]

use std::fmt::Debug;
use std::time::Duration;

use homing_core::{
    Action, Base, Camera, Cell, DepthImage, Frame, GoalEstimate, GoalHypothesis, GridGeometry, Intrinsics, LaserScan,
    MatchedPoint, Mode, Motion, MotionCommand, MotionOutcome, MotionResult, NavigationState, OccupancyGrid, Odometry,
    PlanarPose, RgbImage, Sighting, StageTimes, Stamp, Transform, UnseenReason,
};
use homing_privileged::GroundTruth;
use homing_protocol::convert::{
    CameraInfoMessage, EncodedPhoto, Lease, camera_mount_message, color_message, depth_message, to_camera_mount,
    to_depth, to_rgb, to_tf,
};
use homing_protocol::interfaces::{homing_msgs, nav_msgs, sensor_msgs};
use homing_protocol::{ToDomain, ToMessage};
use nalgebra::{Isometry3, Matrix3, Matrix6, Quaternion, Translation3, UnitQuaternion};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::select;

/// A number of any size, finite; subnormals and both zeros included.
fn number() -> impl Strategy<Value = f64> {
    any::<f64>().prop_filter("finite", |v| v.is_finite())
}

fn size() -> impl Strategy<Value = f64> {
    number().prop_map(f64::abs)
}

/// What a 32-bit field of a ROS message can hold.
fn single() -> impl Strategy<Value = f64> {
    any::<f32>().prop_filter("finite", |v| v.is_finite()).prop_map(f64::from)
}

fn stamp() -> impl Strategy<Value = Stamp> {
    (0..=i32::MAX as u32, 0..1_000_000_000_u32).prop_map(|(s, ns)| Stamp::from_parts(s, ns))
}

fn nanoseconds() -> impl Strategy<Value = Duration> {
    any::<u64>().prop_map(Duration::from_nanos)
}

fn transform<A: Frame, B: Frame>() -> impl Strategy<Value = Transform<A, B>> {
    let axis = || -1.0..1.0_f64;
    (number(), number(), number(), (axis(), axis(), axis(), axis())).prop_filter_map(
        "a rotation",
        |(x, y, z, (a, b, c, w))| {
            let q = Quaternion::new(w, a, b, c);
            let rotation = (q.norm() > 1e-3).then(|| UnitQuaternion::new_normalize(q))?;
            Some(Transform::new(Isometry3::from_parts(Translation3::new(x, y, z), rotation)))
        },
    )
}

fn planar() -> impl Strategy<Value = PlanarPose> {
    (number(), number(), number()).prop_map(|(x_m, y_m, yaw_rad)| PlanarPose { x_m, y_m, yaw_rad })
}

fn intrinsics() -> impl Strategy<Value = Intrinsics> {
    let side = 1..=Intrinsics::SIDE_MAX;
    (side.clone(), side, 1e-3..1e5_f64, 1e-3..1e5_f64, 0.0..=1.0_f64, 0.0..=1.0_f64).prop_map(
        |(width, height, fx, fy, u, v)| {
            Intrinsics::new(width, height, fx, fy, u * f64::from(width), v * f64::from(height)).unwrap()
        },
    )
}

fn covariance() -> impl Strategy<Value = Matrix6<f64>> {
    vec(number(), 21).prop_map(|values| {
        let mut m = Matrix6::zeros();
        let places = (0..6).flat_map(|row| (row..6).map(move |column| (row, column)));
        for (value, (row, column)) in values.into_iter().zip(places) {
            let value = if row == column { value.abs() } else { value };
            (m[(row, column)], m[(column, row)]) = (value, value);
        }
        m
    })
}

fn sighting() -> impl Strategy<Value = Sighting> {
    use UnseenReason::{NoConsensus, NoGoal, NoTexture, TooFewMatches};
    let count = || (0..=u32::MAX).prop_map(|n| n as usize);
    prop_oneof![
        select(vec![NoConsensus, NoGoal, NoTexture, TooFewMatches]).prop_map(|reason| Sighting::NotSeen { reason }),
        (number(), size(), number(), count()).prop_map(|(bearing_rad, bearing_sd_rad, heading_rad, n_inliers)| {
            Sighting::Bearing { bearing_rad, bearing_sd_rad, heading_rad, n_inliers }
        }),
        (transform(), covariance(), count(), size()).prop_map(|(t_camera_goal, covariance, n_inliers, rms_rad)| {
            Sighting::Pose { t_camera_goal, covariance, n_inliers, rms_rad }
        }),
    ]
}

fn probability() -> impl Strategy<Value = Option<f32>> {
    proptest::option::of(0.0..=1.0_f32)
}

fn estimate() -> impl Strategy<Value = GoalEstimate> {
    let pixel = || any::<f32>().prop_filter("finite", |v| v.is_finite());
    let point =
        ((pixel(), pixel()), (pixel(), pixel())).prop_map(|(query_px, goal_px)| MatchedPoint { query_px, goal_px });
    let times = (nanoseconds(), nanoseconds(), nanoseconds()).prop_map(|(extract, matching, pose)| StageTimes {
        extract,
        matching,
        pose,
    });
    (stamp(), any::<u64>(), sighting(), probability(), 0..=u32::MAX, vec(point, 0..20), times).prop_map(
        |(stamp, goal_id, sighting, switch_probability, n_matches, matched_points, times)| GoalEstimate {
            stamp,
            goal_id,
            sighting,
            switch_probability,
            n_matches: n_matches as usize,
            matched_points,
            times,
        },
    )
}

fn odometry() -> impl Strategy<Value = Odometry> {
    (stamp(), transform(), number(), number()).prop_map(|(stamp, t_odom_base, linear_m_s, angular_rad_s)| Odometry {
        stamp,
        t_odom_base,
        linear_m_s,
        angular_rad_s,
    })
}

fn motion() -> impl Strategy<Value = Motion> {
    prop_oneof![
        (number(), number()).prop_map(|(linear_m_s, angular_rad_s)| Motion::Velocity { linear_m_s, angular_rad_s }),
        number().prop_map(|distance_m| Motion::Forward { distance_m }),
        number().prop_map(|angle_rad| Motion::Turn { angle_rad }),
        any::<bool>().prop_map(|done| Motion::Stop { done }),
    ]
}

fn state() -> impl Strategy<Value = NavigationState> {
    use Action::{Forward, Hold, Stop, TurnLeft, TurnRight};
    use Mode::{Align, Arrived, Exploit, Explore, Failed, Idle};
    let points = || vec((number(), number()), 0..8);
    let goal = (planar(), proptest::array::uniform9(number()), 0..=u32::MAX, stamp()).prop_map(
        |(pose, covariance, n_fused, last_seen)| GoalHypothesis {
            pose,
            covariance: Matrix3::from_row_slice(&covariance),
            n_fused: n_fused as usize,
            last_seen,
        },
    );
    let choice = (
        select(vec![Align, Arrived, Exploit, Explore, Failed, Idle]),
        select(vec![Forward, Hold, Stop, TurnLeft, TurnRight]),
    );
    let aims = (proptest::option::of(goal), proptest::option::of((number(), number())), points(), points());
    (stamp(), any::<u64>(), choice, planar(), aims, ".{0,40}").prop_map(
        |(stamp, step, (mode, action), pose, (goal, target_m, path_m, frontiers_m), reason)| NavigationState {
            stamp,
            step,
            mode,
            action,
            pose,
            goal,
            target_m,
            path_m,
            frontiers_m,
            reason,
        },
    )
}

fn scan() -> impl Strategy<Value = LaserScan> {
    let ranges = vec(prop_oneof![0.0..100.0_f32, Just(f32::INFINITY)], 0..400);
    (stamp(), single(), single(), single(), single(), ranges).prop_map(
        |(stamp, angle_min_rad, angle_increment_rad, range_min_m, range_max_m, ranges_m)| LaserScan {
            stamp,
            angle_min_rad,
            angle_increment_rad,
            range_min_m,
            range_max_m,
            ranges_m,
        },
    )
}

fn map() -> impl Strategy<Value = OccupancyGrid> {
    let resolution = (1e-3..10.0_f32).prop_map(f64::from);
    (1..40_usize, 1..40_usize, resolution, number(), number()).prop_flat_map(
        |(width, height, resolution_m, origin_x_m, origin_y_m)| {
            let geometry = GridGeometry { width, height, resolution_m, origin_x_m, origin_y_m };
            vec(select(vec![Cell::Unknown, Cell::Free, Cell::Occupied]), width * height)
                .prop_map(move |cells| OccupancyGrid { geometry, cells })
        },
    )
}

/// Equal, and equal as written: a quaternion equals its negative and zero equals minus zero, but their digits differ.
fn same<T: PartialEq + Debug>(sent: &T, received: &T) -> Result<(), TestCaseError> {
    prop_assert_eq!(sent, received);
    prop_assert_eq!(format!("{sent:?}"), format!("{received:?}"));
    Ok(())
}

fn there_and_back<M: ToDomain<T>, T: ToMessage<M> + PartialEq + Debug>(value: &T) -> Result<(), TestCaseError> {
    same(value, &value.to_message().to_domain().unwrap())
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(128) })]

    #[test]
    fn estimates(value in estimate()) {
        there_and_back::<homing_msgs::GoalEstimate, _>(&value)?;
    }

    #[test]
    fn odometry_readings(value in odometry()) {
        there_and_back::<nav_msgs::Odometry, _>(&value)?;
    }

    #[test]
    fn cameras(stamp in stamp(), intrinsics in intrinsics()) {
        there_and_back::<sensor_msgs::CameraInfo, _>(&CameraInfoMessage { stamp, intrinsics })?;
    }

    #[test]
    fn scans(value in scan()) {
        there_and_back::<sensor_msgs::LaserScan, _>(&value)?;
    }

    #[test]
    fn maps(at in stamp(), value in map()) {
        let message: nav_msgs::OccupancyGrid = (at, &value).to_message();
        same(&value, &message.to_domain().unwrap())?;
    }

    #[test]
    fn commands(numbers in any::<[u64; 3]>(), stamp in stamp(), time_to_live in nanoseconds(), motion in motion()) {
        let [session, epoch, sequence] = numbers;
        let value = MotionCommand { session, epoch, sequence, stamp, time_to_live, motion };
        there_and_back::<homing_msgs::MotionCommand, _>(&value)?;
    }

    #[test]
    fn results(numbers in any::<[u64; 2]>(), stamp in stamp(), moved in planar(), blocked in any::<bool>()) {
        let [session, sequence] = numbers;
        let value = MotionResult { session, sequence, outcome: MotionOutcome { stamp, moved, blocked } };
        there_and_back::<homing_msgs::MotionResult, _>(&value)?;
    }

    #[test]
    fn leases(stamp in stamp(), holder in any::<Option<(u64, u64)>>(), n in any::<[u64; 2]>(), last_refusal in ".{0,40}") {
        let value = Lease { stamp, holder, accepted: n[0], refused: n[1], last_refusal };
        there_and_back::<homing_msgs::MotionLease, _>(&value)?;
    }

    #[test]
    fn states(value in state()) {
        there_and_back::<homing_msgs::NavigationState, _>(&value)?;
    }

    #[test]
    fn goal_photos(id in any::<u64>(), file in vec(any::<u8>(), 1..400), intrinsics in intrinsics()) {
        there_and_back::<homing_msgs::GoalPhoto, _>(&EncodedPhoto { id, file, intrinsics })?;
    }

    #[test]
    fn truths(stamp in stamp(), pose in planar(), start in planar(), n in any::<[u64; 2]>(), way in number(), done in any::<bool>()) {
        let value = GroundTruth { stamp, pose, start, path_length_m: way, steps: n[0], collisions: n[1], done };
        there_and_back::<homing_msgs::GroundTruth, _>(&value)?;
    }

    #[test]
    fn mounts(at in stamp(), mount in transform::<Base, Camera>(), odometry in odometry()) {
        same(&Some(mount), &to_camera_mount(&camera_mount_message(at, &mount)).unwrap())?;
        same(&None, &to_camera_mount(&to_tf(&odometry)).unwrap())?;
    }

    #[test]
    fn colour_images(at in stamp(), (width, height, data) in pixels(3)) {
        let image = RgbImage::new(width, height, data).unwrap();
        let (stamp, back) = to_rgb(&color_message(at, &image)).unwrap();
        prop_assert_eq!(stamp, at);
        prop_assert!(back == image);
    }

    #[test]
    fn depth_images(at in stamp(), (width, height, data) in pixels(4)) {
        // Any bits at all: what is no depth is masked on the way in and stays so.
        let metres = data.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
        let image = DepthImage::from_metres(width, height, metres).unwrap();
        let (stamp, back) = to_depth(&depth_message(at, &image)).unwrap();
        prop_assert_eq!(stamp, at);
        let bits = |i: &DepthImage| i.data().iter().map(|d| d.to_bits()).collect::<Vec<_>>();
        prop_assert_eq!((back.width(), back.height(), bits(&back)), (width, height, bits(&image)));
    }

    #[test]
    fn quaternions_of_other_lengths_are_refused(length in prop_oneof![0.0..0.9_f64, 1.1..1e9_f64]) {
        let mut message = nav_msgs::Odometry::default();
        message.pose.pose.orientation.w = length;
        let refusal = message.to_domain();
        prop_assert!(refusal.is_err(), "{refusal:?}");
    }
}

fn pixels(bytes: usize) -> impl Strategy<Value = (u32, u32, Vec<u8>)> {
    (1..24_u32, 1..24_u32).prop_flat_map(move |(w, h)| (Just(w), Just(h), vec(any::<u8>(), bytes * (w * h) as usize)))
}

#[test]
fn what_32_bits_cannot_hold_arrives_as_the_nearest_number() {
    let grid = OccupancyGrid::unknown(GridGeometry::centred(24.0, 0.05));
    let message: nav_msgs::OccupancyGrid = (Stamp(7), &grid).to_message();
    let back: OccupancyGrid = message.to_domain().unwrap();
    assert_eq!(back.geometry.resolution_m.to_bits(), f64::from(0.05_f32).to_bits());
    assert_eq!(back.geometry.len(), grid.geometry.len());
}

#[test]
fn a_quaternion_a_little_off_unit_length_is_put_right() {
    let mut message = nav_msgs::Odometry::default();
    message.pose.pose.orientation.w = 1.0 + 1e-6;
    let odometry = message.to_domain().unwrap();
    assert_eq!(odometry.t_odom_base.rotation().coords.norm(), 1.0);
}
