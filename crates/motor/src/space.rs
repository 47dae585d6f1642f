//! The search space: free parameters with their bounds, and fixed parameters.

use super::extended::Extended;
use super::linear::Parameters;
use super::parameter::Parameter;
use motorfit_core::coordinate::Coordinate;
use motorfit_core::{Error, Result};
use std::collections::HashSet;

/// Recordings of a joint fit to which a parameter belongs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scope {
    /// One value for all recordings.
    Shared,
    /// A separate value for the recording of this index.
    Recording(u32),
}

impl Scope {
    /// Returns true if the scope includes the recording of this index.
    #[must_use]
    pub fn covers(self, recording: u32) -> bool {
        self == Self::Shared || self == Self::Recording(recording)
    }

    /// Returns the name of a parameter in a table: its symbol, followed by the index of its recording if it has one, as
    /// `R[0]`.
    #[must_use]
    pub fn name(self, parameter: Parameter) -> String {
        match self {
            Self::Shared => parameter.symbol().to_owned(),
            Self::Recording(n) => format!("{}[{n}]", parameter.symbol()),
        }
    }

    /// Returns the index of the only recording; `None` for all.
    #[must_use]
    pub fn recording(self) -> Option<usize> {
        if let Self::Recording(n) = self { usize::try_from(n).ok() } else { None }
    }

    /// Returns a key that sorts parameters by parameter, then by recording.
    #[must_use]
    pub fn order(self, parameter: Parameter) -> (usize, Option<u32>) {
        (parameter as usize, if let Self::Recording(n) = self { Some(n) } else { None })
    }

    /// Parses a name in the format of [`Self::name`] into the parameter and the scope; `None` if it is not one.
    #[must_use]
    pub fn named(name: &str) -> Option<(Parameter, Self)> {
        let Some((symbol, index)) = name.split_once('[') else { return Some((name.parse().ok()?, Self::Shared)) };
        Some((symbol.parse().ok()?, Self::Recording(index.strip_suffix(']')?.parse().ok()?)))
    }
}

/// A free parameter with its bounds, in SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    /// The parameter.
    pub parameter: Parameter,
    /// Recordings that it belongs to.
    pub scope: Scope,
    /// Lower bound, in the domain of the parameter.
    pub min: f64,
    /// Upper bound, above `min`.
    pub max: f64,
}

impl Axis {
    /// Returns the bounds with the coordinate of the parameter: its logarithm for the five parameters of the motor, whose
    /// magnitude is not known beforehand. Other parameters may be zero or negative and have a linear coordinate.
    #[must_use]
    pub fn range(&self) -> Coordinate {
        let is_logarithmic = !self.parameter.is_extension();
        let &Self { parameter, min, max, .. } = self;
        Coordinate { min, max, is_logarithmic, lowest: parameter.lowest(), neutral: self.neutral() }
    }

    /// Returns the coordinate of a value: its logarithm for the five parameters of the motor, else its ratio to the range.
    #[must_use]
    pub fn coordinate(&self, value: f64) -> f64 {
        self.range().of(value)
    }

    /// Returns the value of a coordinate, clamped to the bounds.
    #[must_use]
    pub fn value(&self, coordinate: f64) -> f64 {
        self.range().value(coordinate)
    }

    /// Returns the derivative of the value with respect to the coordinate.
    #[must_use]
    pub fn slope(&self, value: f64) -> f64 {
        self.range().slope(value)
    }

    /// Returns the value within the bounds at which the parameter of an extension has no effect; `None` if there is none.
    #[must_use]
    pub fn neutral(&self) -> Option<f64> {
        let value = if self.parameter == Parameter::Saturation { self.max } else { self.parameter.neutral() };
        (self.parameter.is_extension() && (self.min..=self.max).contains(&value)).then_some(value)
    }

    /// Returns the middle of the bounds: their geometric mean for the five parameters of the motor, else their mean.
    #[must_use]
    pub fn middle(&self) -> f64 {
        self.range().at(0.5)
    }
}

/// Largest index of a recording that a parameter may belong to; the next value marks an index beyond `u32`.
pub const RECORDING_MAX: u32 = u32::MAX - 1;

/// Largest number of recordings for which a parameter may have separate values; a space has an axis for each.
pub const PER_RECORDING_MAX: usize = 1 << 16;

/// Free and fixed parameters; maps a candidate (one value for each free parameter) to the parameters of each recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Space {
    free: Vec<Axis>,
    fixed: Vec<(Parameter, Scope, f64)>,
}

