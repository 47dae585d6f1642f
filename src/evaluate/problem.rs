//! A problem: recordings, model, space and criterion, checked and prepared once.

#[cfg(feature = "gpu")]
use super::segment::Run;
use super::segment::Segment;
use super::signals::{Initial, Signals};
use crate::Result;
use crate::criterion::Criterion;
use crate::motor::{
    Discretization, Extended, ExtendedWalk, Input, Method, ModelFeatures, Parameter, Parameters, Scope,
    SimulationSettings, Space, walk,
};
use crate::record::{Quantity, Record, is_driven_by_current};
use crate::setting::text;
use std::sync::Arc;

/// The simulation model.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Model {
    /// The one-step method.
    pub discretization: Discretization,
    /// The state at the first sample.
    pub initial: Initial,
}

/// A problem: one motor in one or more recordings, on which candidates are evaluated.
#[derive(Debug, Clone)]
pub struct Problem {
    signals: Vec<Arc<Signals>>,
    model: Model,
    input: Input,
    space: Space,
    features: ModelFeatures,
    criterion: Criterion,
    samples: usize,
}

impl Problem {
    /// Prepares the recordings.
    ///
    /// # Errors
    /// `Usage` when there is no recording, or a parameter belongs to one that is not there; `Data` when some have a voltage and
    /// others none; `NotIdentified` when a signal is constant where the scale divides by its
    /// variation.
    pub fn new(records: &[Record], model: Model, space: Space, criterion: Criterion) -> Result<Self> {
        if records.is_empty() {
            return Err(crate::Error::usage("no recording was given", "Give at least one."));
        }
        check_scopes(&space, records.len())?;
        // A voltage that is a line over each step needs the method for lines; one that is held is a level line then.
        let held = model.discretization == Discretization::Zoh && records.iter().any(|r| !r.slope().is_empty());
        let model = if held { Model { discretization: Discretization::Foh, ..model } } else { model };
        let signals = records
            .iter()
            .map(|record| {
                let held = (held && record.slope().is_empty()).then(|| record.with_level_steps());
                let record = held.as_ref().unwrap_or(record);
                Signals::new(record, &criterion, model.initial, model.discretization).map(Arc::new)
            })
            .collect::<Result<Vec<_>>>()?;
        let samples = signals.iter().map(|s| s.samples()).sum();
        Ok(Self { signals, model, input: input(records)?, features: space.features(), space, criterion, samples })
    }

    /// The same with other free and held parameters; the recordings are shared.
    #[must_use]
    pub fn with_space(&self, space: Space) -> Self {
        Self { features: space.features(), space, ..self.clone() }
    }

    /// Returns the same problem with each recording as `make` has it.
    pub(super) fn with_signals(&self, make: impl Fn(&Arc<Signals>) -> Arc<Signals>) -> Self {
        Self { signals: self.signals.iter().map(make).collect(), ..self.clone() }
    }

    /// Returns the problem of one recording; what is free or fixed for a recording alone is still numbered as before.
    ///
    /// # Panics
    /// When there is no such recording, as slices do.
    #[must_use]
    pub fn only(&self, recording: usize) -> Self {
        let signals = vec![self.signals[recording].clone()];
        Self { samples: signals.iter().map(|s| s.samples()).sum(), signals, ..self.clone() }
    }

    /// The same with other initial states for the recordings whose own is free.
    #[must_use]
    pub fn starting_from(mut self, initial: &[[f64; 2]]) -> Self {
        for (signals, initial) in self.signals.iter_mut().zip(initial) {
            if signals.initial_is_free {
                Arc::make_mut(signals).initial = *initial;
            }
        }
        self
    }

    /// Returns the same problem with the squares of each recording and channel divided by those of `sigma`, one pair for each
    /// recording; it is for problems whose errors all count alike.
    pub(crate) fn weighted_by(&self, sigma: &[[f64; 2]]) -> Self {
        let mut weighted = self.clone();
        for (signals, sigma) in weighted.signals.iter_mut().zip(sigma) {
            let signals = Arc::make_mut(signals);
            for channel in (0..2).filter(|channel| self.input == Input::Voltage || *channel == 1) {
                signals.factor[channel] /= sigma[channel] * sigma[channel];
            }
        }
        weighted
    }

