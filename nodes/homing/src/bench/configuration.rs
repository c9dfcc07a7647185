//! A configuration of perception as an argument: features, matcher, solver and a few knobs in one word.

use std::path::Path;

use anyhow::{Context, bail};
use homing_benchmark::perception::Setup;
use homing_perception::onnx::file::sha256_hex;
use homing_perception::onnx::{ExtractorChoice, FeatureChoice, MatcherChoice, ModelFile, ModelName};
use homing_perception::{PerceptionConfig, PoseSolver};

const SOLVERS: [(&str, PoseSolver); 4] = [
    ("lo-ransac", PoseSolver::LoRansac),
    ("gravity", PoseSolver::Gravity),
    ("epnp-ransac", PoseSolver::EpnpRansac),
    ("sling-heading", PoseSolver::SlingHeading),
];

/// Reads a configuration. Models are names of the manifest in `models`, or CONTRACT=FILE.
pub fn setup(text: &str, models: &Path) -> anyhow::Result<Setup> {
    let (knobs, label) = text.split_once(",label=").unwrap_or((text, text));
    let mut parts = knobs.split(',');
    let features = parts.next().unwrap_or_default();
    let (extractor, matcher) = match features.split_once('+') {
        Some((extractor, matcher)) => (extractor, Some(matcher)),
        None => (features, None),
    };
    let extractor = ExtractorChoice::resolve(&model(extractor)?, models)?;
    let matcher = match matcher {
        Some(name) => MatcherChoice::resolve(&model(name)?, models)?,
        None => MatcherChoice::belonging_to(&extractor, models)?,
    };
    let mut setup = Setup {
        name: label.to_owned(),
        features: FeatureChoice::of(extractor, matcher),
        perception: PerceptionConfig::default(),
    };
    for part in parts {
        let (key, value) = part.split_once('=').with_context(|| format!("{part:?} in {text:?} is not KEY=VALUE"))?;
        turn(&mut setup, key, value).with_context(|| format!("{part:?} in the configuration {text:?}"))?;
    }
    setup.perception.check()?;
    Ok(setup)
}

fn model(name: &str) -> anyhow::Result<ModelName> {
    let Some((contract, path)) = name.split_once('=') else { return Ok(ModelName::Listed(name.to_owned())) };
    // A file named here is trusted as it is: its hash is worked out, not compared.
    let bytes = std::fs::read(path).with_context(|| format!("cannot read the model {path}"))?;
    let file = ModelFile { path: path.into(), sha256: sha256_hex(&bytes) };
    Ok(ModelName::File { contract: contract.to_owned(), file })
}

fn turn(setup: &mut Setup, key: &str, value: &str) -> anyhow::Result<()> {
    match key {
        "solver" => {
            let names = SOLVERS.map(|(name, _)| name).join(", ");
            let solver = SOLVERS.iter().find(|(name, _)| *name == value);
            setup.perception.solver = solver.with_context(|| format!("{value:?} is none of {names}"))?.1;
            if setup.perception.solver == PoseSolver::Gravity {
                // Cameras of robots are level here.
                (setup.perception.camera_down_rad, setup.perception.goal_down_rad) = (Some(0.0), Some(0.0));
            }
        }
        "keypoints" => {
            let n = value.parse()?;
            setup.perception.sift.keypoints_max = n;
            setup.features.extractor_config.keypoints_max = n;
            setup.features.matcher_config.keypoints_max = n;
        }
        "ratio" => setup.perception.ratio_max = value.parse()?,
        "confidence" => setup.features.matcher_config.confidence_min = value.parse()?,
        "patches" => setup.perception.gates.patch_share_min = value.parse()?,
        "gate" => setup.perception.gates.error_rad_max = value.parse::<f64>()?.to_radians(),
        _ => bail!("{key:?} is none of solver, keypoints, ratio, confidence, patches, gate; a label comes last"),
    }
    Ok(())
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "tests")]
mod tests {
    use super::*;

    #[test]
    fn a_word_says_it_all() {
        let none = Path::new("/nowhere");
        let s = setup("sift,solver=epnp-ransac,keypoints=500,ratio=0.7,label=SIFT, as in the papers", none).unwrap();
        assert_eq!((s.features.extractor.name(), s.features.matcher.name()), ("sift", "mutual-nearest"));
        assert_eq!((s.perception.solver, s.perception.sift.keypoints_max), (PoseSolver::EpnpRansac, 500));
        assert_eq!((s.perception.ratio_max, s.name.as_str()), (0.7, "SIFT, as in the papers"));
        let s = setup("sift+dual-softmax,confidence=0.4", none).unwrap();
        assert_eq!((s.features.matcher.name(), s.features.matcher_config.confidence_min), ("dual-softmax", 0.4));
        let wrong = |text: &str| format!("{:#}", setup(text, none).err().unwrap());
        assert!(wrong("surf").contains("surf"));
        assert!(wrong("sift,solver=pnp").contains("none of lo-ransac, gravity"));
        assert!(wrong("sift,keypoint=3").contains("none of solver, keypoints"));
        assert!(wrong("sift,ratio=9").contains("ratio_max"));
        assert!(wrong("xfeat=/nowhere.onnx").contains("cannot read the model /nowhere.onnx"));
    }
}
