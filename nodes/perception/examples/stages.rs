//! Time per stage at 640x480, with any features:
//! `cargo run --example stages -- --extractor xfeat=../shared/data/weights/xfeatc_480x640.onnx --matcher
//! lighterglue=../shared/data/weights/lighterglue_L3.onnx --image PHOTO [--runs 30]`
//!
//! With `--image` and `--goal` two photos are used, else a test pattern. `--after` times what follows the network alone, for
//! the contract `homing`. `--network` times the extractor's network alone, to compare with other languages' bindings of
//! ONNX Runtime.

#[path = "support/features.rs"]
mod features;

use std::path::Path;
use std::time::Instant;

use homing_core::{FeatureExtractor, Matcher, RgbImage};
use homing_perception::onnx::contract::{Contract, FoundPort};
use homing_perception::onnx::inventory::test_image;
use homing_perception::onnx::network::{Data, Input, Network, Output, Reader};
use homing_perception::onnx::session::OrtNetwork;
use homing_perception::onnx::{
    ExtractorChoice, ExtractorConfig, ExtractorContract, FeatureChoice, ModelError, Provider,
};
use homing_perception::{FieldOfView, decode_photo};

type Fallible<T> = Result<T, Box<dyn std::error::Error>>;

fn main() -> Fallible<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let value = |name: &str| arguments.iter().position(|a| a == name).and_then(|i| arguments.get(i + 1));
    let runs: usize = value("--runs").map_or(Ok(30), |n| n.parse())?;
    if arguments.iter().any(|a| a == "--help") {
        println!("{} [--image PHOTO] [--goal PHOTO] [--runs N] [--after] [--network]", features::USAGE);
        return Ok(());
    }
    let image = |name: &str| -> Fallible<RgbImage> {
        let Some(path) = value(name) else { return Ok(test_image()) };
        // The field of view does not matter here.
        Ok(decode_photo(&std::fs::read(path)?, FieldOfView::Given(1.0))?.rgb)
    };
    let (query, goal) = (image("--image")?, image("--goal")?);
    if arguments.iter().any(|a| a == "--after") {
        return after(&query, runs);
    }
    let (choice, config) = features::from_arguments(&arguments)?;
    if arguments.iter().any(|a| a == "--network") {
        return network_alone(&choice, runs);
    }
    let start = Instant::now();
    let mut parts = choice.open(&config)?;
    println!("{} + {}, open {:.0} ms", choice.extractor.name(), choice.matcher.name(), ms(start));
    let (a, b) = (parts.extractor.extract(&query)?, parts.extractor.extract(&goal)?);
    let extract = times(runs, || parts.extractor.extract(&query).map(|f| f.keypoints.len()))?;
    let matching = times(runs, || parts.matcher.match_features(&a, &b).map(|m| m.len()))?;
    println!("  {} and {} keypoints, {} matches", a.keypoints.len(), b.keypoints.len(), matching.1);
    println!("  extract: least {:.1} ms, p50 {:.1} ms", extract.0[0], extract.0[runs / 2]);
    println!("  match:   least {:.1} ms, p50 {:.1} ms", matching.0[0], matching.0[runs / 2]);
    Ok(())
}

fn ms(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}

/// Sorted milliseconds, and the last result.
fn times<E>(runs: usize, mut work: impl FnMut() -> Result<usize, E>) -> Result<(Vec<f64>, usize), E> {
    let (mut times, mut last) = (Vec::new(), work()?);
    for _ in 0..runs {
        let start = Instant::now();
        last = work()?;
        times.push(ms(start));
    }
    times.sort_by(f64::total_cmp);
    Ok((times, last))
}

/// One image through the network, and nothing else.
fn network_alone(choice: &FeatureChoice, runs: usize) -> Fallible<()> {
    let ExtractorChoice::Model { contract, file } = &choice.extractor else { return Err("sift has no network".into()) };
    let mut network = OrtNetwork::open(choice.runtime()?, file.verify()?, contract.contract(), choice.run)?;
    let side = |i: usize, open: usize| network.inputs()[0].shape[i].unwrap_or(open);
    let shape = vec![1, side(1, 1), side(2, 480), side(3, 640)];
    let data: Vec<f32> = (0..shape.iter().product::<usize>()).map(|i| ((i * 7919) % 256) as f32).collect();
    let input = [Input { shape: shape.clone(), data: &data }];
    let (times, _) = times(runs, || network.run(&input, &mut |_| {}).map(|()| 0))?;
    println!("network alone, {shape:?}: least {:.2} ms, p50 {:.2} ms", times[0], times[runs / 2]);
    Ok(())
}

/// Gives the same outputs at once, whatever the image: what is timed is everything but the network.
struct Instantly {
    heat: Vec<f32>,
    descriptors: Vec<f32>,
    reliability: Vec<f32>,
}

impl Network for Instantly {
    fn contract(&self) -> &'static Contract {
        ExtractorContract::Homing.contract()
    }

    fn path(&self) -> &Path {
        Path::new("none")
    }

    fn inputs(&self) -> &[FoundPort] {
        &[]
    }

    fn outputs(&self) -> &[FoundPort] {
        &[]
    }

    fn provider(&self) -> Provider {
        Provider::Cpu
    }

    fn run(&mut self, _: &[Input<'_>], read: Reader<'_>) -> Result<(), ModelError> {
        read(&[
            Output { shape: vec![1, 1, 480, 640], data: Data::F32(&self.heat) },
            Output { shape: vec![1, 64, 60, 80], data: Data::F32(&self.descriptors) },
            Output { shape: vec![1, 1, 60, 80], data: Data::F32(&self.reliability) },
        ]);
        Ok(())
    }

    fn fall_back_to_cpu(&mut self) -> Result<bool, ModelError> {
        Ok(false)
    }
}

fn after(image: &RgbImage, runs: usize) -> Fallible<()> {
    // Contrast to the pixel above and to the left stands in for heat: as many candidates as a bad network would give.
    let luma = image.to_luma();
    let heat = (0..640 * 480_usize).map(|i| {
        let of = |j: Option<usize>| j.map_or(0.0, |j| f32::from(luma[i].abs_diff(luma[j])));
        of(i.checked_sub(1)).min(of(i.checked_sub(640))) / 255.0
    });
    let network = Instantly {
        heat: heat.collect(),
        descriptors: (0..64 * 4800_usize).map(|i| ((i * 7919) % 1009) as f32 - 500.0).collect(),
        reliability: (0..4800).map(|i| ((i * 31) % 100) as f32 * 0.01).collect(),
    };
    let mut extractor = ExtractorContract::Homing.extractor(Box::new(network), ExtractorConfig::default());
    let (times, n) = times(runs, || extractor.extract(image).map(|f| f.keypoints.len()))?;
    println!("everything but the network: least {:.2} ms, p50 {:.2} ms, {n} keypoints", times[0], times[runs / 2]);
    Ok(())
}
