//! Accuracy of the goal pose on pairs of real RGB-D frames:
//! `cargo run --example rgbd_pairs -- ../shared/data/rgbd/7scenes_redkitchen [--solver epnp] [--seeds 3] [--verbose]`
//!
//! A pair without a pose counts as failed.

#[path = "support/poses.rs"]
mod poses;
mod support;

use std::path::{Path, PathBuf};

use homing_core::{Sighting, StageTimes};
use homing_perception::{GoalEstimator, PerceptionConfig, PoseSolver};
use poses::t_world_camera;
use support::{Fallible, NumberedFrame, seven_scenes};

struct Outcome {
    position_m: f64,
    angle_deg: f64,
    n_inliers: usize,
    n_matches: usize,
    /// Squared normalised error, 6 degrees of freedom.
    nees: f64,
    times: StageTimes,
}

fn main() -> Fallible<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let value = |name: &str| arguments.iter().position(|a| a == name).and_then(|i| arguments.get(i + 1));
    let folder = PathBuf::from(arguments.first().ok_or("which folder?")?);
    let mut config = PerceptionConfig::default();
    if value("--solver").is_some_and(|s| s == "epnp") {
        config.solver = PoseSolver::EpnpRansac;
    }
    let set = |name: &str, into: &mut f64| -> Fallible<()> {
        if let Some(text) = value(name) {
            *into = text.parse()?;
        }
        Ok(())
    };
    let (mut n, mut ratio, mut n_min) =
        (config.sift.keypoints_max as f64, f64::from(config.ratio_max), config.gates.n_inliers_min as f64);
    set("--keypoints", &mut n)?;
    set("--ratio", &mut ratio)?;
    set("--n-min", &mut n_min)?;
    set("--contrast", &mut config.sift.contrast_min)?;
    set("--gate", &mut config.gates.error_rad_max)?;
    set("--share", &mut config.gates.inlier_share_min)?;
    set("--patches", &mut config.gates.patch_share_min)?;
    set("--sd-px", &mut config.keypoint_sd_px)?;
    (config.sift.keypoints_max, config.ratio_max, config.gates.n_inliers_min) =
        (n as usize, ratio as f32, n_min as usize);
    let frames = seven_scenes(&folder)?;
    let mut seeds = 1.0;
    set("--seeds", &mut seeds)?;
    for gap in [50, 100] {
        let mut outcomes = Vec::new();
        for seed in 0..seeds as u64 {
            outcomes.extend(pairs(&folder, &frames, gap, PerceptionConfig { seed, ..config })?);
        }
        if arguments.iter().any(|a| a == "--verbose") {
            for (number, outcome) in &outcomes {
                match outcome {
                    Some(o) => println!(
                        "  {number:6}: {:.3} m {:5.2} deg, {} of {} matches, nees {:.0}",
                        o.position_m, o.angle_deg, o.n_inliers, o.n_matches, o.nees
                    ),
                    None => println!("  {number:6}: not seen"),
                }
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
) -> Fallible<Vec<(u64, Option<Outcome>)>> {
    let mut estimator = GoalEstimator::new(config)?;
    let mut outcomes = Vec::new();
    for query in frames {
        let Some(goal) = frames.iter().find(|f| f.number == query.number + gap) else { continue };
        estimator.set_goal(goal.as_goal())?;
        let estimate = estimator.estimate(&query.frame)?;
        let truth = t_world_camera(folder, query.number)?.inverse() * t_world_camera(folder, goal.number)?;
        let outcome = match estimate.sighting {
            Sighting::Pose { t_camera_goal, covariance, n_inliers, .. } => {
                let found = t_camera_goal.isometry();
                let offset = found.translation.vector - truth.translation.vector;
                let turn = (found.rotation * truth.rotation.inverse()).scaled_axis();
                let error = nalgebra::Vector6::new(offset.x, offset.y, offset.z, turn.x, turn.y, turn.z);
                let nees = covariance.cholesky().map_or(f64::NAN, |c| error.dot(&c.solve(&error)));
                Some(Outcome {
                    position_m: offset.norm(),
                    angle_deg: turn.norm().to_degrees(),
                    n_inliers,
                    n_matches: estimate.n_matches,
                    nees,
                    times: estimate.times,
                })
            }
            _ => None,
        };
        outcomes.push((query.number, outcome));
    }
    Ok(outcomes)
}

fn report(gap: u64, outcomes: &[Option<Outcome>]) {
    let n = outcomes.len() as f64;
    let found: Vec<&Outcome> = outcomes.iter().flatten().collect();
    let share = |deg: f64, m: f64| found.iter().filter(|o| o.angle_deg <= deg && o.position_m <= m).count() as f64 / n;
    let sorted = |value: &dyn Fn(&Outcome) -> f64| {
        let mut values: Vec<f64> = found.iter().map(|o| value(o)).collect();
        values.sort_by(f64::total_cmp);
        values
    };
    println!(
        "{gap} apart, {n} pairs: {:.3} within 10 deg / 0.25 m, {:.3} within 5 deg / 0.1 m, {:.3} with a pose, {:.3} wrong (over 1 m or 30 deg)",
        share(10.0, 0.25),
        share(5.0, 0.1),
        found.len() as f64 / n,
        found.iter().filter(|o| o.angle_deg > 30.0 || o.position_m > 1.0).count() as f64 / n
    );
    let (position, angle, inliers) =
        (sorted(&|o| o.position_m), sorted(&|o| o.angle_deg), sorted(&|o| o.n_inliers as f64));
    println!(
        "  medians: {:.3} m, {:.2} deg, {} inliers; nees {:.0}",
        quantile(&position, 0.5),
        quantile(&angle, 0.5),
        quantile(&inliers, 0.5),
        quantile(&sorted(&|o| o.nees), 0.5)
    );
    let stage = |name: &str, of: &dyn Fn(&StageTimes) -> core::time::Duration| {
        let ms = sorted(&|o| of(&o.times).as_secs_f64() * 1e3);
        println!("  {name}: p50 {:.1} ms, p90 {:.1} ms", quantile(&ms, 0.5), quantile(&ms, 0.9));
    };
    stage("extract", &|t| t.extract);
    stage("match", &|t| t.matching);
    stage("pose", &|t| t.pose);
    stage("total", &|t| t.extract + t.matching + t.pose);
}

/// The value below which `share` of the sorted values lie.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    if sorted.is_empty() { f64::NAN } else { sorted[((sorted.len() - 1) as f64 * share).round() as usize] }
}
