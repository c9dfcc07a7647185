//! Sends a photo to a planner and shows how it goes.

use std::time::Duration;

use homing_core::Mode;
use homing_protocol::Session;
use homing_protocol::convert::EncodedPhoto;
use homing_protocol::navigate::{MissionReport, NavigateClient, Progress};
use indicatif::{ProgressBar, ProgressStyle};

/// Longest mission, wall clock.
const MISSION_MAX: Duration = Duration::from_secs(3600);

/// What ended the watching.
pub enum Watched {
    /// The planner's report.
    Ended(MissionReport),
    /// Ctrl-C: the mission was cancelled, and the robot told to stand.
    Interrupted,
    /// Ctrl-C, but the planner did not confirm: the robot may still be driving.
    Unconfirmed,
}

/// A bar for people; nothing on a pipe.
pub fn bar() -> ProgressBar {
    let style = ProgressStyle::with_template("{spinner} step {pos:>3}  {elapsed_precise}  {wide_msg}");
    ProgressBar::new_spinner().with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
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
    let interrupt = homing_protocol::process::termination()?;
    tokio::pin!(interrupt);
    let end = goal.result(MISSION_MAX);
    tokio::pin!(end);
    loop {
        tokio::select! {
            report = &mut end => return Ok(Watched::Ended(report?)),
            () = &mut interrupt => {
                bar.set_message("stopping the robot");
                let asked = tokio::time::timeout(Duration::from_secs(3), goal.cancel()).await;
                if !matches!(asked, Ok(Ok(()))) {
                    return Ok(Watched::Unconfirmed);
                }
                // Cancelled means that the planner has told the body to stand.
                return Ok(match tokio::time::timeout(Duration::from_secs(3), &mut end).await {
                    Ok(Ok(_)) => Watched::Interrupted,
                    _ => Watched::Unconfirmed,
                });
            }
            news = goal.progress() => match news {
                Some(progress) => {
                    bar.set_position(progress.step);
                    bar.set_message(words(&progress));
                }
                // No more news; the result is still to come.
                None => tokio::time::sleep(Duration::from_millis(200)).await,
            },
            () = tokio::time::sleep(Duration::from_millis(200)) => {}
        }
        each()?;
    }
}

fn words(progress: &Progress) -> String {
    match (progress.mode, progress.goal_distance_m) {
        (Mode::Exploit, Some(metres)) => format!("goal seen {metres:.1} m away: {}", progress.reason),
        _ => progress.reason.clone(),
    }
}
