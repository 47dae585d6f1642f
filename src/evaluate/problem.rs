//! A problem: recordings, model, space and criterion, checked and prepared once.

use super::signals::{Initial, Signals};
use crate::Result;
use crate::criterion::Criterion;
use crate::motor::{Discretization, Parameters, Space};
use crate::record::Record;
use std::sync::Arc;

/// How the motor is simulated.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Model {
    /// The one-step method.
    pub discretization: Discretization,
    /// The state at the first sample.
    pub initial: Initial,
}

/// What candidates are evaluated on: one motor in one or more recordings.
#[derive(Debug, Clone)]
pub struct Problem {
    signals: Vec<Arc<Signals>>,
    model: Model,
    space: Space,
    criterion: Criterion,
    samples: usize,
}

impl Problem {
    /// Prepares the recordings.
    ///
    /// # Errors
    /// `Usage` when there is no recording; `NotIdentified` when a signal is constant where the scale divides by its
    /// variation.
    pub fn new(records: &[Record], model: Model, space: Space, criterion: Criterion) -> Result<Self> {
        if records.is_empty() {
            return Err(crate::Error::usage("no recording was given", "Give at least one."));
        }
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
        Ok(Self { signals, model, space, criterion, samples })
    }

    /// The same with other free and held parameters; the recordings are shared.
    #[must_use]
    pub fn with_space(&self, space: Space) -> Self {
        Self { space, ..self.clone() }
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

    /// The recordings.
    #[must_use]
    pub fn signals(&self) -> &[Arc<Signals>] {
        &self.signals
    }

    /// How the motor is simulated.
    #[must_use]
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// What is free and what is held.
    #[must_use]
    pub fn space(&self) -> &Space {
        &self.space
    }

    /// The criterion.
    #[must_use]
    pub fn criterion(&self) -> &Criterion {
        &self.criterion
    }

    /// Samples that have to be simulated for each candidate, over all recordings: its candidate-steps.
    #[must_use]
    pub fn active(&self) -> usize {
        self.signals.iter().map(|s| s.active()).sum()
    }

    /// Whether any error counts: a time origin at the end of a recording leaves none.
    #[must_use]
    pub fn has_weight(&self) -> bool {
        let weighs = |s: &Signals| s.weight.is_empty() || s.weight[s.first_active..].iter().flatten().any(|w| *w > 0.0);
        self.signals.iter().any(|s| weighs(s))
    }

    /// What a candidate means for one recording.
    #[must_use]
    pub fn parameters(&self, candidate: &[f64], recording: usize) -> Parameters {
        self.space.parameters(candidate, u32::try_from(recording).unwrap_or(u32::MAX))
    }

    /// Adds one recording's weighted sums (over its active samples) to the total of a candidate.
    #[must_use]
    #[inline]
    pub(crate) fn scaled(signals: &Signals, sums: [f64; 2]) -> f64 {
        signals.factor[0] * (signals.rest[0] + sums[0]) + signals.factor[1] * (signals.rest[1] + sums[1])
    }

    /// The cost from the total over all recordings.
    #[must_use]
    #[inline]
    pub(crate) fn cost(&self, total: f64) -> f64 {
        self.criterion.cost(total, self.samples)
    }
}
