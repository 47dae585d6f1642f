//! Feedforward characteristics of a motor: the voltage for a speed ω \[rad/s\] and an acceleration a \[rad/s²\],
//! `v = kS sgn(ω) + kV ω + kA a`, with standard errors by the delta method.
//!
//! Eliminating the current from `L di/dt = v − R i − K ω − vb sgn(ω)` and `J dω/dt = K i − B ω − Tc sgn(ω)` gives
//! `v = (R Tc/K + vb) sgn(ω) + (R B + K²)/K ω + (R J + L B)/K dω/dt + L J/K d²ω/dt²`; feedforward neglects the last
//! term. `kA/kV` is the sum of the motor's two time constants. A load torque TL adds `kG = R TL/K`.
//!
//! If the current is the input, the characteristics give the current: `i = kS sgn(ω) + kG + kV ω + kA a` with `kS = Tc/K`,
//! `kG = TL/K`, `kV = B/K`, `kA = J/K`; `kA/kV = J/B` is the mechanical time constant.

use super::fitted::FittedMotor;
use motorfit_motor::{Input, Parameter, Parameters, Scope};

/// Covariance matrix of R, L, K, B, J, Tc, vb and TL in their units: zero for fixed parameters, `None` if unknown.
pub type Covariance = [[Option<f64>; CONSTANTS]; CONSTANTS];

/// Number of parameters on which the characteristics depend.
const CONSTANTS: usize = 8;
/// Parameters on which the characteristics depend, in the order of [`Covariance`].
const IN_ORDER: [Parameter; CONSTANTS] = {
    let [r, l, k, b, j] = Parameter::ALL;
    [r, l, k, b, j, Parameter::Coulomb, Parameter::BrushDrop, Parameter::Load]
};

/// A characteristic with its standard error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Characteristic {
    /// Estimate of the characteristic.
    pub value: f64,
    /// Standard error of the estimate, in the same unit; `None` if a covariance that it depends on is unknown.
    pub std_error: Option<f64>,
}

impl Characteristic {
    /// Returns the characteristic without its standard error.
    #[must_use]
    #[doc(hidden)]
    pub fn without_error(self) -> Self {
        Self { std_error: None, ..self }
    }
}

/// The feedforward characteristics of a motor. If the current is the input, A replaces V in all units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Characteristics {
    /// Input of the motor: voltage or current.
    pub input: Input,
    /// Input that overcomes Coulomb friction and brush drop, kS \[V\]; `None` if the model has neither.
    pub ks: Option<Characteristic>,
    /// Input that balances the load torque, kG \[V\]; `None` if the model has none.
    pub kg: Option<Characteristic>,
    /// Input per speed, kV \[V·s/rad\].
    pub kv: Characteristic,
    /// Input per acceleration, kA \[V·s²/rad\].
    pub ka: Characteristic,
    /// Steady-state gain from input to speed, 1/kV \[rad/s/V\].
    pub gain: Characteristic,
    /// Time constant `kA/kV` \[s\].
    pub time_constant: Characteristic,
}

/// A characteristic with its name and unit.
pub type Named = (&'static str, &'static str, Option<Characteristic>);

impl Characteristics {
    /// Returns all characteristics of a fitted motor with their names and units; `None` for those that are not identifiable.
    #[must_use]
    pub fn named_of<'a>(found: impl Into<FittedMotor<'a>>) -> [Named; 6] {
        let found = found.into();
        let mut all = Self::named(Self::of(found).as_ref(), found.input);
        // Without a voltage viscous friction may be unidentifiable while the inertia is identifiable.
        let is_unidentified =
            |p: Parameter| found.lacks(p) && found.space.free().iter().all(|axis| axis.parameter != p);
        let [_, kv, ka, _, gain, time_constant] = &mut all;
        if found.input == Input::Current && is_unidentified(Parameter::B) {
            [kv, gain, time_constant].into_iter().for_each(|of| of.2 = None);
        }
        if found.input == Input::Current && is_unidentified(Parameter::J) {
            ka.2 = None;
        }
        all
    }

    /// Returns all characteristics with their names and units as in results; each is `None` if `all` is `None`.
    #[must_use]
    pub fn named(all: Option<&Self>, input: Input) -> [Named; 6] {
        let [own, by_speed, by_acceleration, gain] = match input {
            Input::Voltage => ["V", "V*s/rad", "V*s^2/rad", "rad/s/V"],
            Input::Current => ["A", "A*s/rad", "A*s^2/rad", "rad/s/A"],
        };
        [
            ("kS", own, all.and_then(|c| c.ks)),
            ("kV", by_speed, all.map(|c| c.kv)),
            ("kA", by_acceleration, all.map(|c| c.ka)),
            ("kG", own, all.and_then(|c| c.kg)),
            ("gain", gain, all.map(|c| c.gain)),
            ("time_constant", "s", all.map(|c| c.time_constant)),
        ]
    }

    /// Returns the characteristics of a fitted motor; `None` if the recordings do not identify them.
    #[must_use]
    pub fn of<'a>(found: impl Into<FittedMotor<'a>>) -> Option<Self> {
        let found = found.into();
        // The normalized model of speed alone has the characteristics of the motor; that of current alone does not.
        let unknown = |parameter| found.lacks(parameter);
        let by_speed = found.sigma(1).is_some();
        let by_current = found.input == Input::Current;
        let is_identified = match unknown(Parameter::K) {
            _ if by_current => true,
            true => by_speed && found.sigma(0).is_none(),
            false => !unknown(Parameter::R) && !unknown(Parameter::J),
        };
        let more = [Parameter::Coulomb, Parameter::BrushDrop, Parameter::Load].map(|parameter| found.shared(parameter));
        is_identified.then(|| characteristics(found.input, found.parameters, more, &covariance(&found)))
    }
}

