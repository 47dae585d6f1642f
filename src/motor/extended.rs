//! The motor with extensions, sample by sample: the oracle of what real motors add to the linear one. With [`Dual`]
//! numbers the same walk gives exact derivatives.
//!
//! The voltage passes the drive (deadband, saturation, a gain for each direction), an offset is added, and it acts late.
//! A step then is that of the linear motor, whose map is exact, with two reactions that are held over it: the drop of the
//! brushes, a voltage of at most ±vb against the current, and Coulomb friction, a torque of at most ±Tc against the
//! movement. Each is as large as it takes to end the step at zero, if that is within its limits: below them the current
//! does not flow, and the motor sticks. (Time stepping with set-valued friction: J. J. Moreau 1988; D. E. Stewart,
//! SIAM Review 42, 2000.) Sensors average over the last samples.
//!
//! [`Dual`]: super::Dual

use super::Parameters;
use super::delay::{Beginning, Late, sample_times};
use super::discretize::{Discretization, Method, StepMaps, step_maps};
use super::dual::Number;
use super::parameter::{Extensions, Parameter};
use super::simulate::Drive;
use std::collections::VecDeque;

/// Which extensions a model has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Extent(u16);

impl Extent {
    /// With one more; the five of the motor change nothing.
    #[must_use]
    pub fn with(self, parameter: Parameter) -> Self {
        if parameter.is_extension() { Self(self.0 | 1 << parameter as u16) } else { self }
    }

    /// Whether it has this one.
    #[must_use]
    pub fn has(self, parameter: Parameter) -> bool {
        self.0 & 1 << parameter as u16 != 0
    }

    /// Whether it has any of these.
    #[must_use]
    pub fn has_any(self, parameters: &[Parameter]) -> bool {
        parameters.iter().any(|p| self.has(*p))
    }

    /// Whether it is the linear motor.
    #[must_use]
    pub fn is_linear(self) -> bool {
        self.0 == 0
    }

    /// Whether the input acts late.
    #[must_use]
    pub fn is_delayed(self) -> bool {
        self.has_any(&[Parameter::DeadTime, Parameter::Latency])
    }

    /// Whether something acts while the input is zero.
    #[must_use]
    pub fn is_biased(self) -> bool {
        self.has_any(&[Parameter::Load, Parameter::Offset])
    }

    /// Whether a sensor averages.
    #[must_use]
    pub fn is_averaged(self) -> bool {
        self.has_any(&[Parameter::CurrentAverage, Parameter::SpeedAverage])
    }

    /// The one-step method of the maps: late voltages are lines, which a method for held ones cannot take.
    #[must_use]
    pub fn method(self, method: Method) -> Method {
        let lines = self.is_delayed() && method.discretization == Discretization::Zoh;
        if lines { Method { discretization: Discretization::Foh, ..method } } else { method }
    }
}

/// A motor with its extensions.
#[derive(Debug, Clone, Copy)]
pub struct Extended<T = f64> {
    /// R, L, K, B, J.
    pub motor: [T; 5],
    /// In the order of [`Parameter::EXTENSIONS`].
    pub extensions: [T; Parameter::EXTENSIONS.len()],
}

impl Extended {
    /// Of values.
    #[must_use]
    pub fn new(parameters: &Parameters, extensions: &Extensions) -> Self {
        Self { motor: parameters.to_array(), extensions: extensions.to_array() }
    }
}

impl<T: Copy> Extended<T> {
    /// The value of one parameter.
    #[must_use]
    pub fn get(&self, parameter: Parameter) -> T {
        let n = parameter as usize;
        if n < self.motor.len() { self.motor[n] } else { self.extensions[n - self.motor.len()] }
    }

    /// Changes the value of one parameter.
    pub fn set(&mut self, parameter: Parameter, value: T) {
        let n = parameter as usize;
        if n < self.motor.len() {
            self.motor[n] = value;
        } else {
            self.extensions[n - self.motor.len()] = value;
        }
    }
}

/// What an extended motor is simulated in.
#[derive(Debug, Clone, Copy)]
pub struct Setting {
    /// Which extensions the model has.
    pub extent: Extent,
    /// The one-step method.
    pub method: Method,
    /// How the recording begins.
    pub beginning: Beginning,
}

