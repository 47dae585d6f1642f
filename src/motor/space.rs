//! The search space: which parameters are free within which bounds, and which are held.

use super::extended::Extended;
use super::linear::Parameters;
use super::parameter::Parameter;
use crate::{Error, Result};
use std::collections::HashSet;

/// Which recordings of a joint fit a parameter belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scope {
    /// One value for all recordings.
    Shared,
    /// A value of its own for the recording of this index.
    Recording(u32),
}

impl Scope {
    /// Returns whether it holds for the recording of this index.
    #[must_use]
    pub fn covers(self, recording: u32) -> bool {
        self == Self::Shared || self == Self::Recording(recording)
    }

    /// The name of a parameter in a table: its symbol, with the index of the recording that it belongs to, as `R[0]`.
    #[must_use]
    pub fn name(self, parameter: Parameter) -> String {
        match self {
            Self::Shared => parameter.symbol().to_owned(),
            Self::Recording(n) => format!("{}[{n}]", parameter.symbol()),
        }
    }

    /// Returns where a parameter of this scope stands among others: by parameter, then by recording.
    #[must_use]
    pub fn order(self, parameter: Parameter) -> (usize, Option<u32>) {
        (parameter as usize, if let Self::Recording(n) = self { Some(n) } else { None })
    }

    /// The parameter and the scope of a name in a table, as [`Self::name`] writes it; `None` for what is no such name.
    #[must_use]
    pub fn named(name: &str) -> Option<(Parameter, Self)> {
        let Some((symbol, index)) = name.split_once('[') else { return Some((name.parse().ok()?, Self::Shared)) };
        Some((symbol.parse().ok()?, Self::Recording(index.strip_suffix(']')?.parse().ok()?)))
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

impl Axis {
    /// Returns whether estimates move along its logarithm: the five of the motor, whose sizes are not known beforehand. Others
    /// may be zero or negative and move along their range.
    fn is_logarithmic(&self) -> bool {
        !self.parameter.is_extension()
    }

    /// Where a value lies on the line that estimates move along.
    #[must_use]
    pub fn coordinate(&self, value: f64) -> f64 {
        if self.is_logarithmic() { value.ln() } else { value / (self.max - self.min) }
    }

    /// The value there, within the bounds.
    #[must_use]
    pub fn value(&self, coordinate: f64) -> f64 {
        let value = if self.is_logarithmic() { coordinate.exp() } else { coordinate * (self.max - self.min) };
        value.max(self.min).min(self.max)
    }

    /// Returns the derivative of the value by the coordinate.
    #[must_use]
    pub fn slope(&self, value: f64) -> f64 {
        if self.is_logarithmic() { value } else { self.max - self.min }
    }

    /// The values so many units of the coordinate below and above one.
    #[must_use]
    pub fn around(&self, value: f64, distance: f64) -> [f64; 2] {
        if self.is_logarithmic() {
            return [value * (-distance).exp(), value * distance.exp()];
        }
        let distance = distance * (self.max - self.min);
        [(value - distance).max(self.parameter.lowest()), value + distance]
    }

    /// Returns the value at which the parameter of an extension changes nothing, where the axis has it.
    #[must_use]
    pub fn neutral(&self) -> Option<f64> {
        let value = if self.parameter == Parameter::Saturation { self.max } else { self.parameter.neutral() };
        (self.parameter.is_extension() && (self.min..=self.max).contains(&value)).then_some(value)
    }

    /// Returns whether the parameter of an extension changes nothing at a value.
    #[must_use]
    pub fn is_idle(&self, value: f64) -> bool {
        self.neutral().is_some_and(|neutral| (neutral - value).abs() <= 1e-9 * (self.max - self.min))
    }

    /// The middle of the bounds: of their logarithms for the five of the motor.
    #[must_use]
    pub fn middle(&self) -> f64 {
        self.value(0.5 * (self.coordinate(self.min) + self.coordinate(self.max)))
    }
}

/// The highest index of a recording that a parameter may belong to; the next stands for those that cannot be counted.
pub const RECORDING_MAX: u32 = u32::MAX - 1;

/// The most recordings that a parameter may have values of their own for: a space has an axis for each.
pub const PER_RECORDING_MAX: usize = 1 << 16;

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
    /// parameter is missing or given twice or belongs to a recording beyond [`RECORDING_MAX`], or nothing is free.
    pub fn new(free: Vec<Axis>, fixed: Vec<(Parameter, Scope, f64)>) -> Result<Self> {
        let space = Self { free, fixed }.checked()?;
        if space.free.is_empty() {
            return Err(Error::usage("every parameter is held: there is nothing to find", "Leave at least one free."));
        }
        Ok(space)
    }

    fn checked(self) -> Result<Self> {
        let scopes = self.free.iter().map(|a| a.scope).chain(self.fixed.iter().map(|f| f.1));
        if let Some(n) = scopes.filter_map(|s| if let Scope::Recording(n) = s { Some(n) } else { None }).max()
            && n > RECORDING_MAX
        {
            let message = format!("found a parameter of recording {n}, expected {RECORDING_MAX} at most");
            return Err(Error::usage(message, "Count recordings from 0, or share the parameter among all."));
        }
        for axis in &self.free {
            check_bounds(axis)?;
        }
        for &(parameter, _, value) in &self.fixed {
            if !parameter.admits(value) {
                return Err(Error::usage(
                    format!("{} cannot be held at {value}", parameter.symbol()),
                    format!("Give a {} value in {}.", parameter.domain(), parameter.unit()),
                ));
            }
        }
        for parameter in Parameter::ALL.into_iter().chain(Parameter::EXTENSIONS) {
            self.check_once(parameter)?;
        }
        Ok(self)
    }

    /// Of parts that belong to a checked space; here nothing need be free.
    pub(crate) fn unchecked(free: Vec<Axis>, fixed: Vec<(Parameter, Scope, f64)>) -> Self {
        Self { free, fixed }
    }

    /// All five parameters free within Table 2 of the paper.
    #[must_use]
    pub fn table2() -> Self {
        let axis = |parameter: Parameter| {
            let (min, max) = parameter.table2()?;
            Some(Axis { parameter, scope: Scope::Shared, min, max })
        };
        Self { free: Parameter::ALL.into_iter().filter_map(axis).collect(), fixed: Vec::new() }
    }

    /// Table 2 of the paper with other bounds and held values for some parameters, all shared.
    ///
    /// # Errors
    /// As [`Space::new`].
    pub fn table2_with(bounds: &[(Parameter, f64, f64)], fixed: &[(Parameter, f64)]) -> Result<Self> {
        let Self { free, fixed } = Self::table2_to_extend(bounds, fixed)?;
        Self::new(free, fixed)
    }

    /// The same for a motor whose extensions are still to come: nothing of it need be free.
    ///
    /// # Errors
    /// As [`Space::new`], but for that.
    pub fn table2_to_extend(bounds: &[(Parameter, f64, f64)], fixed: &[(Parameter, f64)]) -> Result<Self> {
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
            match axes.get_mut(parameter as usize).filter(|_| !parameter.is_extension()) {
                Some(own) => *own = axis,
                None => axes.push(axis),
            }
        }
        axes.retain(|axis| fixed.iter().all(|(parameter, _)| *parameter != axis.parameter));
        let fixed = fixed.iter().map(|&(parameter, value)| (parameter, Scope::Shared, value)).collect();
        Self { free: axes, fixed }.checked()
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
        self.each(candidate, recording, |parameter, value| {
            if let Some(own) = values.get_mut(parameter as usize) {
                *own = value;
            }
        });
        Parameters::from_array(values)
    }

