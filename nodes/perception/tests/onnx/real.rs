//! XFeat and LighterGlue as others published them.

use std::path::Path;

use homing_core::{FeatureExtractor, Features, GoalPhoto, Intrinsics, Matcher, RgbImage, RgbdFrame, Sighting, Stamp};
use homing_perception::onnx::{
    ExtractorChoice, ExtractorContract, FeatureChoice, MatcherChoice, MatcherContract, Parts,
};
use homing_perception::{FieldOfView, PerceptionConfig, ResilientEstimator, decode_photo};

use crate::support::{data, runtime, trusted};

fn choice(matcher: impl Fn(homing_perception::onnx::ModelFile) -> MatcherChoice) -> Option<FeatureChoice> {
    let (weights, (_, library)) = (data("weights")?, runtime()?);
    Some(FeatureChoice {
        extractor: ExtractorChoice::Model {
            contract: ExtractorContract::Xfeat,
            file: trusted(weights.join("xfeatc_480x640.onnx")),
        },
        matcher: matcher(trusted(weights.join("lighterglue_L3.onnx"))),
        library: Some(library),
        ..FeatureChoice::default()
    })
}

fn lighterglue(file: homing_perception::onnx::ModelFile) -> MatcherChoice {
    MatcherChoice::Model { contract: MatcherContract::LighterGlue, file, extractor_sha256: None, confidence_min: None }
}

fn photo(folder: &Path, number: u32) -> RgbImage {
    let file = std::fs::read(folder.join(format!("frame-{number:06}.color.jpg"))).unwrap();
    decode_photo(&file, FieldOfView::Given(1.0)).unwrap().rgb
}

#[test]
fn xfeat_finds_the_same_points_from_elsewhere() {
    let (Some(choice), Some(folder)) = (choice(lighterglue), data("rgbd/7scenes_redkitchen")) else { return };
    let Parts { mut extractor, mut matcher } = choice.open(&PerceptionConfig::default()).unwrap();
    let [a, b] = [100, 150].map(|number| extractor.extract(&photo(&folder, number)).unwrap());
    for features in [&a, &b] {
        assert!(features.keypoints.len() > 500 && features.keypoints.len() <= 1024, "{}", features.keypoints.len());
        assert!(features.keypoints.is_sorted_by(|a, b| a.score >= b.score));
        assert_eq!((features.dimension, features.image_size_px), (64, (640, 480)));
    }
    let glued = matcher.match_features(&a, &b).unwrap();
    assert!(glued.len() > 150, "{}", glued.len());
    // With itself, nearly everything matches itself.
    let own = matcher.match_features(&a, &a).unwrap();
    let right = own.iter().filter(|m| m.query == m.goal).count();
    assert!(10 * right > 9 * a.keypoints.len(), "{right} of {}", a.keypoints.len());
    for n in [0, 1, 3] {
        let few = Features {
            keypoints: a.keypoints[..n].to_vec(),
            descriptors: a.descriptors[..64 * n].to_vec(),
            ..a.clone()
        };
        assert!(matcher.match_features(&few, &b).unwrap().len() <= n);
        assert!(matcher.match_features(&b, &few).unwrap().len() <= n);
    }
}

#[test]
fn images_that_show_nothing_give_nothing() {
    let Some(choice) = choice(lighterglue) else { return };
    let Parts { mut extractor, mut matcher } = choice.open(&PerceptionConfig::default()).unwrap();
    for value in [0, 128, 255] {
        let blank = RgbImage::new(320, 240, vec![value; 320 * 240 * 3]).unwrap();
        let features = extractor.extract(&blank).unwrap();
        assert!(features.keypoints.len() < 20, "{} keypoints on a blank image", features.keypoints.len());
        matcher.match_features(&features, &features).unwrap();
    }
    let tall = RgbImage::new(40, 900, vec![7; 40 * 900 * 3]).unwrap();
    assert_eq!(extractor.extract(&tall).unwrap().image_size_px, (40, 900));
}

#[test]
fn the_whole_pipeline_finds_the_goal_with_models() {
    let Some(folder) = data("rgbd/7scenes_redkitchen") else { return };
    for matcher in [|_| MatcherChoice::MutualNearest, |_| MatcherChoice::DualSoftmax, lighterglue] {
        let Some(choice) = choice(matcher) else { return };
        let config = PerceptionConfig::default();
        let mut estimator = ResilientEstimator::open(config, &choice).unwrap();
        let camera = Intrinsics::new(640, 480, 585.0, 585.0, 320.0, 240.0).unwrap();
        let depth = homing_core::DepthImage::from_metres(640, 480, read_depth(&folder, 100)).unwrap();
        let frame = RgbdFrame::new(Stamp(1), photo(&folder, 100).into(), depth.into(), camera).unwrap();
        let goal = GoalPhoto { id: 1, rgb: photo(&folder, 120).into(), intrinsics: camera };
        estimator.set_goal(goal).unwrap();
        let estimate = estimator.estimate(&frame).unwrap();
        let Sighting::Pose { t_camera_goal, n_inliers, .. } = estimate.sighting else {
            panic!("{}: {:?}, {} matches", choice.matcher.name(), estimate.sighting, estimate.n_matches)
        };
        let [from, to] = [100, 120].map(|number| position(&folder, number));
        let off = t_camera_goal.translation().norm() - (to - from).norm();
        assert!(off.abs() < 0.1 && n_inliers > 100, "{off} m, {n_inliers} inliers");
        assert!(estimator.degraded().is_none());
    }
}

fn read_depth(folder: &Path, number: u32) -> Vec<f32> {
    use opencv::prelude::*;
    let path = folder.join(format!("frame-{number:06}.depth.png"));
    let mm = opencv::imgcodecs::imread(&path, opencv::imgcodecs::IMREAD_UNCHANGED).unwrap();
    mm.data_typed::<u16>().unwrap().iter().map(|&mm| f32::from(mm) * 1e-3).collect()
}

fn position(folder: &Path, number: u32) -> nalgebra::Vector3<f64> {
    let text = std::fs::read_to_string(folder.join(format!("frame-{number:06}.pose.txt"))).unwrap();
    let m: Vec<f64> = text.split_whitespace().map(|v| v.parse().unwrap()).collect();
    nalgebra::Vector3::new(m[3], m[7], m[11])
}
