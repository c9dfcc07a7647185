//! What the recorder promises a control loop: it never waits, it says what it lost, and what it wrote can be read.
#![expect(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use std::io::Read as _;
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use homing_core::{
    Action, Cell, DepthImage, GridGeometry, Intrinsics, Mode, NavigationState, OccupancyGrid, PlanarPose, RgbImage,
    RgbdFrame, Stamp,
};
use homing_monitor::{
    EpisodePicture, Kind, Level, Recorder, RecorderConfig, RecorderError, Update, episode_picture, write_png,
};

fn frame(k: u64) -> Arc<RgbdFrame> {
    let intrinsics = Intrinsics::from_hfov(320, 240, 2.0).unwrap();
    let noise: Vec<u8> = (0..320 * 240 * 3).map(|i: u64| (i.wrapping_mul(2_654_435_761 + k) >> 13) as u8).collect();
    let rgb = Arc::new(RgbImage::new(320, 240, noise).unwrap());
    let depth = Arc::new(DepthImage::from_metres(320, 240, vec![1.0 + k as f32 * 0.01; 320 * 240]).unwrap());
    Arc::new(RgbdFrame::new(Stamp(1_000_000 * k), rgb, depth, intrinsics).unwrap())
}

fn state(step: u64) -> NavigationState {
    NavigationState {
        stamp: Stamp(1_000_000 * step),
        step,
        mode: Mode::Explore,
        action: Action::Forward,
        pose: PlanarPose { x_m: 0.25 * step as f64, ..PlanarPose::default() },
        goal: None,
        target_m: None,
        path_m: Vec::new(),
        frontiers_m: Vec::new(),
        reason: "test".to_owned(),
    }
}

fn log(text: &str) -> Update {
    Update::Log { level: Level::Info, source: "test".to_owned(), text: text.to_owned() }
}

fn recording(path: &Path) -> RecorderConfig {
    RecorderConfig { recording: Some(path.to_owned()), image_rate_hz_max: 1000.0, ..RecorderConfig::default() }
}

/// Offers far more than any sink can take and returns the longest offer.
fn flood(recorder: &Recorder) -> Duration {
    let frames: Vec<_> = (0..8).map(frame).collect();
    let mut longest = Duration::ZERO;
    for k in 0..2000_u64 {
        let (frame, state) = (frames[k as usize % 8].clone(), state(k));
        let before = Instant::now();
        recorder.offer(frame);
        recorder.offer(state);
        longest = longest.max(before.elapsed());
    }
    longest
}

#[test]
fn a_recording_is_complete_and_readable() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("episode.rrd");
    let recorder = Recorder::new(recording(&path)).unwrap();
    for k in 1..20 {
        recorder.offer(frame(k));
        recorder.offer(state(k));
        // No faster than the recorder shows them: on a loaded machine it would rightly drop some.
        let deadline = Instant::now() + Duration::from_secs(10);
        while recorder.status().shown < 2 * k {
            assert!(Instant::now() < deadline, "{:?}", recorder.status());
            std::thread::sleep(Duration::from_millis(1));
        }
    }
    recorder.offer(log("the last line"));
    recorder.offer(Update::Verdict("## Over".to_owned()));
    let status = recorder.finish(Duration::from_secs(20));
    assert!(status.complete, "{status:?}");
    assert_eq!(status.shown, 40);
    assert_eq!(status.error(), None);
    let bytes = std::fs::read(&path).unwrap();
    assert!(bytes.len() as u64 >= status.sinks[0].bytes && bytes.len() > 100_000, "{}", bytes.len());
    assert_eq!(&bytes[..4], b"RRF2");
}

#[test]
fn a_flood_never_waits_and_is_counted() {
    let folder = tempfile::tempdir().unwrap();
    let recorder = Recorder::new(recording(&folder.path().join("episode.rrd"))).unwrap();
    let longest = flood(&recorder);
    // A loaded machine may take the thread off its processor; a sink that is waited for costs seconds.
    assert!(longest < Duration::from_millis(500), "{longest:?}");
    let status = recorder.status();
    assert!(status.dropped.iter().any(|(kind, n)| *kind == Kind::Frame && *n > 0), "{status:?}");
    assert!(recorder.dropped() > 0);
}

#[test]
fn a_full_disk_is_reported_and_does_not_stop_the_loop() {
    let recorder = Recorder::new(recording(Path::new("/dev/full"))).unwrap();
    assert!(flood(&recorder) < Duration::from_millis(500));
    let status = recorder.finish(Duration::from_secs(20));
    assert!(status.error().is_some_and(|error| error.contains("space")), "{status:?}");
    assert!(!status.complete);
}

#[test]
fn a_path_that_cannot_be_written_is_refused_with_its_name() {
    let refused = Recorder::new(recording(Path::new("/nowhere/at/all.rrd"))).err();
    let Some(RecorderError::Recording { path, .. }) = &refused else { panic!("{refused:?}") };
    assert_eq!(path, Path::new("/nowhere/at/all.rrd"));
}

#[test]
fn a_taken_port_is_refused_with_its_address() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    let refused = Recorder::new(RecorderConfig { serve: Some(address), ..RecorderConfig::default() }).err();
    assert!(matches!(refused, Some(RecorderError::Serve { address: a, .. }) if a == address), "{refused:?}");
}

