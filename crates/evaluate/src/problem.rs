//! The problem that candidates are evaluated on: recordings, model, search space and criterion, checked and prepared once.

use super::initial::Initial;
use super::segment::Run;
use super::segment::Segment;
use super::signals::Signals;
use crate::criterion::Criterion;
use motorfit_core::Result;
use motorfit_core::setting::text;
use motorfit_motor::{
    Discretization, Extended, ExtendedWalk, Input, Method, ModelFeatures, Parameter, Parameters, Scope,
    SimulationSettings, Space, walk,
};
use motorfit_record::{Quantity, Record, check_of_motor, is_driven_by_current};
use std::sync::{Arc, OnceLock};

/// The simulation model.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Model {
    /// The discretization of the motor.
    pub discretization: Discretization,
    /// The state at the first sample.
    pub initial: Initial,
}

/// A problem that candidates are evaluated on: one motor in one or more recordings, with model, search space and criterion.
#[derive(Debug, Clone)]
pub struct Problem {
    signals: Vec<Arc<Signals>>,
    model: Model,
    input: Input,
    space: Space,
    features: ModelFeatures,
    criterion: Criterion,
    samples: usize,
    /// The order of the recordings in evaluations with cutoffs, computed on first use.
    order: OnceLock<Vec<usize>>,
}

impl Problem {
    /// Creates a problem and prepares its recordings.
    ///
    /// # Errors
    /// Returns a usage error if there is no recording, or a parameter belongs to a recording that does not exist; a data error
    /// if only some recordings have a voltage; and a not-identified error if the scale divides by the variation of a constant
    /// signal, or by the noise of a signal without any.
    pub fn new(records: &[Record], model: Model, space: Space, criterion: Criterion) -> Result<Self> {
        if records.is_empty() {
            return Err(motorfit_core::Error::usage("no recording was given", "Give at least one."));
        }
        check_of_motor(records)?;
        check_scopes(&space, records.len())?;
        // A resampled voltage has a slope over each step, which only a first-order hold represents. The other recordings, under
        // a zero-order hold, then get slopes of zero.
        let held = model.discretization == Discretization::Zoh && records.iter().any(|r| !r.slope().is_empty());
        let model = if held { Model { discretization: Discretization::Foh, ..model } } else { model };
        let signals = records
            .iter()
            .map(|record| {
                let held = (held && record.slope().is_empty()).then(|| record.with_zero_order_hold());
                let record = held.as_ref().unwrap_or(record);
                Signals::new(record, &criterion, model.initial, model.discretization).map(Arc::new)
            })
            .collect::<Result<Vec<_>>>()?;
        let samples = signals.iter().map(|s| s.samples()).sum();
        let order = OnceLock::new();
        Ok(Self {
            signals,
            model,
            input: input(records)?,
            features: space.features(),
            space,
            criterion,
            samples,
            order,
        })
    }

    /// Returns the same problem with another search space. The recordings are shared.
    #[must_use]
    pub fn with_space(&self, space: Space) -> Self {
        Self { features: space.features(), space, ..self.clone() }
    }

    /// Returns the same problem with each recording replaced by the result of `make`.
    pub(super) fn with_signals(&self, make: impl Fn(&Arc<Signals>) -> Arc<Signals>) -> Self {
        Self { signals: self.signals.iter().map(make).collect(), ..self.clone() }
    }

    /// Returns the problem with one of its recordings only. Parameters of single recordings keep the indices of their
    /// recordings.
    ///
    /// # Panics
    /// Panics if `recording` is out of range.
    #[must_use]
    pub fn only(&self, recording: usize) -> Self {
        let signals = vec![self.signals[recording].clone()];
        Self { samples: signals.iter().map(|s| s.samples()).sum(), signals, order: OnceLock::new(), ..self.clone() }
    }

    /// Returns the problem with other initial states, one per recording. Initial states that are not free are kept.
    #[must_use]
    pub fn starting_from(mut self, initial: &[impl AsRef<[f64]>]) -> Self {
        for (signals, initial) in self.signals.iter_mut().zip(initial) {
            if signals.initial_is_free {
                let state = &mut Arc::make_mut(signals).initial;
                state.iter_mut().zip(initial.as_ref()).for_each(|(own, given)| *own = *given);
            }
        }
        self
    }

    /// Returns the problem with the initial states as they are: none of them is estimated.
    #[doc(hidden)]
    pub fn with_known_initial(&self) -> Self {
        let mut known = self.clone();
        for signals in known.signals.iter_mut().filter(|signals| signals.initial_is_free) {
            Arc::make_mut(signals).initial_is_free = false;
        }
        known
    }

