//! Selection of the device of a search: the CPU, or a GPU where one is requested or the work is large enough for it to be faster.

use super::throughput_profile::ThroughputProfile;
#[cfg(feature = "gpu")]
use super::throughput_profile::{AdapterThroughput, Work};
use crate::evaluate::{Evaluator, Problem, Simd};
use crate::named::named;
use crate::setting::text;
use crate::text::excerpt;
use crate::warning::Warning;
use crate::{Error, ErrorKind, Result};
use std::str::FromStr;
use std::time::Duration;

#[cfg(feature = "gpu")]
use crate::evaluate::gpu::{self, Gpu, Precision};

/// The device that evaluates.
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

impl FromStr for DeviceSpec {
    type Err = Error;

    /// Reads `auto`, `cpu`, `gpu`, `gpu:INDEX` or `gpu:NAME`.
    fn from_str(text: &str) -> Result<Self> {
        match text {
            "auto" => Ok(Self::Auto),
            "cpu" => Ok(Self::Cpu),
            "gpu" => Ok(Self::Gpu),
            other => match other.strip_prefix("gpu:").map(|which| (which, which.parse())) {
                Some((_, Ok(index))) => Ok(Self::GpuIndex(index)),
                Some((name, Err(_))) if !name.is_empty() => Ok(Self::GpuName(name.to_owned())),
                _ => Err(Error::usage(
                    text!([Device](": \"{}\" is no device", excerpt(other))),
                    text!("Give auto, cpu, gpu, gpu:INDEX or gpu:NAME; " [Command::Devices] " lists what is there."),
                )),
            },
        }
    }
}

named! {
    /// The numbers that candidates are evaluated with.
    pub enum PrecisionSpec (default Auto) {
        /// f64 where the device has it.
        Auto = "auto",
        /// f32 in deviations from the best so far; leaders are evaluated again in f64. On a GPU only.
        F32 = "f32",
        /// f64.
        F64 = "f64",
    }
}

/// Settings of the device of a search.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct DeviceSettings {
    /// The device that evaluates.
    pub device: DeviceSpec,
    /// With which numbers.
    pub precision: PrecisionSpec,
    /// The throughput that was measured on this machine, for `auto`; `None` takes conservative limits.
    pub paces: Option<ThroughputProfile>,
    /// Threads; `None` takes the rayon pool of the caller.
    pub threads: Option<usize>,
    /// Candidates of a generation.
    pub population: usize,
    /// Generations, the first population included.
    pub generations: usize,
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

/// Treatment of a device that fails on the way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum OnLoss {
    /// The search ends with the error.
    #[default]
    Fail,
    /// The CPU carries on.
    Cpu,
    /// The device is opened anew.
    Reopen,
    /// The device is opened anew; where that fails, the CPU carries on.
    ReopenOrCpu,
}

/// Opens the same device anew.
pub(super) type Reopen = Box<dyn FnMut() -> Result<Box<dyn Evaluator>> + Send>;

/// Times that a device may fail on the same piece of work, and seconds waited before it is opened anew.
const LOSSES_MAX: usize = 3;
const WAITS_S: [f64; LOSSES_MAX] = if cfg!(test) { [0.0; LOSSES_MAX] } else { [0.0, 1.0, 5.0] };

/// An evaluator and what is said of it.
pub(super) struct SelectedDevice {
    pub evaluator: Box<dyn Evaluator>,
    /// cpu or gpu.
    pub kind: &'static str,
    pub on_loss: OnLoss,
    pub reopen: Option<Reopen>,
    /// The number of times that the evaluator was replaced.
    pub replaced: usize,
    /// Candidate-steps that may pass before the observer is asked again.
    pub slice_steps: usize,
    pub warnings: Vec<Warning>,
    /// The evaluator of the CPU.
    pub simd: Simd,
}

impl SelectedDevice {
    pub(super) fn cpu(warnings: Vec<Warning>) -> Self {
        Self { warnings, ..Self::given(Box::new(Simd::default())) }
    }

    /// One that the caller brought.
    pub(super) fn given(evaluator: Box<dyn Evaluator>) -> Self {
        Self {
            evaluator,
            kind: "cpu",
            on_loss: OnLoss::Fail,
            reopen: None,
            replaced: 0,
            slice_steps: SLICE_STEPS,
            warnings: Vec::new(),
            simd: Simd::default(),
        }
    }

    /// Takes another evaluator after one failed for the Nth time on the same work; false where none may.
    pub(super) fn replace(&mut self, error: &Error, failures: usize) -> bool {
        let reopens = matches!(self.on_loss, OnLoss::Reopen | OnLoss::ReopenOrCpu) && error.kind() == ErrorKind::Device;
        if let (true, Some(wait), Some(reopen)) = (reopens, WAITS_S.get(failures), self.reopen.as_mut()) {
            std::thread::sleep(Duration::from_secs_f64(*wait));
            // One that cannot be opened yet is tried again after a longer wait.
            match reopen() {
                Ok(evaluator) => self.evaluator = evaluator,
                Err(error) => return self.replace(&error, failures + 1),
            }
            self.warnings.push(Warning::new("gpu_reopened", text!({error.text()} "; the device was opened anew")));
        } else if self.kind == "gpu" && matches!(self.on_loss, OnLoss::Cpu | OnLoss::ReopenOrCpu) {
            self.warnings.push(taken_over(error));
            self.evaluator = Box::new(self.simd);
            (self.kind, self.slice_steps) = ("cpu", SLICE_STEPS);
        } else {
            return false;
        }
        self.replaced += 1;
        true
    }

