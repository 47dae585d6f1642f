//! Selection of the device of a search: the CPU, or a GPU if one is requested or the work is large enough for it to be faster.

use super::evaluator_spec::{EvaluatorSpec, Expected, STEPS};
use super::throughput_profile::ThroughputProfile;
#[cfg(feature = "gpu")]
use super::throughput_profile::{AdapterThroughput, Work};
use super::used::DeviceUsed;
use motorfit_core::named::named;
use motorfit_core::numeric::whole;
use motorfit_core::setting::text;
use motorfit_core::text::excerpt;
use motorfit_core::{Error, ErrorKind, Result};
use motorfit_evaluate::{Evaluator, PoleTables, Problem, Simd};
use motorfit_record::warning::Warning;
use std::str::FromStr;
use std::sync::Arc;
use std::time::Duration;

#[cfg(feature = "gpu")]
use motorfit_gpu::{self as gpu, Gpu, Precision};

/// The requested device.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum DeviceSpec {
    /// A GPU if there is one in hardware and the work is large enough for it to be faster, else the CPU.
    #[default]
    Auto,
    /// The CPU.
    Cpu,
    /// The best GPU adapter, which may be a software adapter if there is no other.
    Gpu,
    /// The GPU adapter with an index in the list of devices.
    GpuIndex(usize),
    /// The GPU adapter whose name contains a text.
    GpuName(String),
}

impl FromStr for DeviceSpec {
    type Err = Error;

    /// Parses `auto`, `cpu`, `gpu`, `gpu:INDEX` or `gpu:NAME`.
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
                    text!("Give auto, cpu, gpu, gpu:INDEX or gpu:NAME; " [Command::Devices] " lists those of this machine."),
                )),
            },
        }
    }
}

named! {
    /// The floating-point precision of the evaluation.
    pub enum PrecisionSpec (default Auto) {
        /// f64 if the device supports it, else f32.
        Auto = "auto",
        /// f32 in deviations from the best candidate, on GPUs only; the leaders are evaluated again in f64.
        F32 = "f32",
        /// f64 throughout.
        F64 = "f64",
    }
}

/// Settings that select the device of a search.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct DeviceSettings {
    /// The requested device.
    pub device: DeviceSpec,
    /// The requested precision.
    pub precision: PrecisionSpec,
    /// The requested evaluator on the CPU.
    pub evaluator: EvaluatorSpec,
    /// Throughput measured on this machine, for `auto`; with `None` fixed limits on the work decide.
    pub throughput_profile: Option<ThroughputProfile>,
    /// Number of threads; `None` uses the rayon pool of the caller.
    pub threads: Option<usize>,
    /// Number of candidates in a generation.
    pub population: usize,
    /// Number of generations, the initial population included.
    pub generations: usize,
    /// True if every cost is needed; false for searches, whose cutoffs may end simulations early.
    pub needs_all_costs: bool,
}

/// Smallest number of candidate-steps in one generation for which `auto` opens a GPU that was not measured: a smaller batch
/// does not use the GPU fully.
#[cfg(feature = "gpu")]
const GPU_GENERATION_STEPS: u64 = 200_000_000;
/// Smallest number of candidate-steps in a search for which `auto` opens a GPU that was not measured: opening takes some tenths
/// of a second, in which a few cores evaluate 1e9.
#[cfg(feature = "gpu")]
const GPU_SEARCH_STEPS: u64 = 20_000_000_000;
/// Largest ratio of a GPU's throughput to that of all cores which is expected of a GPU that was not measured: an H200 against 16 threads
/// with AVX-512 on 100,001 samples.
#[cfg(feature = "gpu")]
const GPU_SPEEDUP_MAX: u64 = 25;

/// Number of candidate-steps between two calls of the observer on the CPU: some tenths of a second of a few cores.
pub(super) const SLICE_STEPS: usize = 500_000_000;
/// Size of batches of a discrete GPU relative to those of the CPU; smaller ones would not use it fully.
#[cfg(feature = "gpu")]
const BATCH_FACTOR_DISCRETE: usize = 100;
/// Size of batches of other GPUs in hardware relative to those of the CPU.
#[cfg(feature = "gpu")]
const BATCH_FACTOR_OTHER: usize = 10;

