//! What the robot does and how fast: state lanes, plots, the running summary and the verdict.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use homing_core::{Action, GoalEstimate, Mode, NavigationState, Sighting, UnseenReason};
use rerun::{Scalars, SeriesLines, StateChange, StateConfiguration};

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
    sighting: String,
    over: bool,
}

impl StateScene {
    pub(super) fn new(log: &Logger) -> Self {
        let lane = |entity: &str, states: &[(&str, Rgb)]| {
            let style = StateConfiguration::new()
                .with_values(states.iter().map(|(name, _)| *name))
                .with_colors(states.iter().map(|(_, colour)| rgb(*colour)));
            log.show_always(entity, &style);
        };
        let modes = [Mode::Idle, Mode::Explore, Mode::Exploit, Mode::Align, Mode::Arrived, Mode::Failed];
        lane(entities::MODE, &modes.map(mode_style));
        let (none, bearing, pose) = (dark::NEUTRAL, dark::PLANNED, dark::GOAL);
        lane(entities::SIGHTING, &[("not seen", none), ("bearing", bearing), ("pose", pose)]);
        let actions = [Action::Forward, Action::TurnLeft, Action::TurnRight, Action::Stop, Action::Hold];
        lane(entities::ACTION, &actions.map(action_style));
        for (entity, name, colour) in [
            (entities::MATCH_COUNT, "matches", dark::NEUTRAL),
            (entities::INLIER_COUNT, "verified by geometry", dark::GOAL),
        ] {
            log.show_always(entity, &series(name, colour));
        }
        log.markdown("## Waiting for the robot\nNothing has arrived yet.");
        Self { sighting: "nothing yet".to_owned(), ..Self::default() }
    }

    pub(super) fn estimate(&mut self, log: &Logger, estimate: &GoalEstimate) {
        let (lane, n_inliers) = match &estimate.sighting {
            Sighting::NotSeen { .. } => ("not seen", 0),
            Sighting::Bearing { n_inliers, .. } => ("bearing", *n_inliers),
            Sighting::Pose { n_inliers, .. } => ("pose", *n_inliers),
        };
        self.sighting = describe(&estimate.sighting);
        log.show(entities::SIGHTING, &StateChange::single(lane));
        log.show(entities::MATCH_COUNT, &Scalars::new([estimate.n_matches as f64]));
        log.show(entities::INLIER_COUNT, &Scalars::new([n_inliers as f64]));
        let times = estimate.times;
        for (name, time) in [("extract", times.extract), ("match", times.matching), ("pose", times.pose)] {
            self.latency(log, name, time.as_secs_f64() * 1e3);
        }
    }

    pub(super) fn navigation(&mut self, log: &Logger, state: &NavigationState, driven_m: f64) {
        log.show(entities::MODE, &StateChange::single(mode_style(state.mode).0));
        log.show(entities::ACTION, &StateChange::single(action_style(state.action).0));
        if !self.over {
            log.markdown(&self.summary(state, driven_m));
        }
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
        let mut text = format!("## {}\n{}\n\n| | |\n|---|---|\n", heading(state.mode), state.reason);
        // Writing to a string cannot fail.
        let _ = writeln!(text, "| step | {} |", state.step);
        let _ = writeln!(text, "| action | {} |", action_style(state.action).0);
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

fn mode_style(mode: Mode) -> (&'static str, Rgb) {
    match mode {
        Mode::Idle => ("idle", dark::NEUTRAL),
        Mode::Explore => ("explore", dark::FRONTIER),
        Mode::Exploit => ("drive to goal", dark::ESTIMATED),
        Mode::Align => ("align", dark::PLANNED),
        Mode::Arrived => ("arrived", dark::TRUE),
        Mode::Failed => ("failed", dark::SCAN),
    }
}

fn action_style(action: Action) -> (&'static str, Rgb) {
    match action {
        Action::Forward => ("forward", dark::ESTIMATED),
        Action::TurnLeft => ("turn left", dark::PLANNED),
        Action::TurnRight => ("turn right", dark::TARGET),
        Action::Stop => ("stop", dark::TRUE),
        Action::Hold => ("hold", dark::NEUTRAL),
    }
}
