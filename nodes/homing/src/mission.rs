//! Sends a photo to a planner and shows how it goes.

use std::time::Duration;

use homing_core::Mode;
use homing_protocol::Session;
use homing_protocol::convert::EncodedPhoto;
use homing_protocol::navigate::{MissionReport, NavigateClient, NavigateError, Progress};
use indicatif::{ProgressBar, ProgressStyle};

/// Longest mission, wall clock.
const MISSION_MAX: Duration = Duration::from_secs(3600);

/// What ended the watching.
pub enum Watched {
    /// The planner's report.
    Ended(MissionReport),
    /// Ctrl-C: the mission was cancelled and the robot stands.
    Interrupted,
}

/// A bar for people; nothing on a pipe.
pub fn bar(steps: u64) -> ProgressBar {
    let style = ProgressStyle::with_template("{spinner} step {pos:>3} of at most {len}  [{elapsed}]  {wide_msg}");
    ProgressBar::new(steps).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}

/// Sends the photo and watches until the mission ends. `each` is called between news, at least every 200 ms; an error from
/// it ends the watching.
pub async fn drive(
    session: &Session,
    photo: &EncodedPhoto,
    bar: &ProgressBar,
    mut each: impl FnMut() -> anyhow::Result<()>,
) -> anyhow::Result<Watched> {
    let client = NavigateClient::connect(session, Duration::from_secs(20)).await?;
    let mut goal = client.send(photo).await?;
    let interrupt = tokio::signal::ctrl_c();
    tokio::pin!(interrupt);
    loop {
        tokio::select! {
            _ = &mut interrupt => {
                bar.set_message("stopping the robot");
                // The planner stops the body first, then answers.
                let cancelled = tokio::time::timeout(Duration::from_secs(3), goal.cancel()).await;
                if !matches!(cancelled, Ok(Ok(()))) {
                    tracing::warn!("the planner did not confirm; the body stops by itself when commands cease");
                }
                return Ok(Watched::Interrupted);
            }
            news = goal.progress() => match news {
                Some(progress) => {
                    bar.set_position(progress.step);
                    bar.set_message(words(&progress));
                    if matches!(progress.mode, Mode::Arrived | Mode::Failed) {
                        break;
                    }
                }
                None => break,
            },
            () = tokio::time::sleep(Duration::from_millis(200)) => {}
        }
        each()?;
    }
    let report = tokio::time::timeout(MISSION_MAX, goal.result(MISSION_MAX))
        .await
        .map_err(|_| NavigateError::Transport("no result".to_owned()))??;
    Ok(Watched::Ended(report))
}

fn words(progress: &Progress) -> String {
    let phase = match progress.mode {
        Mode::Idle => "waiting",
        Mode::Explore => "exploring",
        Mode::Exploit => "driving to the goal",
        Mode::Align => "turning to the photo's view",
        Mode::Arrived => "arrived",
        Mode::Failed => "given up",
    };
    match progress.goal_distance_m {
        Some(metres) => format!("{phase}, goal {metres:.1} m away: {}", progress.reason),
        None => format!("{phase}: {}", progress.reason),
    }
}
