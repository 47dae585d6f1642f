//! From syntax trees to nodes of a graph, with the units of all quantities checked.

use super::parts::{Reaction, SampledLaw};
use crate::expression::{Expression, Fault, Function, Kind, Operator};
use crate::graph::{Binary, Comparison, Graph, Id, Leaf, Node, Unary};
use motorfit_core::text::{nearest, quoted};
use motorfit_core::units::Dimension;
use std::collections::HashMap;

/// A value in SI units; the dimension of 0 is open (`None`), because it may be compared with any quantity.
#[derive(Debug, Clone, Copy)]
pub(super) struct Quantity {
    pub id: Id,
    pub dimension: Option<Dimension>,
}

/// A condition of comparisons.
enum Condition {
    Compare(Comparison, [Id; 2]),
    Not(Box<Condition>),
    And(Box<[Condition; 2]>),
    Or(Box<[Condition; 2]>),
}

enum Value {
    Number(Quantity),
    Condition(Condition),
}

/// Names that expressions may use, and the graph that they become.
#[derive(Default)]
pub(super) struct Scope {
    pub graph: Graph,
    pub names: HashMap<String, Quantity>,
    pub reactions: Vec<Reaction>,
    pub laws: Vec<SampledLaw>,
    /// Number of delayed signals, whose memories precede those of the laws.
    pub delayed: usize,
    /// True where a `stick` may stand: in the derivatives of states and in what they use.
    pub has_reactions: bool,
}

/// Largest number of nodes of a model.
pub(crate) const NODES_MAX: usize = 20_000;
/// Largest number of `hold` functions of a model.
const LAWS_MAX: usize = 16;
/// Largest number of `stick` functions of a model.
const REACTIONS_MAX: usize = 16;

type Lowered<T> = Result<T, Fault>;

impl Scope {
    /// Lowers an expression to a quantity.
    pub fn quantity(&mut self, expression: &Expression) -> Lowered<Quantity> {
        match self.value(expression)? {
            Value::Number(quantity) => Ok(quantity),
            Value::Condition(_) => {
                let hint = "Use it as select(condition, a, b).";
                Err(Fault::new(expression.at, "a condition stands where a number is expected", hint))
            }
        }
    }

    /// Lowers an expression whose dimension must be the given one.
    pub fn quantity_of(&mut self, expression: &Expression, dimension: Dimension, what: &str) -> Lowered<Id> {
        let quantity = self.quantity(expression)?;
        match quantity.dimension.filter(|own| *own != dimension) {
            None => Ok(quantity.id),
            Some(own) => {
                let message = format!("{what} has the unit {own}, expected {dimension}");
                Err(Fault::new(expression.at, message, "Correct the equation, or the units of the names in it."))
            }
        }
    }

    fn condition(&mut self, expression: &Expression) -> Lowered<Condition> {
        match self.value(expression)? {
            Value::Condition(condition) => Ok(condition),
            Value::Number(_) => Err(Fault::new(
                expression.at,
                "a number stands where a condition is expected",
                "Write a comparison such as w < 0.",
            )),
        }
    }

    fn value(&mut self, expression: &Expression) -> Lowered<Value> {
        if self.graph.len() > NODES_MAX {
            let message = format!("the model has more than {NODES_MAX} operations");
            return Err(Fault::new(expression.at, message, "Leave out what the recordings cannot show."));
        }
        let number = |quantity| Ok(Value::Number(quantity));
        match &expression.kind {
            Kind::Number(value) => {
                let dimension = (*value != 0.0).then_some(Dimension::ONE);
                number(Quantity { id: self.graph.constant(*value), dimension })
            }
            Kind::Name(name) => number(self.named(name, expression.at)?),
            Kind::Negative(inner) => {
                let Quantity { id, dimension } = self.quantity(inner)?;
                number(Quantity { id: self.graph.negative(id), dimension })
            }
            Kind::Not(inner) => Ok(Value::Condition(Condition::Not(Box::new(self.condition(inner)?)))),
            Kind::Binary(operator, left, right) => self.binary(*operator, expression.at, [left, right]),
            Kind::Call(function, arguments) => number(self.call(*function, expression.at, arguments)?),
        }
    }