/// Computes the characteristics of a motor from its parameters and their covariance. `more` are Tc, vb and TL in their units,
/// `None` if the model lacks them. If the current is the input, R, L and vb are not used.
#[must_use]
pub fn characteristics(
    input: Input,
    motor: &Parameters,
    more: [Option<f64>; 3],
    covariance: &Covariance,
) -> Characteristics {
    let ([ks, kg], [kv, ka, time_constant]) = match input {
        Input::Voltage => by_voltage(motor, more),
        Input::Current => by_current(motor, more),
    };
    let entry = |(value, slope): Sloped| Characteristic { value, std_error: error(&slope, covariance) };
    let gain = (1.0 / kv.0, kv.1.map(|slope| -slope / (kv.0 * kv.0)));
    Characteristics {
        input,
        ks: ks.map(entry),
        kg: kg.map(entry),
        kv: entry(kv),
        ka: entry(ka),
        gain: entry(gain),
        time_constant: entry(time_constant),
    }
}

/// A value with its gradient by the parameters.
type Sloped = (f64, [f64; CONSTANTS]);

/// Returns kS and kG, then kV, kA and the time constant, of a motor with a voltage as its input.
fn by_voltage(motor: &Parameters, [tc, vb, tl]: [Option<f64>; 3]) -> ([Option<Sloped>; 2], [Sloped; 3]) {
    let [r, l, k, b, j] = motor.to_array();
    let friction = (tc.is_some() || vb.is_some()).then(|| (tc.unwrap_or(0.0), vb.unwrap_or(0.0)));
    let ks = friction.map(|(tc, vb)| (r * tc / k + vb, [tc / k, 0.0, -r * tc / (k * k), 0.0, 0.0, r / k, 1.0, 0.0]));
    let kg = tl.map(|tl| (r * tl / k, [tl / k, 0.0, -r * tl / (k * k), 0.0, 0.0, 0.0, 0.0, r / k]));
    let (kv, ka) = ((r * b + k * k) / k, (r * j + l * b) / k);
    let kv_slope = [b / k, 0.0, 1.0 - r * b / (k * k), r / k, 0.0, 0.0, 0.0, 0.0];
    let ka_slope = [j / k, b / k, -ka / k, l / k, r / k, 0.0, 0.0, 0.0];
    let time_constant = ka / kv;
    let time_slope = std::array::from_fn(|n| (ka_slope[n] - time_constant * kv_slope[n]) / kv);
    ([ks, kg], [(kv, kv_slope), (ka, ka_slope), (time_constant, time_slope)])
}

/// Returns kS and kG, then kV, kA and the time constant, of a motor with the current as its input.
fn by_current(motor: &Parameters, [tc, _, tl]: [Option<f64>; 3]) -> ([Option<Sloped>; 2], [Sloped; 3]) {
    let [_, _, k, b, j] = motor.to_array();
    // The ratio of a parameter to K; `index` is that of the parameter in the gradient.
    let over_k = |value: f64, index: usize| {
        let mut slope = [0.0; CONSTANTS];
        (slope[2], slope[index]) = (-value / (k * k), 1.0 / k);
        (value / k, slope)
    };
    let mut time_slope = [0.0; CONSTANTS];
    (time_slope[3], time_slope[4]) = (-j / (b * b), 1.0 / b);
    ([tc.map(|tc| over_k(tc, 5)), tl.map(|tl| over_k(tl, 7))], [over_k(b, 3), over_k(j, 4), (j / b, time_slope)])
}

/// Returns the standard error `√(gᵀ C g)` by the delta method; `None` if a covariance that it depends on is unknown.
fn error(slope: &[f64; CONSTANTS], covariance: &Covariance) -> Option<f64> {
    let mut variance = 0.0;
    for (a, row) in slope.iter().zip(covariance) {
        for (b, entry) in slope.iter().zip(row) {
            if *a != 0.0 && *b != 0.0 {
                variance += a * b * (*entry)?;
            }
        }
    }
    // Rounding may make a variance of zero negative.
    let error = variance.max(0.0).sqrt();
    error.is_finite().then_some(error)
}

/// Returns the covariance matrix of the parameters from their standard errors and correlations.
fn covariance(found: &FittedMotor<'_>) -> Covariance {
    // The assumed parameters of a normalized model contribute no variance to its characteristics.
    let is_normalized = found.input == Input::Current || [0, 1].iter().any(|channel| found.sigma(*channel).is_none());
    let index = |n: usize| {
        let parameter = IN_ORDER[n];
        found.space.free().iter().position(|axis| axis.parameter == parameter && axis.scope == Scope::Shared)
    };
    let entry = |a: usize, b: usize| {
        if !is_normalized && [a, b].into_iter().any(|n| found.lacks(IN_ORDER[n])) {
            return None;
        }
        let (Some(a), Some(b)) = (index(a), index(b)) else { return Some(0.0) };
        let known = found.uncertainty?;
        let error = |n: usize| known.std_error.get(n).copied().flatten();
        Some((*known.correlation.get(a)?.get(b)?)? * error(a)? * error(b)?)
    };
    std::array::from_fn(|a| std::array::from_fn(|b| entry(a, b)))
}
