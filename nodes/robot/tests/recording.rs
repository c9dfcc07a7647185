//! Small recordings made up on the spot, and every way in which they can be broken.
#![expect(clippy::unwrap_used, reason = "tests")]

use std::fs;
use std::path::Path;

use homing_core::{BridgeError, Motion, RobotBridge};
use homing_robot::{Layout, Recording, RecordingError, ReplayBody};
use image::{ImageBuffer, Luma, Rgb};
use tempfile::TempDir;

/// A 4x4 pose: `x` metres to the right, no rotation but what rounding did.
fn matrix(x: f64) -> String {
    format!("1.0004 0 0 {x}\n0 0.9997 0 0\n0 0 1 0\n0 0 0 1\n")
}

fn write_images(colour: &Path, depth: &Path, size: (u32, u32), depth_mm: u16) {
    ImageBuffer::from_pixel(size.0, size.1, Rgb([10_u8, 20, 30])).save(colour).unwrap();
    ImageBuffer::from_pixel(size.0, size.1, Luma([depth_mm])).save(depth).unwrap();
}

fn write_seven_scenes_frame(folder: &Path, number: u32) {
    let stem = folder.join(format!("frame-{number:06}"));
    let with = |ending: &str| folder.join(format!("{}.{ending}", stem.file_name().unwrap().to_str().unwrap()));
    write_images(&with("color.png"), &with("depth.png"), (640, 480), 1500);
    fs::write(with("pose.txt"), matrix(f64::from(number) * 0.1)).unwrap();
}

fn seven_scenes(numbers: &[u32]) -> TempDir {
    let folder = TempDir::new().unwrap();
    for &number in numbers {
        write_seven_scenes_frame(folder.path(), number);
    }
    folder
}

fn open3d(count: u32) -> TempDir {
    let folder = TempDir::new().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::create_dir(at("image")).unwrap();
    fs::create_dir(at("depth")).unwrap();
    let mut log = String::new();
    for i in 0..count {
        write_images(&at(&format!("image/{i:05}.png")), &at(&format!("depth/{i:05}.png")), (8, 6), 2000);
        log += &format!("{i} {i} {}\n{}", i + 1, matrix(f64::from(i)));
    }
    fs::write(at("trajectory.log"), log).unwrap();
    let camera = r#"{"width": 8, "height": 6, "intrinsic_matrix": [7.0, 0, 0, 0, 7.5, 0, 3.5, 2.5, 1]}"#;
    fs::write(at("camera_primesense.json"), camera).unwrap();
    folder
}

/// The error's text names the file, so that somebody can go and look.
fn says(error: &RecordingError, what: &str) {
    assert!(error.to_string().contains(what), "'{error}' should name {what}");
}

#[test]
fn reads_seven_scenes() {
    let folder = seven_scenes(&[20, 0, 10]);
    let recording = Recording::open(folder.path()).unwrap();
    assert_eq!(recording.layout(), Layout::SevenScenes);
    assert_eq!(recording.numbers().collect::<Vec<_>>(), [0, 10, 20]);
    let k = recording.intrinsics();
    assert_eq!((k.fx(), k.fy(), k.cx(), k.cy()), (585.0, 585.0, 320.0, 240.0));
    let frame = recording.frame(10).unwrap();
    assert_eq!(frame.stamp.0, 333_333_333);
    assert_eq!(&frame.rgb.data()[..3], [10, 20, 30]);
    assert!((frame.depth.at(5, 5).unwrap() - 1.5).abs() < 1e-6);
    let rotation = recording.t_world_camera(10).unwrap().rotation().to_rotation_matrix();
    assert!((rotation.matrix().determinant() - 1.0).abs() < 1e-12);
    assert_eq!(recording.t_world_camera(10).unwrap().translation().x, 1.0);
}