/// Treatment of a device that fails during a search.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum OnLoss {
    /// The search ends with the error.
    #[default]
    Fail,
    /// The search continues on the CPU.
    Cpu,
    /// The device is opened again.
    Reopen,
    /// The device is opened again; if that fails, the search continues on the CPU.
    ReopenOrCpu,
}

/// A function that opens the same device again.
pub(super) type Reopen = Box<dyn FnMut() -> Result<Box<dyn Evaluator>> + Send>;

/// Largest number of times that a device may fail on the same batch.
const LOSSES_MAX: usize = 3;
/// Delay before a device is opened again, after each failure \[s\].
const WAITS_S: [f64; LOSSES_MAX] = if cfg!(test) { [0.0; LOSSES_MAX] } else { [0.0, 1.0, 5.0] };

/// The selected evaluator, with its device and the treatment of failures.
pub(super) struct SelectedDevice {
    pub evaluator: Box<dyn Evaluator>,
    /// Kind of the device: `cpu` or `gpu`.
    pub kind: &'static str,
    pub on_loss: OnLoss,
    pub reopen: Option<Reopen>,
    /// Number of times that the evaluator was replaced.
    pub replaced: usize,
    /// True if the evaluator has tables of poles.
    pub has_tables: bool,
    /// Size of batches relative to those of the CPU.
    pub batch_factor: usize,
    pub warnings: Vec<Warning>,
    /// The CPU evaluator that replaces a failed device.
    pub simd: Simd,
}

impl SelectedDevice {
    pub(super) fn cpu(warnings: Vec<Warning>) -> Self {
        Self { warnings, ..Self::given(Box::new(Simd::default())) }
    }

    /// Returns a device with an evaluator of the caller.
    pub(super) fn given(evaluator: Box<dyn Evaluator>) -> Self {
        Self {
            evaluator,
            kind: "cpu",
            on_loss: OnLoss::Fail,
            reopen: None,
            replaced: 0,
            has_tables: false,
            batch_factor: 1,
            warnings: Vec::new(),
            simd: Simd::default(),
        }
    }

    /// Replaces the evaluator after it failed on a batch, which it had failed on `failures` times before. Returns false if
    /// `on_loss` does not allow it.
    pub(super) fn replace(&mut self, error: &Error, failures: usize) -> bool {
        let reopens = matches!(self.on_loss, OnLoss::Reopen | OnLoss::ReopenOrCpu) && error.kind() == ErrorKind::Device;
        if let (true, Some(wait), Some(reopen)) = (reopens, WAITS_S.get(failures), self.reopen.as_mut()) {
            std::thread::sleep(Duration::from_secs_f64(*wait));
            // A device that cannot be opened yet is tried again after a longer delay.
            match reopen() {
                Ok(evaluator) => self.evaluator = evaluator,
                Err(error) => return self.replace(&error, failures + 1),
            }
            self.warnings.push(Warning::new("gpu_reopened", text!({error.text()} "; the device was opened again")));
        } else if self.kind == "gpu" && matches!(self.on_loss, OnLoss::Cpu | OnLoss::ReopenOrCpu) {
            self.warnings.push(taken_over(error));
            self.evaluator = Box::new(self.simd);
            (self.kind, self.batch_factor) = ("cpu", 1);
        } else {
            return false;
        }
        self.replaced += 1;
        true
    }