    /// The motor with its extensions that a candidate means for one recording.
    #[must_use]
    pub fn motor(&self, candidate: &[f64], recording: u32) -> Extended {
        let mut motor = Extended::from(&Parameters::from_array([f64::NAN; 5]));
        self.each(candidate, recording, |parameter, value| motor.set(parameter, value));
        motor
    }

    /// Hands the parameters of one recording to `set`, the held ones first.
    fn each(&self, candidate: &[f64], recording: u32, mut set: impl FnMut(Parameter, f64)) {
        for &(parameter, scope, value) in &self.fixed {
            if scope.covers(recording) {
                set(parameter, value);
            }
        }
        for (axis, &value) in self.free.iter().zip(candidate) {
            if axis.scope.covers(recording) {
                set(axis.parameter, value);
            }
        }
    }

    /// The same with a value of its own for each of `recordings` where these parameters are free.
    ///
    /// # Errors
    /// `Usage` for more recordings than [`PER_RECORDING_MAX`].
    pub fn per_recording(&self, parameters: &[Parameter], recordings: usize) -> Result<Self> {
        if recordings > PER_RECORDING_MAX {
            let message =
                format!("found {recordings} recordings with values of their own, expected {PER_RECORDING_MAX} at most");
            return Err(Error::usage(message, "Fit fewer recordings together, or share the parameters among all."));
        }
        let own = |axis: &Axis| -> Vec<Axis> {
            if axis.scope != Scope::Shared || !parameters.contains(&axis.parameter) {
                return vec![*axis];
            }
            (0..).take(recordings).map(|n| Axis { scope: Scope::Recording(n), ..*axis }).collect()
        };
        Ok(Self { free: self.free.iter().flat_map(own).collect(), fixed: self.fixed.clone() })
    }

    fn check_once(&self, parameter: Parameter) -> Result<()> {
        let free = self.free.iter().filter(|a| a.parameter == parameter).map(|a| a.scope);
        let fixed = self.fixed.iter().filter(|f| f.0 == parameter).map(|f| f.1);
        let scopes: Vec<Scope> = free.chain(fixed).collect();
        let mut recordings = HashSet::new();
        let is_known = |scope: &Scope| match scope {
            Scope::Shared => scopes.len() > 1,
            Scope::Recording(n) => !recordings.insert(*n),
        };
        let twice = scopes.iter().any(is_known);
        let symbol = parameter.symbol();
        if scopes.is_empty() && !parameter.is_extension() {
            Err(Error::usage(format!("{symbol} has neither bounds nor a value"), format!("Bound {symbol} or hold it.")))
        } else if twice {
            Err(Error::usage(format!("{symbol} is given twice"), format!("Either bound {symbol} or hold it, once.")))
        } else {
            Ok(())
        }
    }
}

fn check_bounds(axis: &Axis) -> Result<()> {
    let Axis { parameter, min, max, .. } = *axis;
    let (symbol, unit) = (parameter.symbol(), parameter.unit());
    let remedy = match parameter.table2() {
        Some((low, high)) => format!("Give MIN:MAX in {unit} with 0 < MIN < MAX, for example {symbol}={low}:{high}."),
        None => format!("Give MIN:MAX in {unit} with MIN < MAX, both {}.", parameter.domain()),
    };
    let what = if !(min.is_finite() && max.is_finite()) {
        "not finite".to_owned()
    } else if !(parameter.admits(min) && parameter.admits(max)) {
        format!("not {}", parameter.domain())
    } else if min >= max {
        "reversed or equal".to_owned()
    } else {
        return Ok(());
    };
    Err(Error::usage(format!("the bounds of {symbol}, {min}:{max}, are {what}"), remedy))
}
