//! Which features an example uses, from its arguments.

use std::path::PathBuf;

use homing_perception::PerceptionConfig;
use homing_perception::onnx::file::sha256_hex;
use homing_perception::onnx::{ExtractorChoice, FeatureChoice, MatcherChoice, ModelFile, ModelName, ProviderChoice};

type Fallible<T> = Result<T, Box<dyn std::error::Error>>;

/// What the arguments say about features.
pub const USAGE: &str = "[--extractor sift | NAME | CONTRACT=FILE] [--matcher mutual-nearest | dual-softmax | NAME | \
                         CONTRACT=FILE] [--keypoints N] [--ratio R] [--confidence C] [--threads N] [--provider P] \
                         [--models FOLDER] [--library FILE]";

/// Features and configuration; a file is trusted as it is.
pub fn from_arguments(arguments: &[String]) -> Fallible<(FeatureChoice, PerceptionConfig)> {
    let value = |name: &str| arguments.iter().position(|a| a == name).and_then(|i| arguments.get(i + 1));
    let folder = value("--models").map_or_else(|| PathBuf::from("nodes/perception/models"), PathBuf::from);
    let (mut choice, mut config) = (FeatureChoice::default(), PerceptionConfig::default());
    if let Some(name) = value("--extractor") {
        choice.extractor = ExtractorChoice::resolve(&model(name)?, &folder)?;
    }
    if let Some(name) = value("--matcher") {
        choice.matcher = MatcherChoice::resolve(&model(name)?, &folder)?;
        choice.matcher_config.confidence_min = choice.matcher.confidence_min();
    }
    if let Some(n) = value("--keypoints") {
        config.sift.keypoints_max = n.parse()?;
        choice.extractor_config.keypoints_max = n.parse()?;
        choice.matcher_config.keypoints_max = n.parse()?;
    }
    if let Some(ratio) = value("--ratio") {
        config.ratio_max = ratio.parse()?;
    }
    if let Some(confidence) = value("--confidence") {
        choice.matcher_config.confidence_min = confidence.parse()?;
    }
    if let Some(threads) = value("--threads") {
        choice.run.threads = threads.parse()?;
        config.threads = Some(threads.parse()?);
    }
    if let Some(provider) = value("--provider") {
        let found = ProviderChoice::NAMES.iter().find(|(name, _)| name == provider);
        choice.run.provider = found.ok_or("which provider?")?.1;
    }
    choice.library = value("--library").map(PathBuf::from);
    Ok((choice, config))
}

fn model(name: &str) -> Fallible<ModelName> {
    let Some((contract, path)) = name.split_once('=') else { return Ok(ModelName::Listed(name.to_owned())) };
    let bytes = std::fs::read(path).map_err(|e| format!("{path}: {e}"))?;
    let file = ModelFile { path: path.into(), sha256: sha256_hex(&bytes) };
    Ok(ModelName::File { contract: contract.to_owned(), file })
}
