//! The search space: which parameters are free within which bounds, and which are held.

use super::{Parameter, Parameters};
use crate::{Error, Result};

/// Which recordings of a joint fit a parameter belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scope {
    /// One value for all recordings.
    Shared,
    /// A value of its own for the recording of this index.
    Recording(u32),
}

impl Scope {
    /// Whether it holds for the recording of this index.
    #[must_use]
    pub fn covers(self, recording: u32) -> bool {
        self == Self::Shared || self == Self::Recording(recording)
    }
}

/// A free parameter with its bounds, in SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    /// Which parameter.
    pub parameter: Parameter,
    /// For which recordings.
    pub scope: Scope,
    /// Lower bound, above zero.
    pub min: f64,
    /// Upper bound, above `min`.
    pub max: f64,
}

/// Free and held parameters: maps a candidate (one value per axis) to the parameters of each recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Space {
    free: Vec<Axis>,
    fixed: Vec<(Parameter, Scope, f64)>,
}

impl Space {
    /// A checked space.
    ///
    /// # Errors
    /// `Usage` when bounds are reversed, not positive or not finite, a held value is not positive and finite, a
    /// parameter is missing or given twice, or nothing is free.
    pub fn new(free: Vec<Axis>, fixed: Vec<(Parameter, Scope, f64)>) -> Result<Self> {
        for axis in &free {
            check_bounds(axis)?;
        }
        for &(parameter, _, value) in &fixed {
            if !(value.is_finite() && value > 0.0) {
                return Err(Error::usage(
                    format!("{} cannot be held at {value}", parameter.symbol()),
                    format!("Give a positive value in {}.", parameter.unit()),
                ));
            }
        }
        if free.is_empty() {
            return Err(Error::usage("every parameter is held: there is nothing to find", "Leave at least one free."));
        }
        let space = Self { free, fixed };
        for parameter in Parameter::ALL {
            space.check_once(parameter)?;
        }
        Ok(space)
    }

    /// All five parameters free within Table 2 of the paper.
    #[must_use]
    pub fn table2() -> Self {
        let axis = |parameter: Parameter| {
            let (min, max) = parameter.table2();
            Axis { parameter, scope: Scope::Shared, min, max }
        };
        Self { free: Parameter::ALL.map(axis).to_vec(), fixed: Vec::new() }
    }

    /// Table 2 of the paper with other bounds and held values for some parameters, all shared.
    ///
    /// # Errors
    /// As [`Space::new`].
    pub fn table2_with(bounds: &[(Parameter, f64, f64)], fixed: &[(Parameter, f64)]) -> Result<Self> {
        let mut axes = Self::table2().free;
        for &(parameter, min, max) in bounds {
            let axis = Axis { parameter, scope: Scope::Shared, min, max };
            check_bounds(&axis)?;
            if fixed.iter().any(|(held, _)| *held == parameter) {
                let symbol = parameter.symbol();
                return Err(Error::usage(
                    format!("{symbol} is both bounded and held"),
                    format!("Bound {symbol} or hold it."),
                ));
            }
            axes[parameter as usize] = axis;
        }
        axes.retain(|axis| fixed.iter().all(|(parameter, _)| *parameter != axis.parameter));
        Self::new(axes, fixed.iter().map(|&(parameter, value)| (parameter, Scope::Shared, value)).collect())
    }

    /// The free parameters, in the order of a candidate's values.
    #[must_use]
    pub fn free(&self) -> &[Axis] {
        &self.free
    }

    /// The held parameters.
    #[must_use]
    pub fn fixed(&self) -> &[(Parameter, Scope, f64)] {
        &self.fixed
    }

    /// The box of the search, `(min, max)` for each axis.
    #[must_use]
    pub fn bounds(&self) -> Vec<(f64, f64)> {
        self.free.iter().map(|axis| (axis.min, axis.max)).collect()
    }

    /// The parameters that a candidate means for one recording; `candidate` has one value per free axis.
    #[must_use]
    pub fn parameters(&self, candidate: &[f64], recording: u32) -> Parameters {
        let mut values = [f64::NAN; 5];
        for &(parameter, scope, value) in &self.fixed {
            if scope.covers(recording) {
                values[parameter as usize] = value;
            }
        }
        for (axis, &value) in self.free.iter().zip(candidate) {
            if axis.scope.covers(recording) {
                values[axis.parameter as usize] = value;
            }
        }
        Parameters::from_array(values)
    }

    fn check_once(&self, parameter: Parameter) -> Result<()> {
        let free = self.free.iter().filter(|a| a.parameter == parameter).map(|a| a.scope);
        let fixed = self.fixed.iter().filter(|f| f.0 == parameter).map(|f| f.1);
        let scopes: Vec<Scope> = free.chain(fixed).collect();
        let twice = scopes.iter().enumerate().any(|(n, a)| scopes[..n].iter().any(|b| overlap(*a, *b)));
        let symbol = parameter.symbol();
        if scopes.is_empty() {
            Err(Error::usage(format!("{symbol} has neither bounds nor a value"), format!("Bound {symbol} or hold it.")))
        } else if twice {
            Err(Error::usage(format!("{symbol} is given twice"), format!("Either bound {symbol} or hold it, once.")))
        } else {
            Ok(())
        }
    }
}

fn overlap(a: Scope, b: Scope) -> bool {
    a == b || a == Scope::Shared || b == Scope::Shared
}

fn check_bounds(axis: &Axis) -> Result<()> {
    let Axis { parameter, min, max, .. } = *axis;
    let symbol = parameter.symbol();
    let remedy = format!(
        "Give MIN:MAX in {} with 0 < MIN < MAX, for example {symbol}={}:{}.",
        parameter.unit(),
        parameter.table2().0,
        parameter.table2().1
    );
    if !(min.is_finite() && max.is_finite()) {
        return Err(Error::usage(format!("the bounds of {symbol}, {min}:{max}, are not finite"), remedy));
    }
    if min <= 0.0 || max <= 0.0 {
        return Err(Error::usage(format!("the bounds of {symbol}, {min}:{max}, are not positive"), remedy));
    }
    if min >= max {
        return Err(Error::usage(format!("the bounds of {symbol}, {min}:{max}, are reversed or equal"), remedy));
    }
    Ok(())
}
