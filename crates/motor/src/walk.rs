//! Simulation of the motor with extensions, sample by sample: the oracle of extended models. With [`Dual`] numbers the same
//! code gives exact derivatives.
//!
//! The voltage passes the drive nonlinearity and the delay. A step is that of the linear motor, whose map is exact,
//! followed by the reactions of brushes and friction. Sensors output moving averages. The kernel shares the formulas of the
//! effects but not this loop, which computes every sample in order.
//!
//! [`Dual`]: super::dual::Dual

use super::composed::SplitSteps;
use super::delay::{DelayedVoltage, StepVoltage, sample_times};
use super::discretize::{StepMaps, step_maps};
use super::dual::Number;
use super::extended::Extended;
use super::friction::{Bend, Reactions, reactions};
use super::parameter::Parameter;
use super::sensor::Sensor;
use super::settings::SimulationSettings;
use super::simulate::SimulationInput;
use std::sync::Arc;

/// Iterator over the samples; it yields the current \[A\] and the speed \[rad/s\] that the sensors output.
pub struct ExtendedWalk<'a, T> {
    inputs: Inputs<'a, T>,
    steps: Vec<Step<T>>,
    sensors: [Option<Sensor<T>>; 2],
    load: T,
    x: [T; 2],
    n: usize,
    /// Index of the last step length and bits of the torque, with the change of the states due to the inputs; reused while
    /// these stay equal.
    known: Option<((usize, u64), [T; 2])>,
}

/// State of a simulation that was paused between two inputs.
pub struct PausedWalk<T> {
    sensors: [Option<Sensor<T>>; 2],
    x: [T; 2],
}

impl<'a, T: Number> ExtendedWalk<'a, T> {
    /// Makes a simulation that starts at the state `initial` = `[i, ω]`.
    ///
    /// # Panics
    /// Iteration panics at a sample whose step index `step_s` of the input lacks.
    #[must_use]
    pub fn new(
        motor: &Extended<T>,
        drive: &SimulationInput<'a>,
        settings: SimulationSettings,
        initial: [T; 2],
    ) -> Self {
        let steps = drive.step_s.iter().map(|&h| Step::new(motor, h, settings)).collect();
        Self::with_steps(motor, drive, settings, (initial, steps))
    }

    /// Makes a simulation like [`Self::new`] on a clock whose steps are split as in `split`. The maps of many steps are
    /// composed of few; they differ from those of [`Self::new`] by rounding.
    #[inline(always)]
    #[doc(hidden)]
    pub fn composed(
        motor: &Extended<T>,
        drive: &SimulationInput<'a>,
        settings: SimulationSettings,
        (initial, split): ([T; 2], Option<&SplitSteps>),
    ) -> Self {
        let method = settings.method;
        let one = motor.map(|value| [value]);
        let tables = split.map(|split| (split, split.tables(&one.motor, method)));
        let mut steps = Vec::with_capacity(drive.step_s.len());
        // A loop, because iterator adapters would not be compiled for the target features of the caller.
        for n in 0..drive.step_s.len() {
            let map = match &tables {
                None => step_maps(&one.motor, drive.step_s[n], method),
                Some((split, tables)) => split.whole(tables, n, method),
            };
            steps.push(Step::of(&one, map, settings));
        }
        Self::with_steps(motor, drive, settings, (initial, steps))
    }

    /// Returns the state after the last sample that was taken from the iterator.
    #[doc(hidden)]
    pub fn paused(self) -> PausedWalk<T> {
        PausedWalk { sensors: self.sensors, x: self.x }
    }

    /// Continues a simulation with the samples of another input; the voltage must not be delayed.
    #[doc(hidden)]
    pub fn resumed(
        motor: &Extended<T>,
        drive: &SimulationInput<'a>,
        settings: SimulationSettings,
        paused: PausedWalk<T>,
    ) -> Self {
        Self { sensors: paused.sensors, ..Self::new(motor, drive, settings, paused.x) }
    }

