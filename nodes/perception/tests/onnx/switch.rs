//! The learned switch: what it says, what is refused, and that its word goes with the estimate.

use std::path::Path;

use homing_core::{DepthImage, Features, GoalPhoto, Intrinsics, Keypoint, RgbImage, RgbdFrame, Stamp};
use homing_perception::onnx::inventory::test_image;
use homing_perception::onnx::{ExtractorChoice, ExtractorContract, FeatureChoice, ModelFile, ModelName, SwitchChoice};
use homing_perception::{AnyEstimator, PerceptionConfig, ResilientEstimator};

use crate::bytes::{Kind, Side, homing_extractor, homing_switch};
use crate::support::{Folder, blobs, runtime};

/// One keypoint whose descriptor is 1 at `axis`.
fn looking(axis: usize) -> Features {
    let mut descriptors = vec![0.0; 64];
    descriptors[axis] = 1.0;
    let keypoints = vec![Keypoint { x_px: 3.0, y_px: 4.0, score: 1.0 }];
    Features { keypoints, descriptors, dimension: 64, image_size_px: (640, 480) }
}

/// Our extractor's stand-in with a switch.
fn choice(folder: &Folder, switch: ModelFile) -> Option<FeatureChoice> {
    let (_, library) = runtime()?;
    let file = folder.model("extractor.onnx", &homing_extractor(64).bytes());
    Some(FeatureChoice {
        extractor: ExtractorChoice::Model { contract: ExtractorContract::Homing, file },
        switch: SwitchChoice::Model { file: switch, extractor_sha256: None },
        library: Some(library),
        ..FeatureChoice::default()
    })
}

#[test]
fn a_switch_gives_a_probability_of_two_images() {
    let folder = Folder::new();
    let Some(choice) = choice(&folder, folder.model("switch.onnx", &homing_switch("Sigmoid").bytes())) else { return };
    let mut switch = choice.open_switch().unwrap().unwrap();
    // 1 / (1 + e^-1) and 1 / 2.
    let same = switch.probability(&looking(3), &looking(3)).unwrap().unwrap();
    assert!((same - 0.731_058_6).abs() < 1e-6, "{same}");
    assert_eq!(switch.probability(&looking(3), &looking(4)).unwrap(), Some(0.5));
    let nothing = Features { dimension: 64, ..Features::default() };
    assert_eq!(switch.probability(&looking(3), &nothing).unwrap(), None);
    assert_eq!(switch.probability(&nothing, &looking(3)).unwrap(), None);
    let short = Features { descriptors: vec![1.0; 32], dimension: 32, ..looking(0) };
    let said = switch.probability(&short, &looking(3)).unwrap_err().to_string();
    assert!(said.contains("32"), "{said}");
    assert!(FeatureChoice::default().open_switch().unwrap().is_none(), "none is chosen by default");
}

#[test]
fn what_is_no_switch_is_refused_at_the_start() {
    let folder = Folder::new();
    let refused = |model: &[u8]| {
        let switch = choice(&folder, folder.model("switch.onnx", model))?.open_switch();
        Some(switch.err().expect("it must be refused").to_string())
    };
    // A cosine of keypoints with themselves, doubled, is no probability.
    let Some(said) = refused(&homing_switch("Exp").bytes()) else { return };
    assert!(said.contains("expects a probability of 0 to 1, found 2.7"), "{said}");
    let said = refused(&homing_extractor(64).bytes()).unwrap();
    assert!(said.contains("expects input \"keypoints0\""), "{said}");
    let twice = homing_switch("Sigmoid").input("mask", Kind::Float, &[Side::Is(1)]);
    let said = refused(&twice.bytes()).unwrap();
    assert!(said.contains("expects 6 input(s), found also input \"mask\""), "{said}");
}