    fn named(&mut self, name: &str, at: usize) -> Lowered<Quantity> {
        if let Some(known) = self.names.get(name) {
            return Ok(*known);
        }
        if name == "pi" {
            let id = self.graph.constant(std::f64::consts::PI);
            return Ok(Quantity { id, dimension: Some(Dimension::ONE) });
        }
        let same = self.names.keys().find(|known| known.eq_ignore_ascii_case(name)).map(String::as_str);
        let names: Vec<&str> = self.names.keys().map(String::as_str).collect();
        let hint = match same.or_else(|| nearest(name, &names)) {
            Some(near) => format!("Did you mean \"{near}\"?"),
            None => "Declare it as an input, constant, parameter, signal or state, or in [let].".to_owned(),
        };
        Err(Fault::new(at, format!("{} is not known", quoted(name)), hint))
    }

    /// Returns the dimension of two quantities that must have the same.
    fn same(at: usize, what: &str, [a, b]: [Option<Dimension>; 2]) -> Lowered<Option<Dimension>> {
        match (a, b) {
            (Some(a), Some(b)) if a != b => {
                let hint = "Correct the equation, or the units of the names in it; a number by itself has no unit.";
                Err(Fault::new(at, format!("{what} joins {a} and {b}"), hint))
            }
            (a, b) => Ok(a.or(b)),
        }
    }

    fn binary(&mut self, operator: Operator, at: usize, [left, right]: [&Expression; 2]) -> Lowered<Value> {
        if matches!(operator, Operator::And | Operator::Or) {
            let both = Box::new([self.condition(left)?, self.condition(right)?]);
            return Ok(Value::Condition(if operator == Operator::And {
                Condition::And(both)
            } else {
                Condition::Or(both)
            }));
        }
        let (a, b) = (self.quantity(left)?, self.quantity(right)?);
        let dimensions = [a.dimension, b.dimension];
        let compare = |comparison, operands, name: &str| {
            Self::same(at, name, dimensions)?;
            Ok(Value::Condition(Condition::Compare(comparison, operands)))
        };
        let graph = &mut self.graph;
        let (id, dimension) = match operator {
            Operator::Less => return compare(Comparison::Less, [a.id, b.id], "<"),
            Operator::Greater => return compare(Comparison::Less, [b.id, a.id], ">"),
            Operator::LessEqual => return compare(Comparison::LessEqual, [a.id, b.id], "<="),
            Operator::GreaterEqual => return compare(Comparison::LessEqual, [b.id, a.id], ">="),
            Operator::Add => (graph.add(a.id, b.id), Self::same(at, "+", dimensions)?),
            Operator::Subtract => (graph.subtract(a.id, b.id), Self::same(at, "-", dimensions)?),
            Operator::Multiply => {
                let dimension = a.dimension.zip(b.dimension).map(|(a, b)| a.times(b));
                (graph.multiply(a.id, b.id), dimension)
            }
            Operator::Divide => {
                if graph.is_constant(b.id, 0.0) {
                    return Err(Fault::new(at, "division by zero", "Correct the denominator."));
                }
                let dimension = a.dimension.map(|a| a.per(b.dimension.unwrap_or_default()));
                (graph.divide(a.id, b.id), dimension)
            }
            Operator::Power | Operator::And | Operator::Or => return Ok(Value::Number(self.power(at, a, b)?)),
        };
        Ok(Value::Number(Quantity { id, dimension }))
    }