#[test]
fn a_rig_makes_poses_and_intrinsics_those_of_the_colour_camera() {
    let folder = seven_scenes(&[0, 10]);
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs/kinect_v1.toml");
    let recording = Recording::open_with(folder.path(), Some(&file)).unwrap();
    assert_eq!(recording.intrinsics().fx(), 525.0);
    // Colour lies to the left in the depth camera's view of it, by the calibration's 2.5 cm.
    let p = recording.t_world_camera(10).unwrap().translation();
    assert!((p.x - 1.0 - 0.0255).abs() < 1e-3 && p.y.abs() < 1e-3, "{p}");
    // Between two frames the camera moved as the depth camera did, but for the bar it turns on.
    let moved = recording.relative_pose_truth(0, 10).unwrap();
    assert!((moved.translation().norm() - 1.0).abs() < 1e-9 && moved.rotation().angle() < 1e-6);
    // A wall 1.5 m away is there for the colour camera, too, where the depth camera saw it: not at the picture's rim.
    let frame = recording.frame(10).unwrap();
    let centre = f64::from(frame.depth.at(320, 240).unwrap());
    assert!((centre - 1.5).abs() < 0.01, "{centre}");
    assert_eq!(frame.depth.at(2, 240), None);
    assert!(frame.depth.valid_share() > 0.75);
}

#[test]
fn a_rig_of_other_cameras_or_none_is_refused() {
    let folder = open3d(1);
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs/kinect_v1.toml");
    let error = Recording::open_with(folder.path(), Some(&file)).unwrap_err();
    assert!(matches!(error, RecordingError::Rig { found: (8, 6), expected: (640, 480), .. }), "{error}");
    says(&Recording::open_with(folder.path(), Some(&folder.path().join("none.toml"))).unwrap_err(), "none.toml");
    let other = folder.path().join("trajectory.log");
    says(&Recording::open_with(folder.path(), Some(&other)).unwrap_err(), "kinect_v1.toml is an example");
}

#[test]
fn reads_open3d() {
    let folder = open3d(3);
    let recording = Recording::open(folder.path()).unwrap();
    assert_eq!(recording.layout(), Layout::Open3d);
    let k = recording.intrinsics();
    assert_eq!((k.width(), k.height(), k.fx(), k.fy(), k.cx(), k.cy()), (8, 6, 7.0, 7.5, 3.5, 2.5));
    assert_eq!(recording.frame(2).unwrap().depth.at(7, 5), Some(2.0));
    let truth = recording.relative_pose_truth(0, 2).unwrap();
    assert!((truth.translation().x - 2.0).abs() < 1e-12, "the goal camera lies 2 m to the right of the query camera");
}

#[test]
fn pairs_are_original_frames_apart() {
    let folder = seven_scenes(&[0, 10, 20, 30, 50]);
    let recording = Recording::open(folder.path()).unwrap();
    assert_eq!(recording.pairs(20, 10), [(0, 20), (10, 30), (30, 50)]);
    assert_eq!(recording.pairs(20, 30), [(0, 20), (30, 50)]);
    assert_eq!(recording.pairs(u32::MAX, 0), []);
}

#[test]
fn a_folder_that_is_no_recording() {
    let empty = TempDir::new().unwrap();
    let missing = empty.path().join("nowhere");
    assert!(matches!(Recording::open(&missing), Err(RecordingError::NoFolder { .. })));
    let error = Recording::open(empty.path()).unwrap_err();
    assert!(matches!(error, RecordingError::UnknownLayout { .. }));
    says(&error, "frame-000000.color.jpg");
    let file = empty.path().join("file");
    fs::write(&file, "").unwrap();
    assert!(matches!(Recording::open(&file), Err(RecordingError::NoFolder { .. })));
    let no_frames = open3d(0);
    assert!(matches!(Recording::open(no_frames.path()), Err(RecordingError::NoFrames { .. })));
}

