//! Everything the monitor hears, turned into updates.

use std::io::Cursor;
use std::sync::Arc;
use std::time::Instant;

use homing_core::{GoalEstimate, GoalPhoto, Mode, NavigationState, RgbImage, Sighting, Stamp};
use homing_monitor::{Level, Recorder, Update};
use homing_privileged::{EPISODE_SUMMARY, GROUND_TRUTH};
use homing_protocol::assemble::Part;
use homing_protocol::convert::{EncodedPhoto, Lease, ToDomain, to_depth, to_rgb};
use homing_protocol::interfaces::homing_msgs::{self, EpisodeSummary};
use homing_protocol::interfaces::{nav_msgs, sensor_msgs};
use homing_protocol::{FrameAssembler, Session, Subscription, topics};
use image::{DynamicImage, ImageDecoder, ImageReader};

use crate::still::Still;

/// All subscriptions, and what is remembered between messages.
pub struct Ears {
    colors: Subscription<sensor_msgs::Image>,
    depths: Subscription<sensor_msgs::Image>,
    infos: Subscription<sensor_msgs::CameraInfo>,
    odometry: Subscription<nav_msgs::Odometry>,
    scans: Subscription<sensor_msgs::LaserScan>,
    goals: Subscription<homing_msgs::GoalPhoto>,
    estimates: Subscription<homing_msgs::GoalEstimate>,
    states: Subscription<homing_msgs::NavigationState>,
    maps: Subscription<nav_msgs::OccupancyGrid>,
    leases: Subscription<homing_msgs::MotionLease>,
    truths: Subscription<homing_msgs::GroundTruth>,
    summaries: Subscription<EpisodeSummary>,
    assembler: FrameAssembler,
    goal_id: Option<u64>,
    mode: Option<Mode>,
    seen: bool,
    last_refusal: String,
    frame_arrived: Option<(Stamp, Instant)>,
}

impl Ears {
    pub fn open(session: &Session) -> anyhow::Result<Self> {
        Ok(Self {
            colors: session.subscribe(&topics::CAMERA_COLOR, 2)?,
            depths: session.subscribe(&topics::CAMERA_DEPTH, 2)?,
            infos: session.subscribe(&topics::CAMERA_INFO, 2)?,
            odometry: session.subscribe(&topics::ODOM, 8)?,
            scans: session.subscribe(&topics::SCAN, 1)?,
            goals: session.subscribe(&topics::GOAL_IMAGE, 1)?,
            estimates: session.subscribe(&topics::GOAL_ESTIMATE, 4)?,
            states: session.subscribe(&topics::NAVIGATION_STATE, 8)?,
            maps: session.subscribe(&topics::MAP, 1)?,
            leases: session.subscribe(&topics::MOTION_LEASE, 2)?,
            truths: session.subscribe(&GROUND_TRUTH, 8)?,
            summaries: session.subscribe(&EPISODE_SUMMARY, 1)?,
            assembler: FrameAssembler::default(),
            goal_id: None,
            mode: None,
            seen: false,
            last_refusal: String::new(),
            frame_arrived: None,
        })
    }

    /// Takes in the next message, whichever comes first.
    pub async fn hear(&mut self, recorder: &Recorder, still: &mut Still) -> anyhow::Result<()> {
        tokio::select! {
            color = self.colors.recv() => {
                let (stamp, rgb) = to_rgb(&color?.message)?;
                self.part(stamp, Part::Rgb(rgb), recorder, still)?;
            }
            depth = self.depths.recv() => {
                let (stamp, depth) = to_depth(&depth?.message)?;
                self.part(stamp, Part::Depth(depth), recorder, still)?;
            }
            info = self.infos.recv() => {
                let info = info?.message.to_domain()?;
                self.part(info.stamp, Part::Intrinsics(info.intrinsics), recorder, still)?;
            }
            odometry = self.odometry.recv() => {
                let odometry = odometry?.message.to_domain()?;
                still.odometry(&odometry);
                recorder.offer(odometry);
            }
            scan = self.scans.recv() => recorder.offer(scan?.message.to_domain()?),
            goal = self.goals.recv() => self.goal(goal?.message.to_domain()?, recorder, still)?,
            estimate = self.estimates.recv() => self.estimate(estimate?.message.to_domain()?, recorder),
            state = self.states.recv() => self.state(state?.message.to_domain()?, recorder, still),
            map = self.maps.recv() => {
                let map = Arc::new(map?.message.to_domain()?);
                still.map(Arc::clone(&map));
                recorder.offer(Update::Map(map));
            }
            lease = self.leases.recv() => self.lease(&lease?.message.to_domain()?, recorder),
            truth = self.truths.recv() => {
                let truth = truth?.message.to_domain()?;
                let pose = truth.in_odom(truth.pose);
                still.truth_pose(pose);
                recorder.offer(Update::TruthPose { stamp: truth.stamp, pose });
            }
            summary = self.summaries.recv() => summarize(&summary?.message, recorder, still)?,
        }
        Ok(())
    }

