//! Everything wrong with a model is found at the start, and said with path, expected and found.

use std::path::Path;

use homing_perception::PerceptionConfig;
use homing_perception::PerceptionError;
use homing_perception::onnx::registry::MANIFEST;
use homing_perception::onnx::{
    ExtractorChoice, ExtractorContract, FeatureChoice, MatcherChoice, MatcherContract, ModelError, ModelFile, ModelName,
};

use crate::bytes::{Kind, Model, Side, homing_extractor, homing_matcher};
use crate::support::{Folder, runtime};

/// The refusal of a file as an extractor of contract `homing`.
fn refused(file: &ModelFile) -> String {
    let extractor = ExtractorChoice::Model { contract: ExtractorContract::Homing, file: file.clone() };
    let library = runtime().map(|(_, library)| library);
    let choice = FeatureChoice { extractor, library, ..FeatureChoice::default() };
    let refusal = choice.open(&PerceptionConfig::default()).err().expect("it must be refused").to_string();
    assert!(refusal.contains(&file.path.display().to_string()), "{refusal}");
    refusal
}

#[test]
fn bytes_that_are_not_what_they_should_be_are_not_even_looked_into() {
    let folder = Folder::new();
    let whole = homing_extractor(64).bytes();
    let right = folder.model("right.onnx", &whole);

    let missing = ModelFile { path: folder.path().join("missing.onnx"), ..right.clone() };
    assert!(refused(&missing).contains(&format!("expected a file with sha256 {}", right.sha256)));

    let cut = folder.model("cut.onnx", &whole[..whole.len() / 2]);
    let refusal = refused(&ModelFile { sha256: right.sha256.clone(), ..cut.clone() });
    assert!(refusal.contains(&format!("expected sha256 {}, found {}", right.sha256, cut.sha256)), "{refusal}");
    assert!(refusal.contains(&format!("over {} bytes", whole.len() / 2)), "{refusal}");

    let nonsense = refused(&ModelFile { sha256: "abc".to_owned(), ..right.clone() });
    assert!(nonsense.contains("\"abc\" is not a sha256"), "{nonsense}");
    assert!(matches!(
        ModelFile { path: folder.path().to_owned(), ..right.clone() }.verify(),
        Err(ModelError::Unreadable { .. })
    ));
    let upper = ModelFile { sha256: right.sha256.to_uppercase(), ..right };
    assert_eq!(upper.verify().unwrap().opset, 13, "a hash may be written in capitals");
}

#[test]
fn trusted_bytes_that_are_no_model_are_refused() {
    let folder = Folder::new();
    for (name, bytes) in [
        ("page.onnx", &b"<html>404</html>"[..]),
        ("empty.onnx", b""),
        ("cut.onnx", &homing_extractor(64).bytes()[..9000]),
    ] {
        let refusal = refused(&folder.model(name, bytes));
        assert!(refusal.contains("expected an ONNX model"), "{refusal}");
    }
    for opset in [5, 99] {
        let mut model = homing_extractor(64);
        model.opset = opset;
        let refusal = refused(&folder.model("opset.onnx", &model.bytes()));
        assert!(refusal.contains(&format!("expected operator set 9 to 25, found {opset}")), "{refusal}");
    }
    if runtime().is_none() {
        return;
    }
    // A graph that ONNX Runtime itself refuses.
    let model = homing_extractor(64).node("NoSuchOperator", &["image"], "x", &[]);
    let refusal = refused(&folder.model("operator.onnx", &model.bytes()));
    assert!(
        refusal.contains("expected it to run on CUDA or the CPU") && refusal.contains("NoSuchOperator"),
        "{refusal}"
    );
}

