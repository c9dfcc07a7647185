//! Faults in flight, by networks that fail when told to: fewer keypoints, then the CPU, then SIFT.

use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

use homing_core::{
    DepthImage, FeatureExtractor, Features, GoalPhoto, Intrinsics, Keypoint, Matcher, RgbImage, RgbdFrame, Sighting,
    Stamp,
};
use homing_perception::onnx::contract::{Contract, Element, FoundPort};
use homing_perception::onnx::descriptors::normalise;
use homing_perception::onnx::network::{Data, Input, Network, Output, Reader};
use homing_perception::onnx::{
    ExtractorConfig, ExtractorContract, MatcherConfig, MatcherContract, ModelError, Parts, Provider,
};
use homing_perception::{MutualNearest, PerceptionConfig, PerceptionError, ResilientEstimator};

use crate::support::blobs;

/// A matcher on a GPU with memory for so many keypoints, and a CPU with memory for so many.
struct Small {
    provider: Provider,
    gpu_max: usize,
    cpu_max: usize,
    /// Numbers of query keypoints it was asked to match.
    asked: Arc<Mutex<Vec<(usize, Provider)>>>,
    inputs: Vec<FoundPort>,
}

impl Network for Small {
    fn contract(&self) -> &'static Contract {
        MatcherContract::LighterGlue.contract()
    }

    fn path(&self) -> &Path {
        Path::new("small.onnx")
    }

    fn inputs(&self) -> &[FoundPort] {
        &self.inputs
    }

    fn outputs(&self) -> &[FoundPort] {
        &[]
    }

    fn provider(&self) -> Provider {
        self.provider
    }

    fn run(&mut self, inputs: &[Input<'_>], read: Reader<'_>) -> Result<(), ModelError> {
        let n = inputs[0].shape[1];
        self.asked.lock().unwrap().push((n, self.provider));
        if n > if self.provider == Provider::Cpu { self.cpu_max } else { self.gpu_max } {
            let reason = "Failed to allocate memory".to_owned();
            return Err(ModelError::Run { path: "small.onnx".into(), provider: self.provider.name(), reason });
        }
        let n = n.min(inputs[1].shape[1]);
        let pairs: Vec<i64> = (0..n as i64).flat_map(|i| [i, i]).collect();
        let scores = vec![0.9; n];
        read(&[
            Output { shape: vec![n, 2], data: Data::I64(&pairs) },
            Output { shape: vec![n], data: Data::F32(&scores) },
        ]);
        Ok(())
    }

    fn fall_back_to_cpu(&mut self) -> Result<bool, ModelError> {
        let was = self.provider;
        self.provider = Provider::Cpu;
        Ok(was != Provider::Cpu)
    }
}

fn many(n: usize) -> Features {
    let keypoints = (0..n).map(|i| Keypoint { x_px: i as f32, y_px: 0.0, score: 1.0 }).collect();
    Features { keypoints, descriptors: vec![0.125; 64 * n], dimension: 64, image_size_px: (2000, 10) }
}

/// Matches found in each of `frames` frames, and what the network was asked for.
fn flown(gpu_max: usize, cpu_max: usize, frames: usize) -> (Vec<Option<usize>>, Vec<(usize, Provider)>) {
    let asked = Arc::new(Mutex::new(Vec::new()));
    let inputs =
        vec![FoundPort { name: String::new(), element: Some(Element::F32), shape: vec![Some(1), None, Some(64)] }; 4];
    let network = Small { provider: Provider::Cuda, gpu_max, cpu_max, asked: Arc::clone(&asked), inputs };
    let mut matcher = MatcherContract::LighterGlue.matcher(Box::new(network), MatcherConfig::default());
    let found = (0..frames)
        .map(|_| matcher.match_features(&many(1024), &many(1000)).ok().map(|matches| matches.len()))
        .collect();
    let asked = asked.lock().unwrap().clone();
    (found, asked)
}

#[test]
fn a_matcher_short_of_memory_takes_fewer_keypoints_and_remembers() {
    let (found, asked) = flown(300, 10_000, 2);
    assert_eq!(found, [Some(256), Some(256)]);
    assert_eq!(asked.iter().map(|(n, _)| *n).collect::<Vec<_>>(), [1024, 512, 256, 256]);
    assert!(asked.iter().all(|(_, provider)| *provider == Provider::Cuda));
}

#[test]
fn a_matcher_whose_gpu_is_lost_goes_on_on_the_cpu_with_all_keypoints() {
    let (found, asked) = flown(0, 10_000, 2);
    assert_eq!(found, [Some(1000), Some(1000)]);
    assert_eq!(asked.last(), Some(&(1024, Provider::Cpu)));
    assert_eq!(asked.len(), 5);
}

#[test]
fn a_matcher_that_runs_nowhere_says_so_and_stops_trying() {
    let (found, asked) = flown(0, 0, 1);
    assert_eq!(found, [None]);
    let path: Vec<usize> = asked.iter().map(|(n, _)| *n).collect();
    assert_eq!(path, [1024, 512, 256, 1024, 512, 256]);
}

/// A GPU that is lost after so many runs; the CPU gives one keypoint.
struct Lost {
    runs_left: usize,
    provider: Provider,
}

