//! Opening a verified model on the first execution provider that takes it, and saying which one that was.

use core::fmt;
use std::borrow::Cow;
use std::path::Path;

use ort::ep::{CUDA, ExecutionProviderDispatch, TensorRT, cuda::ConvAlgorithmSearch};
use ort::session::{Session, SessionInputValue};
use ort::value::{DynValue, Outlet, TensorElementType, TensorRef};

use super::contract::{Binding, Contract, Element, FoundPort};
use super::error::ModelError;
use super::file::VerifiedModel;
use super::network::{Data, Input, Network, Output, Reader};
use crate::provider::Runtime;

/// Where a model is asked to run.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub enum ProviderChoice {
    /// CUDA where it works, else the CPU. Not TensorRT: it compiles for minutes at the first start.
    #[default]
    Auto,
    /// CUDA, else the CPU.
    Cuda,
    /// TensorRT, else CUDA, else the CPU.
    TensorRt,
    /// The CPU.
    Cpu,
}

/// Where a model runs.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Provider {
    /// NVIDIA TensorRT.
    TensorRt,
    /// NVIDIA CUDA.
    Cuda,
    /// The CPU.
    Cpu,
}

impl ProviderChoice {
    /// Names in configurations, with what they stand for.
    pub const NAMES: [(&'static str, Self); 4] =
        [("auto", Self::Auto), ("cuda", Self::Cuda), ("tensorrt", Self::TensorRt), ("cpu", Self::Cpu)];

    /// Providers in the order in which they are tried.
    #[must_use]
    pub fn order(self) -> &'static [Provider] {
        match self {
            Self::Auto | Self::Cuda => &[Provider::Cuda, Provider::Cpu],
            Self::TensorRt => &[Provider::TensorRt, Provider::Cuda, Provider::Cpu],
            Self::Cpu => &[Provider::Cpu],
        }
    }
}

impl Provider {
    /// For people.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::TensorRt => "TensorRT",
            Self::Cuda => "CUDA",
            Self::Cpu => "the CPU",
        }
    }

    fn dispatch(self) -> Option<ExecutionProviderDispatch> {
        match self {
            Self::TensorRt => Some(TensorRT::default().build().error_on_failure()),
            // An exhaustive search would stop the first frame of every new image size for seconds.
            Self::Cuda => Some(
                CUDA::default().with_conv_algorithm_search(ConvAlgorithmSearch::Heuristic).build().error_on_failure(),
            ),
            Self::Cpu => None,
        }
    }
}

/// How models run.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub struct RunConfig {
    /// Where.
    pub provider: ProviderChoice,
    /// Threads of one run on the CPU; 0 is one per core.
    pub threads: u16,
}

/// A model ready to run.
pub struct OrtNetwork {
    runtime: &'static Runtime,
    model: VerifiedModel,
    contract: &'static Contract,
    threads: u16,
    session: Session,
    provider: Provider,
    /// Providers that were tried before, and why they did not take it.
    refused: Vec<(Provider, String)>,
    inputs: Vec<FoundPort>,
    outputs: Vec<FoundPort>,
}

impl fmt::Debug for OrtNetwork {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} from {} on {}", self.contract.name, self.model.path.display(), self.provider.name())
    }
}

impl OrtNetwork {
    /// Opens the model on the first provider of the choice that takes it, and checks it against the contract.
    ///
    /// # Errors
    /// [`ModelError::NoProvider`] with every provider's reason, [`ModelError::Contract`] for ports that do not fit.
    pub fn open(
        runtime: &'static Runtime,
        model: VerifiedModel,
        contract: &'static Contract,
        config: RunConfig,
    ) -> Result<Self, ModelError> {
        let (session, provider, refused) = first_that_opens(runtime, &model, config)?;
        let (inputs, outputs) = ports(&session, &model, contract)?;
        let network =
            Self { runtime, model, contract, threads: config.threads, session, provider, refused, inputs, outputs };
        network.say(config.provider);
        Ok(network)
    }

    /// Providers that were tried before the one in use, each with its reason.
    #[must_use]
    pub fn refused(&self) -> &[(Provider, String)] {
        &self.refused
    }

    /// Operator set of the model.
    #[must_use]
    pub fn opset(&self) -> i64 {
        self.model.opset
    }

    fn say(&self, asked: ProviderChoice) {
        let (model, mut why) = (self.contract.name, String::new());
        for (provider, reason) in &self.refused {
            match asked {
                ProviderChoice::Auto => why = format!("{why}; no {}: {reason}", provider.name()),
                _ => tracing::warn!("{model}: {} was asked for and is not there: {reason}", provider.name()),
            }
        }
        tracing::info!("{model} runs on {} ({}{why})", self.provider.name(), self.model.path.display());
    }

    fn failed(&self, cause: &impl fmt::Display) -> ModelError {
        ModelError::Run { path: self.model.path.clone(), provider: self.provider.name(), reason: cause.to_string() }
    }
}

