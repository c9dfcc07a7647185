//! The models that come with Homing: `manifest.json` in their folder, written by training, read here.

use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::error::ChoiceError;
use super::extractors::ExtractorContract;
use super::file::ModelFile;
use super::matchers::MatcherContract;
use super::switch;

/// Name of the file in the folder of models.
pub const MANIFEST: &str = "manifest.json";

/// Where the models lie, seen from the repository's root: the default of every process and command.
pub const FOLDER: &str = "nodes/perception/models";

/// Version of the format that is read.
const FORMAT: u32 = 1;

/// What a model is for.
#[derive(Copy, Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Role {
    /// Finds keypoints.
    Extractor,
    /// Pairs keypoints.
    Matcher,
    /// Tells whether two images were taken near each other.
    Switch,
}

impl Role {
    /// For reports, and the end of a model's name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Extractor => "extractor",
            Self::Matcher => "matcher",
            Self::Switch => "switch",
        }
    }
}

/// One model. Training writes more about it than is read here.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Entry {
    /// Its name, unique for its role. Where the role is clear, "homing" also means "homing-extractor" or "homing-matcher".
    pub name: String,
    /// What it is for.
    #[serde(rename = "kind")]
    pub role: Role,
    /// Its contract's name.
    #[serde(default = "our_own")]
    pub contract: String,
    /// Its file, in the manifest's folder.
    pub file: String,
    /// The file's sha256, 64 hexadecimal digits.
    pub sha256: String,
    /// The file's length.
    pub bytes: u64,
    /// Under what it may be used.
    pub licence: String,
    /// How it was made.
    pub training: Training,
    /// What was measured when it was made; for people.
    #[serde(default)]
    pub accuracy: serde_json::Value,
    /// Of a matcher or a switch: the sha256 of the extractor whose descriptors it was trained on.
    #[serde(default)]
    pub extractor_sha256: Option<String>,
    /// Of a matcher: the smallest confidence of a match, 0 to 1, that served best on validation.
    #[serde(default)]
    pub confidence_min: Option<f32>,
}

/// How a model was made.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
pub struct Training {
    /// Commit of the training scripts.
    pub commit: String,
}

fn our_own() -> String {
    ExtractorContract::Homing.contract().name.to_owned()
}

/// All of them.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
pub struct Manifest {
    /// Version of the format: 1.
    pub format: u32,
    /// The models.
    pub models: Vec<Entry>,
}

impl Manifest {
    /// From the manifest's text.
    ///
    /// # Errors
    /// What is wrong with it, with line and column where it is no JSON of this form.
    pub fn parse(text: &str) -> Result<Self, String> {
        let manifest: Self = serde_json::from_str(text).map_err(|e| e.to_string())?;
        if manifest.format != FORMAT {
            return Err(format!("expected format {FORMAT}, found {}", manifest.format));
        }
        for (i, entry) in manifest.models.iter().enumerate() {
            let known = match entry.role {
                Role::Extractor => ExtractorContract::named(&entry.contract).is_some(),
                Role::Matcher => MatcherContract::named(&entry.contract).is_some(),
                Role::Switch => entry.contract == switch::CONTRACT.name,
            };
            if !known {
                return Err(format!("model {}: contract \"{}\" is unknown", entry.name, entry.contract));
            }
            if entry.confidence_min.is_some_and(|limit| !(0.0..=1.0).contains(&limit)) {
                return Err(format!("model {}: confidence_min is not in 0..1", entry.name));
            }
            // A file elsewhere is named by its path in the configuration, not here.
            if Path::new(&entry.file).file_name() != Some(entry.file.as_ref()) {
                return Err(format!("model {}: \"{}\" is not the plain name of a file", entry.name, entry.file));
            }
            if manifest.models[..i].iter().any(|e| (&e.name, e.role) == (&entry.name, entry.role)) {
                return Err(format!("model {} is listed twice", entry.name));
            }
        }
        Ok(manifest)
    }

    /// Reads the manifest of a folder. A folder without one lists nothing.
    ///
    /// # Errors
    /// [`ChoiceError::Manifest`] with the path and what is wrong.
    pub fn read(folder: &Path) -> Result<Self, ChoiceError> {
        let path = folder.join(MANIFEST);
        let wrong = |reason: String| ChoiceError::Manifest { path: path.clone(), reason };
        match std::fs::read_to_string(&path) {
            Ok(text) => Self::parse(&text).map_err(wrong),
            Err(cause) if cause.kind() == std::io::ErrorKind::NotFound => {
                Ok(Self { format: FORMAT, models: Vec::new() })
            }
            Err(cause) => Err(wrong(cause.to_string())),
        }
    }

