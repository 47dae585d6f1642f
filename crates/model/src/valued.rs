//! Values of what depends on the parameters of a model alone.

use super::Role;
use super::definition::{InitialState, Model};
use super::graph::{Direction, Graph, Id, Leaf, evaluate};

/// Evaluates nodes of a graph for values of the parameters in their units; NaN for a node that depends on anything else.
fn valued(graph: &Graph, ids: &[Id], values: &[f64]) -> Vec<f64> {
    let leaf = |leaf: Leaf| match leaf {
        Leaf::Parameter(n) => values.get(usize::from(n)).copied().unwrap_or(f64::NAN),
        _ => f64::NAN,
    };
    evaluate(graph, ids, &mut Vec::new(), &leaf)
}

impl Model {
    /// Evaluates nodes for values of the parameters in their units; NaN for a node that depends on anything else.
    fn valued(&self, ids: &[Id], values: &[f64]) -> Vec<f64> {
        valued(&self.graph, ids, values)
    }

    /// Returns the roles of the section `export` with their values in SI units, for values of the parameters in their units.
    #[must_use]
    pub fn roles(&self, values: &[f64]) -> Vec<(Role, f64)> {
        let ids: Vec<Id> = self.roles.iter().map(|(_, id)| *id).collect();
        self.roles.iter().map(|(role, _)| *role).zip(self.valued(&ids, values)).collect()
    }

    /// Returns the derived quantities in their units, each with its derivatives by the parameters in theirs, for values of the parameters.
    #[must_use]
    pub fn derived_values(&self, values: &[f64]) -> Vec<(f64, Vec<f64>)> {
        let mut graph = self.graph.clone();
        let one = graph.constant(1.0);
        let parameters = self.parameters.len();
        let mut ids = Vec::new();
        for quantity in &self.derived {
            ids.push(quantity.value);
            for number in 0..parameters {
                let rate = |leaf| matches!(leaf, Leaf::Parameter(n) if usize::from(n) == number).then_some(one);
                ids.push(Direction::new(rate).derivative(&mut graph, quantity.value));
            }
        }
        let all = valued(&graph, &ids, values);
        all.chunks(1 + parameters).map(|own| (own[0], own[1..].to_vec())).collect()
    }

    /// Returns the numbers of the parameters that any role depends on.
    #[must_use]
    pub fn parameters_in_roles(&self) -> Vec<usize> {
        let ids: Vec<Id> = self.roles.iter().map(|(_, id)| *id).collect();
        let leaves = self.graph.leaves(&ids);
        let number = |leaf: &Leaf| if let Leaf::Parameter(n) = leaf { Some(usize::from(*n)) } else { None };
        leaves.iter().filter_map(number).collect()
    }

    /// Returns the initial values of the states in SI units from the zero of their units; `None` for those that are measured or free.
    #[must_use]
    pub fn initial_values(&self, values: &[f64]) -> Vec<Option<f64>> {
        let one = |state: &super::definition::ModelState| match &state.initial {
            InitialState::Given(id) => self.valued(&[id.0], values).first().copied(),
            _ => None,
        };
        self.states.iter().map(one).collect()
    }

    /// Returns the names of the delayed signals with their delay and latency \[s\], for values of the parameters in their units.
    #[must_use]
    pub fn delays_s(&self, values: &[f64]) -> Vec<(String, [f64; 2])> {
        let times = |id: Id| self.valued(&[id], values).first().copied().unwrap_or(f64::NAN);
        self.delayed.iter().map(|of| (of.name.clone(), [times(of.delay), times(of.latency)])).collect()
    }
}