#[test]
fn models_of_another_shape_or_with_other_names_are_refused() {
    let folder = Folder::new();
    if runtime().is_none() {
        return;
    }
    let refusal = refused(&folder.model("narrow.onnx", &homing_extractor(32).bytes()));
    assert!(refusal.contains("expects output \"descriptors\" 1x64xH/8xW/8 float32"), "{refusal}");
    assert!(refusal.contains("found \"descriptors\" 1x32x?x? float32"), "{refusal}");

    let refusal = refused(&folder.model("matcher.onnx", &homing_matcher(64, &[Side::Is(1)]).bytes()));
    assert!(refusal.contains("expects input \"image\" 1x1xHxW float32, found \"kpts0\" 1x?x2"), "{refusal}");

    let image = [Side::Is(1), Side::Is(1), Side::Named("H"), Side::Named("W")];
    let doubles = Model::new()
        .input("image", Kind::Double, &image)
        .node("Identity", &["image"], "heat_map", &[])
        .output("heat_map", Kind::Double, &image);
    let refusal = refused(&folder.model("doubles.onnx", &doubles.bytes()));
    assert!(refusal.contains("\"image\" 1x1x?x? of another type"), "{refusal}");

    let extra = homing_extractor(64).input("mask", Kind::Float, &image);
    let refusal = refused(&folder.model("extra.onnx", &extra.bytes()));
    assert!(refusal.contains("expects 1 input(s), found also input \"mask\""), "{refusal}");
}

#[test]
fn a_model_whose_shapes_show_only_when_it_runs_is_refused_at_the_start_too() {
    let folder = Folder::new();
    if runtime().is_none() {
        return;
    }
    // The graph leaves the number of channels open, and gives 32.
    let open = |name| [Side::Is(1), Side::Named(name), Side::Named("h"), Side::Named("w")];
    let filters = vec![0.5; 32 * 64];
    let model = Model::new()
        .input("image", Kind::Float, &[Side::Is(1), Side::Is(1), Side::Named("H"), Side::Named("W")])
        .constant("filters", &[32, 1, 8, 8], &filters)
        .node("Identity", &["image"], "heat_map", &[])
        .node("Conv", &["image", "filters"], "plain", &[("kernel_shape", &[8, 8]), ("strides", &[8, 8])])
        .node("Identity", &["plain"], "descriptors", &[])
        .node("AveragePool", &["image"], "reliability", &[("kernel_shape", &[4, 4]), ("strides", &[4, 4])])
        .output("heat_map", Kind::Float, &open("a"))
        .output("descriptors", Kind::Float, &open("b"))
        .output("reliability", Kind::Float, &open("c"));
    let refusal = refused(&folder.model("open.onnx", &model.bytes()));
    assert!(refusal.contains("1x64xH/8xW/8") && refusal.contains("32"), "{refusal}");
}

#[test]
fn parts_that_do_not_belong_together_are_refused_before_anything_is_loaded() {
    let file = ModelFile { path: "/nowhere.onnx".into(), sha256: "0".repeat(64) };
    let model = |contract| {
        let file = file.clone();
        MatcherChoice::Model { contract, file, extractor_sha256: None, confidence_min: None }
    };
    let from = |contract| ExtractorChoice::Model { contract, file: file.clone() };
    for (extractor, matcher, expected) in [
        (ExtractorChoice::Sift, MatcherContract::LighterGlue, "extractor xfeat"),
        (from(ExtractorContract::Homing), MatcherContract::LighterGlue, "extractor xfeat"),
        (from(ExtractorContract::Xfeat), MatcherContract::Homing, "extractor homing"),
        (from(ExtractorContract::R2d2), MatcherContract::LightGlue, "extractor superpoint or aliked"),
    ] {
        let name = extractor.name();
        let choice = FeatureChoice { extractor, matcher: model(matcher), ..FeatureChoice::default() };
        let refusal = choice.open(&PerceptionConfig::default()).err().unwrap();
        assert!(matches!(refusal, PerceptionError::Choice(_)), "{refusal}");
        let said = refusal.to_string();
        assert!(said.contains(&format!("expects {expected}, found extractor {name}")), "{said}");
    }
}

#[test]
fn a_matcher_goes_with_the_very_extractor_it_was_trained_on() {
    let file = |digit: &str| ModelFile { path: "/nowhere.onnx".into(), sha256: digit.repeat(64) };
    let matcher = MatcherChoice::Model {
        contract: MatcherContract::Homing,
        file: file("1"),
        extractor_sha256: Some("2".repeat(64)),
        confidence_min: None,
    };
    let extractor = ExtractorChoice::Model { contract: ExtractorContract::Homing, file: file("3") };
    let choice = FeatureChoice { extractor, matcher, ..FeatureChoice::default() };
    let said = choice.open(&PerceptionConfig::default()).err().unwrap().to_string();
    assert!(said.contains(&format!("sha256 {}, found {}", "2".repeat(64), "3".repeat(64))), "{said}");
}

