//! Our single-frame estimate and our way into ONNX Runtime, for `tests/interop/perception_peers.py` to time beside its peers:
//! `cargo run --example perception_peers -- FOLDER [features] [--network EXTRACTOR|MATCHER INPUTS]`
//!
//! Answers on standard output, a line for a line of standard input, so that the peers can take turns:
//! `pair QUERY GOAL` (numbers of frames): milliseconds of extract, match and pose, then metres and degrees off, or `-`;
//! `network`: milliseconds of one run of the network on the inputs of the file, and the sum of all its outputs.

#[path = "support/features.rs"]
mod features;
#[path = "support/poses.rs"]
mod poses;
mod support;

use std::collections::HashMap;
use std::io::{BufRead, Write};
use std::path::{Path, PathBuf};
use std::time::Instant;

use homing_core::Sighting;
use homing_perception::AnyEstimator;
use homing_perception::onnx::network::{Data, Input, Network, Output};
use homing_perception::onnx::session::OrtNetwork;
use homing_perception::onnx::{ExtractorChoice, FeatureChoice, MatcherChoice};
use poses::t_world_camera;
use support::{Fallible, NumberedFrame, seven_scenes};

fn main() -> Fallible<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let Some(folder) = arguments.first().map(PathBuf::from) else { return Err(features::USAGE.into()) };
    let (choice, config) = features::from_arguments(&arguments)?;
    let mut estimates = Estimates {
        frames: seven_scenes(&folder)?.into_iter().map(|f| (f.number, f)).collect(),
        estimator: AnyEstimator::open(config, &choice)?,
        folder,
        goal: None,
    };
    let mut network = match arguments.iter().position(|a| a == "--network") {
        Some(i) => Some(OneNetwork::open(&choice, arguments.get(i + 1..i + 3).ok_or("which network, what inputs?")?)?),
        None => None,
    };
    println!("ready");
    for line in std::io::stdin().lock().lines() {
        let line = line?;
        let words: Vec<&str> = line.split_whitespace().collect();
        match (words.as_slice(), &mut network) {
            (["pair", query, goal], _) => println!("{}", estimates.answer(query.parse()?, goal.parse()?)?),
            (["network"], Some(network)) => println!("{}", network.answer()?),
            _ => return Err(format!("{line:?}: pair QUERY GOAL, or network").into()),
        }
        std::io::stdout().flush()?;
    }
    Ok(())
}

struct Estimates {
    frames: HashMap<u64, NumberedFrame>,
    estimator: AnyEstimator,
    folder: PathBuf,
    goal: Option<u64>,
}

impl Estimates {
    /// The photo's features are found once per photo, and not timed: a robot has many frames for one photo.
    fn answer(&mut self, query: u64, goal: u64) -> Fallible<String> {
        let frame = |number| self.frames.get(&number).ok_or_else(|| format!("no frame {number}"));
        if self.goal != Some(goal) {
            self.estimator.set_goal(frame(goal)?.as_goal())?;
            self.goal = Some(goal);
        }
        let start = Instant::now();
        let estimate = self.estimator.estimate(&frame(query)?.frame)?;
        let total_ms = start.elapsed().as_secs_f64() * 1e3;
        let [extract, matching, pose] =
            [estimate.times.extract, estimate.times.matching, estimate.times.pose].map(|t| t.as_secs_f64() * 1e3);
        let off = match estimate.sighting {
            Sighting::Pose { t_camera_goal, .. } => {
                let truth = t_world_camera(&self.folder, query)?.inverse() * t_world_camera(&self.folder, goal)?;
                let found = t_camera_goal.isometry();
                let metres = (found.translation.vector - truth.translation.vector).norm();
                format!("{metres:.6} {:.6}", found.rotation.angle_to(&truth.rotation).to_degrees())
            }
            _ => "- -".to_owned(),
        };
        Ok(format!("{total_ms:.4} {extract:.4} {matching:.4} {pose:.4} {off}"))
    }
}

/// A network and the inputs it is run on.
struct OneNetwork {
    network: OrtNetwork,
    inputs: Vec<(Vec<usize>, Vec<f32>)>,
}

impl OneNetwork {
    fn open(choice: &FeatureChoice, words: &[String]) -> Fallible<Self> {
        let (file, contract) = match (words[0].as_str(), &choice.extractor, &choice.matcher) {
            ("extractor", ExtractorChoice::Model { contract, file }, _) => (file, contract.contract()),
            ("matcher", _, MatcherChoice::Model { contract, file, .. }) => (file, contract.contract()),
            (other, ..) => return Err(format!("{other}: extractor or matcher, and it must be a model").into()),
        };
        let network = OrtNetwork::open(choice.runtime()?, file.verify()?, contract, choice.run)?;
        Ok(Self { network, inputs: read_inputs(Path::new(&words[1]))? })
    }

    fn answer(&mut self) -> Fallible<String> {
        let inputs: Vec<Input<'_>> =
            self.inputs.iter().map(|(shape, data)| Input { shape: shape.clone(), data }).collect();
        let mut sum = 0.0;
        let start = Instant::now();
        let mut ms = 0.0;
        self.network.run(&inputs, &mut |outputs| {
            ms = start.elapsed().as_secs_f64() * 1e3;
            sum = outputs.iter().map(total).sum();
        })?;
        Ok(format!("{ms:.4} {sum:.6e}"))
    }
}

fn total(output: &Output<'_>) -> f64 {
    match output.data {
        Data::F32(data) => data.iter().map(|&x| f64::from(x)).sum(),
        Data::I64(data) => data.iter().map(|&x| x as f64).sum(),
    }
}

/// Little-endian, in the order of the contract's inputs: the number of sides, the sides (u32), the elements (f32).
fn read_inputs(path: &Path) -> Fallible<Vec<(Vec<usize>, Vec<f32>)>> {
    let bytes = std::fs::read(path)?;
    let mut words = bytes.chunks_exact(4).map(|b| [b[0], b[1], b[2], b[3]]);
    let mut inputs = Vec::new();
    while let Some(n_sides) = words.next().map(u32::from_le_bytes) {
        let shape: Vec<usize> = words.by_ref().take(n_sides as usize).map(|b| u32::from_le_bytes(b) as usize).collect();
        let n = shape.iter().product();
        let data: Vec<f32> = words.by_ref().take(n).map(f32::from_le_bytes).collect();
        if data.len() != n {
            return Err(format!("{} ends early", path.display()).into());
        }
        inputs.push((shape, data));
    }
    Ok(inputs)
}