    /// Selects the device for searches on problems.
    pub(super) fn for_search(settings: &DeviceSettings, problems: &[Arc<Problem>]) -> Result<Self> {
        let Some(first) = problems.first() else {
            return Err(Error::usage("there is nothing to search", "Give at least one problem."));
        };
        if settings.precision == PrecisionSpec::F32 && matches!(settings.device, DeviceSpec::Auto | DeviceSpec::Cpu) {
            let message = "f32 is available on GPUs only; the CPU evaluates in f64 only";
            return Err(Error::usage(message, text!("Add " [Device = "gpu"] ", or leave " [Precision] " out.")));
        }
        let is_gpu = !matches!(settings.device, DeviceSpec::Auto | DeviceSpec::Cpu);
        if settings.evaluator != EvaluatorSpec::Auto && is_gpu {
            let message = text!([Evaluator] " applies to the CPU, and a GPU is requested");
            return Err(Error::usage(message, text!("Leave it out, or give " [Device = "cpu"] ".")));
        }
        if settings.evaluator == EvaluatorSpec::Tables {
            return Ok(Self::on_cpu(settings, problems));
        }
        match open(settings, first, problems.len())? {
            opened if opened.kind == "cpu" => {
                let warnings = opened.warnings;
                Ok(Self { warnings, ..Self::on_cpu(settings, problems) })
            }
            opened => Ok(Self { simd: simd(settings), ..opened }),
        }
    }

    /// Selects the evaluator on the CPU.
    fn on_cpu(settings: &DeviceSettings, problems: &[Arc<Problem>]) -> Self {
        let simd = simd(settings);
        let kernel = Self { simd, ..Self::given(Box::new(simd)) };
        let expected = expected_work(settings, problems.len());
        let is_served = |problem: &Arc<Problem>| PoleTables::serves(problem);
        let warnings = match settings.evaluator {
            EvaluatorSpec::Auto if problems.iter().any(|problem| expected.prefers_tables(problem)) => Vec::new(),
            EvaluatorSpec::Auto | EvaluatorSpec::Kernel => return kernel,
            EvaluatorSpec::Tables if problems.iter().any(is_served) => Vec::new(),
            // Later problems may be served.
            EvaluatorSpec::Tables => vec![unsuited()],
        };
        Self { evaluator: Box::new(PoleTables::default()), has_tables: true, warnings, ..kernel }
    }

    /// Selects the device for a computation without a population: the CPU unless a GPU is requested.
    pub(super) fn for_check(settings: &DeviceSettings, problem: &Arc<Problem>) -> Result<Self> {
        if settings.device == DeviceSpec::Auto {
            return Ok(Self::cpu(Vec::new()));
        }
        // Without a population the kernel is chosen.
        let settings = DeviceSettings { evaluator: EvaluatorSpec::Auto, population: 0, ..settings.clone() };
        Self::for_search(&settings, std::slice::from_ref(problem))
    }

    /// Returns the description of the device.
    pub(super) fn used(&self, problems: &[Arc<Problem>]) -> DeviceUsed {
        DeviceUsed {
            kind: self.kind,
            name: self.evaluator.name(),
            precision: if self.evaluator.is_exact() { "f64" } else { "f32" },
            evaluator: match self.kind {
                "cpu" if problems.iter().any(|problem| self.serves_by_tables(problem)) => "tables",
                "cpu" => "kernel",
                _ => "shader",
            },
        }
    }

    fn serves_by_tables(&self, problem: &Problem) -> bool {
        self.has_tables && PoleTables::serves(problem)
    }

    /// Returns the work of a candidate of a problem by which batches are sized: the number of steps of the kernel that take as long, divided by
    /// the batch factor of the device.
    pub(super) fn steps(&self, problem: &Problem) -> usize {
        if self.serves_by_tables(problem) {
            return whole(STEPS) * problem.signals().len();
        }
        problem.active().div_ceil(self.batch_factor)
    }
}

/// Returns the expected work per problem.
fn expected_work(settings: &DeviceSettings, problems: usize) -> Expected {
    Expected {
        population: settings.population / problems.max(1),
        generations: settings.generations,
        needs_all_costs: settings.needs_all_costs,
    }
}

