//! What people and programs are told at the end.

use std::path::PathBuf;

use homing_protocol::navigate::{MissionReport, Outcome};
use homing_sim::Score;
use serde::Serialize;

use crate::latency::LatencyMs;
use crate::run_folder::shown;

/// The end of an episode. Keys that nobody can know (a photo of the user's own has no true pose) are null.
#[derive(Clone, Debug, Serialize)]
pub struct Verdict {
    /// By the strict score; by the planner's own word where there is no truth.
    pub success: bool,
    pub steps: u64,
    pub path_length_m: f64,
    pub shortest_path_m: Option<f64>,
    pub spl: Option<f64>,
    pub final_distance_m: Option<f64>,
    pub final_heading_error_deg: Option<f64>,
    /// The planner's own judgement: `arrived`, `failed` or `cancelled`.
    pub planner: &'static str,
    /// And its last words.
    pub reason: String,
    pub scene: String,
    pub seed: u64,
    pub policy: &'static str,
    /// From frame to goal estimate, medians over the episode.
    pub latency_ms_p50: Option<LatencyMs>,
    pub recording: PathBuf,
    pub picture: PathBuf,
}

pub fn outcome_name(outcome: &Outcome) -> &'static str {
    match outcome {
        Outcome::Arrived => "arrived",
        Outcome::Failed => "failed",
        Outcome::Cancelled => "cancelled",
    }
}

impl Verdict {
    /// One line: what happened.
    pub fn title(&self) -> String {
        match (self.success, self.planner, self.final_distance_m) {
            (true, _, Some(_)) => "Goal reached".to_owned(),
            (true, ..) => "The planner says that it has reached the goal".to_owned(),
            (false, "arrived", Some(metres)) => format!("Stopped in the wrong place, {metres:.1} m from the goal"),
            _ => format!("Goal not reached: {}", self.reason),
        }
    }

    /// Names and values, for the terminal, the recording and the picture.
    pub fn facts(&self) -> Vec<(&'static str, String)> {
        let mut facts = vec![("steps", self.steps.to_string()), ("driven", format!("{:.2} m", self.path_length_m))];
        if let Some(m) = self.shortest_path_m {
            facts.push(("shortest path", format!("{m:.2} m")));
        }
        if let Some(spl) = self.spl {
            facts.push(("SPL", format!("{spl:.2}")));
        }
        if let Some(m) = self.final_distance_m {
            facts.push(("final distance", format!("{m:.2} m")));
        }
        if let Some(deg) = self.final_heading_error_deg {
            facts.push(("final heading error", format!("{deg:.1} deg")));
        }
        facts
    }

    /// For the terminal.
    pub fn print(&self, result: &std::path::Path) {
        println!("\n{}", self.title());
        for (name, value) in self.facts() {
            println!("  {name:<20} {value}");
        }
        if let Some(ms) = &self.latency_ms_p50 {
            println!();
            println!(
                "  frame to estimate    {:.0} ms (medians over {} estimates): extract {:.0}, match {:.0}, pose {:.0}, on the way {:.0}",
                ms.frame_to_estimate, ms.n_frames, ms.extract, ms.matching, ms.pose, ms.transport
            );
        }
        println!();
        println!("  picture              {}", shown(&self.picture));
        println!("  recording            {}", shown(&self.recording));
        println!("                       look at it: .venv/bin/rerun {}", shown(&self.recording));
        println!("  result as JSON       {}", shown(result));
    }

    /// What the planner said, with or without a score.
    pub fn new(report: &MissionReport, score: Option<&Score>, latency_ms_p50: Option<LatencyMs>, about: About) -> Self {
        Self {
            success: score.map_or(report.outcome == Outcome::Arrived, |s| s.success),
            steps: score.map_or(report.steps, |s| s.steps),
            path_length_m: score.map_or(report.path_length_m, |s| s.path_length_m),
            shortest_path_m: score.map(|s| s.shortest_path_m),
            spl: score.map(|s| s.spl),
            final_distance_m: score.map(|s| s.final_distance_m),
            final_heading_error_deg: score.map(|s| s.final_heading_error_deg),
            planner: outcome_name(&report.outcome),
            reason: report.message.clone(),
            scene: about.scene,
            seed: about.seed,
            policy: about.policy,
            latency_ms_p50,
            recording: about.recording,
            picture: about.picture,
        }
    }
}

/// What a verdict is about.
pub struct About {
    pub scene: String,
    pub seed: u64,
    pub policy: &'static str,
    pub recording: PathBuf,
    pub picture: PathBuf,
}
