//! Turns updates into what the viewer shows. Runs in the recorder's thread only.

pub(crate) mod camera;
mod map;
mod state;

use std::time::{Duration, Instant};

use homing_core::Stamp;
use rerun::{AsComponents, RecordingStream, TextDocument, TextLog, TextLogLevel};

use crate::entities;
use crate::recorder::RecorderConfig;
use crate::update::{Level, Update};
use camera::CameraScene;
use map::MapScene;
use state::StateScene;

/// Everything shown, and what is remembered to show it.
pub(crate) struct Scene {
    log: Logger,
    clock: Clock,
    camera: CameraScene,
    map: MapScene,
    state: StateScene,
}

impl Scene {
    pub(crate) fn new(stream: RecordingStream, config: &RecorderConfig) -> Self {
        let log = Logger { stream };
        let image_interval = Duration::from_secs_f64(1.0 / config.image_rate_hz_max.clamp(0.1, 1000.0));
        Self {
            camera: CameraScene::new(&log, image_interval, config.jpeg_quality),
            map: MapScene::new(&log, image_interval, config.robot_radius_m),
            state: StateScene::new(&log),
            log,
            clock: Clock::default(),
        }
    }

    /// Puts what comes before the first stamp to the beginning of the timelines. To be called in the thread that shows:
    /// the SDK keeps its time per thread, and what is logged without one holds for all times and hides what follows.
    pub(crate) fn begin(&mut self) {
        self.clock.set(&self.log, Stamp::default());
        self.state.begin(&self.log);
    }

    pub(crate) fn show(&mut self, update: Update) {
        let Self { log, clock, camera, map, state } = self;
        match update {
            Update::Frame(frame) => camera.frame(log, clock, frame),
            Update::Goal(photo) => {
                map.forget_goal(log);
                camera.goal(log, photo);
            }
            Update::Estimate(estimate) => {
                clock.set(log, estimate.stamp);
                state.estimate(log, &estimate);
                map.sighting(log, &estimate.sighting);
                camera.estimate(log, clock, &estimate);
            }
            Update::Navigation(navigation) => {
                clock.set_step(log, navigation.stamp, navigation.step);
                map.navigation(log, &navigation);
                state.navigation(log, &navigation, map.driven_m());
            }
            Update::Map(grid) => map.grid(log, &grid),
            Update::Odometry(odometry) => {
                clock.set(log, odometry.stamp);
                map.robot(log, odometry.t_odom_base.planar());
            }
            Update::Scan(scan) => {
                clock.set(log, scan.stamp);
                map.scan(log, &scan);
            }
            Update::TruthPose { stamp, pose } => {
                clock.set(log, stamp);
                map.true_robot(log, pose);
            }
            Update::TruthGoal(pose) => map.true_goal(log, pose),
            Update::ShortestPath(path) => map.shortest_path(log, &path),
            Update::Latency { name, ms } => state.latency(log, &name, ms),
            Update::Log { level, source, text } => log.line(level, &source, &text),
            Update::Verdict(markdown) => state.verdict(log, &markdown),
        }
    }
}

/// The stream, with what the SDK refuses turned into a warning: a picture that cannot be shown stops nothing.
struct Logger {
    stream: RecordingStream,
}

impl Logger {
    fn show(&self, entity: &str, what: &impl AsComponents) {
        if let Err(error) = self.stream.log(entity, what) {
            tracing::warn!(entity, %error, "not shown");
        }
    }

    /// Several archetypes of one entity.
    fn show_all(&self, entity: &str, what: &[&dyn AsComponents]) {
        for part in what {
            if let Err(error) = self.stream.log(entity, *part) {
                tracing::warn!(entity, %error, "not shown");
            }
        }
    }

    /// Holds for all times.
    fn show_always(&self, entity: &str, what: &dyn AsComponents) {
        if let Err(error) = self.stream.log_static(entity, what) {
            tracing::warn!(entity, %error, "not shown");
        }
    }

    fn markdown(&self, text: &str) {
        self.show(entities::SUMMARY, &TextDocument::from_markdown(text));
    }

