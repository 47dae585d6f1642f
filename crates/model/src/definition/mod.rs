//! The definition of a model: what its text declares, checked, with its equations as a graph.

mod check;
mod document;
mod lower;
mod names;
mod read;
mod sections;

pub(crate) use document::TEXT_MAX;

use motorfit_core::limit::{Limit, limit_of};

/// Size limits of models.
pub const LIMITS: [Limit; 5] = [
    limit_of("bytes of a model", document::TEXT_MAX, "refused"),
    limit_of("bytes of an expression of a model", document::EXPRESSION_MAX, "refused, with line and column"),
    limit_of("items of a section of a model", read::DECLARED_MAX, "refused, with line and column"),
    limit_of("operations of a model", lower::NODES_MAX, "refused, with line and column"),
    limit_of("levels of brackets of an expression", crate::expression::DEPTH_MAX, "refused, with line and column"),
];

use super::graph::{Graph, Id};
use super::role::Role;
use super::step::Affine;
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
    /// True if every recording has its own value.
    pub is_per_recording: bool,
    /// Description; empty if there is none.
    pub description: String,
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

/// An output of a model: a measured signal, in its unit.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelOutput {
    /// Name of the output.
    pub name: String,
    /// Unit of the values.
    pub unit: WrittenUnit,
    /// Heading of its column; the name if `None`.
    pub column: Option<String>,
    /// Value in its unit.
    pub(crate) value: Id,
    /// Number of samples of a moving average of the sensor; `None` if it has none.
    pub(crate) average: Option<Id>,
}

impl ModelOutput {
    /// Returns true if the sensor averages over samples.
    #[must_use]
    pub fn is_averaged(&self) -> bool {
        self.average.is_some()
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

/// A model of a machine: inputs, parameters, equations and outputs.
#[derive(Debug, Clone)]
pub struct Model {
    pub(crate) text: String,
    pub(crate) name: String,
    pub graph: Graph,
    pub(crate) constants: Vec<ModelConstant>,
    pub parameters: Vec<ModelParameter>,
    pub inputs: Vec<ModelInput>,
    pub delayed: Vec<DelayedSignal>,
    pub states: Vec<ModelState>,
    pub(crate) reactions: Vec<Reaction>,
    pub outputs: Vec<ModelOutput>,
    pub(crate) equations: Vec<Equation>,
    /// Values of the roles in the files of simulators, in SI units.
    pub(crate) roles: Vec<(Role, Id)>,
}

impl Model {
    /// Returns the SHA-256 digest of the text, in hexadecimal.
    #[must_use]
    pub fn digest(&self) -> String {
        use sha2::Digest as _;
        motorfit_core::text::hexadecimal(&sha2::Sha256::digest(self.text.as_bytes()))
    }

    /// Returns true if the equations are affine in states and inputs, with coefficients of parameters alone.
    #[must_use]
    pub fn is_affine(&self) -> bool {
        let mut graph = self.graph.clone();
        Affine::of(self, &mut graph).nonlinear_rows(&graph).is_empty()
    }

    /// Returns the number of set-valued reactions (`stick`).
    #[must_use]
    pub fn reactions(&self) -> usize {
        self.reactions.len()
    }

    /// Returns the number of operations of the right-hand sides and outputs, shared ones once.
    #[must_use]
    pub fn operations(&self) -> usize {
        let roots: Vec<Id> = self
            .states
            .iter()
            .map(|state| state.derivative)
            .chain(self.outputs.iter().map(|output| output.value))
            .collect();
        let is_operation = |id: &Id| self.graph.operands(*id).next().is_some();
        self.graph.needed(&roots).iter().filter(|id| is_operation(id)).count()
    }

    /// Returns the text of the model.
    #[must_use]
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Returns the name of the model.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the constants in the order of the text.
    #[must_use]
    pub fn constants(&self) -> &[ModelConstant] {
        &self.constants
    }

    /// Returns the parameters in the order of the text.
    #[must_use]
    pub fn parameters(&self) -> &[ModelParameter] {
        &self.parameters
    }

    /// Returns the inputs in the order of the text.
    #[must_use]
    pub fn inputs(&self) -> &[ModelInput] {
        &self.inputs
    }

    /// Returns the states in the order of the text.
    #[must_use]
    pub fn states(&self) -> &[ModelState] {
        &self.states
    }

    /// Returns the outputs in the order of the text.
    #[must_use]
    pub fn outputs(&self) -> &[ModelOutput] {
        &self.outputs
    }

    /// Returns the equations as they are written, in the order of the text.
    #[must_use]
    pub fn equations(&self) -> &[Equation] {
        &self.equations
    }
}