impl Space {
    /// Makes a space and checks it.
    ///
    /// # Errors
    /// Returns `Usage` if bounds are reversed, not finite or outside the domain of their parameter, a fixed value is outside
    /// its domain, a parameter is missing, given twice or belongs to a recording beyond [`RECORDING_MAX`], or no parameter is
    /// free.
    pub fn new(free: Vec<Axis>, fixed: Vec<(Parameter, Scope, f64)>) -> Result<Self> {
        let space = Self { free, fixed }.checked()?;
        if space.free.is_empty() {
            return Err(Error::usage(
                "every parameter is fixed: there is nothing to estimate",
                "Leave at least one parameter free.",
            ));
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
                    format!("{} cannot be fixed at {value}", parameter.symbol()),
                    format!("Give a {} value in {}.", parameter.domain(), parameter.unit()),
                ));
            }
        }
        for parameter in Parameter::ALL.into_iter().chain(Parameter::EXTENSIONS) {
            self.check_once(parameter)?;
        }
        Ok(self)
    }

    /// Makes a space from parts of a checked one, without a check; no parameter need be free.
    #[doc(hidden)]
    pub fn unchecked(free: Vec<Axis>, fixed: Vec<(Parameter, Scope, f64)>) -> Self {
        Self { free, fixed }
    }

    /// Returns the space with all five parameters free within Table 2 of the paper.
    #[must_use]
    pub fn table2() -> Self {
        let axis = |parameter: Parameter| {
            let (min, max) = parameter.table2()?;
            Some(Axis { parameter, scope: Scope::Shared, min, max })
        };
        Self { free: Parameter::ALL.into_iter().filter_map(axis).collect(), fixed: Vec::new() }
    }

    /// Returns the space of Table 2 of the paper with other bounds and fixed values for some parameters, all shared.
    ///
    /// # Errors
    /// Returns the errors of [`Space::new`], and `Usage` if a parameter is both bounded and fixed.
    pub fn table2_with(bounds: &[(Parameter, f64, f64)], fixed: &[(Parameter, f64)]) -> Result<Self> {
        let Self { free, fixed } = Self::table2_to_extend(bounds, fixed)?;
        Self::new(free, fixed)
    }

    /// Returns the space of [`Space::table2_with`] for a motor to which extensions are added later; no parameter need be free.
    ///
    /// # Errors
    /// Returns the errors of [`Space::table2_with`], except that all parameters may be fixed.
    pub fn table2_to_extend(bounds: &[(Parameter, f64, f64)], fixed: &[(Parameter, f64)]) -> Result<Self> {
        let mut axes = Self::table2().free;
        for &(parameter, min, max) in bounds {
            let axis = Axis { parameter, scope: Scope::Shared, min, max };
            check_bounds(&axis)?;
            if fixed.iter().any(|(other, _)| *other == parameter) {
                let symbol = parameter.symbol();
                return Err(Error::usage(
                    format!("{symbol} is both bounded and fixed"),
                    format!("Give either bounds or a fixed value of {symbol}."),
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

    /// Returns the free parameters, in the order of a candidate's values.
    #[must_use]
    pub fn free(&self) -> &[Axis] {
        &self.free
    }

    /// Returns the fixed parameters with their scopes and values.
    #[must_use]
    pub fn fixed(&self) -> &[(Parameter, Scope, f64)] {
        &self.fixed
    }

    /// Returns the box of the search, `(min, max)` for each free parameter.
    #[must_use]
    pub fn bounds(&self) -> Vec<(f64, f64)> {
        self.free.iter().map(|axis| (axis.min, axis.max)).collect()
    }

    /// Returns the parameters of one recording for a candidate, which has one value for each free parameter.
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

    /// Returns the parameters of one recording for several candidates side by side, shape `[parameters][candidates]`.
    #[inline]
    #[doc(hidden)]
    pub fn side_by_side<const N: usize>(&self, candidates: [&[f64]; N], recording: u32) -> [[f64; N]; 5] {
        let mut values = [[f64::NAN; N]; 5];
        for &(parameter, scope, value) in &self.fixed {
            if let Some(own) = values.get_mut(parameter as usize).filter(|_| scope.covers(recording)) {
                *own = [value; N];
            }
        }
        for (place, axis) in self.free.iter().enumerate() {
            if let Some(own) = values.get_mut(axis.parameter as usize).filter(|_| axis.scope.covers(recording)) {
                *own = candidates.map(|candidate| candidate.get(place).copied().unwrap_or(f64::NAN));
            }
        }
        values
    }

    /// Returns where a candidate has the value of each of the five parameters for one recording: its place, or the value where it is
    /// fixed.
    #[doc(hidden)]
    pub fn places(&self, recording: u32) -> [std::result::Result<usize, f64>; 5] {
        let mut places = [Err(f64::NAN); 5];
        for &(parameter, scope, value) in &self.fixed {
            if let Some(own) = places.get_mut(parameter as usize).filter(|_| scope.covers(recording)) {
                *own = Err(value);
            }
        }
        for (place, axis) in self.free.iter().enumerate() {
            if let Some(own) = places.get_mut(axis.parameter as usize).filter(|_| axis.scope.covers(recording)) {
                *own = Ok(place);
            }
        }
        places
    }

    /// Returns the motor with its extensions of one recording for a candidate.
    #[must_use]
    pub fn motor(&self, candidate: &[f64], recording: u32) -> Extended {
        let mut motor = Extended::from(&Parameters::from_array([f64::NAN; 5]));
        self.each(candidate, recording, |parameter, value| motor.set(parameter, value));
        motor
    }

    /// Calls `set` with each parameter of one recording, the fixed ones first.
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

    /// Returns the space with a separate value of each of these parameters for each of `recordings` recordings, where they
    /// are free and shared.
    ///
    /// # Errors
    /// Returns `Usage` if there are more recordings than [`PER_RECORDING_MAX`].
    pub fn per_recording(&self, parameters: &[Parameter], recordings: usize) -> Result<Self> {
        if recordings > PER_RECORDING_MAX {
            let message =
                format!("found {recordings} recordings with separate values, expected {PER_RECORDING_MAX} at most");
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
        let is_repeated = |scope: &Scope| match scope {
            Scope::Shared => scopes.len() > 1,
            Scope::Recording(n) => !recordings.insert(*n),
        };
        let twice = scopes.iter().any(is_repeated);
        let symbol = parameter.symbol();
        if scopes.is_empty() && !parameter.is_extension() {
            Err(Error::usage(
                format!("{symbol} has neither bounds nor a fixed value"),
                format!("Give one of them for {symbol}."),
            ))
        } else if twice {
            Err(Error::usage(
                format!("{symbol} is given twice"),
                format!("Give either bounds or a fixed value of {symbol}, once."),
            ))
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