    fn line(&self, level: Level, source: &str, text: &str) {
        let level = match level {
            Level::Debug => TextLogLevel::DEBUG,
            Level::Info => TextLogLevel::INFO,
            Level::Warn => TextLogLevel::WARN,
            Level::Error => TextLogLevel::ERROR,
        };
        let line = TextLog::new(format!("{source}: {text}")).with_level(level);
        self.show(&format!("{}/{source}", entities::LOG), &line);
    }
}

/// Where on the timelines the next thing belongs. `robot_time` counts from the first stamp seen, since a robot's clock may
/// begin in 1970; `step` is the planner's, and a stamp later than its last step belongs to the next one.
#[derive(Default)]
struct Clock {
    origin: Option<Stamp>,
    last_step: Option<(Stamp, u64)>,
}

impl Clock {
    fn set_step(&mut self, log: &Logger, stamp: Stamp, step: u64) {
        self.last_step = Some((stamp, step));
        self.set(log, stamp);
    }

    fn set(&mut self, log: &Logger, stamp: Stamp) {
        if stamp != Stamp::default() {
            self.origin.get_or_insert(stamp);
        }
        let since = stamp.since(self.origin.unwrap_or_default());
        let step = match self.last_step {
            Some((at, step)) if stamp > at => step + 1,
            Some((_, step)) => step,
            None => 0,
        };
        log.stream.set_time_sequence(entities::STEP, i64::try_from(step).unwrap_or(i64::MAX));
        log.stream.set_duration_secs(entities::ROBOT_TIME, since.as_secs_f64());
    }
}

/// Opens at most once per interval of wall-clock time.
struct Gate {
    interval: Duration,
    last: Option<Instant>,
}

impl Gate {
    fn new(interval: Duration) -> Self {
        Self { interval, last: None }
    }

    fn opens(&mut self) -> bool {
        let now = Instant::now();
        if self.last.is_some_and(|last| now.duration_since(last) < self.interval) {
            return false;
        }
        self.last = Some(now);
        true
    }
}

fn rgb(colour: crate::palette::Rgb) -> rerun::Color {
    rerun::Color::from_rgb(colour[0], colour[1], colour[2])
}

/// A radius in points of the screen, the same at every zoom.
fn points(radius: f32) -> rerun::Radius {
    rerun::Radius::new_ui_points(radius)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use homing_core::{GoalPhoto, Intrinsics, RgbImage};
    use rerun::log::{Chunk, LogMsg};

    use super::*;

    /// Data that holds for all times hides whatever its entity shows later: only styles and fixed places may.
    #[test]
    fn what_comes_before_the_first_stamp_has_a_time() {
        let (stream, storage) = rerun::RecordingStreamBuilder::new("test").memory().unwrap();
        let mut scene = Scene::new(stream, &RecorderConfig::default());
        let photo = GoalPhoto {
            id: 1,
            rgb: Arc::new(RgbImage::new(8, 6, vec![90; 8 * 6 * 3]).unwrap()),
            intrinsics: Intrinsics::from_hfov(8, 6, 1.5).unwrap(),
        };
        let shown = std::thread::spawn(move || {
            scene.begin();
            scene.show(Update::Goal(photo));
            scene.show(Update::Log { level: Level::Info, source: "test".to_owned(), text: "first".to_owned() });
        });
        shown.join().unwrap();
        let chunks: Vec<Chunk> =
            storage
                .take()
                .iter()
                .filter_map(|message| {
                    if let LogMsg::ArrowMsg(_, arrow) = message { Chunk::from_arrow_msg(arrow).ok() } else { None }
                })
                .collect();
        let timed = |entity: &str| {
            let path = rerun::EntityPath::from(entity);
            chunks
                .iter()
                .filter(|chunk| *chunk.entity_path() == path)
                .map(|chunk| !chunk.is_static())
                .collect::<Vec<_>>()
        };
        for entity in
            [entities::GOAL_PHOTO, entities::MATCH_LINES, entities::GOAL_ELLIPSE, entities::SUMMARY, "log/test"]
        {
            let timed = timed(entity);
            assert!(!timed.is_empty() && timed.iter().all(|t| *t), "{entity}: {timed:?}");
        }
    }
}
