//! `proof N_FLATS [EXTRACTOR MATCHER]`: what the proof by view synthesis keeps and what it refuses, by its settings, on
//! validation flats, with depth as the simulator gives it and with depth that is not registered to the colour.

use std::path::Path;

use homing_benchmark::perception::{
    Finding, MeasureOptions, Measured, PairSource, Setup, SimulatedPairs, Unregistered, measure,
};
use homing_perception::PerceptionConfig;
use homing_perception::onnx::FeatureChoice;
use homing_sim::views::{Cameras, ViewSpec};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [n, features @ ..] = arguments.as_slice() else { return Err("proof N_FLATS [EXTRACTOR MATCHER]".into()) };
    let choice = match features {
        [extractor, matcher] => FeatureChoice::listed(extractor, Some(matcher), Path::new("nodes/perception/models"))?,
        _ => FeatureChoice::default(),
    };
    let mut setups = Vec::new();
    for share in [0.0, 0.2, 0.3, 0.4, 0.5, 0.6] {
        let mut perception = PerceptionConfig::default();
        perception.gates.patch_share_min = share;
        if share == 0.0 {
            perception.gates.n_patches_min = 0;
        }
        setups.push(Setup { name: format!("patch_share_min {share}"), features: choice.clone(), perception });
    }
    let pairs = SimulatedPairs {
        seeds: 200_000..200_000 + n.parse::<u64>()?,
        spec: ViewSpec::of_robot(12),
        cameras: Cameras::Drawn,
    };
    show("registered", &pairs, &setups)?;
    show("unregistered", &Unregistered(pairs), &setups)?;
    Ok(())
}

fn show(name: &str, source: &dyn PairSource, setups: &[Setup]) -> Result<(), Box<dyn std::error::Error>> {
    let options = MeasureOptions { threads: 0, n_decided: None };
    let Measured { pairs, findings } = measure(source, setups, &options, &|_| eprint!("."))?;
    println!("\n{name}: {} pairs", pairs.len());
    println!("right: within 0.25 m and 10 deg; wrong: off by more than 1 m or 30 deg; by number of inliers");
    for (setup, findings) in setups.iter().zip(&findings) {
        let n_seen = pairs.iter().filter(|facts| facts.overlap >= 0.1).count();
        let (mut right, mut wrong) = ([0; 3], [0; 3]);
        for finding in findings {
            let Finding::Pose(pose) = finding else { continue };
            let off = pose.error.map_or((f64::INFINITY, 180.0), |e| (e.position_m, e.rotation_deg));
            let class = usize::from(pose.n_inliers >= 15) + usize::from(pose.n_inliers >= 30);
            right[class] += usize::from(off.0 <= 0.25 && off.1 <= 10.0);
            wrong[class] += usize::from(off.0 > 1.0 || off.1 > 30.0);
        }
        let share = right.iter().sum::<usize>() as f64 / n_seen.max(1) as f64;
        println!(
            "{:22} right {share:.3} of {n_seen} seen; below 15: {} right, {} wrong; below 30: {}, {}; more: {}, {}",
            setup.name, right[0], wrong[0], right[1], wrong[1], right[2], wrong[2]
        );
    }
    Ok(())
}
