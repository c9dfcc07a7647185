//! Accuracy of the goal pose on pairs of real RGB-D frames, with any features:
//! `cargo run --example rgbd_pairs -- ../shared/data/rgbd/7scenes_redkitchen --extractor
//! xfeat=../shared/data/weights/xfeatc_480x640.onnx --matcher lighterglue=../shared/data/weights/lighterglue_L3.onnx`
//!
//! A pair without a pose counts as failed. `--gaps 50,100`, `--solver epnp`, `--gate RAD`, `--share S`, `--n-min N`,
//! `--patches S` and `--sd-px PX` change the pipeline; `--verbose` prints every pair.

#[path = "support/features.rs"]
mod features;
#[path = "support/poses.rs"]
mod poses;
mod support;

use std::path::{Path, PathBuf};
use std::time::Duration;

use homing_core::{Features, Sighting, StageTimes};
use homing_perception::onnx::FeatureChoice;
use homing_perception::{AnyEstimator, PerceptionConfig, PoseSolver};
use poses::t_world_camera;
use support::{Fallible, NumberedFrame, seven_scenes};

struct Outcome {
    /// Position (m) and angle (degrees) off, if there is a pose.
    off: Option<(f64, f64)>,
    n_matches: usize,
    n_inliers: usize,
    times: StageTimes,
}

fn main() -> Fallible<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let Some(folder) = arguments.first().map(PathBuf::from) else { return Err(features::USAGE.into()) };
    let (choice, mut config) = features::from_arguments(&arguments)?;
    let value = |name: &str| arguments.iter().position(|a| a == name).and_then(|i| arguments.get(i + 1));
    let set = |name: &str, into: &mut f64| -> Fallible<()> {
        if let Some(text) = value(name) {
            *into = text.parse()?;
        }
        Ok(())
    };
    set("--gate", &mut config.gates.error_rad_max)?;
    set("--share", &mut config.gates.inlier_share_min)?;
    set("--patches", &mut config.gates.patch_share_min)?;
    set("--sd-px", &mut config.keypoint_sd_px)?;
    let mut n_min = config.gates.n_inliers_min as f64;
    set("--n-min", &mut n_min)?;
    config.gates.n_inliers_min = n_min as usize;
    if value("--solver").is_some_and(|name| name == "epnp") {
        config.solver = PoseSolver::EpnpRansac;
    }
    let frames = seven_scenes(&folder)?;
    println!("{} + {}", choice.extractor.name(), choice.matcher.name());
    for gap in value("--gaps").map_or("50,100", String::as_str).split(',') {
        let outcomes = pairs(&folder, &frames, gap.parse()?, config, &choice)?;
        if arguments.iter().any(|a| a == "--verbose") {
            for (number, o) in &outcomes {
                println!("  {number}: {:?}, {} of {} matches", o.off, o.n_inliers, o.n_matches);
            }
        }
        report(gap, &outcomes.into_iter().map(|(_, o)| o).collect::<Vec<_>>());
    }
    Ok(())
}

/// One outcome per pair of frames `gap` original frames apart.
fn pairs(
    folder: &Path,
    frames: &[NumberedFrame],
    gap: u64,
    config: PerceptionConfig,
    choice: &FeatureChoice,
) -> Fallible<Vec<(u64, Outcome)>> {
    let mut estimator = AnyEstimator::open(config, choice)?;
    let mut outcomes = Vec::new();
    for query in frames {
        let Some(goal) = frames.iter().find(|f| f.number == query.number + gap) else { continue };
        estimator.set_goal(goal.as_goal())?;
        let estimate = estimator.estimate(&query.frame)?;
        let truth = t_world_camera(folder, query.number)?.inverse() * t_world_camera(folder, goal.number)?;
        let (off, n_inliers) = match estimate.sighting {
            Sighting::Pose { t_camera_goal, n_inliers, .. } => {
                let found = t_camera_goal.isometry();
                let shift = (found.translation.vector - truth.translation.vector).norm();
                (Some((shift, found.rotation.angle_to(&truth.rotation).to_degrees())), n_inliers)
            }
            _ => (None, 0),
        };
        let outcome = Outcome { off, n_matches: estimate.n_matches, n_inliers, times: estimate.times };
        outcomes.push((query.number, outcome));
    }
    let keypoints = |f: &Features| f.keypoints.len();
    println!("  {} keypoints in the last photo", estimator.goal_features().map_or(0, keypoints));
    Ok(outcomes)
}

fn report(gap: &str, outcomes: &[Outcome]) {
    let n = outcomes.len() as f64;
    let share = |m: f64, deg: f64| {
        outcomes.iter().filter(|o| o.off.is_some_and(|(p, a)| p <= m && a <= deg)).count() as f64 / n
    };
    let found = outcomes.iter().filter(|o| o.off.is_some()).count() as f64 / n;
    let wrong = outcomes.iter().filter(|o| o.off.is_some_and(|(p, a)| p > 1.0 || a > 30.0)).count();
    println!(
        "{gap} apart, {n} pairs: {:.3} within 10 deg / 0.25 m, {:.3} within 5 deg / 0.1 m, {found:.3} with a pose, {wrong} wrong (over 1 m or 30 deg)",
        share(0.25, 10.0),
        share(0.1, 5.0),
    );
    let median = |value: &dyn Fn(&Outcome) -> Option<f64>| {
        let mut values: Vec<f64> = outcomes.iter().filter_map(value).collect();
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
    };
    println!(
        "  medians: {:.3} m, {:.2} deg, {} inliers of {} matches",
        median(&|o| o.off.map(|(m, _)| m)),
        median(&|o| o.off.map(|(_, deg)| deg)),
        median(&|o| o.off.map(|_| o.n_inliers as f64)),
        median(&|o| Some(o.n_matches as f64)),
    );
    let ms = |of: &dyn Fn(&StageTimes) -> Duration| median(&|o| Some(of(&o.times).as_secs_f64() * 1e3));
    println!(
        "  p50: extract {:.1} ms, match {:.1} ms, pose {:.1} ms",
        ms(&|t| t.extract),
        ms(&|t| t.matching),
        ms(&|t| t.pose)
    );
}