impl Setting {
    /// A line as the method takes it: where that holds its input, its mean.
    #[inline(always)]
    pub(crate) fn held<T: Number>(&self, [start, end]: [T; 2]) -> [T; 2] {
        if self.extent.method(self.method).uses_next_input() { [start, end] } else { [(start + end) * 0.5; 2] }
    }
}

/// Simulates over all samples from the state `initial` = `[i, ω]`, handing what the sensors show of each to `visit`.
#[inline(always)]
pub fn walk_extended<T: Number>(
    motor: &Extended<T>,
    drive: &Drive<'_>,
    setting: Setting,
    initial: [T; 2],
    mut visit: impl FnMut([T; 2]),
) {
    let steps: Vec<Step<T>> = drive.step_s.iter().map(|&h| Step::new(motor, h, setting)).collect();
    let time = if setting.extent.is_delayed() { sample_times(drive) } else { Vec::new() };
    let mut inputs = Inputs { motor, drive, setting, cursor: 0, last: None };
    let mut sensors = [Parameter::CurrentAverage, Parameter::SpeedAverage]
        .map(|of| setting.extent.has(of).then(|| Average::new(motor.get(of))));
    let mut x = initial;
    for n in 0..drive.voltage.len() {
        let mut seen = x;
        for channel in 0..2 {
            if let Some(sensor) = &mut sensors[channel] {
                seen[channel] = sensor.shows(x[channel], initial[channel]);
            }
        }
        visit(seen);
        let torque = T::constant(drive.torque.get(n).copied().unwrap_or(0.0)) + motor.get(Parameter::Load);
        x = steps[drive.index(n)].advance(x, inputs.line(n, &time), torque);
    }
}

/// The voltage at the motor, step by step.
struct Inputs<'a, T> {
    motor: &'a Extended<T>,
    drive: &'a Drive<'a>,
    setting: Setting,
    cursor: usize,
    /// The voltages that the drive was told last, and what it gave.
    last: Option<([u64; 2], [T; 2])>,
}

impl<T: Number> Inputs<'_, T> {
    /// At the start and at the end of a step.
    #[inline(always)]
    fn line(&mut self, n: usize, time: &[f64]) -> [T; 2] {
        let Self { motor, drive, setting, .. } = *self;
        if setting.extent.is_delayed() {
            let line = late(motor, drive, setting, time).line(n, drive.step(n), &mut self.cursor);
            return setting.held(line);
        }
        let told = [drive.voltage[n], if setting.method.uses_next_input() { drive.end(n) } else { drive.voltage[n] }];
        let bits = told.map(f64::to_bits);
        match self.last {
            Some((known, given)) if known == bits => given,
            _ => self.last.insert((bits, told.map(|v| terminal(motor, v)))).1,
        }
    }
}

/// The voltage of a motor as it comes late, in pieces between samples; `time` is that of each.
#[inline(always)]
pub(crate) fn late<'a, T: Number>(
    motor: &'a Extended<T>,
    drive: &'a Drive<'a>,
    setting: Setting,
    time: &'a [f64],
) -> Late<'a, T, impl Fn(usize) -> [T; 2] + 'a> {
    let lines = setting.method.uses_next_input();
    Late {
        piece: move |n: usize| {
            let start = terminal(motor, drive.voltage[n]);
            [start, if lines { terminal(motor, drive.end(n)) } else { start }]
        },
        before: terminal(motor, setting.beginning.voltage),
        time,
        dead_time: motor.get(Parameter::DeadTime),
        latency: setting.extent.has(Parameter::Latency).then(|| motor.get(Parameter::Latency)),
        first_movement: setting.beginning.first_movement,
    }
}

/// What the drive makes of a voltage that it is told.
#[inline(always)]
fn terminal<T: Number>(motor: &Extended<T>, voltage: f64) -> T {
    Terminal::of(motor).gives(voltage)
}

/// What a drive makes of the voltages that it is told.
#[derive(Clone, Copy)]
pub(crate) struct Terminal<T> {
    pub deadband: T,
    pub saturation: T,
    pub reverse_gain: T,
    pub offset: T,
}

