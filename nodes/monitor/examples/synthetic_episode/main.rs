//! Records an invented episode, so that the viewer's layout and the picture can be looked at without a robot:
//!
//! `cargo run -p homing-monitor --example synthetic_episode -- episode.rrd episode.png [serve-address]`

mod flat;

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use flat::Flat;
use homing_core::{
    Action, GoalEstimate, GoalHypothesis, GoalPhoto, Intrinsics, MatchedPoint, Mode, NavigationState, PlanarPose,
    RgbdFrame, Sighting, StageTimes, Stamp, Transform, UnseenReason, wrap_angle,
};
use homing_monitor::{EpisodePicture, Level, Recorder, RecorderConfig, Update, episode_picture, write_png};
use nalgebra::{Matrix3, Matrix6};

type Error = Box<dyn std::error::Error>;

/// Where the robot drives, metres of the flat.
const WAYPOINTS: [(f64, f64); 8] =
    [(1.5, 1.5), (3.6, 1.4), (4.6, 3.4), (2.2, 4.4), (5.0, 4.4), (7.2, 4.5), (7.6, 6.4), (8.85, 6.95)];
/// Where the photo was taken, metres and radians of the flat.
const GOAL: PlanarPose = PlanarPose { x_m: 8.9, y_m: 7.05, yaw_rad: 0.25 };

fn main() -> Result<(), Error> {
    let mut arguments = std::env::args().skip(1);
    let recording = PathBuf::from(arguments.next().unwrap_or_else(|| "episode.rrd".to_owned()));
    let picture = PathBuf::from(arguments.next().unwrap_or_else(|| "episode.png".to_owned()));
    let serve = arguments.next().map(|address| address.parse()).transpose()?;
    let config = RecorderConfig { recording: Some(recording), serve, image_rate_hz_max: 1000.0, ..Default::default() };
    let recorder = Recorder::new(config)?;
    if let Some(url) = recorder.url() {
        println!("rerun {url}");
    }
    Episode::new()?.play(&recorder, &picture)?;
    println!("{:#?}", recorder.finish(Duration::from_secs(30)));
    Ok(())
}

struct Episode {
    flat: Flat,
    camera: Intrinsics,
    start: PlanarPose,
    goal_frame: RgbdFrame,
    true_path_m: Vec<(f64, f64)>,
    estimated_path_m: Vec<(f64, f64)>,
}

impl Episode {
    fn new() -> Result<Self, Error> {
        let camera = Intrinsics::from_hfov(640, 480, 2.0)?;
        let photo_camera = Intrinsics::from_hfov(600, 480, 1.5)?;
        let flat = Flat::new();
        let goal_frame = flat.look(&GOAL, photo_camera, Stamp(0))?;
        let start = PlanarPose { x_m: WAYPOINTS[0].0, y_m: WAYPOINTS[0].1, yaw_rad: 0.6 };
        Ok(Self { flat, camera, start, goal_frame, true_path_m: Vec::new(), estimated_path_m: Vec::new() })
    }

    fn play(mut self, recorder: &Recorder, picture: &std::path::Path) -> Result<(), Error> {
        recorder.offer(GoalPhoto { id: 1, rgb: self.goal_frame.rgb.clone(), intrinsics: self.goal_frame.intrinsics });
        recorder.offer(Update::TruthGoal(self.in_odom(&GOAL)));
        let shortest = [WAYPOINTS[0], (4.7, 1.7), (5.0, 4.2), (7.2, 4.5), (7.6, 6.4), (GOAL.x_m, GOAL.y_m)];
        let shortest: Vec<_> = shortest.iter().map(|&(x_m, y_m)| self.point_in_odom(x_m, y_m)).collect();
        recorder.offer(Update::ShortestPath(shortest.clone()));
        say(recorder, Level::Info, "homing", "goal photo 600x480 taken over; policy frontier");
        let poses = drive();
        let mut last = None;
        for (step, pose) in poses.iter().enumerate() {
            let is_last = step + 1 == poses.len();
            last = Some(self.step(recorder, step as u64, pose, is_last)?);
            // The recorder keeps what a robot sends, not what a loop without a robot can make.
            std::thread::sleep(Duration::from_millis(25));
        }
        recorder.offer(Update::Verdict(VERDICT.to_owned()));
        say(recorder, Level::Info, "homing", "goal reached: 0.12 m and 2.1 degrees off");
        let Some(final_frame) = last else { return Ok(()) };
        let facts = [
            ("steps", poses.len().to_string()),
            ("driven", "17.3 m".to_owned()),
            ("shortest", "13.0 m".to_owned()),
            ("SPL", "0.75".to_owned()),
            ("final distance", "0.12 m".to_owned()),
            ("final heading error", "2.1°".to_owned()),
        ];
        let end = self.in_odom(&poses[poses.len() - 1]);
        let image = episode_picture(&EpisodePicture {
            title: "Goal reached",
            success: true,
            facts: &facts,
            map: &self.flat.map_in_odom(&self.start),
            estimated_path_m: &self.estimated_path_m,
            true_path_m: &self.true_path_m,
            shortest_path_m: &shortest,
            start: PlanarPose::default(),
            end,
            goal: Some(self.in_odom(&GOAL)),
            goal_estimate: Some(drifted(&self.in_odom(&GOAL), 200)),
            goal_photo: &self.goal_frame.rgb,
            final_view: &final_frame.rgb,
        });
        write_png(&image, picture)?;
        Ok(())
    }

