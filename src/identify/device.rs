//! What evaluates a search: the CPU, or a GPU where it is asked for or the work is large enough for one to win.

use super::{IdentifySpec, Warning};
use crate::Result;
use crate::evaluate::{Evaluator, Problem, Simd};

#[cfg(feature = "gpu")]
use crate::evaluate::gpu::{self, Gpu, Precision};

/// What evaluates.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum DeviceSpec {
    /// A GPU where the work is large enough for one to win and a real one answers, else the CPU.
    #[default]
    Auto,
    /// The CPU.
    Cpu,
    /// The best GPU adapter, a software one if there is nothing else.
    Gpu,
    /// A GPU adapter by its place in the list.
    GpuIndex(usize),
    /// A GPU adapter by a part of its name.
    GpuName(String),
}

/// With which numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PrecisionSpec {
    /// f64 where the device has it.
    #[default]
    Auto,
    /// f32 in deviations from the best so far; leaders are evaluated again in f64. On a GPU only.
    F32,
    /// f64.
    F64,
}

/// Candidate-steps of one generation and of a whole search from which on `auto` looks for a GPU: opening one takes
/// some tenths of a second, in which a few cores do 1e9, and a small batch does not fill it.
#[cfg(feature = "gpu")]
const GPU_GENERATION_STEPS: u64 = 200_000_000;
#[cfg(feature = "gpu")]
const GPU_SEARCH_STEPS: u64 = 20_000_000_000;

/// Candidate-steps between two questions to the observer: some tenth of a second of a few cores, or of a real GPU.
const SLICE_STEPS: usize = 500_000_000;
#[cfg(feature = "gpu")]
const SLICE_STEPS_GPU: usize = 100 * SLICE_STEPS;

/// An evaluator and what is said of it.
pub(super) struct Opened {
    pub evaluator: Box<dyn Evaluator>,
    /// cpu or gpu.
    pub kind: &'static str,
    /// Whether the CPU may take over.
    pub auto: bool,
    /// Candidate-steps that may pass before the observer is asked again.
    pub slice_steps: usize,
    pub warnings: Vec<Warning>,
}

impl Opened {
    pub(super) fn cpu(warnings: Vec<Warning>) -> Self {
        Self { warnings, ..Self::given(Box::new(Simd::default())) }
    }

    /// One that the caller brought.
    pub(super) fn given(evaluator: Box<dyn Evaluator>) -> Self {
        Self { evaluator, kind: "cpu", auto: false, slice_steps: SLICE_STEPS, warnings: Vec::new() }
    }

    /// What a search by `spec` on a problem is evaluated on.
    pub(super) fn for_search(spec: &IdentifySpec, problem: &Problem) -> Result<Self> {
        if spec.precision == PrecisionSpec::F32 && matches!(spec.device, DeviceSpec::Auto | DeviceSpec::Cpu) {
            return Err(crate::Error::usage(
                "f32 is for GPUs: the CPU evaluates in f64 only",
                "Add --device gpu, or leave --precision out.",
            ));
        }
        open(spec, problem)
    }

    /// A GPU only where one is named: for what has no population.
    pub(super) fn for_check(spec: &IdentifySpec, problem: &Problem) -> Result<Self> {
        if spec.device == DeviceSpec::Auto {
            return Ok(Self::cpu(Vec::new()));
        }
        Self::for_search(spec, problem)
    }

    /// The numbers of its evaluation.
    pub(super) fn precision(&self) -> &'static str {
        if self.evaluator.is_exact() { "f64" } else { "f32" }
    }
}

#[cfg(feature = "gpu")]
fn open(spec: &IdentifySpec, problem: &Problem) -> Result<Opened> {
    let selector = match &spec.device {
        DeviceSpec::Gpu => gpu::Selector::Best,
        DeviceSpec::GpuIndex(index) => gpu::Selector::Index(*index),
        DeviceSpec::GpuName(name) => gpu::Selector::Name(name.clone()),
        DeviceSpec::Auto if is_large(spec, problem) => {
            // A real adapter only; one that fails is said, and the CPU takes over.
            let real = gpu::list().into_iter().find(|a| a.kind != "software");
            let Some(real) = real else { return Ok(Opened::cpu(Vec::new())) };
            let opened = open_gpu(&gpu::Selector::Index(real.index), spec.precision);
            return Ok(match opened {
                Ok(opened) => Opened { auto: true, ..opened },
                Err(error) => Opened::cpu(vec![taken_over(&error)]),
            });
        }
        DeviceSpec::Auto | DeviceSpec::Cpu => return Ok(Opened::cpu(Vec::new())),
    };
    open_gpu(&selector, spec.precision)
}

#[cfg(feature = "gpu")]
fn open_gpu(selector: &gpu::Selector, precision: PrecisionSpec) -> Result<Opened> {
    let precision = match precision {
        PrecisionSpec::Auto => None,
        PrecisionSpec::F32 => Some(Precision::F32),
        PrecisionSpec::F64 => Some(Precision::F64),
    };
    let gpu = Gpu::open(selector, precision)?;
    let software = gpu.facts().kind == "software";
    let message = format!("{} is a software adapter: slower than --device cpu", gpu.facts().name);
    let warnings = software.then_some(Warning { code: "software_adapter", message });
    let slice_steps = if software { SLICE_STEPS } else { SLICE_STEPS_GPU };
    let warnings = warnings.into_iter().collect();
    Ok(Opened { kind: "gpu", slice_steps, warnings, ..Opened::given(Box::new(gpu)) })
}

#[cfg(not(feature = "gpu"))]
fn open(spec: &IdentifySpec, _: &Problem) -> Result<Opened> {
    if matches!(spec.device, DeviceSpec::Auto | DeviceSpec::Cpu) {
        return Ok(Opened::cpu(Vec::new()));
    }
    Err(crate::Error::new(
        crate::ErrorKind::Device,
        "this build has no GPU evaluation",
        "Build with the feature gpu, or use --device cpu.",
    ))
}

pub(super) fn taken_over(error: &crate::Error) -> Warning {
    Warning { code: "gpu_failed", message: format!("{error}; the CPU evaluates instead") }
}

/// Whether a search is large enough for a GPU to win.
#[cfg(feature = "gpu")]
fn is_large(spec: &IdentifySpec, problem: &Problem) -> bool {
    let generation = (spec.population as u64).saturating_mul(problem.active() as u64);
    generation >= GPU_GENERATION_STEPS && generation.saturating_mul(spec.generations as u64) >= GPU_SEARCH_STEPS
}