#[test]
fn a_switch_goes_with_the_very_extractor_it_was_trained_on() {
    let file = |digit: &str| ModelFile { path: "/nowhere.onnx".into(), sha256: digit.repeat(64) };
    let from = |contract, digit| ExtractorChoice::Model { contract, file: file(digit) };
    for (extractor, says) in [
        (ExtractorChoice::Sift, "switch homing-switch expects extractor homing, found extractor sift".to_owned()),
        (from(ExtractorContract::R2d2, "2"), "expects extractor homing, found extractor r2d2".to_owned()),
        (from(ExtractorContract::Homing, "3"), format!("sha256 {}, found {}", "2".repeat(64), "3".repeat(64))),
    ] {
        let switch = SwitchChoice::Model { file: file("1"), extractor_sha256: Some("2".repeat(64)) };
        let said =
            FeatureChoice { extractor, switch, ..FeatureChoice::default() }.open_switch().err().unwrap().to_string();
        assert!(said.contains(&says), "{said}");
    }
}

#[test]
fn its_word_goes_with_every_estimate() {
    let folder = Folder::new();
    let Some(choice) = choice(&folder, folder.model("switch.onnx", &homing_switch("Sigmoid").bytes())) else { return };
    let camera = Intrinsics::from_hfov(352, 256, 1.5).unwrap();
    let centres: Vec<(f32, f32)> =
        (0..40).map(|i| (20.0 + 31.0 * (i % 10) as f32, 25.0 + 53.0 * (i / 10) as f32)).collect();
    let seen = blobs(352, 256, &centres);
    let depth = DepthImage::from_metres(352, 256, vec![2.0; 352 * 256]).unwrap();
    let frame = RgbdFrame::new(Stamp(1), seen.clone(), depth.into(), camera).unwrap();
    let blank = RgbImage::new(352, 256, vec![0; 3 * 352 * 256]).unwrap();
    let without = FeatureChoice { switch: SwitchChoice::Geometry, ..choice.clone() };
    for (choice, photo, expected) in
        [(&choice, seen.clone(), Some(0.731)), (&choice, blank.into(), None), (&without, seen, None)]
    {
        let mut estimator = ResilientEstimator::open(PerceptionConfig::default(), choice).unwrap();
        estimator.set_goal(GoalPhoto { id: 1, rgb: photo, intrinsics: camera }).unwrap();
        let said = estimator.estimate(&frame).unwrap().switch_probability;
        assert_eq!(said.map(|p| (1e3 * p).round() / 1e3), expected);
    }
}

#[test]
fn the_shipped_switch_tells_the_same_view_from_another() {
    let Some((_, library)) = runtime() else { return };
    let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("models");
    let listed = |name: &str| SwitchChoice::resolve(&ModelName::Listed(name.to_owned()), &models);
    assert_eq!(listed("homing").unwrap(), listed("homing-switch").unwrap());
    assert_eq!(listed("nrns").unwrap_err().to_string(), "switch \"nrns\" is unknown: expected one of homing-switch");
    let choice = FeatureChoice {
        switch: listed("homing-switch").unwrap(),
        library: Some(library),
        ..FeatureChoice::listed("homing", None, &models).unwrap()
    };
    let mut estimator = AnyEstimator::open(PerceptionConfig::default(), &choice).unwrap();
    let camera = Intrinsics::from_hfov(640, 480, 2.0).unwrap();
    let depth = DepthImage::from_metres(640, 480, vec![2.0; 640 * 480]).unwrap();
    let same = std::sync::Arc::new(test_image());
    let frame = RgbdFrame::new(Stamp(1), same.clone(), depth.into(), camera).unwrap();
    let mut said = |photo: std::sync::Arc<RgbImage>| {
        estimator.set_goal(GoalPhoto { id: 1, rgb: photo, intrinsics: camera }).unwrap();
        estimator.estimate(&frame).unwrap().switch_probability.unwrap()
    };
    let (alike, unlike) = (said(same), said(blobs(640, 480, &[(100.0, 60.0), (400.0, 300.0), (550.0, 90.0)])));
    assert!(alike > unlike, "{alike} of the same view, {unlike} of another");
    assert_eq!(alike, said(std::sync::Arc::new(test_image())), "repeatable");
}
