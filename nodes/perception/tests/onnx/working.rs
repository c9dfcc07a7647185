//! Small models that fulfil our contracts, run by the real ONNX Runtime.

use homing_core::{FeatureExtractor, Matcher};
use homing_perception::PerceptionConfig;
use homing_perception::onnx::inventory::AnyContract;
use homing_perception::onnx::network::Network;
use homing_perception::onnx::registry::MANIFEST;
use homing_perception::onnx::session::OrtNetwork;
use homing_perception::onnx::{
    ExtractorChoice, ExtractorConfig, ExtractorContract, FeatureChoice, MatcherChoice, MatcherContract, ModelName,
    Provider, ProviderChoice, RunConfig,
};

use crate::bytes::{Side, homing_extractor, homing_matcher};
use crate::support::{Folder, blobs, runtime};

#[test]
fn a_provider_that_is_not_there_is_said_and_the_next_one_runs() {
    let (folder, Some((runtime, _))) = (Folder::new(), runtime()) else { return };
    let file = folder.model("homing.onnx", &homing_extractor(64).bytes());
    let built_with = |name: &str| runtime.report().providers.iter().any(|(p, has)| *p == name && *has);
    if built_with("CUDA") {
        eprintln!("SKIPPED: this ONNX Runtime has CUDA, what is tested is its absence");
        return;
    }
    for (asked, absent) in [
        (ProviderChoice::Cpu, &[][..]),
        (ProviderChoice::Auto, &[Provider::Cuda]),
        (ProviderChoice::Cuda, &[Provider::Cuda]),
        (ProviderChoice::TensorRt, &[Provider::TensorRt, Provider::Cuda]),
    ] {
        let run = RunConfig { provider: asked, threads: 1 };
        let contract = ExtractorContract::Homing.contract();
        let mut network = OrtNetwork::open(runtime, file.verify().unwrap(), contract, run).unwrap();
        assert_eq!(network.provider(), Provider::Cpu);
        let refused: Vec<Provider> = network.refused().iter().map(|(provider, _)| *provider).collect();
        assert_eq!(refused, absent, "{asked:?}");
        assert!(network.refused().iter().all(|(_, reason)| !reason.is_empty()));
        assert!(!network.fall_back_to_cpu().unwrap(), "it is there already");
    }
}

#[test]
fn our_contract_gives_keypoints_where_the_heat_is_to_a_fraction_of_a_pixel() {
    let (folder, Some((runtime, _))) = (Folder::new(), runtime()) else { return };
    let file = folder.model("homing.onnx", &homing_extractor(64).bytes());
    let contract = ExtractorContract::Homing;
    let open = || OrtNetwork::open(runtime, file.verify().unwrap(), contract.contract(), RunConfig::default()).unwrap();
    let mut extractor = contract.extractor(Box::new(open()), ExtractorConfig::default());
    let centres = [(100.0, 60.0), (200.3, 99.6), (31.75, 180.0), (280.0, 20.5)];
    // A size the model takes as it is, one that is resized a little, and one that is halved.
    for (width, height, scale, tolerance_px) in [(320, 224, 1.0, 0.1), (330, 250, 1.0, 0.25), (1280, 960, 4.0, 0.6)] {
        let scaled: Vec<(f32, f32)> = centres.iter().map(|(x, y)| (x * scale, y * scale)).collect();
        let mut image = blobs(width, height, &scaled);
        if scale > 1.0 {
            // Blobs of the same angular size.
            let small = blobs(320, 240, &centres);
            let pixel = |i: u32| {
                let (x, y) = (i % width / 4, i / width / 4);
                let at = 3 * (y * 320 + x) as usize;
                [small.data()[at], small.data()[at + 1], small.data()[at + 2]]
            };
            let data = (0..width * height).flat_map(pixel).collect();
            image = homing_core::RgbImage::new(width, height, data).unwrap().into();
        }
        let features = extractor.extract(&image).unwrap();
        assert_eq!((features.keypoints.len(), features.dimension), (4, 64), "{width}x{height}");
        assert_eq!((features.descriptors.len(), features.image_size_px), (256, (width, height)));
        for (x, y) in centres {
            let (x, y) = if scale > 1.0 { ((x + 0.5) * scale - 0.5, (y + 0.5) * scale - 0.5) } else { (x, y) };
            let off = |k: &homing_core::Keypoint| (k.x_px - x).abs().max((k.y_px - y).abs());
            let nearest = features.keypoints.iter().map(off).fold(f32::INFINITY, f32::min);
            assert!(nearest < tolerance_px * scale, "{nearest} px off in {width}x{height}");
        }
        for descriptor in features.descriptors.chunks_exact(64) {
            assert!((descriptor.iter().map(|x| x * x).sum::<f32>() - 1.0).abs() < 1e-4);
        }
        assert_eq!(features, extractor.extract(&image).unwrap(), "repeatable");
    }
    let few = ExtractorConfig { keypoints_max: 2, ..ExtractorConfig::default() };
    let mut extractor = contract.extractor(Box::new(open()), few);
    assert_eq!(extractor.extract(&blobs(320, 224, &centres)).unwrap().keypoints.len(), 2);
    for (width, height) in [(1, 1), (15, 400), (16, 16)] {
        let found = extractor.extract(&blobs(width, height, &[])).unwrap();
        assert!(found.keypoints.is_empty() && found.dimension == 64, "{width}x{height}");
    }
}

