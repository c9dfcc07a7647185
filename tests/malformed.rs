//! Messages that describe no value are refused with a reason; images of other makes are read; what is no depth is masked.
#![expect(clippy::unwrap_used, clippy::expect_used, reason = "a test may fail by panicking")]

use std::fmt::Debug;

use homing_core::{
    DepthImage, GoalEstimate, GridGeometry, Intrinsics, MatchedPoint, OccupancyGrid, Odometry, RgbImage, Sighting,
    StageTimes, Stamp, Transform, UnseenReason,
};
use homing_privileged::GroundTruth;
use homing_protocol::convert::{
    CameraInfoMessage, EncodedPhoto, camera_mount_message, color_message, depth_message, to_camera_mount, to_depth,
    to_rgb, to_velocity,
};
use homing_protocol::interfaces::{geometry_msgs, homing_msgs, nav_msgs, sensor_msgs};
use homing_protocol::{Malformed, ToDomain, ToMessage};
use nalgebra::Matrix6;

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

/// What the refusal must say, and what breaks the message.
type Case<'a, M> = (&'a str, fn(&mut M));

/// Breaks a good message and expects a refusal that names what is wrong.
fn refused<M: Clone, T: Debug>(good: &M, read: impl Fn(&M) -> Result<T, Malformed>, cases: &[Case<M>]) {
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
        switch_probability: Some(0.5),
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
            ("switch_probability is -0.01", |m| m.switch_probability = -0.01),
            ("switch_probability is 1.01", |m| m.switch_probability = 1.01),
            ("switch_probability is inf", |m| m.switch_probability = f32::INFINITY),
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
            ("action 6", |m| m.action = 6),
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
    refused::<M, GroundTruth>(
        &M::default(),
        M::to_domain,
        &[
            ("not finite", |m| m.path_length_m = f64::NAN),
            ("not finite", |m| m.start_yaw_rad = f64::INFINITY),
            ("before the clock's origin", |m| m.header.stamp.sec = -1),
            ("ns in a second", |m| m.header.stamp.nanosec = 1_000_000_000),
        ],
    );
}