    /// Selects what a search on a problem is evaluated on.
    pub(super) fn for_search(settings: &DeviceSettings, problem: &Problem) -> Result<Self> {
        if settings.precision == PrecisionSpec::F32 && matches!(settings.device, DeviceSpec::Auto | DeviceSpec::Cpu) {
            let message = "f32 is for GPUs: the CPU evaluates in f64 only";
            return Err(Error::usage(message, text!("Add " [Device = "gpu"] ", or leave " [Precision] " out.")));
        }
        let mut opened = open(settings, problem)?;
        if settings.threads == Some(1) {
            opened.simd = Simd::alone();
            if opened.kind == "cpu" {
                opened.evaluator = Box::new(opened.simd);
            }
        }
        Ok(opened)
    }

    /// A GPU only where one is named: for what has no population.
    pub(super) fn for_check(settings: &DeviceSettings, problem: &Problem) -> Result<Self> {
        if settings.device == DeviceSpec::Auto {
            return Ok(Self::cpu(Vec::new()));
        }
        Self::for_search(settings, problem)
    }

    /// The numbers of its evaluation.
    pub(super) fn precision(&self) -> &'static str {
        if self.evaluator.is_exact() { "f64" } else { "f32" }
    }
}

#[cfg(feature = "gpu")]
fn open(settings: &DeviceSettings, problem: &Problem) -> Result<SelectedDevice> {
    let selector = match &settings.device {
        DeviceSpec::Gpu => gpu::Selector::Best,
        DeviceSpec::GpuIndex(index) => gpu::Selector::Index(*index),
        DeviceSpec::GpuName(name) => gpu::Selector::Name(name.clone()),
        DeviceSpec::Auto => {
            let Some(index) = worth_opening(settings, problem) else { return Ok(SelectedDevice::cpu(Vec::new())) };
            // One that fails is said, and the CPU takes over.
            return Ok(match open_gpu(&gpu::Selector::Index(index), settings.precision) {
                Ok(opened) => SelectedDevice { on_loss: OnLoss::Cpu, ..opened },
                Err(error) => SelectedDevice::cpu(vec![taken_over(&error)]),
            });
        }
        DeviceSpec::Cpu => return Ok(SelectedDevice::cpu(Vec::new())),
    };
    open_gpu(&selector, settings.precision)
}

#[cfg(feature = "gpu")]
fn open_gpu(selector: &gpu::Selector, precision: PrecisionSpec) -> Result<SelectedDevice> {
    let precision = match precision {
        PrecisionSpec::Auto => None,
        PrecisionSpec::F32 => Some(Precision::F32),
        PrecisionSpec::F64 => Some(Precision::F64),
    };
    let gpu = Gpu::open(selector, precision)?;
    let software = gpu.facts().kind == "software";
    let message = text!(("{} is a software adapter: slower than ", gpu.facts().name)[Device = "cpu"]);
    let warnings = software.then_some(Warning::new("software_adapter", message));
    let slice_steps = if software { SLICE_STEPS } else { SLICE_STEPS_GPU };
    let warnings = warnings.into_iter().collect();
    let selector = selector.clone();
    let reopen: Reopen = Box::new(move || Ok(Box::new(Gpu::open(&selector, precision)?)));
    Ok(SelectedDevice {
        kind: "gpu",
        slice_steps,
        warnings,
        reopen: Some(reopen),
        ..SelectedDevice::given(Box::new(gpu))
    })
}

#[cfg(not(feature = "gpu"))]
fn open(settings: &DeviceSettings, _: &Problem) -> Result<SelectedDevice> {
    if matches!(settings.device, DeviceSpec::Auto | DeviceSpec::Cpu) {
        return Ok(SelectedDevice::cpu(Vec::new()));
    }
    let hint = text!("Build with the feature gpu, or use " [Device = "cpu"] ".");
    Err(Error::new(ErrorKind::Device, "this build has no GPU evaluation", hint))
}

pub(super) fn taken_over(error: &Error) -> Warning {
    Warning::new("gpu_failed", text!({error.text()} "; the CPU evaluates instead"))
}

/// The place of a real adapter that will win; `None` where the work is too small for that to be looked for. Adapters that
/// a bench has measured are judged by that, others by the size of the work.
#[cfg(feature = "gpu")]
fn worth_opening(settings: &DeviceSettings, problem: &Problem) -> Option<usize> {
    let work = Work {
        samples: problem.active() as u64,
        population: settings.population as u64,
        generations: settings.generations as u64,
        threads: rayon::current_num_threads(),
    };
    let paces = settings.paces.as_ref().filter(|paces| paces.are_current());
    let precision = (settings.precision == PrecisionSpec::F64).then_some("f64");
    let faster = paces.and_then(|paces| paces.faster(work, precision));
    if faster.is_none() && !is_large(work) {
        return None;
    }
    let is = |a: &gpu::AdapterFacts, known: &AdapterThroughput| {
        a.name == known.name && a.driver == known.driver && a.backend == known.backend
    };
    let real: Vec<gpu::AdapterFacts> = gpu::list().into_iter().filter(|a| a.kind != "software").collect();
    let measured = |a: &&gpu::AdapterFacts| paces.is_some_and(|p| p.adapters.iter().any(|known| is(a, known)));
    let chosen = faster.and_then(|faster| real.iter().find(|a| is(a, faster)));
    let unknown = || real.iter().filter(|_| is_large(work)).find(|a| !measured(a));
    chosen.or_else(unknown).map(|a| a.index)
}

/// Returns whether a search is large enough for a GPU to win where nothing was measured.
#[cfg(feature = "gpu")]
fn is_large(work: Work) -> bool {
    let generation = work.population.saturating_mul(work.samples);
    generation >= GPU_GENERATION_STEPS && generation.saturating_mul(work.generations) >= GPU_SEARCH_STEPS
}