impl<T: Number> Terminal<T> {
    #[inline(always)]
    pub(crate) fn of(motor: &Extended<T>) -> Self {
        Self {
            deadband: motor.get(Parameter::Deadband),
            saturation: motor.get(Parameter::Saturation),
            reverse_gain: motor.get(Parameter::ReverseGain),
            offset: motor.get(Parameter::Offset),
        }
    }

    #[inline(always)]
    pub(crate) fn gives(self, voltage: f64) -> T {
        let told = T::constant(voltage.abs());
        let reached = if self.saturation.value() < told.value() { self.saturation } else { told };
        let left = reached - self.deadband;
        let given = if left.value() > 0.0 { left } else { T::constant(0.0) };
        let turned = if voltage < 0.0 { -(self.reverse_gain * given) } else { given };
        turned + self.offset
    }
}

/// The map of a step with the limits of its reactions.
struct Step<T> {
    map: StepMaps<1, T>,
    drop: Option<T>,
    friction: Option<T>,
}

impl<T: Number> Step<T> {
    #[inline(never)]
    fn new(motor: &Extended<T>, h: f64, setting: Setting) -> Self {
        let limit = |of: Parameter| setting.extent.has(of).then(|| motor.get(of));
        Self {
            map: step_maps(&motor.motor.map(|p| [p]), h, setting.extent.method(setting.method)),
            drop: limit(Parameter::BrushDrop),
            friction: limit(Parameter::Coulomb),
        }
    }

    #[inline(always)]
    fn advance(&self, x: [T; 2], [start, end]: [T; 2], torque: T) -> [T; 2] {
        let Self { map, drop, friction } = self;
        let mut next = x;
        for axis in 0..2 {
            let gain = map.taps[0][axis][0] * start + map.taps[1][axis][0] * end + map.torque[axis][0] * torque;
            next[axis] = x[axis] + (map.d[2 * axis][0] * x[0] + map.d[2 * axis + 1][0] * x[1] + gain);
        }
        let mut x = next;
        if let Some(drop) = *drop {
            x = react(x, 0, [0, 1].map(|axis| -(map.taps[0][axis][0] + map.taps[1][axis][0])), drop);
        }
        match *friction {
            Some(friction) => react(x, 1, map.torque.map(|[gain]| gain), friction),
            None => x,
        }
    }
}

/// A state after a reaction of at most ±`limit` that ends `axis` at zero if it can; `gain` is what one unit of it adds.
#[inline(always)]
fn react<T: Number>(x: [T; 2], axis: usize, gain: [T; 2], limit: T) -> [T; 2] {
    let needed = -(x[axis] / gain[axis]);
    let sticks = needed.value().abs() <= limit.value();
    let reaction = if sticks {
        needed
    } else if needed.value() > 0.0 {
        limit
    } else {
        -limit
    };
    let mut after = [x[0] + gain[0] * reaction, x[1] + gain[1] * reaction];
    if sticks {
        after[axis] = T::constant(0.0);
    }
    after
}

/// The longest average, in samples: more than any recording has is as good as all.
pub(crate) const WINDOW_MAX: f64 = 1e6;

/// A sensor that shows the mean of the last `window` samples, of which the oldest counts in part. Before the first
/// sample it has seen what the motor began with.
struct Average<T> {
    window: T,
    whole: usize,
    /// The last `whole` values, the oldest first.
    seen: VecDeque<T>,
    sum: T,
}

impl<T: Number> Average<T> {
    fn new(window: T) -> Self {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 1 and 1e6")]
        let whole = window.value().clamp(1.0, WINDOW_MAX) as usize;
        Self { window, whole, seen: VecDeque::new(), sum: T::constant(0.0) }
    }

    #[inline(always)]
    fn shows(&mut self, value: T, initial: T) -> T {
        #[expect(clippy::cast_precision_loss, reason = "at most 1e6")]
        let whole = self.whole as f64;
        if self.seen.is_empty() {
            self.sum = initial * whole;
        }
        let full = self.seen.len() == self.whole;
        let oldest = if full { self.seen.pop_front().unwrap_or(initial) } else { initial };
        self.seen.push_back(value);
        self.sum = self.sum + value - oldest;
        (self.sum + (self.window - T::constant(whole)) * oldest) / self.window
    }
}