    /// Returns the same problem with the squared errors of each recording and channel divided by σ². `sigma` has one pair per
    /// recording. The problem must have unit weights.
    #[doc(hidden)]
    pub fn weighted_by(&self, sigma: &[impl AsRef<[f64]>]) -> Self {
        let mut weighted = self.clone();
        for (signals, sigma) in weighted.signals.iter_mut().zip(sigma) {
            let signals = Arc::make_mut(signals);
            for channel in (0..2).filter(|channel| self.input == Input::Voltage || *channel == 1) {
                let sigma = sigma.as_ref().get(channel).copied().unwrap_or(1.0);
                signals.factor[channel] /= sigma * sigma;
            }
        }
        weighted
    }

    /// Returns the prepared recordings.
    #[must_use]
    pub fn signals(&self) -> &[Arc<Signals>] {
        &self.signals
    }

    /// Returns the order of the recordings in evaluations with cutoffs, found by `find` on first use; empty for a single recording.
    pub(super) fn order(&self, find: impl FnOnce(&Self) -> Vec<usize>) -> &[usize] {
        if self.signals.len() == 1 { &[] } else { self.order.get_or_init(|| find(self)) }
    }

    /// Returns the simulation model.
    #[must_use]
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Returns the space of free and fixed parameters.
    #[must_use]
    pub fn space(&self) -> &Space {
        &self.space
    }

    /// Returns the input of the motor: its voltage, or its current.
    #[must_use]
    pub fn input(&self) -> Input {
        self.input
    }

    /// Returns the discretization together with the input of the motor.
    #[must_use]
    pub fn method(&self) -> Method {
        Method { discretization: self.model.discretization, input: self.input }
    }

    /// Returns the criterion.
    #[must_use]
    pub fn criterion(&self) -> &Criterion {
        &self.criterion
    }

    /// Returns the extensions of the motor.
    #[must_use]
    pub fn features(&self) -> ModelFeatures {
        self.features
    }

    /// Returns true if a motor may move before its input does: driven by an offset or a load, or with a negative dead time.
    fn moves_early(&self) -> bool {
        let free = self.space.free().iter().map(|axis| (axis.parameter, axis.min));
        let mut lowest = free.chain(self.space.fixed().iter().map(|(parameter, _, value)| (*parameter, *value)));
        self.features.is_biased() || lowest.any(|(parameter, value)| parameter == Parameter::DeadTime && value < 0.0)
    }

    /// Returns the index of the first sample of a recording that must be simulated. Before it every candidate is at rest.
    #[must_use]
    pub fn first_active(&self, signals: &Signals) -> usize {
        if self.moves_early() { 0 } else { signals.first_active }
    }