    fn step(&mut self, recorder: &Recorder, step: u64, pose: &PlanarPose, is_last: bool) -> Result<RgbdFrame, Error> {
        let stamp = Stamp(1_700_000_000_000_000_000 + step * 250_000_000);
        let frame = self.flat.look(pose, self.camera, stamp)?;
        let truth = self.in_odom(pose);
        let believed = drifted(&truth, step);
        self.true_path_m.push((truth.x_m, truth.y_m));
        self.estimated_path_m.push((believed.x_m, believed.y_m));
        recorder.offer(Arc::new(frame.clone()));
        recorder.offer(Update::TruthPose { stamp, pose: truth });
        self.flat.explore(pose);
        recorder.offer(self.flat.map_in_odom(&self.start));
        let matched_points = self.matches(&frame, pose);
        let n_inliers = matched_points.len();
        let sighting = sighting_of(n_inliers, step);
        let wobble = (step % 7) as f64;
        recorder.offer(GoalEstimate {
            stamp,
            goal_id: 1,
            sighting,
            switch_probability: None,
            n_matches: n_inliers + 12 + (step % 9) as usize,
            matched_points,
            times: StageTimes {
                extract: Duration::from_secs_f64(0.052 + 0.001 * wobble),
                matching: Duration::from_secs_f64(0.009 + 0.0006 * wobble),
                pose: Duration::from_secs_f64(0.002 + 0.0003 * wobble),
            },
        });
        recorder.offer(Update::Latency { name: "planner".to_owned(), ms: 3.1 + 0.2 * wobble });
        recorder.offer(Update::Latency { name: "frame to estimate".to_owned(), ms: 71.0 + 2.0 * wobble });
        recorder.offer(self.navigation(recorder, stamp, step, &believed, n_inliers, is_last));
        Ok(frame)
    }

    fn navigation(
        &self,
        recorder: &Recorder,
        stamp: Stamp,
        step: u64,
        pose: &PlanarPose,
        n_inliers: usize,
        is_last: bool,
    ) -> NavigationState {
        let goal = drifted(&self.in_odom(&GOAL), step);
        let seen = n_inliers >= 14;
        let mode = match (is_last, seen) {
            (true, _) => Mode::Arrived,
            (false, true) => Mode::Exploit,
            (false, false) => Mode::Explore,
        };
        if step.is_multiple_of(20) {
            say(recorder, Level::Info, "planner", &format!("step {step}: {mode:?}, {n_inliers} matches agree"));
        }
        if step == 30 {
            say(recorder, Level::Warn, "safety", "forward step cut short: obstacle 0.2 m ahead");
        }
        let sd = 0.4 / (1.0 + 0.12 * n_inliers as f64);
        let target = if seen { (goal.x_m, goal.y_m) } else { self.ahead(step) };
        NavigationState {
            stamp,
            step,
            mode,
            action: if is_last {
                Action::Stop
            } else {
                [Action::Forward, Action::Forward, Action::TurnLeft][(step / 5 % 3) as usize]
            },
            pose: *pose,
            goal: seen.then(|| GoalHypothesis {
                pose: goal,
                covariance: Matrix3::new(
                    sd * sd,
                    0.4 * sd * sd,
                    0.0,
                    0.4 * sd * sd,
                    0.5 * sd * sd,
                    0.0,
                    0.0,
                    0.0,
                    0.01,
                ),
                n_fused: n_inliers / 3,
                last_seen: stamp,
            }),
            target_m: Some(target),
            path_m: vec![(pose.x_m, pose.y_m), target],
            frontiers_m: if seen {
                Vec::new()
            } else {
                vec![target, self.point_in_odom(1.0, 4.9), self.point_in_odom(7.0, 1.6)]
            },
            reason: if seen {
                "the goal is believed 3 m ahead".to_owned()
            } else {
                "nearest frontier, 2.4 m away".to_owned()
            },
        }
    }

