//! Proves: the delay of a signal that stands in an output and in a state is found within its standard error, for whole and broken numbers
//! of periods, on even and irregular clocks, with both holds, against exact responses.
//! Does not prove: delays that only an output with a zero-order hold shows, whose periods alone are known.
#![allow(clippy::unwrap_used, reason = "a test may stop")]

use motorfit::evaluate::model::ModelRecording;
use motorfit::experiment::white_noise;
use motorfit::identify::TrustLevel;
use motorfit::identify::model::{ModelSpec, identify_model};
use motorfit::model::Model;
use motorfit::numeric::count;
use std::ops::ControlFlow;

const TEXT: &str = r#"
format = 1
name = "resistor"
[inputs]
v = { unit = "V" }
[parameters]
R  = { unit = "ohm", min = 0.1, max = 100, log = true }
td = { unit = "s", min = 0, max = 0.05 }
T  = { unit = "s", min = 0.001, max = 1, log = true }
[signals]
vm = { value = "v", unit = "V", delay = "td" }
[states]
h = { unit = "V", d = "(vm - h)/T", initial = 0 }
[outputs]
i = { value = "vm/R", unit = "A" }
h = { value = "h", unit = "V" }
"#;

const STEP_S: f64 = 1e-3;
const SAMPLES: usize = 400;
/// Values of R, T, and the noise of both outputs.
const R: f64 = 2.0;
const T: f64 = 0.02;
const SIGMA: f64 = 0.005;

/// A voltage with its times.
struct Voltage {
    time_s: Vec<f64>,
    values: Vec<f64>,
    is_line: bool,
}

impl Voltage {
    /// Returns the last sample that is not later than a time.
    fn sample(&self, at: f64) -> usize {
        self.time_s.iter().rposition(|time| *time <= at + 1e-12).unwrap_or(0)
    }

    /// Returns the voltage at a time, and its slope after it.
    fn at(&self, at: f64) -> [f64; 2] {
        let n = self.sample(at);
        if !self.is_line || at < -1e-12 || n + 1 == SAMPLES {
            return [self.values[n], 0.0];
        }
        let slope = (self.values[n + 1] - self.values[n]) / (self.time_s[n + 1] - self.time_s[n]);
        [self.values[n] + slope * (at - self.time_s[n]), slope]
    }

    /// Returns the response of the filter at the samples to the voltage with a delay: exact between the moments at which it bends.
    fn filtered(&self, td: f64) -> Vec<f64> {
        let mut h = 0.0;
        let mut all = vec![h];
        for pair in self.time_s.windows(2) {
            let mut moments: Vec<f64> = pair.to_vec();
            let inside = |at: &f64| *at > pair[0] + 1e-12 && *at < pair[1] - 1e-12;
            moments.extend(self.time_s.iter().map(|time| time + td).filter(inside));
            moments.sort_by(f64::total_cmp);
            for part in moments.windows(2) {
                let ([u, slope], length) = (self.at(part[0] - td), part[1] - part[0]);
                h = u + slope * (length - T) + (h - u + slope * T) * (-length / T).exp();
            }
            all.push(h);
        }
        all
    }
}

fn voltage(is_even: bool, is_line: bool) -> Voltage {
    // Steps of a whole number of ticks of the clock, a thousandth of the period.
    let step = |n: usize| if is_even { 1.0 } else { 1.0 + (0.2 * (1.7 * count(n)).sin() * 1e3).round() / 1e3 };
    let mut time_s = vec![0.0];
    for n in 1..SAMPLES {
        time_s.push(time_s[n - 1] + STEP_S * step(n));
    }
    let values = (0..SAMPLES).map(|n| if n < 10 { 0.0 } else { 6.0 * (count(n / 7) * 2.1).sin() }).collect();
    Voltage { time_s, values, is_line }
}

#[test]
fn a_delay_in_an_output_is_found_within_its_standard_error() {
    let model = Model::parse(TEXT).unwrap();
    let cases = [
        (true, false, vec![0.5, 1.0, 1.2, 2.0, 2.05, 10.0]),
        (false, false, vec![0.5, 2.0, 3.37]),
        (true, true, vec![0.5, 1.2, 2.0]),
        (false, true, vec![1.2]),
    ];
    let mut squares = Vec::new();
    for (is_even, is_line, delays) in cases {
        for (seed, periods) in (0..).zip(delays) {
            let (voltage, td) = (voltage(is_even, is_line), periods * STEP_S);
            let current = voltage.time_s.iter().map(|time| voltage.at(time - td)[0] / R).collect();
            let noisy = |signal: Vec<f64>, stream: u64| {
                let noise = white_noise(SAMPLES, SIGMA, seed, stream);
                Some(signal.iter().zip(noise).map(|(a, b)| a + b).collect::<Vec<f64>>())
            };
            let steps: Vec<f64> = voltage.time_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
            let recording = ModelRecording {
                step_s: if is_even { vec![STEP_S] } else { steps.iter().copied().chain([STEP_S]).collect() },
                inputs: vec![voltage.values.clone()],
                measured: vec![noisy(current, 0), noisy(voltage.filtered(td), 1)],
                counting: Vec::new(),
                effective_sample_ratio: 1.0,
                name: None,
                assumed: None,
                time_s: voltage.time_s.clone(),
            };
            let spec = ModelSpec { is_first_order_hold: is_line, ..ModelSpec::default() };
            let found = identify_model(&model, &[recording], &spec, &mut |_| ControlFlow::Continue(())).unwrap();
            let errors = &found.uncertainty.as_ref().unwrap().std_error;
            for (n, truth) in [R, td, T].into_iter().enumerate() {
                let z = (found.values[n] - truth) / errors[n].unwrap();
                // The probability of a larger error is 6e-5, of some 40.
                assert!(z.abs() < 4.0, "{is_even} {is_line} {periods} parameter {n}: {z} standard errors");
                squares.push(z * z);
            }
            // A start may end at another jump of the output, so that fewer than three agree; nothing else may be held against the fit.
            let codes: Vec<&str> = found.trust.reasons.iter().map(|reason| reason.code).collect();
            let is_fine = codes.iter().all(|code| *code == "search_inconclusive");
            assert!(is_fine && found.trust.level != TrustLevel::Poor, "{is_even} {is_line} {periods}: {codes:?}");
        }
    }
    // The mean of 39 squares is 1 ± 0.23; a delay of whole periods cannot appear longer, which makes it smaller.
    let mean = squares.iter().sum::<f64>() / count(squares.len());
    assert!((0.3..1.8).contains(&mean), "mean square {mean}");
}
