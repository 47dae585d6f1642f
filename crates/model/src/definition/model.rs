//! A model: what its text declares, with its equations as a graph.

use super::parts::{
    DelayedSignal, DerivedQuantity, Equation, ModelConstant, ModelInput, ModelOutput, ModelParameter, ModelState,
    ModelTerm, Reaction, SampledLaw,
};
use crate::graph::{Binary, Graph, Id, Leaf, Node, Unary};
use crate::role::Role;

/// A model of a machine: inputs, parameters, equations and outputs.
#[derive(Debug, Clone)]
pub struct Model {
    pub(crate) text: String,
    pub(crate) name: String,
    #[doc(hidden)]
    pub graph: Graph,
    pub(crate) constants: Vec<ModelConstant>,
    #[doc(hidden)]
    pub parameters: Vec<ModelParameter>,
    pub(crate) terms: Vec<ModelTerm>,
    #[doc(hidden)]
    pub inputs: Vec<ModelInput>,
    #[doc(hidden)]
    pub delayed: Vec<DelayedSignal>,
    /// Sampled laws; their leaves are memories with the numbers after those of the delayed signals.
    #[doc(hidden)]
    pub laws: Vec<SampledLaw>,
    #[doc(hidden)]
    pub states: Vec<ModelState>,
    pub(crate) reactions: Vec<Reaction>,
    #[doc(hidden)]
    pub outputs: Vec<ModelOutput>,
    pub(crate) equations: Vec<Equation>,
    pub(crate) derived: Vec<DerivedQuantity>,
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

    /// Returns the number of set-valued reactions (`stick`).
    #[must_use]
    pub fn reactions(&self) -> usize {
        self.reactions.len()
    }

    /// Returns true if a right-hand side has a function with a jump or a corner: `sign`, `abs`, `min`, `max` or `select`.
    #[must_use]
    pub fn has_corners(&self) -> bool {
        let roots: Vec<Id> = self.states.iter().map(|state| state.derivative).collect();
        self.graph.needed(&roots).into_iter().any(|id| {
            matches!(
                self.graph.node(id),
                Node::Unary(Unary::Sign | Unary::Abs, _)
                    | Node::Binary(Binary::Min | Binary::Max, ..)
                    | Node::Select(..)
            )
        })
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

    /// Returns true if an input acts on an output at the same sample: in its equation, or by a delayed signal, whose delay may be zero.
    #[must_use]
    pub fn has_feedthrough(&self, input: usize, output: usize) -> bool {
        let Some(output) = self.outputs.get(output) else { return false };
        self.graph.leaves(&[output.value]).into_iter().any(|leaf| match leaf {
            Leaf::Input(number) => usize::from(number) == input,
            Leaf::Memory(number) => self.delayed.get(usize::from(number)).is_some_and(|signal| {
                self.graph
                    .leaves(&[signal.value])
                    .iter()
                    .any(|leaf| matches!(leaf, Leaf::Input(n) if usize::from(*n) == input))
            }),
            // An output cannot depend on reactions.
            Leaf::NextInput(_) | Leaf::Parameter(_) | Leaf::Reaction(_) | Leaf::State(_) => false,
        })
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

    /// Returns the quantities that the model derives from its parameters, in the order of the text.
    #[must_use]
    pub fn derived(&self) -> &[DerivedQuantity] {
        &self.derived
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
