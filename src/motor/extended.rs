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
use super::delay::{Beginning, Late, late, sample_times};
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
pub fn walk_extended<T: Number>(
    motor: &Extended<T>,
    drive: &Drive<'_>,
    setting: Setting,
    initial: [T; 2],
    visit: impl FnMut([T; 2]),
) {
    ExtendedWalk::new(motor, drive, setting, initial).for_each(visit);
}

/// What the sensors of a motor show, one pair `[i, ω]` a sample.
pub struct ExtendedWalk<'a, T> {
    inputs: Inputs<'a, T>,
    steps: Vec<Step<T>>,
    sensors: [Option<Average<T>>; 2],
    load: T,
    initial: [T; 2],
    x: [T; 2],
    n: usize,
    /// What inputs add in a step, while they last: the step's map, the torque, what it adds.
    known: Option<((usize, u64), [T; 2])>,
}

impl<'a, T: Number> ExtendedWalk<'a, T> {
    /// From the state `initial` = `[i, ω]`.
    #[must_use]
    pub fn new(motor: &Extended<T>, drive: &'a Drive<'a>, setting: Setting, initial: [T; 2]) -> Self {
        let time = if setting.extent.is_delayed() { sample_times(drive) } else { Vec::new() };
        let average = |of| setting.extent.has(of).then(|| Average::new(motor.get(of)));
        Self {
            inputs: Inputs { late: late(motor, drive, setting, time), setting, cursor: 0, last: None },
            steps: drive.step_s.iter().map(|&h| Step::new(motor, h, setting)).collect(),
            sensors: [Parameter::CurrentAverage, Parameter::SpeedAverage].map(average),
            load: motor.get(Parameter::Load),
            initial,
            x: initial,
            n: 0,
            known: None,
        }
    }
}

impl<T: Number> Iterator for ExtendedWalk<'_, T> {
    type Item = [T; 2];

    #[inline(always)]
    fn next(&mut self) -> Option<[T; 2]> {
        let Self { inputs, steps, sensors, initial, n, .. } = self;
        let drive = inputs.late.drive;
        if *n == drive.voltage.len() {
            return None;
        }
        let mut seen = self.x;
        for (channel, sensor) in sensors.iter_mut().enumerate() {
            if let Some(sensor) = sensor {
                seen[channel] = sensor.shows(self.x[channel], initial[channel]);
            }
        }
        let outside = drive.torque.get(*n).copied().unwrap_or(0.0);
        let acting = (drive.index(*n), outside.to_bits());
        let (line, lasts) = inputs.line(*n);
        let gain = match self.known {
            Some((same, gain)) if lasts && same == acting => gain,
            _ => self.known.insert((acting, steps[acting.0].gain(line, T::constant(outside) + self.load))).1,
        };
        self.x = steps[acting.0].advance(self.x, gain);
        *n += 1;
        Some(seen)
    }
}

/// The voltage at the motor, step by step.
struct Inputs<'a, T> {
    late: Late<'a, T>,
    setting: Setting,
    cursor: usize,
    /// The voltages that the drive was told last, held ones or a line, and what it gave.
    last: Option<([u64; 2], [T; 2])>,
}

impl<T: Number> Inputs<'_, T> {
    /// At the start and at the end of a step, and whether that is as in the step before.
    #[inline(always)]
    fn line(&mut self, n: usize) -> ([T; 2], bool) {
        let Self { late, setting, .. } = self;
        let told = if !setting.extent.is_delayed() {
            Some([late.drive.voltage[n], late.end(n)])
        } else {
            late.advance(n, &mut self.cursor);
            late.held(n, self.cursor).map(|voltage| [voltage; 2])
        };
        let Some(told) = told else {
            self.last = None;
            return (setting.held(late.line_from(n, self.cursor)), false);
        };
        let bits = told.map(f64::to_bits);
        match self.last {
            Some((known, given)) if known == bits => (given, true),
            _ => (self.last.insert((bits, told.map(|v| late.terminal.gives(v)))).1, false),
        }
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

    /// What a line of the voltage and a torque add in a step.
    #[inline(always)]
    fn gain(&self, [start, end]: [T; 2], torque: T) -> [T; 2] {
        let map = &self.map;
        [0, 1].map(|axis| map.taps[0][axis][0] * start + map.taps[1][axis][0] * end + map.torque[axis][0] * torque)
    }

    #[inline(always)]
    fn advance(&self, x: [T; 2], gain: [T; 2]) -> [T; 2] {
        let Self { map, drop, friction } = self;
        let mut next = x;
        for axis in 0..2 {
            next[axis] = x[axis] + (map.d[2 * axis][0] * x[0] + map.d[2 * axis + 1][0] * x[1] + gain[axis]);
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
