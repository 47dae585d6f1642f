//! Selection of the device of a search: the CPU, or a GPU if one is requested or the work is large enough for it to be faster.

use super::evaluator_spec::EvaluatorSpec;
use super::problem::DeviceProblem;
#[cfg(feature = "gpu")]
use super::problem::NO_SHADER;
use super::settings::{DeviceSettings, DeviceSpec, PrecisionSpec};
use super::used::DeviceUsed;
use motorfit_core::setting::text;
use motorfit_core::{Error, ErrorKind, Result};
use motorfit_evaluate::{Evaluator, Simd};
use motorfit_record::warning::Warning;
use std::sync::Arc;
use std::time::Duration;

#[cfg(feature = "gpu")]
use motorfit_gpu::{Precision, Selector};

/// Number of candidate-steps between two calls of the observer on the CPU: some tenths of a second of a few cores.
pub(super) const SLICE_STEPS: usize = 500_000_000;
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
pub(super) type Reopen<P> = Box<dyn FnMut() -> Result<Box<dyn Evaluator<P>>> + Send>;

/// Largest number of times that a device may fail on the same batch.
const LOSSES_MAX: usize = 3;
/// Delay before a device is opened again, after each failure \[s\].
const WAITS_S: [f64; LOSSES_MAX] = if cfg!(test) { [0.0; LOSSES_MAX] } else { [0.0, 1.0, 5.0] };

/// The selected evaluator, with its device and the treatment of failures.
pub(super) struct SelectedDevice<P> {
    pub evaluator: Box<dyn Evaluator<P>>,
    /// Kind of the device: `cpu` or `gpu`.
    pub kind: &'static str,
    pub on_loss: OnLoss,
    pub reopen: Option<Reopen<P>>,
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

impl<P: DeviceProblem> SelectedDevice<P> {
    pub(super) fn cpu(warnings: Vec<Warning>) -> Self {
        Self { warnings, ..Self::given(P::kernel(Simd::default())) }
    }

    /// Returns a device with an evaluator of the caller.
    pub(super) fn given(evaluator: Box<dyn Evaluator<P>>) -> Self {
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
            self.evaluator = P::kernel(self.simd);
            (self.kind, self.batch_factor) = ("cpu", 1);
        } else {
            return false;
        }
        self.replaced += 1;
        true
    }

    /// Selects the device for searches on problems.
    pub(super) fn for_search(settings: &DeviceSettings, problems: &[Arc<P>]) -> Result<Self> {
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
    fn on_cpu(settings: &DeviceSettings, problems: &[Arc<P>]) -> Self {
        let simd = simd(settings);
        let kernel = Self { simd, ..Self::given(P::kernel(simd)) };
        let expected = settings.expected(problems.len());
        let is_served = || problems.iter().any(|problem| problem.steps_of_tables().is_some());
        let has_tables = match settings.evaluator {
            EvaluatorSpec::Auto => problems.iter().any(|problem| problem.prefers_tables(expected)),
            EvaluatorSpec::Kernel => false,
            EvaluatorSpec::Tables => true,
        };
        let is_unsuited = settings.evaluator == EvaluatorSpec::Tables && !is_served();
        let warnings = is_unsuited.then(unsuited).into_iter().collect();
        match P::tables().filter(|_| has_tables) {
            // Later problems may be served.
            Some(evaluator) => Self { evaluator, has_tables, warnings, ..kernel },
            None => Self { warnings, ..kernel },
        }
    }

    /// Selects the device for a computation without a population: the CPU unless a GPU is requested.
    pub(super) fn for_check(settings: &DeviceSettings, problem: &Arc<P>) -> Result<Self> {
        if settings.device == DeviceSpec::Auto {
            return Ok(Self::cpu(Vec::new()));
        }
        // Without a population the kernel is chosen.
        let settings = DeviceSettings { evaluator: EvaluatorSpec::Auto, population: 0, ..settings.clone() };
        Self::for_search(&settings, std::slice::from_ref(problem))
    }

    /// Returns the description of the device.
    pub(super) fn used(&self, problems: &[Arc<P>]) -> DeviceUsed {
        DeviceUsed {
            kind: self.kind,
            name: self.evaluator.name(),
            precision: if self.evaluator.is_exact() { "f64" } else { "f32" },
            evaluator: match self.kind {
                "cpu" if problems.iter().any(|problem| self.steps_of_tables(problem).is_some()) => "tables",
                "cpu" => "kernel",
                _ => "shader",
            },
        }
    }

    fn steps_of_tables(&self, problem: &P) -> Option<usize> {
        problem.steps_of_tables().filter(|_| self.has_tables)
    }

    /// Returns the work of a candidate of a problem by which batches are sized: the number of steps of the kernel that take as long, divided by
    /// the batch factor of the device.
    pub(super) fn steps(&self, problem: &P) -> usize {
        self.steps_of_tables(problem).unwrap_or_else(|| problem.steps().div_ceil(self.batch_factor))
    }
}

#[cfg(feature = "gpu")]
fn open<P: DeviceProblem>(settings: &DeviceSettings, problem: &Arc<P>, problems: usize) -> Result<SelectedDevice<P>> {
    let selector = match &settings.device {
        DeviceSpec::Gpu => Selector::Best,
        DeviceSpec::GpuIndex(index) => Selector::Index(*index),
        DeviceSpec::GpuName(name) => Selector::Name(name.clone()),
        DeviceSpec::Auto => {
            let Some(index) = problem.faster_adapter(settings, problems) else {
                return Ok(SelectedDevice::cpu(Vec::new()));
            };
            // A GPU that cannot be opened gives a warning, and the CPU is used.
            return Ok(match open_gpu(Selector::Index(index), settings.precision, problem) {
                Ok(opened) => SelectedDevice { on_loss: OnLoss::Cpu, ..opened },
                Err(error) => SelectedDevice::cpu(vec![taken_over(&error)]),
            });
        }
        DeviceSpec::Cpu => return Ok(SelectedDevice::cpu(Vec::new())),
    };
    open_gpu(selector, settings.precision, problem)
}

#[cfg(feature = "gpu")]
fn open_gpu<P: DeviceProblem>(
    selector: Selector,
    precision: PrecisionSpec,
    problem: &Arc<P>,
) -> Result<SelectedDevice<P>> {
    let precision = match precision {
        PrecisionSpec::Auto => None,
        PrecisionSpec::F32 => Some(Precision::F32),
        PrecisionSpec::F64 => Some(Precision::F64),
    };
    let Some((evaluator, facts)) = problem.open_gpu(&selector, precision)? else {
        return Ok(SelectedDevice::cpu(vec![Warning::new("gpu_unsuited", NO_SHADER)]));
    };
    let slow = text!(("{} is a software adapter: slower than ", facts.name)[Device = "cpu"]);
    let warnings = (facts.kind == "software").then(|| Warning::new("software_adapter", slow)).into_iter().collect();
    let problem = problem.clone();
    let reopen: Reopen<P> = Box::new(move || {
        let opened = problem.open_gpu(&selector, precision)?;
        Ok(opened.map_or_else(|| P::kernel(Simd::default()), |(evaluator, _)| evaluator))
    });
    Ok(SelectedDevice {
        kind: "gpu",
        batch_factor: P::batch_factor(facts.kind),
        warnings,
        reopen: Some(reopen),
        ..SelectedDevice::given(evaluator)
    })
}

#[cfg(not(feature = "gpu"))]
fn open<P: DeviceProblem>(settings: &DeviceSettings, _: &Arc<P>, _: usize) -> Result<SelectedDevice<P>> {
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