#[test]
fn a_viewer_that_reads_nothing_delays_neither_the_loop_nor_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("episode.rrd");
    let serve = Some(SocketAddr::from(([127, 0, 0, 1], 0)));
    let recorder = Recorder::new(RecorderConfig { serve, ..recording(&path) }).unwrap();
    let url = recorder.url().unwrap();
    let address = url.trim_start_matches("rerun+http://").trim_end_matches("/proxy").to_owned();
    let connect = || {
        (0..50).find_map(|_| {
            std::thread::sleep(Duration::from_millis(20));
            TcpStream::connect(&address).ok()
        })
    };
    let mut stalled = connect().unwrap();
    assert!(flood(&recorder) < Duration::from_millis(500));
    let before = Instant::now();
    let status = recorder.finish(Duration::from_secs(20));
    assert!(before.elapsed() < Duration::from_secs(21));
    let file = status.sinks.iter().find(|sink| sink.name.ends_with(".rrd")).unwrap();
    assert!(file.error.is_none() && file.bytes > 10_000, "{status:?}");
    stalled.set_read_timeout(Some(Duration::from_millis(10))).unwrap();
    let _ = stalled.read(&mut [0; 16]);
}

#[test]
fn finishing_keeps_to_its_limit() {
    let folder = tempfile::tempdir().unwrap();
    let recorder = Recorder::new(recording(&folder.path().join("episode.rrd"))).unwrap();
    flood(&recorder);
    let before = Instant::now();
    recorder.finish(Duration::from_millis(1));
    assert!(before.elapsed() < Duration::from_millis(500));
}

#[test]
fn a_recorder_without_sinks_takes_everything() {
    let recorder = Recorder::new(RecorderConfig::default()).unwrap();
    recorder.offer(log("into the void"));
    let status = recorder.finish(Duration::from_secs(5));
    assert!(status.complete && status.sinks.is_empty() && status.shown == 1, "{status:?}");
}

#[test]
fn the_picture_shows_both_paths_walls_and_views() {
    let mut map = OccupancyGrid::unknown(GridGeometry::centred(10.0, 0.1));
    for (i, cell) in map.cells.iter_mut().enumerate() {
        let (c, r) = (i % 100, i / 100);
        let inside = (20..80).contains(&c) && (20..80).contains(&r);
        let wall = inside && (c == 20 || c == 79 || r == 20 || r == 79);
        *cell = if wall {
            Cell::Occupied
        } else if inside {
            Cell::Free
        } else {
            Cell::Unknown
        };
    }
    let view = RgbImage::new(4, 3, [250, 120, 10].repeat(12)).unwrap();
    let (truth, estimated) = ([(-2.0, -2.0), (2.0, 2.0)], [(-2.0, -2.0), (2.0, 1.2)]);
    let end = PlanarPose { x_m: 2.0, y_m: 2.0, yaw_rad: 0.0 };
    let image = episode_picture(&EpisodePicture {
        title: "Goal reached",
        success: true,
        facts: &[("steps", "12".to_owned())],
        map: &map,
        estimated_path_m: &estimated,
        true_path_m: &truth,
        shortest_path_m: &[],
        start: PlanarPose { x_m: -2.0, y_m: -2.0, yaw_rad: 0.7 },
        end,
        goal: Some(PlanarPose { x_m: 2.4, y_m: 2.4, yaw_rad: 0.0 }),
        goal_estimate: None,
        goal_photo: &view,
        final_view: &view,
    });
    let count = |colour: [u8; 3]| image.data().chunks_exact(3).filter(|p| **p == colour).count();
    assert_eq!((image.width(), image.height()), (1600, 900));
    assert!(count([22, 150, 84]) > 1500, "true path");
    assert!(count([37, 110, 214]) > 500, "estimated path");
    assert!(count([58, 66, 82]) > 2000, "walls");
    assert!(count([250, 120, 10]) > 100_000, "views");
    let folder = tempfile::tempdir().unwrap();
    write_png(&image, &folder.path().join("episode.png")).unwrap();
    assert!(write_png(&image, Path::new("/nowhere/at/all.png")).is_err());
}

#[test]
fn a_picture_of_nothing_and_of_nonsense_is_still_a_picture() {
    let map = OccupancyGrid::unknown(GridGeometry::centred(1.0, 0.1));
    let view = RgbImage::new(1, 1, vec![0; 3]).unwrap();
    let nowhere = PlanarPose { x_m: f64::NAN, y_m: f64::INFINITY, yaw_rad: f64::NAN };
    let path = [(f64::NAN, 0.0), (1e12, -1e12), (0.0, f64::INFINITY)];
    let image = episode_picture(&EpisodePicture {
        title: "",
        success: false,
        facts: &[],
        map: &map,
        estimated_path_m: &path,
        true_path_m: &path,
        shortest_path_m: &path,
        start: nowhere,
        end: nowhere,
        goal: Some(nowhere),
        goal_estimate: Some(nowhere),
        goal_photo: &view,
        final_view: &view,
    });
    assert_eq!(image.width(), 1600);
}
