//! Parameters of the results of a sweep, with what tables and figures say of them.

use motorfit_model::Model;
use motorfit_motor::{Parameter, Scope};

/// A parameter of the results of a sweep: of the DC motor or of a user's model, shared by all recordings or of one recording.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepParameter {
    /// Name, with the index of the recording if it belongs to one, as in `T0[1]`.
    pub name: String,
    /// Symbol without the recording.
    pub symbol: String,
    /// Index of its recording; `None` if it is shared by all.
    pub recording: Option<u32>,
    /// Unit of its values.
    pub unit: String,
    /// Description, as `winding resistance`.
    pub description: String,
    /// True if every result of its machine has it.
    pub is_always: bool,
    /// Sort key: the machine (the DC motor before models), the parameter and the recording.
    pub(super) order: (usize, usize, Option<u32>),
}

impl SweepParameter {
    /// Returns a parameter of the DC motor.
    #[must_use]
    pub fn of_motor(parameter: Parameter, scope: Scope) -> Self {
        let (place, recording) = scope.order(parameter);
        Self {
            name: scope.name(parameter),
            symbol: parameter.symbol().to_owned(),
            recording,
            unit: parameter.unit().to_owned(),
            description: parameter.name().to_owned(),
            is_always: recording.is_none() && Parameter::ALL.contains(&parameter),
            order: (0, place, recording),
        }
    }

    /// Returns the five parameters of the linear DC motor.
    #[must_use]
    pub fn motor() -> Vec<Self> {
        Parameter::ALL.map(|parameter| Self::of_motor(parameter, Scope::Shared)).to_vec()
    }

    /// Returns the parameter of the DC motor with this name; `None` if it has none.
    pub(super) fn named_of_motor(name: &str) -> Option<Self> {
        Scope::named(name).map(|(parameter, scope)| Self::of_motor(parameter, scope))
    }

    /// Returns the parameter of a model with this name; `None` if it has none. `machine` is the number of the model, from 1.
    pub(super) fn named_of_model(model: &Model, machine: usize, name: &str) -> Option<Self> {
        let (symbol, recording) = match name.strip_suffix(']').and_then(|name| name.split_once('[')) {
            Some((symbol, recording)) => (symbol, Some(recording.parse().ok()?)),
            None => (name, None),
        };
        let place = model.parameters().iter().position(|parameter| parameter.name == symbol)?;
        let parameter = &model.parameters()[place];
        let described = if parameter.description.is_empty() { symbol } else { &parameter.description };
        Some(Self {
            name: name.to_owned(),
            symbol: symbol.to_owned(),
            recording,
            unit: parameter.unit.text.clone(),
            description: described.to_owned(),
            is_always: recording.is_none(),
            order: (machine, place, recording),
        })
    }
}
