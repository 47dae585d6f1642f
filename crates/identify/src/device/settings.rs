//! Settings by which the device of a search is selected.

use super::evaluator_spec::{EvaluatorSpec, Expected};
use super::throughput_profile::ThroughputProfile;
use motorfit_core::named::named;
use motorfit_core::setting::text;
use motorfit_core::text::excerpt;
use motorfit_core::{Error, Result};
use std::str::FromStr;

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

impl DeviceSettings {
    /// Returns the expected work for each of so many problems.
    pub(super) fn expected(&self, problems: usize) -> Expected {
        Expected {
            population: self.population / problems.max(1),
            generations: self.generations,
            needs_all_costs: self.needs_all_costs,
        }
    }
}
