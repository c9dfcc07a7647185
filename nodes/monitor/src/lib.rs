//! What people look at: a running episode in a viewer, and the recording of one that is over.
//!
//! [`Recorder`] takes [`Update`]s from a control loop and never delays it: an update goes into a bounded queue, a thread
//! of its own turns it into pictures, and each sink (a file, a server for viewers) has a bounded queue and a thread again.
//! Whatever does not keep up loses updates, and says how many ([`Status`]).
//!
//! [`episode_picture`] draws one still of a finished episode; it needs no recorder.
//!
//! Everything shown lies in the odometry frame (`odom`, REP-105), lengths in metres. Ground truth is drawn only where the
//! caller hands it over, always in a colour of its own.
#![cfg_attr(test, expect(clippy::unwrap_used, reason = "a test fails by panicking"))]

mod blueprint;
mod canvas;
mod encode;
mod entities;
mod glyphs;
mod lane;
mod palette;
mod picture;
mod queue;
mod recorder;
mod scene;
mod update;

pub use picture::{EpisodePicture, PictureError, episode_picture, write_png};
pub use queue::Kind;
pub use recorder::{Recorder, RecorderConfig, RecorderError, SinkStatus, Status};
pub use update::{Level, Update};
