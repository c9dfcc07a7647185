//! How many matches agree on a pose between frames that show different places? That is what n_th must stay above.
//! `cargo run --example unrelated -- ../shared/data/rgbd/7scenes_redkitchen ../shared/data/rgbd/o3d_livingroom1 [--every 5]`
//!
//! The first folder is 7-Scenes style, the second has image/, depth/ with f = 525, c = (319.5, 239.5). Each gives the
//! goal photos for the other's frames. With `--no-depth` the depth is taken away and the bearing is measured.

mod support;

use std::path::Path;
use std::sync::Arc;

use homing_core::{DepthImage, GoalEstimate, Intrinsics, RgbdFrame, Sighting, Stamp};
use homing_perception::{Gates, GoalEstimator, PerceptionConfig};
use support::{Fallible, NumberedFrame, files_with, read_depth, read_rgb, seven_scenes};

fn main() -> Fallible<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let value = |name: &str| arguments.iter().position(|a| a == name).and_then(|i| arguments.get(i + 1));
    let (Some(first), Some(second)) = (arguments.first(), arguments.get(1)) else {
        return Err("which two folders?".into());
    };
    let every: usize = value("--every").map_or(Ok(5), |text| text.parse())?;
    let ratio_max: f32 = value("--ratio").map_or(Ok(PerceptionConfig::default().ratio_max), |text| text.parse())?;
    let mut frames = [seven_scenes(Path::new(first))?, living_room(Path::new(second), every)?];
    frames[0] = core::mem::take(&mut frames[0]).into_iter().step_by(every).collect();
    let counted = if arguments.iter().any(|a| a == "--no-depth") { Counted::Bearings } else { Counted::Poses };
    if matches!(counted, Counted::Bearings) {
        for numbered in frames.iter_mut().flatten() {
            numbered.frame.depth = Arc::new(DepthImage::from_metres(640, 480, vec![0.0; 640 * 480])?);
        }
    }
    let gates =
        Gates { n_inliers_min: 4, inlier_share_min: 0.0, n_bearing_min: 6, bearing_share_min: 0.0, ..Gates::default() };
    let config = PerceptionConfig { gates, ratio_max, guided_rounds: 0, ..PerceptionConfig::default() };
    let mut estimator = GoalEstimator::new(config)?;
    let mut found = Vec::new();
    for (goals, queries) in [(&frames[0], &frames[1]), (&frames[1], &frames[0])] {
        for goal in goals {
            estimator.set_goal(goal.as_goal())?;
            for query in queries {
                found.push(support_of(&estimator.estimate(&query.frame)?, counted));
            }
        }
    }
    report(&mut found);
    Ok(())
}

/// Which findings are of interest.
#[derive(Copy, Clone)]
enum Counted {
    Poses,
    Bearings,
}

struct Support {
    n_matches: usize,
    n_inliers: usize,
    ms: f64,
}

fn support_of(estimate: &GoalEstimate, counted: Counted) -> Support {
    let n_inliers = match (&estimate.sighting, counted) {
        (Sighting::Pose { n_inliers, .. }, Counted::Poses) => *n_inliers,
        (Sighting::Bearing { n_inliers, .. }, Counted::Bearings) => *n_inliers,
        _ => 0,
    };
    Support { n_matches: estimate.n_matches, n_inliers, ms: estimate.times.pose.as_secs_f64() * 1e3 }
}

fn report(found: &mut [Support]) {
    let n = found.len();
    let mean = found.iter().map(|s| s.n_matches as f64).sum::<f64>() / n as f64;
    let most = found.iter().map(|s| s.n_matches).max().unwrap_or(0);
    println!("{n} pairs of unrelated frames; matches: mean {mean:.1}, most {most}");
    for bound in 4..=40 {
        let reached = found.iter().filter(|s| s.n_inliers >= bound).count();
        let shares: Vec<f64> =
            found.iter().filter(|s| s.n_inliers >= bound).map(|s| s.n_inliers as f64 / s.n_matches as f64).collect();
        println!(
            "  {bound:3} inliers or more: {reached:6} ({:.5}), largest share of the matches {:.2}",
            reached as f64 / n as f64,
            shares.into_iter().fold(0.0, f64::max)
        );
        if reached == 0 {
            break;
        }
    }
    found.sort_by(|a, b| a.ms.total_cmp(&b.ms));
    println!("  pose: p50 {:.1} ms, most {:.1} ms", found[n / 2].ms, found[n - 1].ms);
}

fn living_room(folder: &Path, every: usize) -> Fallible<Vec<NumberedFrame>> {
    let intrinsics = Intrinsics::new(640, 480, 525.0, 525.0, 319.5, 239.5)?;
    let (images, depths) = (files_with(&folder.join("image"), ".")?, files_with(&folder.join("depth"), ".")?);
    let mut frames = Vec::new();
    for (number, (image, depth)) in images.iter().zip(&depths).enumerate().step_by(every) {
        let (rgb, depth) = (Arc::new(read_rgb(image)?), Arc::new(read_depth(depth)?));
        let number = number as u64;
        let frame = RgbdFrame::new(Stamp(number), rgb, depth, intrinsics)?;
        frames.push(NumberedFrame { number, frame });
    }
    Ok(frames)
}