#[cfg(feature = "gpu")]
fn open(settings: &DeviceSettings, problem: &Problem, problems: usize) -> Result<SelectedDevice> {
    let selector = match &settings.device {
        DeviceSpec::Gpu => gpu::Selector::Best,
        DeviceSpec::GpuIndex(index) => gpu::Selector::Index(*index),
        DeviceSpec::GpuName(name) => gpu::Selector::Name(name.clone()),
        DeviceSpec::Auto => {
            let Some(index) = worth_opening(settings, problem, problems) else {
                return Ok(SelectedDevice::cpu(Vec::new()));
            };
            // A GPU that cannot be opened gives a warning, and the CPU is used.
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
    let batch_factor = match gpu.facts().kind {
        "discrete" => BATCH_FACTOR_DISCRETE,
        _ if software => 1,
        _ => BATCH_FACTOR_OTHER,
    };
    let warnings = warnings.into_iter().collect();
    let selector = selector.clone();
    let reopen: Reopen = Box::new(move || Ok(Box::new(Gpu::open(&selector, precision)?)));
    Ok(SelectedDevice {
        kind: "gpu",
        batch_factor,
        warnings,
        reopen: Some(reopen),
        ..SelectedDevice::given(Box::new(gpu))
    })
}

#[cfg(not(feature = "gpu"))]
fn open(settings: &DeviceSettings, _: &Problem, _: usize) -> Result<SelectedDevice> {
    if matches!(settings.device, DeviceSpec::Auto | DeviceSpec::Cpu) {
        return Ok(SelectedDevice::cpu(Vec::new()));
    }
    let hint = text!("Build with the feature gpu, or use " [Device = "cpu"] ".");
    Err(Error::new(ErrorKind::Device, "this build has no GPU evaluation", hint))
}

fn unsuited() -> Warning {
    let message = "tables serve linear motors on even clocks with a recorded voltage and criteria of squares without time weights, masks or \
         torques; the kernel evaluates instead";
    Warning::new("tables_unsuited", message)
}

/// Returns the kernel for the requested threads.
fn simd(settings: &DeviceSettings) -> Simd {
    if settings.threads == Some(1) { Simd::alone() } else { Simd::default() }
}

pub(super) fn taken_over(error: &Error) -> Warning {
    Warning::new("gpu_failed", text!({error.text()} "; the CPU evaluates instead"))
}

/// Returns the index of a hardware adapter that is predicted to be faster than the CPU with its evaluator for the work, or `None` if there
/// is none or the work is too small. The prediction is based on the throughput profile for measured adapters, and on the size of the work
/// for others.
#[cfg(feature = "gpu")]
fn worth_opening(settings: &DeviceSettings, problem: &Problem, problems: usize) -> Option<usize> {
    let equivalent_samples = || expected_work(settings, problems).equivalent_samples(problem);
    let work = Work {
        samples: problem.active() as u64,
        population: settings.population as u64,
        generations: settings.generations as u64,
        threads: rayon::current_num_threads(),
        equivalent_samples: (settings.evaluator == EvaluatorSpec::Auto).then(equivalent_samples).flatten(),
    };
    let throughput_profile =
        settings.throughput_profile.as_ref().filter(|throughput_profile| throughput_profile.is_current());
    let precision = (settings.precision == PrecisionSpec::F64).then_some("f64");
    let faster = throughput_profile.and_then(|throughput_profile| throughput_profile.faster(work, precision));
    if faster.is_none() && !is_large(work) {
        return None;
    }
    let is = |a: &gpu::AdapterFacts, known: &AdapterThroughput| {
        a.name == known.name && a.driver == known.driver && a.backend == known.backend
    };
    let real: Vec<gpu::AdapterFacts> = gpu::list().into_iter().filter(|a| a.kind != "software").collect();
    let measured =
        |a: &&gpu::AdapterFacts| throughput_profile.is_some_and(|p| p.adapters.iter().any(|known| is(a, known)));
    let chosen = faster.and_then(|faster| real.iter().find(|a| is(a, faster)));
    let unknown = || real.iter().filter(|_| is_large(work)).find(|a| !measured(a));
    chosen.or_else(unknown).map(|a| a.index)
}

/// Returns true if a search is large enough for a GPU that was not measured to be faster.
#[cfg(feature = "gpu")]
fn is_large(work: Work) -> bool {
    let on_cpu = work.equivalent_samples.unwrap_or(work.samples);
    let candidates = work.population.saturating_mul(work.generations);
    work.population.saturating_mul(work.samples) >= GPU_GENERATION_STEPS
        && candidates.saturating_mul(on_cpu) >= GPU_SEARCH_STEPS
        && work.samples <= GPU_SPEEDUP_MAX.saturating_mul(on_cpu)
}