    /// Points of the photo that the robot sees too, found by geometry.
    fn matches(&self, frame: &RgbdFrame, pose: &PlanarPose) -> Vec<MatchedPoint> {
        let mut matches = Vec::new();
        for row in (30..450).step_by(23) {
            for column in (20..590).step_by(19) {
                let Some(depth_m) = self.goal_frame.depth.at(column, row) else { continue };
                let p_goal =
                    self.goal_frame.intrinsics.unproject(f64::from(column), f64::from(row), f64::from(depth_m));
                let (x_m, y_m, z_m) = flat::to_floor(&GOAL, &p_goal);
                let p_camera = flat::to_camera(pose, x_m, y_m, z_m);
                let Some(pixel) = frame.intrinsics.project(&p_camera) else { continue };
                let inside = (0.0..640.0).contains(&pixel.x) && (0.0..480.0).contains(&pixel.y);
                let visible = inside
                    && frame
                        .depth
                        .at(pixel.x as u32, pixel.y as u32)
                        .is_some_and(|d| (f64::from(d) - p_camera.z).abs() < 0.08);
                if visible && (column * 7 + row * 13) % 5 == 0 {
                    let query_px = (pixel.x as f32, pixel.y as f32);
                    matches.push(MatchedPoint { query_px, goal_px: (column as f32, row as f32) });
                }
            }
        }
        matches
    }

    fn ahead(&self, step: u64) -> (f64, f64) {
        let (x_m, y_m) = WAYPOINTS[(2 + step as usize / 22).min(WAYPOINTS.len() - 1)];
        self.point_in_odom(x_m, y_m)
    }

    fn in_odom(&self, pose: &PlanarPose) -> PlanarPose {
        let (x_m, y_m) = self.point_in_odom(pose.x_m, pose.y_m);
        PlanarPose { x_m, y_m, yaw_rad: wrap_angle(pose.yaw_rad - self.start.yaw_rad) }
    }

    fn point_in_odom(&self, x_m: f64, y_m: f64) -> (f64, f64) {
        flat::in_odom(&self.start, x_m, y_m)
    }
}

/// Poses along the way, quarter-metre steps and 15-degree turns.
fn drive() -> Vec<PlanarPose> {
    let mut pose = PlanarPose { x_m: WAYPOINTS[0].0, y_m: WAYPOINTS[0].1, yaw_rad: 0.6 };
    let mut poses = vec![pose];
    let turn_to = |pose: &mut PlanarPose, poses: &mut Vec<PlanarPose>, bearing: f64| {
        let n = (bearing.abs() / 0.2618).ceil().max(1.0);
        for _ in 0..n as usize {
            pose.yaw_rad = wrap_angle(pose.yaw_rad + bearing / n);
            poses.push(*pose);
        }
    };
    for &(x_m, y_m) in &WAYPOINTS[1..] {
        let bearing = pose.bearing_to(x_m, y_m);
        turn_to(&mut pose, &mut poses, bearing);
        let n = (pose.distance_to(x_m, y_m) / 0.25).ceil();
        let (dx, dy) = ((x_m - pose.x_m) / n, (y_m - pose.y_m) / n);
        for _ in 0..n as usize {
            pose = PlanarPose { x_m: pose.x_m + dx, y_m: pose.y_m + dy, ..pose };
            poses.push(pose);
        }
    }
    let rest = wrap_angle(GOAL.yaw_rad + 0.04 - pose.yaw_rad);
    turn_to(&mut pose, &mut poses, rest);
    poses
}

/// What odometry makes of a pose after so many steps.
fn drifted(pose: &PlanarPose, step: u64) -> PlanarPose {
    let growth = step as f64 / 200.0;
    PlanarPose { x_m: pose.x_m + 0.25 * growth, y_m: pose.y_m - 0.32 * growth, yaw_rad: pose.yaw_rad + 0.03 * growth }
}

fn sighting_of(n_inliers: usize, step: u64) -> Sighting {
    match n_inliers {
        0..5 => Sighting::NotSeen { reason: UnseenReason::TooFewMatches },
        5..14 => Sighting::Bearing {
            bearing_rad: 0.3 - 0.01 * (step % 10) as f64,
            bearing_sd_rad: 0.05,
            heading_rad: 0.1,
            n_inliers,
        },
        _ => Sighting::Pose {
            t_camera_goal: Transform::identity(),
            covariance: Matrix6::identity() * 0.01,
            n_inliers,
            rms_rad: 0.002,
        },
    }
}

fn say(recorder: &Recorder, level: Level, source: &str, text: &str) {
    recorder.offer(Update::Log { level, source: source.to_owned(), text: text.to_owned() });
}

const VERDICT: &str = "## Goal reached\n\n| steps | 103 |\n|---|---|\n| driven | 17.3 m |\n| shortest path | 13.0 m |\n\
| SPL | 0.75 |\n| final distance | 0.12 m |\n| final heading error | 2.1° |\n| recording | episode.rrd |\n";