#[test]
fn names_of_the_manifest_open_and_their_parts_work_together() {
    let (folder, Some((_, library))) = (Folder::new(), runtime()) else { return };
    let entry = |role: &str, bytes: &[u8]| {
        let file = folder.model(&format!("{role}.onnx"), bytes);
        format!(
            r#"{{"name": "homing-{role}", "kind": "{role}", "file": "{role}.onnx", "sha256": "{}",
                "bytes": {}, "licence": "MIT", "training": {{"commit": "0"}}, "accuracy": {{}}}}"#,
            file.sha256,
            bytes.len()
        )
    };
    let models =
        [entry("extractor", &homing_extractor(64).bytes()), entry("matcher", &homing_matcher(64, &[]).bytes())]
            .join(",");
    std::fs::write(folder.path().join(MANIFEST), format!(r#"{{"format": 1, "models": [{models}]}}"#)).unwrap();
    let name = ModelName::Listed("homing".to_owned());
    let choice = FeatureChoice {
        extractor: ExtractorChoice::resolve(&name, folder.path()).unwrap(),
        matcher: MatcherChoice::resolve(&name, folder.path()).unwrap(),
        library: Some(library),
        ..FeatureChoice::default()
    };
    let mut parts = choice.open(&PerceptionConfig::default()).unwrap();
    let centres: Vec<(f32, f32)> =
        (0..40).map(|i| (20.0 + 31.0 * (i % 10) as f32, 25.0 + 53.0 * (i / 10) as f32)).collect();
    let image = blobs(352, 256, &centres);
    let features = parts.extractor.extract(&image).unwrap();
    assert_eq!(features.keypoints.len(), 40);
    let matches = parts.matcher.match_features(&features, &features).unwrap();
    // Blobs that fall on the same part of a cell look alike: each still has one partner at most.
    assert!(matches.len() > 10 && matches.iter().all(|m| m.confidence > 0.99));
    let mut goals: Vec<usize> = matches.iter().map(|m| m.goal).collect();
    goals.sort_unstable();
    goals.dedup();
    assert_eq!(goals.len(), matches.len());
    let none = homing_core::Features { dimension: 64, ..Default::default() };
    assert!(parts.matcher.match_features(&none, &features).unwrap().is_empty());
}

#[test]
fn a_model_is_checked_and_explained() {
    let (folder, Some((runtime, _))) = (Folder::new(), runtime()) else { return };
    let run = RunConfig { provider: ProviderChoice::Cpu, threads: 1 };
    let file = folder.model("homing.onnx", &homing_extractor(64).bytes());
    let checked = AnyContract::Extractor(ExtractorContract::Homing).check(&file, runtime, run).unwrap();
    assert_eq!((checked.opset, checked.provider), (13, Provider::Cpu));
    assert!(checked.result.contains("keypoints, 64 long") && checked.run <= checked.start);
    for batch in [&[][..], &[Side::Is(1)]] {
        let file = folder.model("matcher.onnx", &homing_matcher(64, batch).bytes());
        let checked = AnyContract::Matcher(MatcherContract::Homing).check(&file, runtime, run).unwrap();
        assert_eq!(checked.result, "512 of 512 matched with themselves");
    }
    for contract in AnyContract::all() {
        let text = contract.explain();
        let ports = contract.contract().inputs.len() + contract.contract().outputs.len();
        assert!(text.lines().count() >= ports + 2, "{text}");
    }
}
