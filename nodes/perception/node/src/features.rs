//! `[features]`, `[matcher]` and `[runtime]` of the process's TOML file.

use std::fmt;
use std::path::PathBuf;

use homing_perception::PerceptionConfig;
use homing_perception::onnx::{
    ChoiceError, ExtractorChoice, ExtractorConfig, FeatureChoice, MatcherChoice, MatcherConfig, ModelFile, ModelName,
    ProviderChoice, RunConfig, SwitchChoice, registry,
};
use serde::de::value::MapAccessDeserializer;
use serde::de::{MapAccess, Visitor};
use serde::{Deserialize, Deserializer};

/// `[features]`.
#[derive(Clone, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FeatureSettings {
    /// "sift", a name of the manifest, or { contract, path, sha256 }.
    pub extractor: ModelSetting,
    /// Most keypoints per image; where none is named, 1024 of a model and 1500 of SIFT.
    pub keypoints_max: Option<usize>,
    /// A model that says, beside them, whether an image was taken near the photo: "homing-switch", or { contract, path, sha256 };
    /// none where none is named.
    pub switch: Option<ModelSetting>,
    /// A larger image is shrunk to this longer side before a model sees it, pixels.
    pub side_max_px: u32,
}

/// `[matcher]`.
#[derive(Clone, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MatcherSettings {
    /// "mutual-nearest", "dual-softmax", a name of the manifest, or { contract, path, sha256 }; where none is named, the one
    /// that goes with the extractor.
    pub method: Option<ModelSetting>,
    /// Largest ratio of the ratio test (mutual-nearest).
    pub ratio_max: f32,
    /// Smallest confidence of a match (dual-softmax and models); where none is named, the model's own.
    pub confidence_min: Option<f32>,
}

/// `[runtime]`.
#[derive(Clone, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RuntimeSettings {
    /// Where models run: auto, cuda, tensorrt or cpu.
    pub provider: String,
    /// Threads of a model on the CPU; 0 is one per core.
    pub threads: u16,
    /// ONNX Runtime's library; empty looks for it.
    pub library: PathBuf,
    /// The folder of the models that come with Homing.
    pub models: PathBuf,
}

/// A model by its name, or any file that fulfils a contract.
#[derive(Clone, Debug)]
pub enum ModelSetting {
    /// By name.
    Named(String),
    /// By path and hash.
    File(FileSetting),
}

/// `{ contract = "xfeat", path = "xfeat.onnx", sha256 = "..." }`.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FileSetting {
    contract: String,
    path: PathBuf,
    sha256: String,
}

impl<'de> Deserialize<'de> for ModelSetting {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct NameOrFile;
        impl<'de> Visitor<'de> for NameOrFile {
            type Value = ModelSetting;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a name, or { contract = \"...\", path = \"...\", sha256 = \"...\" }")
            }

            fn visit_str<E>(self, name: &str) -> Result<ModelSetting, E> {
                Ok(ModelSetting::Named(name.to_owned()))
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<ModelSetting, A::Error> {
                FileSetting::deserialize(MapAccessDeserializer::new(map)).map(ModelSetting::File)
            }
        }
        deserializer.deserialize_any(NameOrFile)
    }
}

impl ModelSetting {
    fn name(&self) -> ModelName {
        match self {
            Self::Named(name) => ModelName::Listed(name.clone()),
            Self::File(FileSetting { contract, path, sha256 }) => ModelName::File {
                contract: contract.clone(),
                file: ModelFile { path: path.clone(), sha256: sha256.clone() },
            },
        }
    }
}

impl Default for FeatureSettings {
    fn default() -> Self {
        Self {
            extractor: ModelSetting::Named("homing".to_owned()),
            keypoints_max: None,
            switch: None,
            side_max_px: ExtractorConfig::default().side_max_px,
        }
    }
}

impl Default for MatcherSettings {
    fn default() -> Self {
        Self { method: None, ratio_max: PerceptionConfig::default().ratio_max, confidence_min: None }
    }
}