impl Network for Lost {
    fn contract(&self) -> &'static Contract {
        ExtractorContract::Superpoint.contract()
    }

    fn path(&self) -> &Path {
        Path::new("lost.onnx")
    }

    fn inputs(&self) -> &[FoundPort] {
        &[]
    }

    fn outputs(&self) -> &[FoundPort] {
        &[]
    }

    fn provider(&self) -> Provider {
        self.provider
    }

    fn run(&mut self, inputs: &[Input<'_>], read: Reader<'_>) -> Result<(), ModelError> {
        assert_eq!(inputs[0].shape, [1, 1, 96, 160]);
        if self.provider == Provider::Cuda {
            if self.runs_left == 0 {
                let reason = "CUDA failure 999".to_owned();
                return Err(ModelError::Run { path: "lost.onnx".into(), provider: "CUDA", reason });
            }
            self.runs_left -= 1;
        }
        read(&[
            Output { shape: vec![1, 2, 2], data: Data::I64(&[7, 9, 30, 40]) },
            Output { shape: vec![1, 2], data: Data::F32(&[0.25, 0.5]) },
            Output { shape: vec![1, 2, 256], data: Data::F32(&[2.0; 512]) },
        ]);
        Ok(())
    }

    fn fall_back_to_cpu(&mut self) -> Result<bool, ModelError> {
        self.provider = Provider::Cpu;
        Ok(true)
    }
}

#[test]
fn an_extractor_whose_gpu_is_lost_goes_on_on_the_cpu() {
    let network = Lost { runs_left: 1, provider: Provider::Cuda };
    let mut extractor = ExtractorContract::Superpoint.extractor(Box::new(network), ExtractorConfig::default());
    let image = blobs(160, 96, &[]);
    let before = extractor.extract(&image).unwrap();
    assert_eq!(before.keypoints[0], Keypoint { x_px: 30.0, y_px: 40.0, score: 0.5 }, "strongest first");
    assert_eq!(before.descriptors, vec![1.0 / 16.0; 512]);
    for _ in 0..3 {
        assert_eq!(extractor.extract(&image).unwrap(), before);
    }
}

/// SIFT's keypoints under another name, until it breaks.
struct Breaks {
    sift: homing_perception::Sift,
    runs_left: Arc<AtomicUsize>,
}

impl FeatureExtractor for Breaks {
    type Error = PerceptionError;

    fn name(&self) -> &str {
        "breaks"
    }

    fn extract(&mut self, image: &RgbImage) -> Result<Features, PerceptionError> {
        if self.runs_left.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |n| n.checked_sub(1)).is_err() {
            let reason = "no provider is left".to_owned();
            return Err(ModelError::Run { path: "breaks.onnx".into(), provider: "the CPU", reason }.into());
        }
        let mut features = self.sift.extract(image)?;
        // Descriptors of another family: SIFT's own do not match them.
        features.dimension = 64;
        features.descriptors = features.descriptors.chunks_exact(128).flat_map(|d| d[..64].to_vec()).collect();
        features.descriptors.chunks_exact_mut(64).for_each(normalise);
        Ok(features)
    }
}

/// A wall 2 m ahead with a pattern that does not repeat.
fn wall() -> RgbdFrame {
    let camera = Intrinsics::from_hfov(320, 240, 1.2).unwrap();
    let pixel = |i: u32| {
        let (x, y) = (i % 320, i / 320);
        let cell = (x / 11).wrapping_mul(0x9e37_79b9) ^ (y / 9).wrapping_mul(0x85eb_ca6b);
        [(cell.wrapping_mul(0xc2b2_ae35) >> 24) as u8; 3]
    };
    let rgb = RgbImage::new(320, 240, (0..320 * 240).flat_map(pixel).collect()).unwrap();
    let depth = DepthImage::from_metres(320, 240, vec![2.0; 320 * 240]).unwrap();
    RgbdFrame::new(Stamp(1), rgb.into(), depth.into(), camera).unwrap()
}

#[test]
fn where_no_model_is_left_sift_finds_the_goal_and_nothing_exits() {
    let (frame, config) = (wall(), PerceptionConfig::default());
    let goal = GoalPhoto { id: 5, rgb: Arc::clone(&frame.rgb), intrinsics: frame.intrinsics };
    for runs_left in [0, 1, 3] {
        let sift = homing_perception::Sift::new(config.sift).unwrap();
        let extractor = Box::new(Breaks { sift, runs_left: Arc::new(AtomicUsize::new(runs_left)) });
        let parts = Parts { extractor, matcher: Box::new(MutualNearest::default()) };
        let mut estimator = ResilientEstimator::with_parts(config, parts).unwrap();
        estimator.set_goal(goal.clone()).unwrap();
        for i in 1..5 {
            let estimate = estimator.estimate(&frame).unwrap();
            let Sighting::Pose { t_camera_goal, .. } = estimate.sighting else {
                panic!("{:?}, {} matches", estimate.sighting, estimate.n_matches)
            };
            assert!(t_camera_goal.translation().norm() < 0.01 && estimate.goal_id == 5);
            // One run was the goal photo's.
            assert_eq!(estimator.degraded().is_some(), i >= runs_left, "frame {i} after {runs_left} runs");
        }
        assert!(estimator.degraded().unwrap().contains("no provider is left"));
    }
}