    fn power(&mut self, at: usize, base: Quantity, exponent: Quantity) -> Lowered<Quantity> {
        if exponent.dimension.is_some_and(|dimension| dimension != Dimension::ONE) {
            let unit = exponent.dimension.unwrap_or_default();
            return Err(Fault::new(at, format!("an exponent with the unit {unit}"), "An exponent has no unit."));
        }
        let fixed = self.graph.value(exponent.id);
        let dimension = match (base.dimension, fixed) {
            (Some(Dimension::ONE) | None, _) => Some(Dimension::ONE),
            (Some(base), Some(value)) => {
                let halves = 2.0 * value;
                let whole = (halves.fract() == 0.0 && halves.abs() <= 32.0)
                    .then(|| motorfit_core::numeric::whole(halves.abs()));
                let halves =
                    whole.and_then(|whole| i32::try_from(whole).ok()).map(|n| if value < 0.0 { -n } else { n });
                let dimension = halves.and_then(|halves| base.power(halves));
                Some(dimension.ok_or_else(|| {
                    Fault::new(
                        at,
                        format!("the power {value} of the unit {base}"),
                        "Divide the base by a constant of its unit.",
                    )
                })?)
            }
            (Some(base), None) => {
                let hint = "Divide the base by a constant of its unit, as in (w/w0)^n.";
                return Err(Fault::new(at, format!("a variable power of the unit {base}"), hint));
            }
        };
        // The base of a power that is not an integer must not be negative; it is taken as 0 then.
        let base = match fixed {
            Some(value) if value.fract() == 0.0 => base.id,
            _ => {
                let zero = self.graph.constant(0.0);
                self.graph.binary(Binary::Max, base.id, zero)
            }
        };
        Ok(Quantity { id: self.graph.power(base, exponent.id), dimension })
    }

    fn call(&mut self, function: Function, at: usize, arguments: &[Expression]) -> Lowered<Quantity> {
        let name = function.name();
        match function {
            Function::Select => {
                let condition = self.condition(&arguments[0])?;
                let (a, b) = (self.quantity(&arguments[1])?, self.quantity(&arguments[2])?);
                let dimension = Self::same(at, name, [a.dimension, b.dimension])?;
                return Ok(Quantity { id: self.choose(&condition, [a.id, b.id]), dimension });
            }
            Function::Stick => return self.stick(at, arguments),
            Function::Hold => return self.hold(at, arguments),
            Function::Pow => {
                let (base, exponent) = (self.quantity(&arguments[0])?, self.quantity(&arguments[1])?);
                return self.power(at, base, exponent);
            }
            _ => {}
        }
        let values: Vec<Quantity> = arguments.iter().map(|argument| self.quantity(argument)).collect::<Lowered<_>>()?;
        let dimensions = values.iter().map(|value| value.dimension);
        let common = dimensions.clone().try_fold(None, |all, own| Self::same(at, name, [all, own]));
        let plain = |unary| {
            let units = dimensions.clone().flatten().find(|dimension| *dimension != Dimension::ONE);
            match units {
                Some(unit) => {
                    let hint = "Divide the argument by a constant of its unit, as in tanh(w/w0).";
                    Err(Fault::new(at, format!("{name} of a quantity with the unit {unit}"), hint))
                }
                None => Ok((unary, Some(Dimension::ONE))),
            }
        };
        let (operator, dimension) = match function {
            Function::Sin => plain(Unary::Sin)?,
            Function::Cos => plain(Unary::Cos)?,
            Function::Tan => plain(Unary::Tan)?,
            Function::Exp => plain(Unary::Exp)?,
            Function::Log => plain(Unary::Log)?,
            Function::Tanh => plain(Unary::Tanh)?,
            Function::Atan => plain(Unary::Atan)?,
            Function::Sign => (Unary::Sign, Some(Dimension::ONE)),
            Function::Abs => (Unary::Abs, values[0].dimension),
            Function::Sqrt => {
                let halved = values[0].dimension.map(|own| own.power(1));
                let halved = halved.map(|own| {
                    own.ok_or_else(|| {
                        Fault::new(at, "the root of a unit of quarters", "Correct the unit of the argument.")
                    })
                });
                (Unary::Sqrt, halved.transpose()?)
            }
            _ => {
                let ids: Vec<Id> = values.iter().map(|value| value.id).collect();
                return Ok(self.of_several(function, &ids, common?));
            }
        };
        Ok(Quantity { id: self.graph.unary(operator, values[0].id), dimension })
    }

