//! A network as the extractors and matchers see it: float tensors in, tensors out. Behind it is an ONNX Runtime session, or
//! in tests a few lines that stand in for one.

use std::path::Path;

use super::contract::{Contract, FoundPort};
use super::error::ModelError;
use super::session::Provider;

/// A tensor that goes in, in the order of the contract's inputs.
#[derive(Clone, Debug)]
pub struct Input<'a> {
    /// Sides.
    pub shape: Vec<usize>,
    /// Row-major elements.
    pub data: &'a [f32],
}

/// A tensor that came out, in the order of the contract's outputs.
#[derive(Clone, Debug)]
pub struct Output<'a> {
    /// Sides.
    pub shape: Vec<usize>,
    /// Row-major elements.
    pub data: Data<'a>,
}

/// Elements of an [`Output`].
#[derive(Copy, Clone, Debug)]
pub enum Data<'a> {
    /// Floats.
    F32(&'a [f32]),
    /// Integers.
    I64(&'a [i64]),
}

impl<'a> Output<'a> {
    /// The elements as floats; empty if they are integers, which the contract's check rules out.
    #[must_use]
    pub fn floats(&self) -> &'a [f32] {
        match self.data {
            Data::F32(data) => data,
            Data::I64(_) => &[],
        }
    }

    /// The elements as integers; empty if they are floats.
    #[must_use]
    pub fn integers(&self) -> &'a [i64] {
        match self.data {
            Data::I64(data) => data,
            Data::F32(_) => &[],
        }
    }

    /// One element, whatever the type.
    #[must_use]
    pub fn number(&self, i: usize) -> f32 {
        match self.data {
            Data::F32(data) => data[i],
            Data::I64(data) => data[i] as f32,
        }
    }
}

/// Reads the outputs of one run.
pub type Reader<'a> = &'a mut dyn FnMut(&[Output<'_>]);

/// Something that runs.
pub trait Network: Send {
    /// The contract it fulfils.
    fn contract(&self) -> &'static Contract;
    /// The model's file.
    fn path(&self) -> &Path;
    /// The model's own inputs, in the order of the contract: fixed sides are those it was exported with.
    fn inputs(&self) -> &[FoundPort];
    /// The model's own outputs, in the order of the contract.
    fn outputs(&self) -> &[FoundPort];
    /// Where it runs now.
    fn provider(&self) -> Provider;
    /// Runs once; `read` sees the outputs, which fit the contract's shapes.
    ///
    /// # Errors
    /// [`ModelError::Run`] if the run fails, [`ModelError::Contract`] if an output has another shape.
    fn run(&mut self, inputs: &[Input<'_>], read: Reader<'_>) -> Result<(), ModelError>;
    /// Gives up the accelerator. `false` if it runs on the CPU already.
    ///
    /// # Errors
    /// [`ModelError`] if the CPU does not take the model either.
    fn fall_back_to_cpu(&mut self) -> Result<bool, ModelError>;
}

/// An output that does not fit the contract in a way its shapes alone cannot say.
pub(super) fn refuse(network: &dyn Network, expected: &str, found: String) -> ModelError {
    ModelError::Contract {
        path: network.path().to_owned(),
        contract: network.contract().name,
        expected: expected.to_owned(),
        found,
    }
}

/// Runs, and once more on the CPU if an accelerator fails: it may be lost or out of memory.
pub(super) fn run_somewhere(
    network: &mut dyn Network,
    inputs: &[Input<'_>],
    read: Reader<'_>,
) -> Result<(), ModelError> {
    let Err(fault) = network.run(inputs, read) else { return Ok(()) };
    if network.provider() == Provider::Cpu || matches!(fault, ModelError::Contract { .. }) {
        return Err(fault);
    }
    let lost = network.provider();
    tracing::error!("DEGRADED: {fault}; {} is given up, the model goes on on the CPU", lost.name());
    network.fall_back_to_cpu()?;
    network.run(inputs, read)
}