impl Network for OrtNetwork {
    fn contract(&self) -> &'static Contract {
        self.contract
    }

    fn path(&self) -> &Path {
        &self.model.path
    }

    fn inputs(&self) -> &[FoundPort] {
        &self.inputs
    }

    fn outputs(&self) -> &[FoundPort] {
        &self.outputs
    }

    fn provider(&self) -> Provider {
        self.provider
    }

    fn run(&mut self, inputs: &[Input<'_>], read: Reader<'_>) -> Result<(), ModelError> {
        let values = tensors(&self.inputs, inputs).map_err(|cause| self.failed(&cause))?;
        let (path, provider) = (&self.model.path, self.provider);
        let failed = |reason: String| ModelError::Run { path: path.clone(), provider: provider.name(), reason };
        let values = self.session.run(values).map_err(|cause| failed(cause.to_string()))?;
        let mut outputs = Vec::with_capacity(self.outputs.len());
        for (port, found) in self.contract.outputs.iter().zip(&self.outputs) {
            let value = values.get(&found.name).ok_or_else(|| failed(format!("no output \"{}\" came", found.name)))?;
            let output = extract(value).map_err(|cause| failed(cause.to_string()))?;
            if !port.has_shape(&output.shape) {
                return Err(ModelError::Contract {
                    path: path.clone(),
                    contract: self.contract.name,
                    expected: format!("output {port}"),
                    found: format!("\"{}\" of {:?}", found.name, output.shape),
                });
            }
            outputs.push(output);
        }
        read(&outputs);
        Ok(())
    }

    fn fall_back_to_cpu(&mut self) -> Result<bool, ModelError> {
        if self.provider == Provider::Cpu {
            return Ok(false);
        }
        let config = RunConfig { provider: ProviderChoice::Cpu, threads: self.threads };
        let (session, provider, _) = first_that_opens(self.runtime, &self.model, config)?;
        (self.session, self.provider) = (session, provider);
        Ok(true)
    }
}

type Opened = (Session, Provider, Vec<(Provider, String)>);

fn first_that_opens(runtime: &'static Runtime, model: &VerifiedModel, config: RunConfig) -> Result<Opened, ModelError> {
    let mut refused = Vec::new();
    for &provider in config.provider.order() {
        match open_on(runtime, model, provider, config.threads) {
            Ok(session) => return Ok((session, provider, refused)),
            Err(cause) => refused.push((provider, cause.to_string())),
        }
    }
    let reasons: Vec<String> = refused.iter().map(|(p, reason)| format!("{}: {reason}", p.name())).collect();
    let asked: Vec<&str> = config.provider.order().iter().map(|p| p.name()).collect();
    Err(ModelError::NoProvider { path: model.path.clone(), asked: asked.join(" or "), reasons: reasons.join("; ") })
}

fn open_on(runtime: &'static Runtime, model: &VerifiedModel, provider: Provider, threads: u16) -> ort::Result<Session> {
    let mut builder = Session::builder(runtime.environment())?.with_intra_threads(usize::from(threads))?;
    if let Some(dispatch) = provider.dispatch() {
        builder = builder.with_execution_providers([dispatch])?;
    }
    builder.commit_from_memory(&model.bytes)
}

/// The model's ports in the order of the contract's.
fn ports(
    session: &Session,
    model: &VerifiedModel,
    contract: &'static Contract,
) -> Result<(Vec<FoundPort>, Vec<FoundPort>), ModelError> {
    let found = |outlets: &[Outlet]| outlets.iter().map(found_port).collect::<Vec<_>>();
    let (inputs, outputs) = (found(session.inputs()), found(session.outputs()));
    let Binding { inputs: i, outputs: o } =
        contract.bind(&inputs, &outputs).map_err(|misfit| ModelError::Contract {
            path: model.path.clone(),
            contract: contract.name,
            expected: misfit.expected,
            found: misfit.found,
        })?;
    let ordered = |indices: Vec<usize>, ports: &[FoundPort]| indices.iter().map(|&i| ports[i].clone()).collect();
    Ok((ordered(i, &inputs), ordered(o, &outputs)))
}

fn found_port(outlet: &Outlet) -> FoundPort {
    let element = match outlet.dtype().tensor_type() {
        Some(TensorElementType::Float32) => Some(Element::F32),
        Some(TensorElementType::Int64) => Some(Element::I64),
        _ => None,
    };
    let sides = outlet.dtype().tensor_shape().map(|shape| shape.iter().map(|&n| usize::try_from(n).ok()).collect());
    FoundPort { name: outlet.name().to_owned(), element, shape: sides.unwrap_or_default() }
}

type Named<'i, 'v> = Vec<(Cow<'i, str>, SessionInputValue<'v>)>;

fn tensors<'i, 'v>(ports: &'i [FoundPort], inputs: &[Input<'v>]) -> ort::Result<Named<'i, 'v>> {
    let pairs = ports.iter().zip(inputs);
    pairs
        .map(|(port, input)| {
            let value = TensorRef::from_array_view((input.shape.clone(), input.data))?;
            Ok((Cow::from(port.name.as_str()), SessionInputValue::from(value)))
        })
        .collect()
}

fn extract(value: &DynValue) -> ort::Result<Output<'_>> {
    let sides = |shape: &[i64]| shape.iter().map(|&n| usize::try_from(n).unwrap_or(0)).collect();
    if value.dtype().tensor_type() == Some(TensorElementType::Int64) {
        let (shape, data) = value.try_extract_tensor::<i64>()?;
        return Ok(Output { shape: sides(shape), data: Data::I64(data) });
    }
    let (shape, data) = value.try_extract_tensor::<f32>()?;
    Ok(Output { shape: sides(shape), data: Data::F32(data) })
}
