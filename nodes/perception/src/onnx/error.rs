//! Why a model cannot be used: always with its path, what was expected and what was found.

use std::path::PathBuf;

use thiserror::Error;

use crate::RuntimeError;

/// A model that cannot be used.
#[derive(Debug, Error)]
pub enum ModelError {
    /// There is no such file, or it cannot be read.
    #[error("model {}: cannot be read ({source}); expected a file with sha256 {expected_sha256}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What it should hold.
        expected_sha256: String,
        /// What the system says.
        source: std::io::Error,
    },
    /// The configured hash is not one.
    #[error("model {}: sha256 = \"{found}\" is not a sha256 of 64 hexadecimal digits", path.display())]
    BadHash {
        /// The file.
        path: PathBuf,
        /// What is configured.
        found: String,
    },
    /// The file holds something else, or only a part.
    #[error("model {}: expected sha256 {expected}, found {found} over {bytes} bytes: fetch the file again, or correct the hash", path.display())]
    WrongHash {
        /// The file.
        path: PathBuf,
        /// Configured hash.
        expected: String,
        /// Hash of what is there.
        found: String,
        /// Length of what is there.
        bytes: usize,
    },
    /// The right bytes are no ONNX model.
    #[error("model {}: expected an ONNX model, found bytes that are none: {reason}", path.display())]
    NotOnnx {
        /// The file.
        path: PathBuf,
        /// Where reading ended.
        reason: &'static str,
    },
    /// Operators newer or older than ONNX Runtime knows.
    #[error("model {}: expected operator set {oldest} to {newest}, found {found}: export it again", path.display())]
    Opset {
        /// The file.
        path: PathBuf,
        /// Oldest set taken.
        oldest: i64,
        /// Newest set taken.
        newest: i64,
        /// What the model asks for.
        found: i64,
    },
    /// An input or output is missing, or has another type or shape.
    #[error("model {}: contract {contract} expects {expected}, found {found}", path.display())]
    Contract {
        /// The file.
        path: PathBuf,
        /// The contract's name.
        contract: &'static str,
        /// What the contract asks for.
        expected: String,
        /// What the model has.
        found: String,
    },
    /// No execution provider takes the model.
    #[error("model {}: expected it to run on {asked}, but: {reasons}", path.display())]
    NoProvider {
        /// The file.
        path: PathBuf,
        /// Providers tried, best first.
        asked: String,
        /// What each said.
        reasons: String,
    },
    /// A run failed, on the last provider there is.
    #[error("model {}: run failed on {provider}: {reason}", path.display())]
    Run {
        /// The file.
        path: PathBuf,
        /// Where it ran.
        provider: &'static str,
        /// What ONNX Runtime says.
        reason: String,
    },
    /// ONNX Runtime itself.
    #[error(transparent)]
    Runtime(#[from] RuntimeError),
}

/// Why a choice of models cannot work.
#[derive(Debug, Error)]
pub enum ChoiceError {
    /// Nobody knows the name.
    #[error("{role} \"{name}\" is unknown: expected one of {known}")]
    UnknownName {
        /// Extractor, matcher, contract or provider.
        role: &'static str,
        /// The name given.
        name: String,
        /// Names that would do.
        known: String,
    },
    /// A model's name, and no list of models to look it up in.
    #[error(
        "{role} \"{name}\": {} does not exist; start in the repository's root, or say where the models are (--models, or \
         models in [runtime])",
        manifest.display()
    )]
    NoModels {
        /// Extractor or matcher.
        role: &'static str,
        /// The name given.
        name: String,
        /// Where the list was looked for.
        manifest: PathBuf,
    },
    /// Extractor and matcher were not made for each other.
    #[error("matcher {matcher} expects {expected}, found {extractor}: choose another, or mutual-nearest")]
    Mismatch {
        /// The matcher.
        matcher: String,
        /// What it was trained on.
        expected: String,
        /// The extractor, and the length of its descriptors where that is known.
        extractor: String,
    },
    /// The learned switch was made for other features.
    #[error("switch {switch} expects {expected}, found {extractor}: choose that, or no switch")]
    SwitchMismatch {
        /// The switch's contract.
        switch: &'static str,
        /// What it was trained on.
        expected: String,
        /// The extractor.
        extractor: String,
    },
    /// The matcher or switch was trained on another version of the extractor.
    #[error("model {matcher}: expected the extractor it was trained on, sha256 {expected}, found {found}")]
    TrainedOn {
        /// The file of the matcher or switch.
        matcher: String,
        /// Hash of the extractor it was trained on.
        expected: String,
        /// Hash of the extractor chosen.
        found: String,
    },
    /// The list of models cannot be used.
    #[error("list of models {}: {reason}", path.display())]
    Manifest {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
}
