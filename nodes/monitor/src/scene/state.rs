//! What the robot does and how fast: the mode over time, plots, the running summary and the verdict.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use homing_core::{Action, GoalEstimate, Mode, NavigationState, Sighting, UnseenReason};
use rerun::components::MarkerShape;
use rerun::{Scalars, SeriesLines, SeriesPoints};

use super::{Logger, rgb};
use crate::entities;
use crate::palette::{Rgb, dark};

/// Line colours of the latency plot, in the order in which names turn up.
const SERIES: [Rgb; 6] = [dark::ESTIMATED, dark::PLANNED, dark::GOAL, dark::TRUE, dark::FRONTIER, dark::SCAN];

/// More names than this are not plotted: a name is meant to be one of a few.
const SERIES_MAX: usize = 24;

#[derive(Default)]
pub(super) struct StateScene {
    latencies: BTreeSet<String>,
    modes: Vec<&'static str>,
    sighting: String,
    over: bool,
}

impl StateScene {
    pub(super) fn new(log: &Logger) -> Self {
        for (entity, name, colour) in [
            (entities::MATCH_COUNT, "matches", dark::NEUTRAL),
            (entities::INLIER_COUNT, "verified by geometry", dark::GOAL),
        ] {
            log.show_always(entity, &series(name, colour));
        }
        Self { sighting: "nothing yet".to_owned(), ..Self::default() }
    }

    pub(super) fn begin(&self, log: &Logger) {
        log.markdown("## Waiting for the robot\nNothing has arrived yet.");
    }

    pub(super) fn estimate(&mut self, log: &Logger, estimate: &GoalEstimate) {
        let n_inliers = match &estimate.sighting {
            Sighting::NotSeen { .. } => 0,
            Sighting::Bearing { n_inliers, .. } | Sighting::Pose { n_inliers, .. } => *n_inliers,
        };
        self.sighting = describe(&estimate.sighting);
        log.show(entities::MATCH_COUNT, &Scalars::new([estimate.n_matches as f64]));
        log.show(entities::INLIER_COUNT, &Scalars::new([n_inliers as f64]));
        let times = estimate.times;
        for (name, time) in [("extract", times.extract), ("match", times.matching), ("pose", times.pose)] {
            self.latency(log, name, time.as_secs_f64() * 1e3);
        }
    }

    pub(super) fn navigation(&mut self, log: &Logger, state: &NavigationState, driven_m: f64) {
        self.mode(log, state.mode);
        if !self.over {
            log.markdown(&self.summary(state, driven_m));
        }
    }

    /// A bar per mode, made of squares: the mode in force has one at every step, the others have none.
    fn mode(&mut self, log: &Logger, mode: Mode) {
        let (name, colour, lane) = mode_style(mode);
        let entity = format!("{}/{name}", entities::MODE);
        if !self.modes.contains(&name) {
            let style = SeriesPoints::new().with_names([name]).with_colors([rgb(colour)]);
            log.show_always(&entity, &style.with_markers([MarkerShape::Square]).with_marker_sizes([5.0]));
            self.modes.push(name);
        }
        log.show(&entity, &Scalars::new([lane]));
    }

    pub(super) fn latency(&mut self, log: &Logger, name: &str, ms: f64) {
        let entity = format!("{}/{name}", entities::LATENCY);
        if !self.latencies.contains(name) {
            if self.latencies.len() == SERIES_MAX {
                return;
            }
            log.show_always(&entity, &series(name, SERIES[self.latencies.len() % SERIES.len()]));
            self.latencies.insert(name.to_owned());
        }
        log.show(&entity, &Scalars::new([ms]));
    }

    pub(super) fn verdict(&mut self, log: &Logger, markdown: &str) {
        self.over = true;
        log.markdown(markdown);
    }

    fn summary(&self, state: &NavigationState, driven_m: f64) -> String {
        let mut text = format!("## {}\n{}\n\n", heading(state.mode), state.reason);
        // Writing to a string cannot fail.
        let _ = writeln!(text, "| step | {} |\n|---|---|", state.step);
        let _ = writeln!(text, "| action | {} |", action_name(state.action));
        let _ = writeln!(text, "| driven | {driven_m:.2} m |");
        let _ = writeln!(text, "| goal in view | {} |", self.sighting);
        if let Some(goal) = &state.goal {
            let distance_m = state.pose.distance_to(goal.pose.x_m, goal.pose.y_m);
            let sd_m = (0.5 * (goal.covariance[(0, 0)] + goal.covariance[(1, 1)])).max(0.0).sqrt();
            let _ = writeln!(text, "| to the goal | {distance_m:.2} m (± {sd_m:.2} m) |");
            let _ = writeln!(text, "| estimates fused | {} |", goal.n_fused);
        }
        text
    }
}

fn series(name: &str, colour: Rgb) -> SeriesLines {
    SeriesLines::new().with_names([name]).with_colors([rgb(colour)]).with_widths([1.5])
}

fn describe(sighting: &Sighting) -> String {
    match sighting {
        Sighting::NotSeen { reason } => {
            let why = match reason {
                UnseenReason::TooFewMatches => "too few matches",
                UnseenReason::NoConsensus => "matches do not agree",
                UnseenReason::NoTexture => "no texture",
                UnseenReason::NoGoal => "no photo given",
            };
            format!("no: {why}")
        }
        Sighting::Bearing { bearing_rad, n_inliers, .. } => {
            format!("bearing {:.0}°, {n_inliers} matches agree", bearing_rad.to_degrees())
        }
        Sighting::Pose { n_inliers, .. } => format!("yes: {n_inliers} matches agree"),
    }
}

fn heading(mode: Mode) -> &'static str {
    match mode {
        Mode::Idle => "Waiting for a photo",
        Mode::Explore => "Looking for the place",
        Mode::Exploit => "Driving to the goal",
        Mode::Align => "Turning to the photo's view",
        Mode::Arrived => "Goal declared reached",
        Mode::Failed => "Given up",
    }
}

/// Name, colour and height in the plot: the further an episode is, the higher.
fn mode_style(mode: Mode) -> (&'static str, Rgb, f64) {
    match mode {
        Mode::Idle => ("idle", dark::NEUTRAL, 0.0),
        Mode::Explore => ("explore", dark::FRONTIER, 1.0),
        Mode::Exploit => ("drive to goal", dark::ESTIMATED, 2.0),
        Mode::Align => ("align", dark::PLANNED, 3.0),
        Mode::Arrived => ("arrived", dark::TRUE, 4.0),
        Mode::Failed => ("failed", dark::SCAN, 4.0),
    }
}

fn action_name(action: Action) -> &'static str {
    match action {
        Action::Forward => "forward",
        Action::TurnLeft => "turn left",
        Action::TurnRight => "turn right",
        Action::Face { .. } => "face the goal's way",
        Action::Stop => "stop",
        Action::Hold => "hold",
    }
}
