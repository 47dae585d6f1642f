//! Step responses of any length, simulated in blocks of samples with memory independent of the length.
//!
//! A first pass computes the statistics of the complete signals that noise and responses need; a second pass writes the
//! samples. Sums are taken in the order of the samples, so that the text is equal to that of
//! [`write_csv`](motorfit_record::write_csv).

use super::excitation::Excitation;
use crate::criterion::Noise;
use motorfit_core::Result;
use motorfit_core::numeric::{count, rounded};
use motorfit_motor::{
    Discretization, Extended, ExtendedWalk, InputHistory, SimulationInput, SimulationSettings, StepResponse, walk,
};
use motorfit_record::{Quantity, Record, Samples, VALUE_MAX};
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};
use std::fmt::Write as _;
use std::ops::ControlFlow;

/// Number of samples of a block.
const BLOCK: usize = 1 << 14;

/// A voltage step applied to a motor at rest.
#[derive(Debug, Clone, Copy)]
pub struct StepExperiment {
    motor: Extended,
    volts: f64,
    at_s: f64,
    period_s: f64,
    samples: usize,
    /// Sampling period that a recording with these times has \[s\].
    step_s: f64,
}

/// Statistics of current and speed without noise: sums of squares, peaks with their samples, and steady-state values.
#[derive(Debug, Clone, Copy)]
pub struct StepFigures {
    squares: [f64; 2],
    peak: [(f64, usize); 2],
    steady: [f64; 2],
    samples: usize,
}

impl StepFigures {
    /// Returns the standard deviation of the noise to be added to current \[A\] and speed \[rad/s\]; `None` for estimated
    /// noise, which needs the complete signals.
    #[must_use]
    pub fn sigma(&self, noise: Noise) -> Option<[f64; 2]> {
        let rms = self.squares.map(|squares| (squares / count(self.samples)).sqrt());
        match noise {
            Noise::Estimated => None,
            Noise::Sigma(sigma) => Some(sigma.map(|sigma| sigma.unwrap_or(0.0))),
            Noise::Decibels(decibels) => Some(rms.map(|rms| rms * 10f64.powf(-decibels / 20.0))),
        }
    }
}

impl StepExperiment {
    /// Creates an experiment: 0 V before `at_s`, `volts` from then on, as in [`Excitation::step`]. Returns `None` for a motor
    /// with a dead time or a start latency, which needs the complete voltage.
    ///
    /// # Errors
    /// Returns an error in the cases of [`Excitation::step`].
    pub fn new(
        motor: impl Into<Extended>,
        volts: f64,
        at_s: f64,
        [duration_s, period_s]: [f64; 2],
    ) -> Result<Option<Self>> {
        let samples = Excitation::samples(duration_s, period_s)?;
        Excitation::check_step(volts, at_s)?;
        let motor = motor.into();
        let mut own = Self { motor, volts, at_s, period_s, samples, step_s: period_s };
        let first = own.block(0, samples.min(BLOCK));
        let zero = Some(vec![0.0; first.len()]);
        let time_s = (0..first.len()).map(|n| own.time(n)).collect();
        let draft = Record::new(Samples {
            time_s,
            voltage: first,
            torque: None,
            current: zero.clone(),
            speed: zero,
            ..Samples::default()
        })?;
        own.checked(samples - 1, [0.0; 2])?;
        own.step_s = draft.period_s();
        let is_even = draft.steps().step_index.is_empty();
        Ok((is_even && !motor.features().is_delayed()).then_some(own))
    }