    /// The model of that name and role.
    #[must_use]
    pub fn find(&self, name: &str, role: Role) -> Option<&Entry> {
        let mut of_role = self.models.iter().filter(|entry| entry.role == role);
        of_role.find(|entry| entry.name == name || entry.name == format!("{name}-{}", role.name()))
    }

    /// The first matcher that was trained on the extractor of that hash.
    #[must_use]
    pub fn matcher_of(&self, extractor_sha256: &str) -> Option<&Entry> {
        let trained_on_it = |entry: &&Entry| {
            entry.extractor_sha256.as_ref().is_some_and(|hash| hash.eq_ignore_ascii_case(extractor_sha256))
        };
        self.models.iter().filter(|entry| entry.role == Role::Matcher).find(trained_on_it)
    }

    /// Names of the models of a role.
    pub fn names(&self, role: Role) -> impl Iterator<Item = &str> {
        self.models.iter().filter(move |entry| entry.role == role).map(|entry| entry.name.as_str())
    }
}

impl Entry {
    /// The file to open, given the manifest's folder.
    #[must_use]
    pub fn model_file(&self, folder: &Path) -> ModelFile {
        ModelFile { path: PathBuf::from(folder).join(&self.file), sha256: self.sha256.clone() }
    }
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "tests")]
mod tests {
    use super::*;

    fn manifest(change: impl Fn(&mut serde_json::Value)) -> Result<Manifest, String> {
        let entry = |role: &str| {
            serde_json::json!({
                "name": format!("homing-{role}"), "kind": role, "file": format!("{role}.onnx"), "opset": 18,
                "sha256": "ab".repeat(32), "bytes": 2_071_234, "licence": "Apache-2.0 OR MIT",
                "training": {"commit": "0123abc", "seed": 1}, "accuracy": {"validation_auc_5deg": 0.5}
            })
        };
        let mut value = serde_json::json!({"format": 1, "models": [entry("extractor"), entry("matcher")]});
        change(&mut value);
        Manifest::parse(&value.to_string())
    }

    #[test]
    fn a_name_and_a_role_give_file_and_hash() {
        let read = manifest(|_| {}).unwrap();
        let found = read.find("homing", Role::Matcher).unwrap();
        assert_eq!(found.model_file(Path::new("models")).path, Path::new("models/matcher.onnx"));
        let extractor = read.find("homing-extractor", Role::Extractor).unwrap();
        assert_eq!((extractor.sha256.as_str(), extractor.contract.as_str()), ("ab".repeat(32).as_str(), "homing"));
        assert_eq!((extractor.training.commit.as_str(), &extractor.extractor_sha256), ("0123abc", &None));
        assert!(read.find("other", Role::Extractor).is_none());
        assert_eq!(found.confidence_min, None);
        let limited = manifest(|v| v["models"][1]["confidence_min"] = 0.25.into()).unwrap();
        assert_eq!(limited.find("homing", Role::Matcher).unwrap().confidence_min, Some(0.25));
        assert_eq!(read.names(Role::Matcher).collect::<Vec<_>>(), ["homing-matcher"]);
    }

    #[test]
    fn what_is_wrong_is_said() {
        let reason = |change: &dyn Fn(&mut serde_json::Value)| manifest(change).unwrap_err();
        assert!(reason(&|v| v["format"] = 2.into()).contains("expected format 1, found 2"));
        assert!(reason(&|v| v["models"][0]["contract"] = "x".into()).contains("contract \"x\" is unknown"));
        assert!(reason(&|v| v["models"][0]["file"] = "../x.onnx".into()).contains("plain name"));
        assert!(reason(&|v| v["models"][0] = v["models"][1].clone()).contains("homing-matcher is listed twice"));
        assert!(reason(&|v| drop(v["models"][0]["sha256"].take())).contains("invalid type: null"));
        assert!(reason(&|v| v["models"][1]["confidence_min"] = 2.into()).contains("confidence_min is not in 0..1"));
        assert!(Manifest::parse("{").unwrap_err().contains("line 1"));
    }

    #[test]
    fn a_folder_without_a_manifest_lists_nothing() {
        assert!(Manifest::read(Path::new("/nowhere")).unwrap().models.is_empty());
    }
}
