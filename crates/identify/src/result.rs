//! The result of an identification, of any machine.

use super::dc_motor::DcMotor;
use super::estimates::ParameterEstimate;
use super::forward_selection::{Alternative, SelectionStep};
use super::trust_level::Trust;
use super::verify::Verification;
use crate::analysis::{Output, ResidualTests};
use crate::device::DeviceUsed;
use motorfit_estimate::Uncertainty;
use motorfit_optimize::Stop;
use motorfit_record::warning::Warning;
use motorfit_record::{Excluded, Record};
use serde::{Serialize, Serializer};
use std::ops::Deref;

/// The first optimum that a method found, before the refinement.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct SearchOutcome {
    /// Name of the method: the requested one, or the one that [`Method::Auto`](super::Method::Auto) selected.
    pub method: &'static str,
    /// True if a population search replaced the initial estimates of [`Method::Auto`](super::Method::Auto) because these are
    /// not applicable or lead to a poor fit.
    #[serde(skip)]
    pub is_fallback: bool,
    /// True if a population search was run, also if its result was not used.
    #[serde(skip)]
    pub has_population: bool,
    /// Parameters of the first optimum by name, those of the first recording, fixed ones of the DC motor included.
    #[serde(serialize_with = "by_name")]
    pub parameters: Vec<(String, f64)>,
    /// Cost of these parameters in the criterion of the spec, by the scalar evaluator.
    pub cost: f64,
}

fn by_name<S: Serializer>(values: &[(String, f64)], serializer: S) -> std::result::Result<S::Ok, S::Error> {
    serializer.collect_map(values.iter().map(|(name, value)| (name, value)))
}

/// A run of samples that were excluded from a fit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LeftOut {
    /// Index of the recording, from 0.
    #[serde(rename = "record")]
    pub recording: usize,
    /// Time of the first excluded sample \[s\].
    pub from_s: f64,
    /// Time of the last excluded sample \[s\].
    pub to_s: f64,
    /// Number of excluded samples.
    pub samples: usize,
}

/// Returns the samples that are excluded in `used` and not in `records`, which are the same recordings.
pub(super) fn left_out(records: &[Record], used: &[Record]) -> Vec<LeftOut> {
    let of = |(recording, (record, used)): (usize, (&Record, &Record))| {
        let more = used.excluded().iter().filter(|excluded| !record.excluded().contains(excluded));
        let time = &record.samples().time_s;
        let one = |e: &Excluded| LeftOut {
            recording,
            from_s: time[e.start],
            to_s: time[e.end - 1],
            samples: e.end - e.start,
        };
        more.map(one).collect::<Vec<_>>()
    };
    records.iter().zip(used).enumerate().flat_map(of).collect()
}

/// The result of an identification. Its field `machine`, to which it dereferences, is of the machine `M` alone: the DC motor
/// ([`DcMotor`]) or a user's model ([`OwnModel`](crate::model::OwnModel)).
#[derive(Debug, Clone, PartialEq)]
pub struct Identification<M = DcMotor> {
    /// Level of trust in the result with its reasons.
    pub trust: Trust,
    /// Facts that results of other machines do not have.
    pub machine: M,
    /// Outputs of the machine, of which some may not be measured.
    pub outputs: Vec<Output>,
    /// Parameters in the order of the machine, those of single recordings once for each.
    pub estimates: Vec<ParameterEstimate>,
    /// Samples that were excluded automatically.
    pub left_out: Vec<LeftOut>,
    /// Extensions of the DC motor, or optional terms of a model, by name.
    pub with: Vec<String>,
    /// Models that the forward selection fitted, in their order; `None` if extensions and terms were given.
    pub selection: Option<Vec<SelectionStep>>,
    /// Other models that fit the recordings equally well.
    pub alternatives: Vec<Alternative>,
    /// Cost of the estimates in the criterion of the spec, in f64.
    pub cost: f64,
    /// Values of the free parameters, in the order of the space.
    pub values: Vec<f64>,
    /// First optimum, before the refinement.
    pub searched: SearchOutcome,
    /// Uncertainty of the parameters; `None` without a refinement.
    pub uncertainty: Option<Uncertainty>,
    /// Standard deviation of the residuals of each output in its unit; `None` for one that was not measured.
    pub residual_sigma: Vec<Option<f64>>,
    /// True if the polish converged.
    pub converged: bool,
    /// Fit `100 (1 − ‖y − ŷ‖/‖y − mean y‖)` of each output over all recordings \[%\]; `None` for one that was not measured or does not
    /// vary.
    pub fit_percent: Vec<Option<f64>>,
    /// Fit of each output of each recording \[%\].
    pub fit_percent_by_recording: Vec<Vec<Option<f64>>>,
    /// Tests of the residuals of each output of each recording; empty without a polish.
    pub residual_tests: Vec<ResidualTests>,
    /// Comparison of the result with references.
    pub verification: Verification,
    /// Warnings about the recordings, the spec and the result.
    pub warnings: Vec<Warning>,
    /// Reason for which the search ended.
    pub stop: Stop,
    /// Number of evaluated candidates.
    pub evaluations: u64,
    /// Lowest cost after each generation; empty without a population search.
    pub history: Vec<f64>,
    /// Device that evaluated.
    pub device: DeviceUsed,
    /// Cost of the best candidate on the device minus that of the scalar evaluator; `None` on the CPU.
    pub cost_difference: Option<f64>,
    /// Duration of the estimation \[s\].
    pub seconds: f64,
}

impl<M> Deref for Identification<M> {
    type Target = M;

    fn deref(&self) -> &M {
        &self.machine
    }
}

impl<M> Identification<M> {
    /// Makes a result without a fit of `machine`, whose outputs are none yet.
    pub(super) fn of(machine: M) -> Self {
        Self {
            trust: Trust::default(),
            machine,
            outputs: Vec::new(),
            estimates: Vec::new(),
            left_out: Vec::new(),
            with: Vec::new(),
            selection: None,
            alternatives: Vec::new(),
            cost: f64::NAN,
            values: Vec::new(),
            searched: SearchOutcome::default(),
            uncertainty: None,
            residual_sigma: Vec::new(),
            converged: true,
            fit_percent: Vec::new(),
            fit_percent_by_recording: Vec::new(),
            residual_tests: Vec::new(),
            verification: Verification::none(),
            warnings: Vec::new(),
            stop: Stop::BudgetSpent,
            evaluations: 0,
            history: Vec::new(),
            device: DeviceUsed::default(),
            cost_difference: None,
            seconds: 0.0,
        }
    }
}