#[test]
fn a_frame_that_is_not_complete() {
    for (gone, number) in [("frame-000010.depth.png", 10), ("frame-000020.pose.txt", 20), ("frame-000000.color.png", 0)]
    {
        let folder = seven_scenes(&[0, 10, 20]);
        fs::remove_file(folder.path().join(gone)).unwrap();
        let error = Recording::open(folder.path()).unwrap_err();
        assert!(matches!(error, RecordingError::MissingFile { number: n, .. } if n == number), "{error}");
        says(&error, &gone[..12]);
    }
    for (gone, named) in [("depth/00001.png", "depth/00001.png"), ("image/00002.png", "image/00002")] {
        let folder = open3d(3);
        fs::remove_file(folder.path().join(gone)).unwrap();
        says(&Recording::open(folder.path()).unwrap_err(), named);
    }
    let folder = open3d(3);
    let log = folder.path().join("trajectory.log");
    let text = fs::read_to_string(&log).unwrap();
    fs::write(&log, text.lines().take(10).collect::<Vec<_>>().join("\n")).unwrap();
    assert!(matches!(Recording::open(folder.path()), Err(RecordingError::MissingPose { number: 2, .. })));
    fs::write(&log, text.lines().take(13).collect::<Vec<_>>().join("\n")).unwrap();
    says(&Recording::open(folder.path()).unwrap_err(), "cut short");
}

#[test]
fn a_pose_that_is_none() {
    for (text, line) in [
        ("", 0),
        ("1 0 0 0\n0 1 0 0\n0 0 1 0\n", 3),
        ("1 0 0 0\n0 1 0\n0 0 1 0\n0 0 0 1\n", 2),
        ("1 0 0 0\n0 1 0 0\n0 0 nan 0\n0 0 0 1\n", 3),
        ("1 0 0 0\n0 1 0 0\n0 0 one 0\n0 0 0 1\n", 3),
        ("1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 2\n", 4),
        ("1 0 0 0\n0 1 0 0\n0 0 -1 0\n0 0 0 1\n", 1),
        ("0 0 0 0\n0 0 0 0\n0 0 0 0\n0 0 0 1\n", 1),
    ] {
        let folder = seven_scenes(&[0]);
        fs::write(folder.path().join("frame-000000.pose.txt"), text).unwrap();
        let error = Recording::open(folder.path()).unwrap_err();
        assert!(matches!(error, RecordingError::Malformed { line: l, .. } if l == line), "{text:?}: {error}");
        says(&error, "frame-000000.pose.txt");
    }
}

#[test]
fn images_that_are_damaged_or_of_another_size() {
    let folder = seven_scenes(&[0]);
    let depth = folder.path().join("frame-000000.depth.png");
    let recording = Recording::open(folder.path()).unwrap();
    let whole = fs::read(&depth).unwrap();
    for kept in [0, 4, 20, whole.len() / 2, whole.len() - 20] {
        fs::write(&depth, &whole[..kept]).unwrap();
        let error = recording.frame(0).unwrap_err();
        assert!(matches!(error, RecordingError::Undecodable { .. }), "{kept} bytes: {error}");
        says(&error, "frame-000000.depth.png");
    }
    // A header that claims 65500 x 65500 pixels: refused by its size, not after 8 GB of memory.
    let mut bomb = whole.clone();
    bomb[16..24].copy_from_slice(&[0, 0, 0xff, 0xdc, 0, 0, 0xff, 0xdc]);
    let crc = crc32(&bomb[12..29]);
    bomb[29..33].copy_from_slice(&crc.to_be_bytes());
    fs::write(&depth, &bomb).unwrap();
    let error = recording.frame(0).unwrap_err();
    assert!(matches!(error, RecordingError::Size { found: (65_500, 65_500), .. }), "{error}");

    ImageBuffer::from_pixel(320, 240, Luma([1000_u16])).save(&depth).unwrap();
    let error = recording.frame(0).unwrap_err();
    assert!(matches!(error, RecordingError::Size { found: (320, 240), expected: (640, 480), .. }), "{error}");
    ImageBuffer::from_pixel(640, 480, Luma([100_u8])).save(&depth).unwrap();
    assert!(matches!(recording.frame(0), Err(RecordingError::NotDepth { .. })));
    fs::remove_file(&depth).unwrap();
    assert!(matches!(recording.frame(0), Err(RecordingError::Unreadable { .. })));
    says(&recording.frame(7).unwrap_err(), "no frame 7");
}