    /// Returns the number of samples.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.samples
    }

    fn time(&self, n: usize) -> f64 {
        count(n) * self.period_s
    }

    fn block(&self, from: usize, to: usize) -> Vec<f64> {
        (from..to).map(|n| Excitation::voltage(self.volts, self.time(n) - self.at_s, self.period_s)).collect()
    }

    /// Checks a sample as [`Record::new`] does.
    fn checked(&self, n: usize, [current, speed]: [f64; 2]) -> Result<()> {
        if current.abs() <= VALUE_MAX && speed.abs() <= VALUE_MAX && n + 1 < self.samples {
            return Ok(());
        }
        let two = |value: f64| vec![value; 2];
        let time_s = vec![self.time(n), self.time(n + 1)];
        let (current, speed) = (Some(two(current)), Some(two(speed)));
        Record::new(Samples { time_s, voltage: two(self.volts), torque: None, current, speed, ..Samples::default() })
            .map(|_| ())
    }

    /// Simulates block by block. `each` gets the index of the first sample of a block, its voltages, and its states `[i, ω]`;
    /// it may end the simulation.
    fn blocks(
        &self,
        mut each: impl FnMut(usize, &[f64], &[[f64; 2]]) -> Result<ControlFlow<()>>,
    ) -> Result<ControlFlow<()>> {
        let step_s = [self.step_s];
        let features = self.motor.features();
        let settings = SimulationSettings {
            features,
            method: Discretization::Zoh.into(),
            history: InputHistory { voltage: 0.0, first_movement: 0 },
        };
        let (mut at, mut seen) = (0, Vec::with_capacity(BLOCK + 1));
        let mut extended = None;
        let mut x = [0.0; 2];
        while at < self.samples {
            let end = self.samples.min(at + BLOCK);
            seen.clear();
            let voltage = if features.is_linear() {
                // The state of one more sample is the first of the next block.
                let voltage = self.block(at, end + 1);
                walk(&self.motor.parameters(), &drive(&step_s, &voltage), x, Discretization::Zoh, |state| {
                    seen.push(state)
                });
                x = seen.pop().unwrap_or(x);
                voltage
            } else {
                let voltage = self.block(at, end);
                let mut walk = match extended.take() {
                    None => ExtendedWalk::new(&self.motor, &drive(&step_s, &voltage), settings, x),
                    Some(paused) => ExtendedWalk::resumed(&self.motor, &drive(&step_s, &voltage), settings, paused),
                };
                seen.extend(walk.by_ref());
                extended = Some(walk.paused());
                voltage
            };
            if each(at, &voltage, &seen)?.is_break() {
                return Ok(ControlFlow::Break(()));
            }
            at = end;
        }
        Ok(ControlFlow::Continue(()))
    }

    /// Simulates the motor and returns the statistics of its signals. `go_on` is called after each block; if it returns
    /// `Break`, the result is `None`.
    ///
    /// # Errors
    /// Returns a data error if the simulation diverges.
    pub fn figures(&self, go_on: &mut dyn FnMut() -> ControlFlow<()>) -> Result<Option<StepFigures>> {
        let tail = self.samples - self.samples.div_ceil(10);
        let (mut squares, mut peak, mut sums) = ([0.0; 2], [(0.0_f64, 0); 2], [0.0; 2]);
        let flow = self.blocks(|at, _, seen| {
            for (n, state) in (at..).zip(seen) {
                self.checked(n, *state).map_err(|error| super::excitation::diverges(&error))?;
                for (channel, &value) in state.iter().enumerate() {
                    squares[channel] += value * value;
                    if n == 0 || value.abs() > peak[channel].0.abs() {
                        peak[channel] = (value, n);
                    }
                    if n >= tail {
                        sums[channel] += value;
                    }
                }
            }
            Ok(go_on())
        })?;
        let steady = sums.map(|sum| sum / count(self.samples - tail));
        Ok(flow.is_continue().then_some(StepFigures { squares, peak, steady, samples: self.samples }))
    }

    /// Passes the text of a recording, the samples with white Gaussian noise of standard deviation `sigma`, piece by piece to
    /// `write`, and returns the step responses of current and speed without noise. `band` is the half-width of the settling band
    /// relative to the steady state. If `write` returns `Break`, the result is `None`.
    ///
    /// # Errors
    /// Returns a data error if a value leaves the range of a recording, and propagates the errors of `write`.
    pub fn write(
        &self,
        figures: &StepFigures,
        (sigma, seed): ([f64; 2], u64),
        band: f64,
        write: &mut dyn FnMut(&str) -> Result<ControlFlow<()>>,
    ) -> Result<Option<[StepResponse; 2]>> {
        let mut generators = [0, 1].map(|stream| {
            let mut generator = ChaCha8Rng::seed_from_u64(seed);
            generator.set_stream(stream);
            generator
        });
        let mut responses = [0, 1].map(|channel| Settling::new(figures.steady[channel], band));
        let heads = [Quantity::Time, Quantity::Voltage, Quantity::Current, Quantity::Speed].map(Quantity::canonical);
        let mut text = heads.join(",") + "\n";
        let flow = self.blocks(|at, voltage, seen| {
            for ((n, voltage), state) in (at..).zip(voltage).zip(seen) {
                let mut noisy = *state;
                for channel in 0..2 {
                    responses[channel].see(n, state[channel]);
                    let normal: f64 = StandardNormal.sample(&mut generators[channel]);
                    noisy[channel] += sigma[channel] * normal;
                }
                self.checked(n, noisy)?;
                let [current, speed] = noisy;
                let _ = writeln!(text, "{},{voltage},{current},{speed}", rounded(self.time(n), 15));
            }
            let flow = write(&text)?;
            text.clear();
            Ok(flow)
        })?;
        let response = |channel: usize| {
            let ((peak, at), steady_state) = (figures.peak[channel], figures.steady[channel]);
            StepResponse {
                peak,
                peak_time_s: self.time(at),
                steady_state,
                overshoot_percent: (steady_state != 0.0).then(|| (100.0 * (peak / steady_state - 1.0)).max(0.0)),
                settling_time_s: responses[channel].settled(self.samples).map(|n| self.time(n)),
            }
        };
        Ok(flow.is_continue().then(|| [0, 1].map(response)))
    }
}

fn drive<'a>(step_s: &'a [f64], voltage: &'a [f64]) -> SimulationInput<'a> {
    SimulationInput { step_s, step_index: &[], voltage, voltage_end: &[], torque: &[] }
}