    /// Returns the runs of constant inputs from the first active sample on.
    #[doc(hidden)]
    pub fn runs<'a>(&self, signals: &'a Signals) -> &'a [Run] {
        if self.moves_early() { &signals.runs } else { signals.active_runs() }
    }

    /// Returns the segments from the first active sample on.
    pub(super) fn segments<'a>(&self, signals: &'a Signals) -> &'a [Segment] {
        if self.moves_early() { &signals.segments } else { signals.active_segments() }
    }

    /// Returns the weighted sums of errors before the first active sample, per channel.
    #[doc(hidden)]
    pub fn idle_sums(&self, signals: &Signals) -> [f64; 2] {
        if self.moves_early() { [0.0; 2] } else { signals.idle_sums }
    }

    /// Returns the number of samples that must be simulated per candidate, over all recordings.
    #[must_use]
    pub fn active(&self) -> usize {
        self.signals.iter().map(|s| s.len() - self.first_active(s)).sum()
    }

    /// Returns true if any error has a positive weight. A time origin at the end of a recording makes all weights zero.
    #[must_use]
    pub fn has_weight(&self) -> bool {
        let weighs =
            |s: &Signals| s.weight.is_empty() || s.weight[self.first_active(s)..].iter().flatten().any(|w| *w > 0.0);
        self.signals.iter().any(|s| weighs(s))
    }

    /// Returns the parameters of a candidate for one recording.
    #[must_use]
    pub fn parameters(&self, candidate: &[f64], recording: usize) -> Parameters {
        self.space.parameters(candidate, u32::try_from(recording).unwrap_or(u32::MAX))
    }

    /// Returns the parameters of several candidates for one recording, shape `[parameters][candidates]`.
    #[inline]
    #[doc(hidden)]
    pub fn side_by_side<const N: usize>(&self, candidates: [&[f64]; N], recording: usize) -> [[f64; N]; 5] {
        self.space.side_by_side(candidates, u32::try_from(recording).unwrap_or(u32::MAX))
    }

    /// Returns the motor of a candidate, with its extensions, for one recording.
    #[must_use]
    pub fn motor(&self, candidate: &[f64], recording: usize) -> Extended {
        self.space.motor(candidate, u32::try_from(recording).unwrap_or(u32::MAX))
    }

    /// Simulates a candidate on one recording from the state `initial` by the scalar reference simulation, and passes the
    /// sensor outputs `[i, ω]` of each sample to `visit`.
    ///
    /// # Panics
    /// Panics if `recording` is out of range.
    pub fn walk(&self, candidate: &[f64], recording: usize, initial: [f64; 2], visit: impl FnMut([f64; 2])) {
        let signals = &self.signals[recording];
        if self.features.is_linear() {
            return walk(&self.parameters(candidate, recording), &signals.drive(), initial, self.method(), visit);
        }
        let motor = self.motor(candidate, recording);
        ExtendedWalk::new(&motor, &signals.drive(), self.settings(signals), initial).for_each(visit);
    }

    /// Simulates a candidate on one recording from the state `initial` and returns the sensor outputs, current \[A\] and speed
    /// \[rad/s\], one value per sample.
    ///
    /// # Panics
    /// Panics if `recording` is out of range.
    #[must_use]
    pub fn simulate(&self, candidate: &[f64], recording: usize, initial: [f64; 2]) -> [Vec<f64>; 2] {
        let mut signals = [0, 1].map(|_| Vec::with_capacity(self.signals[recording].len()));
        self.walk(candidate, recording, initial, |seen| {
            signals.iter_mut().zip(seen).for_each(|(signal, value)| signal.push(value));
        });
        signals
    }

    /// Returns the settings for simulating an extended motor on a recording.
    #[must_use]
    pub fn settings(&self, signals: &Signals) -> SimulationSettings {
        SimulationSettings { features: self.features, method: self.method(), history: signals.history }
    }

    /// Returns the contribution of one recording to the total of a candidate, from the weighted sums over its active samples.
    #[must_use]
    #[inline]
    pub(crate) fn scaled(&self, signals: &Signals, sums: [f64; 2]) -> f64 {
        self.scaling(signals).total(sums)
    }

    /// Returns what scales the sums of one recording.
    #[inline]
    #[doc(hidden)]
    pub fn scaling(&self, signals: &Signals) -> Scaling {
        Scaling { factor: signals.factor, idle: self.idle_sums(signals) }
    }

    /// Returns the cost for a total over all recordings.
    #[must_use]
    #[inline]
    #[doc(hidden)]
    pub fn cost(&self, total: f64) -> f64 {
        self.criterion.cost(total, self.samples)
    }

    /// Returns a total above which the cost is above `cost`.
    #[doc(hidden)]
    pub fn total_above(&self, cost: f64) -> f64 {
        self.criterion.total_above(cost, self.samples)
    }
}

/// The factors of both channels of one recording, and the sums of errors before its first active sample.
#[derive(Clone, Copy)]
pub struct Scaling {
    pub factor: [f64; 2],
    idle: [f64; 2],
}

impl Scaling {
    /// Returns the contribution of the recording to the total of a candidate.
    #[inline(always)]
    pub fn total(self, sums: [f64; 2]) -> f64 {
        self.factor[0] * (self.idle[0] + sums[0]) + self.factor[1] * (self.idle[1] + sums[1])
    }
}

/// Returns an error for parameters of a recording that does not exist, on which no cost would depend.
fn check_scopes(space: &Space, recordings: usize) -> Result<()> {
    let free = space.free().iter().map(|axis| (axis.parameter, axis.scope));
    let mut all = free.chain(space.fixed().iter().map(|(parameter, scope, _)| (*parameter, *scope)));
    let is_missing =
        |scope: Scope| matches!(scope, Scope::Recording(n) if motorfit_core::numeric::index(n.into()) >= recordings);
    let Some((parameter, scope)) = all.find(|(_, scope)| is_missing(*scope)) else { return Ok(()) };
    let message = format!("found {}, expected an index of a recording below {recordings}", scope.name(parameter));
    Err(motorfit_core::Error::usage(message, "Count recordings from 0, or share the parameter among all."))
}

/// Returns the input of all recordings, the voltage or the current.
fn input(records: &[Record]) -> Result<Input> {
    if is_driven_by_current(records) {
        return Ok(Input::Current);
    }
    let Some(without) = records.iter().find(|record| record.driver() == Quantity::Current) else {
        return Ok(Input::Voltage);
    };
    let message = "has no voltage, while other recordings of this fit have one";
    let hint = text!(
        "Fit the recordings without a voltage separately, or name the column: "
        [Columns = "voltage=HEADING:V"] "."
    );
    let error = motorfit_core::Error::data(message, hint);
    Err(without.source().path.iter().fold(error, |error, path| error.in_file(path)))
}
