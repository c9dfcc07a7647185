//! The process's TOML file.

use std::path::PathBuf;

use homing_protocol::process::SessionSettings;
use serde::Deserialize;

/// `robot.toml`.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Config {
    /// Network: the body listens.
    #[serde(default)]
    pub session: SessionSettings,
    /// Folder of the recording to play.
    pub recording: PathBuf,
    /// Calibration of colour and depth camera, where depth is not registered to the colour: it will be.
    #[serde(default)]
    pub rig: Option<PathBuf>,
    /// Frames to play, by their numbers in the recording; empty means all.
    #[serde(default)]
    pub frames: Vec<u32>,
    /// Which answer closes a frame.
    #[serde(default)]
    pub answers: Answers,
}

/// Which of perception's answers a frame waits for.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Answers {
    /// About any goal.
    #[default]
    AnyGoal,
    /// Every frame has a goal of its own, counted from 1: the n-th stays until it is answered about a goal after n.
    GoalPerFrame,
}