    /// Returns the value of a function of several quantities with one dimension.
    fn of_several(&mut self, function: Function, ids: &[Id], common: Option<Dimension>) -> Quantity {
        let graph = &mut self.graph;
        let (id, dimension) = match (function, ids) {
            (Function::Min, [a, b]) => (graph.binary(Binary::Min, *a, *b), common),
            (Function::Max, [a, b]) => (graph.binary(Binary::Max, *a, *b), common),
            (Function::Atan2, [y, x]) => (graph.binary(Binary::Atan2, *y, *x), Some(Dimension::ONE)),
            (Function::Clamp, [x, low, high]) => {
                let above = graph.binary(Binary::Max, *x, *low);
                (graph.binary(Binary::Min, above, *high), common)
            }
            (Function::Deadzone, [x, width]) => {
                let low = graph.negative(*width);
                let above = graph.binary(Binary::Max, *x, low);
                let within = graph.binary(Binary::Min, above, *width);
                (graph.subtract(*x, within), common)
            }
            // All other functions are handled by the caller.
            _ => (ids.first().copied().unwrap_or_default(), common),
        };
        Quantity { id, dimension }
    }

    fn choose(&mut self, condition: &Condition, [then, otherwise]: [Id; 2]) -> Id {
        match condition {
            Condition::Compare(comparison, operands) => self.graph.select(*comparison, *operands, [then, otherwise]),
            Condition::Not(inner) => self.choose(inner, [otherwise, then]),
            Condition::And(both) => {
                let inner = self.choose(&both[1], [then, otherwise]);
                self.choose(&both[0], [inner, otherwise])
            }
            Condition::Or(both) => {
                let inner = self.choose(&both[1], [then, otherwise]);
                self.choose(&both[0], [then, inner])
            }
        }
    }

    /// Lowers a sampled law to the memory that holds it.
    fn hold(&mut self, at: usize, arguments: &[Expression]) -> Lowered<Quantity> {
        let law = self.quantity(&arguments[0])?;
        let period = self.quantity_of(&arguments[1], Dimension::TIME, "the period of hold")?;
        let Some(period_s) = self.graph.value(period).filter(|period| *period > 0.0 && period.is_finite()) else {
            let hint = "Declare it in [constants], as Ts = { value = 5, unit = \"ms\" }.";
            return Err(Fault::new(arguments[1].at, "the period of hold is not a positive constant", hint));
        };
        if self.graph.leaves(&[law.id]).iter().any(|leaf| matches!(leaf, Leaf::Reaction(_))) {
            let hint = "Reactions are known at the end of a step only. Give the law without the stick function.";
            return Err(Fault::new(at, "a sampled law depends on stick", hint));
        }
        let new = SampledLaw { value: law.id, period_s };
        let index = self.laws.iter().position(|known| *known == new).unwrap_or(self.laws.len());
        if index >= LAWS_MAX {
            return Err(Fault::new(at, format!("more than {LAWS_MAX} hold functions"), "Hold their sum in one."));
        }
        if index == self.laws.len() {
            self.laws.push(new);
        }
        let number = u16::try_from(self.delayed + index).unwrap_or(u16::MAX);
        Ok(Quantity { id: self.graph.leaf(Leaf::Memory(number)), dimension: law.dimension })
    }

    fn stick(&mut self, at: usize, arguments: &[Expression]) -> Lowered<Quantity> {
        if !self.has_reactions {
            let hint = "Write it in the derivative of a state, directly or by a name of [let].";
            return Err(Fault::new(at, "stick has no meaning here", hint));
        }
        let axis = self.quantity(&arguments[0])?;
        let Node::Leaf(Leaf::State(state)) = self.graph.node(axis.id) else {
            let hint = "Write stick(w, limit) with a state w, such as a speed.";
            return Err(Fault::new(arguments[0].at, "the first argument of stick is not a state", hint));
        };
        let limit = self.quantity(&arguments[1])?;
        let known = self
            .reactions
            .iter()
            .position(|reaction| (reaction.state, reaction.limit) == (usize::from(state), limit.id));
        let index = known.unwrap_or(self.reactions.len());
        if index >= REACTIONS_MAX {
            return Err(Fault::new(
                at,
                format!("more than {REACTIONS_MAX} stick functions"),
                "Add their limits in one.",
            ));
        }
        if known.is_none() {
            self.reactions.push(Reaction { state: usize::from(state), limit: limit.id });
        }
        let index = u16::try_from(index).unwrap_or(u16::MAX);
        Ok(Quantity { id: self.graph.leaf(Leaf::Reaction(index)), dimension: limit.dimension })
    }
}
