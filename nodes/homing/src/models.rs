//! `homing models`: which models there are, whether they work, and what their contracts mean.

use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow, bail};
use clap::Args;
use homing_perception::onnx::inventory::AnyContract;
use homing_perception::onnx::registry::FOLDER;
use homing_perception::onnx::{
    Entry, ExtractorContract, Manifest, MatcherContract, ModelFile, ProviderChoice, Role, RunConfig, switch,
};
use homing_perception::{Runtime, RuntimeError, find_runtime};

use crate::Ended;

/// Lists the models that come with Homing and explains the contracts. Exit code 1 if a check fails.
#[derive(Args)]
pub struct ModelsArgs {
    /// Check every model, or the one given with --file: hash, load, one run on a test image, and the time it takes.
    #[arg(long)]
    check: bool,
    /// Explain the contracts: what a model takes and gives.
    #[arg(long)]
    explain: bool,
    /// The folder with the models and their manifest.json.
    #[arg(long, default_value = FOLDER)]
    models: PathBuf,
    /// Check this file in place of the listed ones; needs --contract and --sha256.
    #[arg(long, requires_all = ["contract", "sha256"])]
    file: Option<PathBuf>,
    /// The contract of --file.
    #[arg(long)]
    contract: Option<String>,
    /// The sha256 of --file.
    #[arg(long)]
    sha256: Option<String>,
    /// Where models run: auto, cuda, tensorrt or cpu.
    #[arg(long, default_value = "auto")]
    provider: String,
    /// Threads of a model on the CPU; 0 is one per core.
    #[arg(long, default_value_t = 0)]
    threads: u16,
    /// ONNX Runtime's library; found by itself if not given.
    #[arg(long)]
    library: Option<PathBuf>,
}

pub fn run(args: ModelsArgs) -> anyhow::Result<Ended> {
    let provider = ProviderChoice::NAMES.iter().find(|(name, _)| *name == args.provider);
    let provider = provider.ok_or_else(|| anyhow!("--provider {}: auto, cuda, tensorrt or cpu", args.provider))?.1;
    let run = RunConfig { provider, threads: args.threads };
    if let (Some(path), Some(contract), Some(sha256)) = (&args.file, &args.contract, &args.sha256) {
        let contract = AnyContract::all()
            .find(|c| c.contract().name == contract)
            .ok_or_else(|| anyhow!("--contract {contract}: `homing models --explain` lists them"))?;
        let file = ModelFile { path: path.clone(), sha256: sha256.clone() };
        return Ok(ended(check(contract, &file, &args, run)?));
    }
    let manifest = Manifest::read(&args.models)?;
    if manifest.models.is_empty() {
        bail!(
            "{}: no models are listed; start in the repository's root, or name their folder with --models",
            args.models.display()
        );
    }
    let mut all_well = true;
    for entry in &manifest.models {
        describe(entry);
        if args.check {
            all_well &= check(contract_of(entry)?, &entry.model_file(&args.models), &args, run)?;
        }
    }
    if args.explain {
        AnyContract::all().for_each(|contract| println!("\n{}", contract.explain()));
    } else {
        println!("\n--extractor homing and --matcher homing are short for the first of either.");
        println!("--explain says what the contracts mean, --check tries the models.");
    }
    Ok(ended(all_well))
}

fn ended(well: bool) -> Ended {
    if well { Ended::Well } else { Ended::Missed }
}

fn describe(entry: &Entry) {
    let role = entry.role.name();
    println!("{} ({role}, contract {}): {}, {} bytes", entry.name, entry.contract, entry.file, entry.bytes);
    println!("  sha256 {}", entry.sha256);
    println!("  licence {}, trained at {}", entry.licence, entry.training.commit);
    for (method, share) in solved(&entry.accuracy) {
        println!("  of 300 pairs of views of validation flats {share:.2} within 0.25 m and 10 deg, with {method}");
    }
}

/// What the manifest says of the validation pairs: matching method, share solved.
fn solved(accuracy: &serde_json::Value) -> Vec<(&str, f64)> {
    let methods = accuracy.get("validation").and_then(serde_json::Value::as_object);
    let solved = |figures: &serde_json::Value| figures.get("all")?.get("0.25m_10deg")?.as_f64();
    methods.into_iter().flatten().filter_map(|(name, figures)| Some((name.as_str(), solved(figures)?))).collect()
}

fn contract_of(entry: &Entry) -> anyhow::Result<AnyContract> {
    let found = match entry.role {
        Role::Extractor => ExtractorContract::named(&entry.contract).map(AnyContract::Extractor),
        Role::Matcher => MatcherContract::named(&entry.contract).map(AnyContract::Matcher),
        Role::Switch => (entry.contract == switch::CONTRACT.name).then_some(AnyContract::Switch),
    };
    found.ok_or_else(|| anyhow!("model {}: contract {} is unknown", entry.name, entry.contract))
}

/// Prints how the check went; `false` if the model cannot be used.
fn check(contract: AnyContract, file: &ModelFile, args: &ModelsArgs, run: RunConfig) -> anyhow::Result<bool> {
    let runtime = runtime(args.library.as_deref()).context("models cannot be checked")?;
    match contract.check(file, runtime, run) {
        Ok(checked) => {
            let ms = |time: std::time::Duration| time.as_secs_f64() * 1e3;
            for (provider, reason) in &checked.refused {
                println!("  --      {}: {reason}", provider.name());
            }
            println!(
                "  ok      operator set {}, runs on {}: {}; first result after {:.0} ms, then {:.1} ms",
                checked.opset,
                checked.provider.name(),
                checked.result,
                ms(checked.start),
                ms(checked.run)
            );
            Ok(true)
        }
        Err(cause) => {
            println!("  FAILED  {cause}");
            Ok(false)
        }
    }
}

fn runtime(library: Option<&Path>) -> Result<&'static Runtime, RuntimeError> {
    let library = library.map(Path::to_owned).or_else(find_runtime).ok_or(RuntimeError::NotFound)?;
    Runtime::load(&library)
}