    /// The recordings.
    #[must_use]
    pub fn signals(&self) -> &[Arc<Signals>] {
        &self.signals
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

    /// The one-step method, for what drives the motor.
    #[must_use]
    pub fn method(&self) -> Method {
        Method { discretization: self.model.discretization, input: self.input }
    }

    /// The criterion.
    #[must_use]
    pub fn criterion(&self) -> &Criterion {
        &self.criterion
    }

    /// Returns the extensions of the motor.
    #[must_use]
    pub fn features(&self) -> ModelFeatures {
        self.features
    }

    /// Returns whether a motor may move before its input: driven by an offset or a load, or by a voltage that is recorded late.
    fn moves_early(&self) -> bool {
        let free = self.space.free().iter().map(|axis| (axis.parameter, axis.min));
        let mut lowest = free.chain(self.space.fixed().iter().map(|(parameter, _, value)| (*parameter, *value)));
        self.features.is_biased() || lowest.any(|(parameter, value)| parameter == Parameter::DeadTime && value < 0.0)
    }

    /// The first sample of a recording that has to be simulated: those before find the motor at rest, unless something
    /// acts on it without an input.
    #[must_use]
    pub fn first_active(&self, signals: &Signals) -> usize {
        if self.moves_early() { 0 } else { signals.first_active }
    }

    /// Returns the runs of constant inputs from there on.
    #[cfg(feature = "gpu")]
    pub(crate) fn runs<'a>(&self, signals: &'a Signals) -> &'a [Run] {
        if self.moves_early() { &signals.runs } else { signals.active_runs() }
    }

    /// Returns the segments from there on.
    pub(super) fn segments<'a>(&self, signals: &'a Signals) -> &'a [Segment] {
        if self.moves_early() { &signals.segments } else { signals.active_segments() }
    }

    /// Returns the weighted sums of errors before that sample.
    pub(crate) fn idle_sums(&self, signals: &Signals) -> [f64; 2] {
        if self.moves_early() { [0.0; 2] } else { signals.idle_sums }
    }

    /// Samples that have to be simulated for each candidate, over all recordings: its candidate-steps.
    #[must_use]
    pub fn active(&self) -> usize {
        self.signals.iter().map(|s| s.len() - self.first_active(s)).sum()
    }

    /// Returns whether any error counts: a time origin at the end of a recording leaves none.
    #[must_use]
    pub fn has_weight(&self) -> bool {
        let weighs =
            |s: &Signals| s.weight.is_empty() || s.weight[self.first_active(s)..].iter().flatten().any(|w| *w > 0.0);
        self.signals.iter().any(|s| weighs(s))
    }

    /// The parameters that a candidate means for one recording.
    #[must_use]
    pub fn parameters(&self, candidate: &[f64], recording: usize) -> Parameters {
        self.space.parameters(candidate, u32::try_from(recording).unwrap_or(u32::MAX))
    }

    /// The motor with its extensions that a candidate means for one recording.
    #[must_use]
    pub fn motor(&self, candidate: &[f64], recording: usize) -> Extended {
        self.space.motor(candidate, u32::try_from(recording).unwrap_or(u32::MAX))
    }

    /// Simulates one recording from the state `initial` by the oracle, handing what the sensors show to `visit`.
    ///
    /// # Panics
    /// When there is no such recording, as slices do.
    pub fn walk(&self, candidate: &[f64], recording: usize, initial: [f64; 2], visit: impl FnMut([f64; 2])) {
        let signals = &self.signals[recording];
        if self.features.is_linear() {
            return walk(&self.parameters(candidate, recording), &signals.drive(), initial, self.method(), visit);
        }
        let motor = self.motor(candidate, recording);
        ExtendedWalk::new(&motor, &signals.drive(), self.settings(signals), initial).for_each(visit);
    }

    /// Simulates one recording likewise: current and speed as the sensors show them, one value a sample.
    ///
    /// # Panics
    /// When there is no such recording, as slices do.
    #[must_use]
    pub fn simulate(&self, candidate: &[f64], recording: usize, initial: [f64; 2]) -> [Vec<f64>; 2] {
        let mut signals = [0, 1].map(|_| Vec::with_capacity(self.signals[recording].len()));
        self.walk(candidate, recording, initial, |seen| {
            signals.iter_mut().zip(seen).for_each(|(signal, value)| signal.push(value));
        });
        signals
    }

    /// Returns the settings in which an extended motor is simulated.
    #[must_use]
    pub fn settings(&self, signals: &Signals) -> SimulationSettings {
        SimulationSettings { features: self.features, method: self.method(), history: signals.history }
    }

    /// Adds one recording's weighted sums (over its active samples) to the total of a candidate.
    #[must_use]
    #[inline]
    pub(crate) fn scaled(&self, signals: &Signals, sums: [f64; 2]) -> f64 {
        let idle = self.idle_sums(signals);
        signals.factor[0] * (idle[0] + sums[0]) + signals.factor[1] * (idle[1] + sums[1])
    }

    /// The cost from the total over all recordings.
    #[must_use]
    #[inline]
    pub(crate) fn cost(&self, total: f64) -> f64 {
        self.criterion.cost(total, self.samples)
    }
}

/// Refuses parameters of a recording that is not there: nothing would depend on them.
fn check_scopes(space: &Space, recordings: usize) -> Result<()> {
    let free = space.free().iter().map(|axis| (axis.parameter, axis.scope));
    let mut all = free.chain(space.fixed().iter().map(|(parameter, scope, _)| (*parameter, *scope)));
    let is_missing =
        |scope: Scope| matches!(scope, Scope::Recording(n) if crate::numeric::index(n.into()) >= recordings);
    let Some((parameter, scope)) = all.find(|(_, scope)| is_missing(*scope)) else { return Ok(()) };
    let message = format!("found {}, expected recordings below {recordings}", scope.name(parameter));
    Err(crate::Error::usage(message, "Count recordings from 0, or share the parameter among all."))
}

/// Returns the input of all recordings: the voltage, or the current.
fn input(records: &[Record]) -> Result<Input> {
    if is_driven_by_current(records) {
        return Ok(Input::Current);
    }
    let Some(without) = records.iter().find(|record| record.driver() == Quantity::Current) else {
        return Ok(Input::Voltage);
    };
    let message = "has no voltage, while other recordings of this fit have one";
    let hint = text!(
        "Fit the recordings without a voltage by themselves, or name the column: "
        [Columns = "voltage=HEADING:V"] "."
    );
    let error = crate::Error::data(message, hint);
    Err(without.source().path.iter().fold(error, |error, path| error.in_file(path)))
}
