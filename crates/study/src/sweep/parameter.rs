//! Parameters of the results of a sweep, with what tables and figures say of them.

use motorfit_identify::analysis::Characteristics;
use motorfit_model::Model;
use motorfit_motor::{Input, Parameter, Scope};

/// Place of the first characteristic or derived quantity among the parameters of a machine.
const CHARACTERISTICS: usize = 1000;

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
        let own = Scope::named(name).map(|(parameter, scope)| Self::of_motor(parameter, scope));
        own.or_else(|| Self::characteristic(name))
    }

    /// Returns the feedforward characteristic of the DC motor with this name, in the units of a voltage; `None` if it has none.
    pub(super) fn characteristic(name: &str) -> Option<Self> {
        let mut all = Characteristics::named(None, Input::Voltage).into_iter().enumerate();
        let (place, (name, unit, _)) = all.find(|(_, of)| of.0 == name)?;
        Some(Self { order: (0, CHARACTERISTICS + place, None), ..Self::without_unit(name, unit) })
    }

    /// Returns a parameter of which nothing but its name is known, as of limits that no result has.
    #[must_use]
    pub fn unknown(name: &str) -> Self {
        Self::without_unit(name, "1")
    }

    fn without_unit(name: &str, unit: &str) -> Self {
        let (name, description) = (name.to_owned(), name.replace('_', " "));
        let order = (usize::MAX, 0, None);
        Self {
            symbol: name.clone(),
            name,
            recording: None,
            unit: unit.to_owned(),
            description,
            is_always: false,
            order,
        }
    }

    /// Returns the parameter of a model with this name; `None` if it has none. `machine` is the number of the model, from 1.
    pub(super) fn named_of_model(model: &Model, machine: usize, name: &str) -> Option<Self> {
        let (symbol, recording) = match name.strip_suffix(']').and_then(|name| name.split_once('[')) {
            Some((symbol, recording)) => (symbol, Some(recording.parse().ok()?)),
            None => (name, None),
        };
        if let Some(place) = model.derived().iter().position(|quantity| quantity.name == name) {
            let order = (machine, CHARACTERISTICS + place, None);
            return Some(Self { order, ..Self::without_unit(name, &model.derived()[place].unit.text) });
        }
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