#[test]
fn a_matcher_for_descriptors_of_another_length_is_refused() {
    let folder = Folder::new();
    let Some((_, library)) = runtime() else { return };
    let choice = FeatureChoice {
        extractor: ExtractorChoice::Model {
            contract: ExtractorContract::Aliked,
            file: folder.model("aliked.onnx", &sparse_extractor().bytes()),
        },
        matcher: MatcherChoice::Model {
            contract: MatcherContract::LightGlue,
            file: folder.model("lightglue.onnx", &lightglue(256).bytes()),
            extractor_sha256: None,
            confidence_min: None,
        },
        library: Some(library),
        ..FeatureChoice::default()
    };
    let said = choice.open(&PerceptionConfig::default()).err().unwrap().to_string();
    assert!(said.contains("found extractor aliked with descriptors of length 128"), "{said}");
}

/// Contract `aliked` with three keypoints, whatever the image.
fn sparse_extractor() -> Model {
    let descriptors: Vec<f32> = (0..3 * 128).map(|i| (i % 7) as f32).collect();
    Model::new()
        .input("image", Kind::Float, &[Side::Is(1), Side::Is(3), Side::Named("H"), Side::Named("W")])
        .constant("k", &[1, 3, 2], &[-1.0, -1.0, 0.0, 0.0, 1.0, 1.0])
        .constant("s", &[1, 3], &[0.2, 0.9, 0.5])
        .constant("d", &[1, 3, 128], &descriptors)
        .node("Identity", &["k"], "keypoints", &[])
        .node("Identity", &["s"], "scores", &[])
        .node("Identity", &["d"], "descriptors", &[])
        .output("keypoints", Kind::Float, &[Side::Is(1), Side::Is(3), Side::Is(2)])
        .output("scores", Kind::Float, &[Side::Is(1), Side::Is(3)])
        .output("descriptors", Kind::Float, &[Side::Is(1), Side::Is(3), Side::Is(128)])
}

/// Contract `lightglue` by its ports alone.
fn lightglue(dimension: u64) -> Model {
    let mut model = Model::new();
    for (i, n) in [("0", "N0"), ("1", "N1")] {
        model = model.input(&format!("kpts{i}"), Kind::Float, &[Side::Is(1), Side::Named(n), Side::Is(2)]).input(
            &format!("desc{i}"),
            Kind::Float,
            &[Side::Is(1), Side::Named(n), Side::Is(dimension)],
        );
    }
    model
        .node("Shape", &["kpts0"], "shape", &[])
        .node("Unsqueeze", &["shape", "shape"], "matches0", &[])
        .node("Identity", &["kpts0"], "mscores0", &[])
        .output("matches0", Kind::Int64, &[Side::Named("M"), Side::Is(2)])
        .output("mscores0", Kind::Float, &[Side::Named("M")])
}

#[test]
fn names_that_nobody_knows_are_answered_with_those_that_are() {
    let folder = Folder::new();
    let listed = ModelName::Listed("homing".to_owned());
    let said = ExtractorChoice::resolve(&listed, folder.path()).unwrap_err().to_string();
    assert!(said.contains(MANIFEST) && said.contains("--models"), "{said}");
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("models");
    let unknown = ModelName::Listed("surf".to_owned());
    let said = ExtractorChoice::resolve(&unknown, &shipped).unwrap_err().to_string();
    assert_eq!(said, "extractor \"surf\" is unknown: expected one of sift, homing-extractor, homing-r2d2");
    let file = ModelName::File {
        contract: "superglue".to_owned(),
        file: ModelFile { path: "x".into(), sha256: String::new() },
    };
    let said = MatcherChoice::resolve(&file, folder.path()).unwrap_err().to_string();
    assert!(said.contains("contract \"superglue\" is unknown: expected one of homing-matcher, lighterglue"), "{said}");
    std::fs::write(folder.path().join(MANIFEST), "{\"format\": 1}").unwrap();
    let said = ExtractorChoice::resolve(&listed, folder.path()).unwrap_err().to_string();
    assert!(said.contains(MANIFEST) && said.contains("missing field `models`"), "{said}");
}
