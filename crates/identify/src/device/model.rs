//! Selection of the device that evaluates the populations of a model.

use super::select::{DeviceSpec, PrecisionSpec};
use super::used::DeviceUsed;
use motorfit_core::Error;
#[cfg(not(feature = "gpu"))]
use motorfit_core::ErrorKind;
use motorfit_core::Result;
use motorfit_core::setting::text;
use motorfit_evaluate::model::{ModelEvaluator, ModelProblem, ModelSimd};
use motorfit_record::warning::Warning;

#[cfg(feature = "gpu")]
use motorfit_gpu::{ModelGpu, Selector};
#[cfg(feature = "gpu")]
use motorfit_model::ShaderPrecision;

/// The device of a model's search.
pub struct ModelDevice {
    /// The evaluator.
    pub evaluator: Box<dyn ModelEvaluator>,
    /// Kind of the device: `cpu` or `gpu`.
    pub kind: &'static str,
    /// Warnings of the selection.
    pub warnings: Vec<Warning>,
}

impl ModelDevice {
    /// Returns the CPU.
    #[must_use]
    pub fn cpu() -> Self {
        Self { evaluator: Box::new(ModelSimd), kind: "cpu", warnings: Vec::new() }
    }

    /// Returns the description of the device.
    #[must_use]
    pub fn used(&self) -> DeviceUsed {
        let evaluator = if self.kind == "gpu" { "shader" } else { "kernel" };
        DeviceUsed { kind: self.kind, name: self.evaluator.name(), precision: self.evaluator.precision(), evaluator }
    }

    /// Opens the requested device; `auto` is the CPU. A problem that shaders cannot evaluate is evaluated on the CPU, with a warning.
    ///
    /// # Errors
    /// Returns a usage error for f32 on the CPU, and a device error if a requested GPU cannot be opened or computes wrongly.
    pub fn open(device: &DeviceSpec, precision: PrecisionSpec, problem: &ModelProblem) -> Result<Self> {
        if matches!(device, DeviceSpec::Auto | DeviceSpec::Cpu) {
            if precision == PrecisionSpec::F32 {
                let message = "f32 is available on GPUs only; the CPU evaluates in f64 only";
                return Err(Error::usage(message, text!("Add " [Device = "gpu"] ", or leave " [Precision] " out.")));
            }
            return Ok(Self::cpu());
        }
        gpu(device, precision, problem)
    }
}

#[cfg(feature = "gpu")]
fn gpu(device: &DeviceSpec, precision: PrecisionSpec, problem: &ModelProblem) -> Result<ModelDevice> {
    let selector = match device {
        DeviceSpec::GpuIndex(index) => Selector::Index(*index),
        DeviceSpec::GpuName(name) => Selector::Name(name.clone()),
        _ => Selector::Best,
    };
    let precision = match precision {
        PrecisionSpec::Auto => None,
        PrecisionSpec::F32 => Some(ShaderPrecision::F32),
        PrecisionSpec::F64 => Some(ShaderPrecision::F64),
    };
    let mut gpu = ModelGpu::open(&selector, precision)?;
    if !gpu.serves(problem)? {
        let message = "no shader can be made, or checked, for this model and clock (moving averages, delays on an irregular clock, candidates that \
             all diverge); the CPU evaluates instead";
        let warnings = vec![Warning::new("gpu_unsuited", message)];
        return Ok(ModelDevice { warnings, ..ModelDevice::cpu() });
    }
    let facts = gpu.facts();
    let slow = text!(("{} is a software adapter: slower than ", facts.name)[Device = "cpu"]);
    let warnings = (facts.kind == "software").then(|| Warning::new("software_adapter", slow)).into_iter().collect();
    Ok(ModelDevice { evaluator: Box::new(gpu), kind: "gpu", warnings })
}

#[cfg(not(feature = "gpu"))]
fn gpu(_: &DeviceSpec, _: PrecisionSpec, _: &ModelProblem) -> Result<ModelDevice> {
    let hint = text!("Build with the feature gpu, or use " [Device = "cpu"] ".");
    Err(Error::new(ErrorKind::Device, "this build has no GPU evaluation", hint))
}