#[test]
fn a_truncated_jpeg_is_no_image() {
    let folder = seven_scenes(&[0]);
    fs::remove_file(folder.path().join("frame-000000.color.png")).unwrap();
    let colour = folder.path().join("frame-000000.color.jpg");
    ImageBuffer::from_fn(640, 480, |x, y| Rgb([(x * y) as u8, (x ^ y) as u8, x as u8])).save(&colour).unwrap();
    let recording = Recording::open(folder.path()).unwrap();
    assert!(recording.frame(0).is_ok());
    let whole = fs::read(&colour).unwrap();
    for kept in [2, 100, whole.len() / 2, whole.len() - 100, whole.len() - 2] {
        fs::write(&colour, &whole[..kept]).unwrap();
        let error = recording.frame(0).unwrap_err();
        assert!(matches!(error, RecordingError::Undecodable { .. }), "{kept} of {} bytes: {error}", whole.len());
    }
}

#[test]
fn invalid_depth_is_masked() {
    let folder = seven_scenes(&[0]);
    let depth = ImageBuffer::from_fn(640, 480, |x, _| Luma([if x == 0 { 0 } else { u16::MAX }]));
    depth.save(folder.path().join("frame-000000.depth.png")).unwrap();
    let frame = Recording::open(folder.path()).unwrap().frame(0).unwrap();
    assert_eq!(frame.depth.valid_share(), 0.0);
}

#[test]
fn intrinsics_that_are_none() {
    let folder = open3d(1);
    for text in ["", "{}", r#"{"width": 8, "height": 6, "intrinsic_matrix": [0, 0, 0, 0, 7.5, 0, 3.5, 2.5, 1]}"#] {
        fs::write(folder.path().join("camera_primesense.json"), text).unwrap();
        says(&Recording::open(folder.path()).unwrap_err(), "camera_primesense.json");
    }
    let folder = seven_scenes(&[0]);
    for text in ["", "1 2\n3 4\n", "585 0 9000\n0 585 240\n0 0 1\n"] {
        fs::write(folder.path().join("camera-intrinsics.txt"), text).unwrap();
        says(&Recording::open(folder.path()).unwrap_err(), "camera-intrinsics.txt");
    }
}

#[test]
fn a_recording_is_a_body_that_cannot_be_driven() {
    let folder = seven_scenes(&[10, 20, 30]);
    let mut body = ReplayBody::new(Recording::open(folder.path()).unwrap()).unwrap();
    assert!(!body.capabilities().drivable && !body.capabilities().has_scan);
    assert!(matches!(body.apply(Motion::Stop { done: false }), Err(BridgeError::NotDrivable { .. })));
    assert!(matches!(body.apply(Motion::Turn { angle_rad: f64::NAN }), Err(BridgeError::NotFinite { .. })));
    let first = body.observe().unwrap();
    assert!(first.odometry.t_odom_base.planar().distance_to(0.0, 0.0) < 1e-12);
    assert_eq!((first.odometry.stamp, first.scan.is_none()), (first.frame.stamp, true));
    // The camera moved 1 m to its right: for a robot that looks ahead, to y = -1.
    let second = body.observe().unwrap().odometry;
    let pose = second.t_odom_base.planar();
    assert!(pose.x_m.abs() < 1e-9 && (pose.y_m + 1.0).abs() < 1e-9 && pose.yaw_rad.abs() < 1e-9, "{pose:?}");
    body.stop();
    fs::remove_file(folder.path().join("frame-000030.depth.png")).unwrap();
    assert!(matches!(body.observe(), Err(BridgeError::Device { .. })));
    assert!(matches!(body.observe(), Err(BridgeError::Exhausted { .. })));
    let again = Recording::open(seven_scenes(&[0]).path()).unwrap();
    assert!(ReplayBody::with_playlist(again, vec![0, 5]).is_err());
}

/// CRC-32 of a PNG chunk (ISO 3309).
fn crc32(bytes: &[u8]) -> u32 {
    !bytes
        .iter()
        .fold(u32::MAX, |crc, &byte| (0..8).fold(crc ^ u32::from(byte), |c, _| (c >> 1) ^ (0xedb8_8320 * (c & 1))))
}