    fn part(&mut self, stamp: Stamp, part: Part, recorder: &Recorder, still: &mut Still) -> anyhow::Result<()> {
        if let Some(frame) = self.assembler.add(stamp, part)? {
            let frame = Arc::new(frame);
            self.frame_arrived = Some((stamp, Instant::now()));
            still.view(Arc::clone(&frame.rgb));
            recorder.offer(frame);
        }
        Ok(())
    }

    fn goal(&mut self, photo: EncodedPhoto, recorder: &Recorder, still: &mut Still) -> anyhow::Result<()> {
        if self.goal_id == Some(photo.id) {
            return Ok(());
        }
        let image = upright(&photo.file)?.to_rgb8();
        let (width, height) = image.dimensions();
        let rgb = Arc::new(RgbImage::new(width, height, image.into_raw())?);
        let intrinsics = photo.intrinsics.resized(width, height)?;
        self.goal_id = Some(photo.id);
        still.goal(Arc::clone(&rgb));
        recorder.offer(GoalPhoto { id: photo.id, rgb, intrinsics });
        Ok(())
    }

    fn estimate(&mut self, estimate: GoalEstimate, recorder: &Recorder) {
        if let Some((stamp, arrived)) = self.frame_arrived
            && stamp == estimate.stamp
        {
            let ms = arrived.elapsed().as_secs_f64() * 1e3;
            recorder.offer(Update::Latency { name: "frame to estimate".to_owned(), ms });
        }
        if let Sighting::Pose { t_camera_goal, n_inliers, .. } = &estimate.sighting {
            if !self.seen {
                let distance_m = t_camera_goal.translation().norm();
                let text = format!("the goal is in sight: {distance_m:.1} m away, {n_inliers} matches agree");
                say(recorder, Level::Info, "perception", text);
            }
            self.seen = true;
        } else {
            self.seen = false;
        }
        recorder.offer(estimate);
    }

    fn state(&mut self, state: NavigationState, recorder: &Recorder, still: &mut Still) {
        if self.mode != Some(state.mode) {
            self.mode = Some(state.mode);
            say(recorder, Level::Info, "planner", format!("{:?}: {}", state.mode, state.reason));
        }
        still.state(&state);
        recorder.offer(state);
    }

    fn lease(&mut self, lease: &Lease, recorder: &Recorder) {
        if lease.last_refusal != self.last_refusal {
            self.last_refusal.clone_from(&lease.last_refusal);
            say(recorder, Level::Warn, "body", lease.last_refusal.clone());
        }
    }
}

/// Decodes a photo as perception does: turned as its camera noted.
fn upright(file: &[u8]) -> anyhow::Result<DynamicImage> {
    // The limits on memory are the decoder's own.
    let mut decoder = ImageReader::new(Cursor::new(file)).with_guessed_format()?.into_decoder()?;
    let orientation = decoder.orientation()?;
    let mut image = DynamicImage::from_decoder(decoder)?;
    image.apply_orientation(orientation);
    Ok(image)
}

fn say(recorder: &Recorder, level: Level, source: &str, text: String) {
    recorder.offer(Update::Log { level, source: source.to_owned(), text });
}

fn summarize(summary: &EpisodeSummary, recorder: &Recorder, still: &mut Still) -> anyhow::Result<()> {
    let facts: Vec<(&str, String)> = summary
        .facts
        .lines()
        .filter_map(|line| line.split_once('\t').map(|(name, value)| (name, value.to_owned())))
        .collect();
    let mut text = format!("# {}\n\n", summary.title);
    for (n, (name, value)) in facts.iter().enumerate() {
        text += &format!("| {name} | {value} |\n");
        if n == 0 {
            text += "|---|---|\n";
        }
    }
    recorder.offer(Update::Verdict(text));
    still.draw(&summary.title, summary.success, &facts)
}
