//! How long a frame takes to become a goal estimate, everything running.

use std::collections::VecDeque;

use homing_core::{Sighting, Stamp, UnseenReason};
use homing_protocol::convert::ToDomain;
use homing_protocol::interfaces::{homing_msgs, sensor_msgs};
use homing_protocol::{Session, Subscription, topics};
use serde::Serialize;

/// Frames remembered while their estimates are on the way.
const FRAMES_MAX: usize = 64;

/// Medians over an episode, milliseconds.
#[derive(Clone, Debug, Serialize)]
pub struct LatencyMs {
    pub n_frames: usize,
    /// From just before the images were sent to the arrival of the estimate, here.
    pub frame_to_estimate: f64,
    pub extract: f64,
    pub matching: f64,
    pub pose: f64,
    /// What is left: two images out, decoding, one estimate back.
    pub transport: f64,
}

/// Compares when a frame's intrinsics were sent (just before its images) with when its estimate arrived. Both by this
/// host's clock.
pub struct Stopwatch {
    infos: Subscription<sensor_msgs::CameraInfo>,
    estimates: Subscription<homing_msgs::GoalEstimate>,
    sent: VecDeque<(Stamp, i64)>,
    rows: Vec<[f64; 5]>,
}

impl Stopwatch {
    pub fn open(session: &Session) -> anyhow::Result<Self> {
        Ok(Self {
            infos: session.subscribe(&topics::CAMERA_INFO, 64)?,
            estimates: session.subscribe(&topics::GOAL_ESTIMATE, 64)?,
            sent: VecDeque::with_capacity(FRAMES_MAX),
            rows: Vec::new(),
        })
    }

    /// Takes in what arrived. Malformed messages are somebody else's to report.
    pub fn listen(&mut self) {
        while let Some(received) = self.infos.try_recv() {
            let Ok(received) = received else { continue };
            let (Ok(info), Some(at)) = (received.message.to_domain(), received.sent_unix_ns) else { continue };
            // A frame that is sent again counts from its first sending.
            if self.sent.back().is_none_or(|(stamp, _)| *stamp != info.stamp) {
                if self.sent.len() == FRAMES_MAX {
                    self.sent.pop_front();
                }
                self.sent.push_back((info.stamp, at));
            }
        }
        while let Some(received) = self.estimates.try_recv() {
            let Ok(received) = received else { continue };
            let Ok(estimate) = received.message.to_domain() else { continue };
            let no_goal = matches!(estimate.sighting, Sighting::NotSeen { reason: UnseenReason::NoGoal });
            let Some(place) = self.sent.iter().position(|(stamp, _)| *stamp == estimate.stamp) else { continue };
            let Some((_, sent)) = self.sent.remove(place) else { continue };
            if no_goal {
                continue;
            }
            let whole = received.arrived_unix_ns.saturating_sub(sent) as f64 * 1e-6;
            let t = &estimate.times;
            let stages = [t.extract, t.matching, t.pose].map(|d| d.as_secs_f64() * 1e3);
            self.rows.push([whole, stages[0], stages[1], stages[2], whole - stages.iter().sum::<f64>()]);
        }
    }

    /// Medians, if anything was measured.
    pub fn p50(&self) -> Option<LatencyMs> {
        let median = |column: usize| {
            let mut values: Vec<f64> = self.rows.iter().map(|row| row[column]).collect();
            values.sort_by(f64::total_cmp);
            values.get(values.len() / 2).copied()
        };
        Some(LatencyMs {
            n_frames: self.rows.len(),
            frame_to_estimate: median(0)?,
            extract: median(1)?,
            matching: median(2)?,
            pose: median(3)?,
            transport: median(4)?,
        })
    }
}