/// The settling time of a signal, computed sample by sample.
struct Settling {
    steady: f64,
    band: f64,
    /// Index after the last sample outside the band.
    settled: usize,
    /// The last three values, the newest last.
    last: [f64; 3],
    /// Number of third differences that are larger than those of noise with a standard deviation of a third of the band.
    rough: usize,
}

impl Settling {
    fn new(steady: f64, band: f64) -> Self {
        Self { steady, band: band * steady.abs(), settled: 0, last: [0.0; 3], rough: 0 }
    }

    fn see(&mut self, n: usize, value: f64) {
        if (value - self.steady).abs() > self.band {
            self.settled = n + 1;
        }
        let [a, b, c] = self.last;
        if n >= 3 {
            let third = (value - 3.0 * c + 3.0 * b - a).abs();
            // The factor is that of `numeric::noise_sigma`, which uses the median of the third differences.
            let sigma = third / (0.674_489_750_196_081_7 * 20.0_f64.sqrt());
            self.rough += usize::from(3.0 * sigma > self.band);
        }
        self.last = [b, c, value];
    }

    /// Returns the index of the sample from which on the signal has settled, `None` if it has not settled or noise hides it.
    fn settled(&self, samples: usize) -> Option<usize> {
        let thirds = samples.saturating_sub(3);
        // If at least half of the third differences are rough, the median is too.
        let is_hidden = thirds > 0 && self.rough >= thirds - thirds / 2;
        (self.settled < samples && !is_hidden).then_some(self.settled)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::{noise_of, simulated, with_noise};
    use motorfit_motor::{Parameter, Parameters, response};
    use motorfit_record::write_csv;

    fn motors() -> Vec<Extended> {
        let linear = Extended::from(&Parameters::M2);
        let with = |parameter, value| {
            let mut motor = linear;
            motor.set(parameter, value);
            motor
        };
        let mut averaged = with(Parameter::SpeedAverage, 7.5);
        averaged.set(Parameter::Coulomb, 0.02);
        vec![linear, with(Parameter::Coulomb, 0.05), with(Parameter::Offset, 0.3), averaged]
    }

    /// The lengths are within a block, at its ends and over several blocks.
    #[test]
    fn text_and_statistics_equal_those_of_complete_signals() {
        let going = &mut || ControlFlow::Continue(());
        for (n, motor) in motors().into_iter().enumerate() {
            for samples in [2, 3, 4, 50, BLOCK, BLOCK + 1, 3 * BLOCK + 17] {
                let period = [0.001, 1.0 / 3000.0][n % 2];
                let clock = [count(samples - 1) * period, period];
                let step = StepExperiment::new(motor, 10.5, 0.1, clock).unwrap().unwrap();
                let excitation = Excitation::step(10.5, 0.1, clock[0], period).unwrap();
                let whole = simulated(motor, &excitation, Discretization::Zoh).unwrap();
                let figures = step.figures(going).unwrap().unwrap();
                let noise = Noise::Decibels(40.0);
                let sigma = noise_of(&whole, noise);
                assert_eq!(figures.sigma(noise), Some(sigma));
                let mut text = String::new();
                let mut write = |part: &str| {
                    text.push_str(part);
                    Ok(ControlFlow::Continue(()))
                };
                let responses = step.write(&figures, (sigma, 3), 0.02, &mut write).unwrap().unwrap();
                assert!(text == write_csv(&with_noise(&whole, sigma, 3).unwrap()), "motor {n}, {samples} samples");
                for (channel, signal) in whole.measured().into_iter().enumerate() {
                    let mut of = response(&whole.samples().time_s, signal.unwrap(), 0.02).unwrap();
                    if 3.0 * motorfit_core::numeric::noise_sigma(signal.unwrap()) > 0.02 * of.steady_state.abs() {
                        of.settling_time_s = None;
                    }
                    assert_eq!(responses[channel], of, "motor {n}, {samples} samples");
                }
            }
        }
    }

    #[test]
    fn it_ends_on_request_and_reports_divergence() {
        let step = StepExperiment::new(&Parameters::M2, 10.5, 1.0, [1e4, 1e-3]).unwrap().unwrap();
        let mut blocks = 0;
        let mut third = || {
            blocks += 1;
            if blocks == 3 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        assert!(step.figures(&mut third).unwrap().is_none());
        assert_eq!(blocks, 3);
        let mut unstable = Parameters::M2;
        unstable.b = -0.1;
        let diverging = StepExperiment::new(&unstable, 10.5, 1.0, [1e4, 1e-3]).unwrap().unwrap();
        let error = diverging.figures(&mut || ControlFlow::Continue(())).unwrap_err();
        assert!(error.to_string().contains("the simulated motor diverges: "), "{error}");
        assert!(StepExperiment::new(&Parameters::M2, 10.5, 1.0, [1e9, 1e-3]).is_err());
        assert!(StepExperiment::new(&Parameters::M2, f64::NAN, 1.0, [1.0, 1e-3]).is_err());
        let mut late = Extended::from(&Parameters::M2);
        late.set(Parameter::DeadTime, 0.004);
        assert!(StepExperiment::new(late, 10.5, 1.0, [1.0, 1e-3]).unwrap().is_none());
    }
}
