//! Domain values survive the way over ROS 2 messages bit for bit; messages that describe no value are refused with a
//! reason.
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
    to_depth, to_rgb, to_tf, to_velocity,
};
use homing_protocol::interfaces::{geometry_msgs, homing_msgs, nav_msgs, sensor_msgs};
use homing_protocol::{Malformed, ToDomain, ToMessage};
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

fn estimate() -> impl Strategy<Value = GoalEstimate> {
    let pixel = || any::<f32>().prop_filter("finite", |v| v.is_finite());
    let point =
        ((pixel(), pixel()), (pixel(), pixel())).prop_map(|(query_px, goal_px)| MatchedPoint { query_px, goal_px });
    let times = (nanoseconds(), nanoseconds(), nanoseconds()).prop_map(|(extract, matching, pose)| StageTimes {
        extract,
        matching,
        pose,
    });
    (stamp(), any::<u64>(), sighting(), 0..=u32::MAX, vec(point, 0..20), times).prop_map(
        |(stamp, goal_id, sighting, n_matches, matched_points, times)| GoalEstimate {
            stamp,
            goal_id,
            sighting,
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

#[test]
fn velocities() {
    let mut message = geometry_msgs::TwistStamped::default();
    (message.twist.linear.x, message.twist.angular.z) = (0.3, -0.7);
    assert_eq!(to_velocity(&message).unwrap(), (0.3, -0.7));
    message.twist.angular.z = f64::NAN;
    assert_eq!(to_velocity(&message).unwrap_err().reason, "twist.angular.z is NaN");
}

#[test]
fn images_of_other_makes() {
    let rgb = RgbImage::new(2, 2, (1..=12).collect()).unwrap();
    let mut message = color_message(Stamp(5), &rgb);
    message.encoding = "bgr8".to_owned();
    assert_eq!(to_rgb(&message).unwrap().1.data(), [3, 2, 1, 6, 5, 4, 9, 8, 7, 12, 11, 10]);
    // Rows that end with padding.
    message.encoding = "rgb8".to_owned();
    message.step = 8;
    message.data = [&[1, 2, 3, 4, 5, 6, 0, 0][..], &[7, 8, 9, 10, 11, 12, 0, 0]].concat().into();
    assert!(to_rgb(&message).unwrap().1 == rgb);
}

#[test]
fn depths_that_are_none_are_masked() {
    let millimetres = |big: bool, values: [u16; 4]| sensor_msgs::Image {
        height: 2,
        width: 2,
        encoding: "16UC1".to_owned(),
        is_bigendian: u8::from(big),
        step: 4,
        data: values
            .iter()
            .flat_map(|v| if big { v.to_be_bytes() } else { v.to_le_bytes() })
            .collect::<Vec<_>>()
            .into(),
        ..Default::default()
    };
    for big in [false, true] {
        let depth = to_depth(&millimetres(big, [1000, 0, 65_535, 2500])).unwrap().1;
        assert_eq!(depth.data(), [1.0, 0.0, 0.0, 2.5], "big-endian: {big}");
    }
    let metres = [f32::NAN, f32::INFINITY, -1.0, 2.0];
    let mut message = millimetres(false, [0; 4]);
    message.encoding = "32FC1".to_owned();
    message.step = 8;
    message.data = metres.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<_>>().into();
    assert_eq!(to_depth(&message).unwrap().1.data(), [0.0, 0.0, 0.0, 2.0]);
    let nothing = to_depth(&millimetres(false, [0; 4])).unwrap().1;
    assert_eq!(nothing.valid_share(), 0.0, "an image without a single depth is an image all the same");
}

/// Breaks a good message and expects a refusal that names what is wrong.
fn refused<M: Clone, T: Debug>(good: &M, read: impl Fn(&M) -> Result<T, Malformed>, cases: &[(&str, fn(&mut M))]) {
    assert!(read(good).is_ok(), "the message was bad before it was broken");
    for (says, breaks) in cases {
        let mut message = good.clone();
        breaks(&mut message);
        let refusal = read(&message).expect_err(says);
        assert!(refusal.reason.contains(says), "'{refusal}' does not say '{says}'");
        assert!(refusal.to_string().starts_with(refusal.message) && refusal.message.contains('/'));
    }
}

#[test]
fn malformed_estimates() {
    let sighting = Sighting::Pose {
        t_camera_goal: Transform::identity(),
        covariance: Matrix6::identity(),
        n_inliers: 30,
        rms_rad: 1e-3,
    };
    let pose = GoalEstimate {
        stamp: Stamp(1),
        goal_id: 1,
        sighting,
        n_matches: 40,
        matched_points: vec![MatchedPoint { query_px: (1.0, 2.0), goal_px: (3.0, 4.0) }],
        times: StageTimes::default(),
    };
    type M = homing_msgs::GoalEstimate;
    refused::<M, _>(
        &pose.to_message(),
        M::to_domain,
        &[
            ("kind 3", |m| m.kind = 3),
            ("pose is NaN", |m| m.pose.position.y = f64::NAN),
            ("pose is inf", |m| m.pose.orientation.x = f64::INFINITY),
            ("length 0.5", |m| m.pose.orientation.w = 0.5),
            ("length 0.0", |m| m.pose.orientation.w = 0.0),
            ("covariance", |m| m.covariance[0] = -1e-9),
            ("covariance", |m| m.covariance[20] = -1.0),
            ("covariance", |m| m.covariance[3] = f64::NAN),
            ("rms_rad is NaN", |m| m.rms_rad = f64::NAN),
            ("rms_rad is -1", |m| m.rms_rad = -1.0),
            ("1 query and 2 goal", |m| m.query_px.truncate(1)),
            ("3 query and 3 goal", |m| [&mut m.query_px, &mut m.goal_px].into_iter().for_each(|v| v.push(0.0))),
            ("matched point", |m| m.goal_px[1] = f32::NAN),
            ("before the clock", |m| m.header.stamp.sec = -1),
            ("1000000000 ns", |m| m.header.stamp.nanosec = 1_000_000_000),
        ],
    );
    let bearing = Sighting::Bearing { bearing_rad: 0.1, bearing_sd_rad: 0.2, heading_rad: 0.3, n_inliers: 9 };
    refused::<M, _>(
        &GoalEstimate { sighting: bearing, ..pose.clone() }.to_message(),
        M::to_domain,
        &[
            ("bearing_rad is NaN", |m| m.bearing_rad = f64::NAN),
            ("bearing_sd_rad is inf", |m| m.bearing_sd_rad = f64::INFINITY),
            ("bearing_sd_rad is -0.1", |m| m.bearing_sd_rad = -0.1),
            ("heading_rad is NaN", |m| m.heading_rad = f64::NAN),
        ],
    );
    let unseen = Sighting::NotSeen { reason: UnseenReason::NoTexture };
    refused::<M, _>(
        &GoalEstimate { sighting: unseen, ..pose }.to_message(),
        M::to_domain,
        &[("reason 4", |m| m.reason = 4)],
    );
}

#[test]
fn malformed_motions() {
    type Command = homing_msgs::MotionCommand;
    let mut command = Command { kind: 0, ..Command::default() };
    refused(
        &command,
        Command::to_domain,
        &[
            ("kind 5", |m| m.kind = 5),
            ("linear_m_s is NaN", |m| m.linear_m_s = f64::NAN),
            ("angular_rad_s is inf", |m| m.angular_rad_s = f64::INFINITY),
            ("before the clock", |m| m.header.stamp.sec = i32::MIN),
        ],
    );
    command.kind = 1;
    refused(&command, Command::to_domain, &[("distance_m is -inf", |m| m.distance_m = f64::NEG_INFINITY)]);
    command.kind = 2;
    refused(&command, Command::to_domain, &[("angle_rad is NaN", |m| m.angle_rad = f64::NAN)]);
    type Result = homing_msgs::MotionResult;
    refused(
        &Result::default(),
        Result::to_domain,
        &[("moved_yaw_rad is NaN", |m| m.moved_yaw_rad = f64::NAN), ("moved_x_m", |m| m.moved_x_m = f64::INFINITY)],
    );
}

#[test]
fn malformed_odometry_and_mounts() {
    let good = Odometry { stamp: Stamp(1), t_odom_base: Transform::identity(), linear_m_s: 0.0, angular_rad_s: 0.0 };
    refused::<nav_msgs::Odometry, _>(
        &good.to_message(),
        nav_msgs::Odometry::to_domain,
        &[
            ("pose is NaN", |m| m.pose.pose.position.z = f64::NAN),
            ("length 0.000", |m| m.pose.pose.orientation.w = 0.0),
            ("twist.linear.x is NaN", |m| m.twist.twist.linear.x = f64::NAN),
            ("twist.angular.z is inf", |m| m.twist.twist.angular.z = f64::INFINITY),
        ],
    );
    refused(
        &camera_mount_message(Stamp(1), &Transform::identity()),
        to_camera_mount,
        &[
            ("length 2.000", |m| m.transforms[0].transform.rotation.w = 2.0),
            ("pose is NaN", |m| m.transforms[0].transform.translation.x = f64::NAN),
        ],
    );
}

#[test]
fn malformed_states() {
    type M = homing_msgs::NavigationState;
    let good = M { goal_known: true, has_target: true, path_m: vec![1.0, 2.0], ..M::default() };
    refused(
        &good,
        M::to_domain,
        &[
            ("mode 6", |m| m.mode = 6),
            ("action 5", |m| m.action = 5),
            ("yaw_rad is NaN", |m| m.yaw_rad = f64::NAN),
            ("x_m is inf", |m| m.goal_x_m = f64::INFINITY),
            ("goal_covariance is NaN", |m| m.goal_covariance[8] = f64::NAN),
            ("1000000000 ns", |m| m.goal_last_seen.nanosec = 1_000_000_000),
            ("target_y_m is NaN", |m| m.target_y_m = f64::NAN),
            ("path_m has 3 numbers", |m| m.path_m.push(0.0)),
            ("frontiers_m is NaN", |m| m.frontiers_m = vec![0.0, f64::NAN]),
        ],
    );
}

#[test]
fn malformed_cameras_photos_scans_and_maps() {
    let intrinsics = Intrinsics::new(640, 480, 500.0, 500.0, 319.5, 239.5).unwrap();
    refused::<sensor_msgs::CameraInfo, _>(
        &CameraInfoMessage { stamp: Stamp(1), intrinsics }.to_message(),
        sensor_msgs::CameraInfo::to_domain,
        &[
            ("distorted", |m| m.d[0] = 0.1),
            ("skew", |m| m.k[1] = 0.5),
            ("focal", |m| m.k[0] = 0.0),
            ("focal", |m| m.k[4] = f64::NAN),
            ("principal", |m| m.k[2] = 641.0),
            ("0x480", |m| m.width = 0),
            ("4294967295", |m| m.height = u32::MAX),
            ("binning", |m| m.binning_x = 2),
        ],
    );
    refused::<homing_msgs::GoalPhoto, _>(
        &EncodedPhoto { id: 1, file: vec![1], intrinsics }.to_message(),
        homing_msgs::GoalPhoto::to_domain,
        &[("no bytes", |m| m.data = Vec::new().into()), ("focal", |m| m.fx = -1.0), ("65536", |m| m.width = 65_536)],
    );
    refused(
        &sensor_msgs::LaserScan { ranges: vec![1.0, f32::INFINITY], ..Default::default() },
        sensor_msgs::LaserScan::to_domain,
        &[
            ("rays", |m| m.ranges = vec![1.0; 32_769]),
            ("angle_increment is NaN", |m| m.angle_increment = f32::NAN),
            ("range_max is inf", |m| m.range_max = f32::INFINITY),
        ],
    );
    let grid = OccupancyGrid::unknown(GridGeometry::centred(1.0, 0.1));
    refused::<nav_msgs::OccupancyGrid, _>(
        &(Stamp(1), &grid).to_message(),
        nav_msgs::OccupancyGrid::to_domain,
        &[
            ("99 values", |m| m.data.truncate(99)),
            ("0x10", |m| m.info.width = 0),
            ("4294967295", |m| (m.info.width, m.info.height, m.data) = (u32::MAX, u32::MAX, vec![0])),
            ("resolution is 0", |m| m.info.resolution = 0.0),
            ("resolution is NaN", |m| m.info.resolution = f32::NAN),
            ("origin.x is NaN", |m| m.info.origin.position.x = f64::NAN),
            ("turned", |m| m.info.origin.orientation.z = 0.7),
        ],
    );
}

#[test]
fn a_range_that_was_not_measured_is_not_free_space() {
    let message = sensor_msgs::LaserScan { ranges: vec![1.0, f32::NAN], ..Default::default() };
    assert_eq!(message.to_domain().unwrap().ranges_m, [1.0, 0.0]);
}

#[test]
fn malformed_images() {
    let colour = color_message(Stamp(1), &RgbImage::new(4, 2, vec![9; 24]).unwrap());
    refused(
        &colour,
        to_rgb,
        &[
            ("yuv422", |m| m.encoding = "yuv422".to_owned()),
            ("mono8", |m| m.encoding = "mono8".to_owned()),
            ("does not fit 23 bytes", |m| m.data = vec![9; 23].into()),
            ("does not fit 0 bytes", |m| m.data = Vec::new().into()),
            ("rows of 11 bytes", |m| m.step = 11),
            ("5x2", |m| m.width = 5),
            ("4x4294967295", |m| m.height = u32::MAX),
            ("4294967295x2", |m| m.width = u32::MAX),
            ("empty", |m| (m.width, m.height, m.step, m.data) = (0, 0, 0, Vec::new().into())),
        ],
    );
    let depth = depth_message(Stamp(1), &DepthImage::from_metres(4, 2, vec![1.0; 8]).unwrap());
    refused(
        &depth,
        to_depth,
        &[
            ("64FC1", |m| m.encoding = "64FC1".to_owned()),
            ("rgb8", |m| m.encoding = "rgb8".to_owned()),
            ("does not fit 31 bytes", |m| m.data = vec![0; 31].into()),
            ("4x3", |m| m.height = 3),
            ("1000000000 ns", |m| m.header.stamp.nanosec = 1_000_000_000),
        ],
    );
}

#[test]
fn truths_that_are_none() {
    type M = homing_msgs::GroundTruth;
    refused(
        &M::default(),
        M::to_domain,
        &[
            ("not finite", |m| m.path_length_m = f64::NAN),
            ("not finite", |m| m.start_yaw_rad = f64::INFINITY),
            ("negative stamp", |m| m.header.stamp.sec = -1),
        ],
    );
}