    fn with_steps(
        motor: &Extended<T>,
        drive: &SimulationInput<'a>,
        settings: SimulationSettings,
        (initial, steps): ([T; 2], Vec<Step<T>>),
    ) -> Self {
        let time = if settings.features.is_delayed() { sample_times(drive) } else { Arc::default() };
        let sensor =
            |of, channel: usize| settings.features.has(of).then(|| Sensor::new(motor.get(of), initial[channel]));
        Self {
            inputs: Inputs {
                delayed: DelayedVoltage::new(motor, *drive, settings, time),
                settings,
                cursor: 0,
                last: None,
            },
            steps,
            sensors: [sensor(Parameter::CurrentAverage, 0), sensor(Parameter::SpeedAverage, 1)],
            load: motor.get(Parameter::Load),
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
        let Self { inputs, steps, sensors, n, .. } = self;
        let drive = inputs.delayed.drive;
        if *n == drive.voltage.len() {
            return None;
        }
        let mut seen = self.x;
        for (sensor, seen) in sensors.iter_mut().zip(&mut seen) {
            if let Some(sensor) = sensor {
                *seen = sensor.show(*seen);
            }
        }
        let torque = drive.torque.get(*n).copied().unwrap_or(0.0);
        let acting = (drive.index(*n), torque.to_bits());
        let (StepVoltage { ends, bend }, is_same) = inputs.step_voltage(*n);
        let gain = match self.known {
            Some((same, gain)) if is_same && same == acting => gain,
            _ => self.known.insert((acting, steps[acting.0].gain(ends, T::constant(torque) + self.load))).1,
        };
        let gain = bend.map_or(gain, |Bend { added, .. }| [gain[0] + added[0], gain[1] + added[1]]);
        self.x = steps[acting.0].advance(self.x, gain, bend);
        *n += 1;
        Some(seen)
    }
}

/// The voltage at the motor in each step.
struct Inputs<'a, T> {
    delayed: DelayedVoltage<'a, T>,
    settings: SimulationSettings,
    cursor: usize,
    /// Bits of the last commanded voltages at both ends of a step, and the voltages at the motor.
    last: Option<([u64; 2], [T; 2])>,
}

impl<T: Number> Inputs<'_, T> {
    /// Returns the voltage of a step, and true if it equals that of the step before.
    #[inline(always)]
    fn step_voltage(&mut self, n: usize) -> (StepVoltage<T>, bool) {
        let Self { delayed, settings, .. } = self;
        let commanded = if !settings.features.is_delayed() {
            Some([delayed.drive.voltage[n], delayed.end(n)])
        } else {
            delayed.advance(n, &mut self.cursor);
            delayed.constant(n, self.cursor).map(|voltage| [voltage; 2])
        };
        let Some(commanded) = commanded else {
            self.last = None;
            return (delayed.step_voltage_from(n, self.cursor), false);
        };
        let bits = commanded.map(f64::to_bits);
        let (ends, is_same) = match self.last {
            Some((known, given)) if known == bits => (given, true),
            _ => (self.last.insert((bits, commanded.map(|v| delayed.nonlinearity.output(v)))).1, false),
        };
        (StepVoltage { ends, bend: None }, is_same)
    }
}

/// One-step map with its reactions.
struct Step<T> {
    map: StepMaps<1, T>,
    reactions: Reactions<1, T>,
    acts: [bool; 2],
}

impl<T: Number> Step<T> {
    #[inline(never)]
    fn new(motor: &Extended<T>, h: f64, settings: SimulationSettings) -> Self {
        let motor = motor.map(|value| [value]);
        let map = step_maps(&motor.motor, h, settings.method);
        Self::of(&motor, map, settings)
    }

    #[inline(always)]
    fn of(motor: &Extended<[T; 1]>, map: StepMaps<1, T>, settings: SimulationSettings) -> Self {
        let features = settings.features;
        Self { reactions: Reactions::new(motor, &map, features), map, acts: reactions(features) }
    }

    /// Returns the change of the states in a step due to a voltage \[V\] at its ends and a torque \[N·m\].
    #[inline(always)]
    fn gain(&self, [start, end]: [T; 2], torque: T) -> [T; 2] {
        let map = &self.map;
        [0, 1].map(|axis| map.taps[0][axis][0] * start + map.taps[1][axis][0] * end + map.torque[axis][0] * torque)
    }

    #[inline(always)]
    fn advance(&self, x: [T; 2], gain: [T; 2], bend: Option<Bend<T>>) -> [T; 2] {
        let Self { map, reactions, acts } = self;
        let mut next = x;
        for axis in 0..2 {
            next[axis] = x[axis] + (map.d[2 * axis][0] * x[0] + map.d[2 * axis + 1][0] * x[1] + gain[axis]);
        }
        reactions.friction_step::<false>(*acts, (x, next), bend, 0)
    }
}