impl Default for RuntimeSettings {
    fn default() -> Self {
        Self { provider: "auto".to_owned(), threads: 0, library: PathBuf::new(), models: registry::FOLDER.into() }
    }
}

/// As the library's choice; the manifest is read where a name asks for it.
pub fn choice(
    features: &FeatureSettings,
    matcher: &MatcherSettings,
    runtime: &RuntimeSettings,
) -> Result<FeatureChoice, ChoiceError> {
    let mut providers = ProviderChoice::NAMES.iter();
    let provider = providers.find(|(name, _)| *name == runtime.provider).ok_or_else(|| ChoiceError::UnknownName {
        role: "provider",
        name: runtime.provider.clone(),
        known: ProviderChoice::NAMES.map(|(name, _)| name).join(", "),
    })?;
    let extractor = ExtractorChoice::resolve(&features.extractor.name(), &runtime.models)?;
    let method = match &matcher.method {
        Some(method) => MatcherChoice::resolve(&method.name(), &runtime.models)?,
        None => MatcherChoice::belonging_to(&extractor, &runtime.models)?,
    };
    let switch = match &features.switch {
        Some(switch) => SwitchChoice::resolve(&switch.name(), &runtime.models)?,
        None => SwitchChoice::default(),
    };
    let confidence_min = matcher.confidence_min.unwrap_or_else(|| method.confidence_min());
    let keypoints_max = features.keypoints_max.unwrap_or(ExtractorConfig::default().keypoints_max);
    Ok(FeatureChoice {
        extractor,
        matcher: method,
        switch,
        extractor_config: ExtractorConfig { keypoints_max, side_max_px: features.side_max_px },
        matcher_config: MatcherConfig { keypoints_max, confidence_min },
        run: RunConfig { provider: provider.1, threads: runtime.threads },
        library: (!runtime.library.as_os_str().is_empty()).then(|| runtime.library.clone()),
    })
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "tests")]
mod tests {
    use homing_perception::onnx::ExtractorContract;

    use super::*;

    #[test]
    fn a_model_is_named_or_described() {
        let named: FeatureSettings = toml::from_str("extractor = \"homing\"").unwrap();
        let sift: FeatureSettings = toml::from_str("extractor = \"sift\"").unwrap();
        let file: FeatureSettings =
            toml::from_str("extractor = { contract = \"xfeat\", path = \"x.onnx\", sha256 = \"ab\" }").unwrap();
        let models = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../models"));
        let (matcher, runtime) = (MatcherSettings::default(), RuntimeSettings { models, ..RuntimeSettings::default() });
        assert_eq!(
            choice(&named, &matcher, &runtime).unwrap(),
            choice(&FeatureSettings::default(), &matcher, &runtime).unwrap()
        );
        // The matcher goes with the extractor.
        assert_eq!(choice(&named, &matcher, &runtime).unwrap().matcher.name(), "homing-matcher");
        assert_eq!(choice(&sift, &matcher, &runtime).unwrap(), FeatureChoice::default());
        let ExtractorChoice::Model { contract, file } = choice(&file, &matcher, &runtime).unwrap().extractor else {
            unreachable!("a file is a model")
        };
        assert_eq!((contract, file.sha256.as_str()), (ExtractorContract::Xfeat, "ab"));
    }

    #[test]
    fn what_is_misspelt_is_refused_with_advice() {
        let wrong = |text: &str| toml::from_str::<FeatureSettings>(text).unwrap_err().to_string();
        assert!(wrong("extractor = 3").contains("expected a name, or { contract"));
        assert!(
            wrong("extractor = { contract = \"xfeat\", path = \"x\", sha = \"y\" }").contains("unknown field `sha`")
        );
        assert!(wrong("ratio_max = 0.8").contains("unknown field"));
        let runtime = RuntimeSettings { provider: "gpu".to_owned(), ..RuntimeSettings::default() };
        let refusal = choice(&FeatureSettings::default(), &MatcherSettings::default(), &runtime).unwrap_err();
        assert!(refusal.to_string().contains("provider \"gpu\" is unknown: expected one of auto, cuda, tensorrt, cpu"));
    }
}
