//! The parts of a model: parameters, inputs, constants, states, delayed signals, outputs and equations.

use crate::graph::Id;
use motorfit_core::coordinate::Coordinate;
use motorfit_core::units::{Dimension, Unit};

/// A unit as it is written, and what it means.
#[derive(Debug, Clone, PartialEq)]
pub struct WrittenUnit {
    /// The unit as written in the model.
    pub text: String,
    /// The dimension and the factor of the unit.
    pub unit: Unit,
}

/// A parameter of a model. Its values are in its unit.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelParameter {
    /// Name in the equations.
    pub name: String,
    /// Unit of the values.
    pub unit: WrittenUnit,
    /// Lower bound of the search.
    pub min: f64,
    /// Upper bound of the search.
    pub max: f64,
    /// True if the search and the refinement move its logarithm.
    pub is_logarithmic: bool,
    /// Value where none is given, as in a simulation.
    pub value: Option<f64>,
    /// Value at which the parameter has no effect; it may lie outside the bounds. `None` if there is none.
    pub neutral: Option<f64>,
    /// True if every recording has its own value.
    pub is_per_recording: bool,
    /// Description; empty if there is none.
    pub description: String,
}

impl ModelParameter {
    /// Returns the usual value: that of the text, or else the middle of the bounds.
    #[must_use]
    pub fn usual(&self) -> f64 {
        let &Self { min, max, is_logarithmic, .. } = self;
        let range = Coordinate { min, max, is_logarithmic, lowest: f64::NEG_INFINITY, neutral: None };
        self.value.unwrap_or_else(|| range.at(0.5))
    }
}

/// An optional term of a model: without it each of its parameters has its neutral value, or none that matters.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ModelTerm {
    /// Name of the term.
    pub name: String,
    /// Numbers of its parameters, of which at least one has a neutral value.
    pub parameters: Vec<usize>,
}

/// An input of a model: a recorded signal, in its unit.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelInput {
    /// Name in the equations.
    pub name: String,
    /// Unit of the values.
    pub unit: WrittenUnit,
    /// Heading of its column; the name if `None`.
    pub column: Option<String>,
    /// Value where the recording has no such column; `None` if it must have one.
    pub default: Option<f64>,
    /// True if the equations have the signal with an offset.
    pub is_offset: bool,
}

/// A constant of a model.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelConstant {
    /// Name in the equations.
    pub name: String,
    /// Value in SI units.
    pub value: f64,
    /// Dimension of the value.
    pub dimension: Dimension,
}

/// A quantity that a model derives from its parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct DerivedQuantity {
    /// Name.
    pub name: String,
    /// Unit of the values in results.
    pub unit: WrittenUnit,
    /// Value in this unit: a node that depends on parameters alone.
    pub(crate) value: Id,
}

/// Initial value of a state.
#[derive(Debug, Clone, PartialEq)]
pub enum InitialState {
    /// A function of the parameters: a node of the graph, in SI units from the zero of the state's unit.
    Given(NodeId),
    /// The first sample of the output with this number, whose value is the state.
    Measured(usize),
    /// Unknown, estimated for each recording.
    Free,
}

/// A node of the graph of a model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NodeId(#[doc(hidden)] pub Id);

/// A state of a model.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelState {
    /// Name in the equations.
    pub name: String,
    /// Unit of the initial value.
    pub unit: WrittenUnit,
    /// Derivative with respect to time, in SI units.
    #[doc(hidden)]
    pub derivative: Id,
    /// Value at the first sample.
    pub initial: InitialState,
}

/// A set-valued reaction (`stick`): constant over a step, it brings its state to zero within its limit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Reaction {
    pub state: usize,
    /// Largest magnitude, in SI units.
    pub limit: Id,
}

/// A signal with a delay: a function of inputs and parameters that acts on the equations later.
#[derive(Debug, Clone, PartialEq)]
pub struct DelayedSignal {
    pub name: String,
    /// The signal without its delay, in SI units.
    pub value: Id,
    /// Delay \[s\] and latency \[s\]; each is zero if it is not given.
    pub delay: Id,
    pub latency: Id,
}

/// A sampled law (`hold`): a value that is computed at multiples of its period and held between them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampledLaw {
    /// The law, in SI units.
    pub value: Id,
    /// Period \[s\], from the start of a recording.
    pub period_s: f64,
}

/// An output of a model: a measured signal, in its unit.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelOutput {
    /// Name of the output.
    pub name: String,
    /// Unit of the values.
    pub unit: WrittenUnit,
    /// Heading of its column; the name if `None`.
    pub column: Option<String>,
    /// Value in its unit, with the gain and the offset of the sensor.
    pub(crate) value: Id,
    /// Time constant of a lag of first order of the sensor \[s\]; `None` if it has none.
    pub(crate) filter: Option<Id>,
    /// Delay of the sensor \[s\]; `None` if it has none.
    pub(crate) delay: Option<Id>,
    /// Number of samples of a moving average of the sensor; `None` if it has none.
    pub(crate) average: Option<Id>,
}

impl ModelOutput {
    /// Returns true if the sensor averages over samples.
    #[must_use]
    pub fn is_averaged(&self) -> bool {
        self.average.is_some()
    }

    /// Returns true if the sensor has a filter or a delay.
    #[must_use]
    pub fn is_late(&self) -> bool {
        self.filter.is_some() || self.delay.is_some()
    }

    /// Returns the nodes of the value and of the sensor.
    pub(crate) fn roots(&self) -> impl Iterator<Item = Id> {
        [Some(self.value), self.filter, self.delay, self.average].into_iter().flatten()
    }
}

/// An equation as it is written: the name on its left, its section and the text.
#[derive(Debug, Clone, PartialEq)]
pub struct Equation {
    /// Section of the model.
    pub section: &'static str,
    /// Name that the equation defines.
    pub name: String,
    /// The expression.
    pub text: String,
}
