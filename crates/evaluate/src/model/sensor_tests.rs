//! Sensors with gain, offset, filter and delay, and inputs with offset and delay, on even and irregular clocks, against a simulation by
//! hand with fine steps; their derivatives against differences.

#![allow(clippy::unwrap_used, reason = "a test may stop")]

use super::trajectory::Unknown;
use super::*;
use motorfit_core::numeric::{count, rms};
use motorfit_model::{IntegrationMethod, Model};

const SAMPLES: usize = 80;
const STEP_S: f64 = 1e-3;
/// Fine steps of a step of the even clock.
const FINE: usize = 400;

/// A damped oscillator of 10 ms that is driven by an input: its states, and a mix with its input. The delay tu is that of the input, or of that mix.
fn text(damping: &str, is_late: bool) -> String {
    let (input, output) = if is_late { (", delay = \"tu\"", "") } else { ("", ", delay = \"tu\"") };
    format!(
        r#"
format = 1
[inputs]
u = {{ unit = "1", offset = "u0"{input} }}
[constants]
s = {{ value = 1, unit = "1/s" }}
[parameters]
k  = {{ unit = "1/s", min = 1, max = 1e4, log = true }}
c  = {{ unit = "1", min = 0, max = 10 }}
u0 = {{ unit = "1", min = -1, max = 1, neutral = 0 }}
tu = {{ unit = "s", min = 0, max = 0.1, neutral = 0 }}
g  = {{ unit = "1", min = 0.1, max = 10, neutral = 1 }}
b  = {{ unit = "1", min = -1, max = 1, neutral = 0 }}
Tf = {{ unit = "ms", min = 0, max = 100, neutral = 0 }}
td = {{ unit = "s", min = 0, max = 0.1, neutral = 0 }}
[states]
x = {{ unit = "1", d = "k*v", initial = 0 }}
v = {{ unit = "1", d = "k*(u - x) - {damping}", initial = 0 }}
[outputs]
y = {{ value = "x + 0.2*v", unit = "1", gain = "g", offset = "b", filter = "Tf", delay = "td" }}
z = {{ value = "u - 0.5*v", unit = "1", filter = "Tf"{output} }}
"#
    )
}

fn damping(kind: &str) -> &'static str {
    match kind {
        "affine" => "k*c*v",
        "cubic" => "k*c*v^3",
        _ => "k*stick(v, 0.5*c)",
    }
}

/// The values of the parameters: k, c, u0, tu, g, b, Tf \[ms\], td.
fn values(tu: f64, filter: f64, td: f64) -> Vec<f64> {
    vec![300.0, 0.4, 0.1, tu * STEP_S, 1.3, 0.25, filter * STEP_S * 1e3, td * STEP_S]
}

fn clock(is_even: bool) -> Vec<f64> {
    let step = |n: usize| if is_even { STEP_S } else { STEP_S * (1.0 + 0.3 * (1.7 * count(n)).sin()) };
    (0..SAMPLES).map(|n| (0..n).map(step).sum()).collect()
}

fn input(n: usize) -> f64 {
    if n < 3 { 0.0 } else { f64::from(u8::from((n / 17).is_multiple_of(2))) + 0.3 * (0.4 * count(n)).sin() }
}

/// Returns the outputs at a time on the even clock by hand: the signals by fine Runge–Kutta steps of constant inputs, the filters as
/// states beside them.
fn by_hand(kind: &str, values: &[f64], is_first_order_hold: bool) -> [Vec<f64>; 2] {
    let &[k, c, u0, tu, g, b, filter, td] = values else { panic!() };
    let (filter, h) = (filter * 1e-3, STEP_S / count(FINE));
    let held = |time: f64| {
        let at = (time - tu).max(0.0) / STEP_S + 1e-9;
        let n = (at.floor() as usize).min(SAMPLES - 1);
        let next = if is_first_order_hold { input((n + 1).min(SAMPLES - 1)) } else { input(n) };
        input(n) + (at - count(n)) * (next - input(n)) + u0
    };
    let shown = |y: f64, f: f64| if filter > 0.0 { f } else { y };
    let rate = |[x, v, f, z]: [f64; 4], u: f64| {
        let damping = match kind {
            "affine" => k * c * v,
            "cubic" => k * c * v.powi(3),
            _ => 0.0,
        };
        let lag = |y: f64, f: f64| if filter > 0.0 { (y - f) / filter } else { 0.0 };
        [k * v, k * (u - x) - damping, lag(g * (x + 0.2 * v) + b, f), lag(u - 0.5 * v, z)]
    };
    let u = held(0.0);
    let mut x = [0.0, 0.0, b, u];
    let (mut ys, mut zs) = (Vec::new(), Vec::new());
    for n in 0..SAMPLES * FINE {
        let time = count(n) * h;
        let now = held(time);
        ys.push(shown(g * (x[0] + 0.2 * x[1]) + b, x[2]));
        zs.push(shown(now - 0.5 * x[1], x[3]));
        let u = held(time + 0.5 * h);
        let moved = |by: f64, k: [f64; 4]| std::array::from_fn(|n| x[n] + by * k[n]);
        let k1 = rate(x, u);
        let k2 = rate(moved(0.5 * h, k1), u);
        let k3 = rate(moved(0.5 * h, k2), u);
        let k4 = rate(moved(h, k3), u);
        let before = x;
        x = std::array::from_fn(|n| x[n] + h / 6.0 * (k1[n] + 2.0 * (k2[n] + k3[n]) + k4[n]));
        if kind == "stick" {
            // Dry friction over a fine step: it stops, but does not reverse.
            let most = k * 0.2 * h;
            let pull = x[1] - before[1];
            x[1] = match before[1] {
                0.0 => pull.signum() * (pull.abs() - most).max(0.0),
                v => {
                    let moved = before[1] + pull - v.signum() * most;
                    if moved * v < 0.0 { 0.0 } else { moved }
                }
            };
        }
    }
    let late = |all: &[f64], delay: f64| -> Vec<f64> {
        let at = |n: usize| (count(n * FINE) - delay / h).max(0.0) + 1e-6;
        (0..SAMPLES)
            .map(at)
            .map(|at| {
                let n = at.floor() as usize;
                all[n] + (at - count(n)) * (all[(n + 1).min(all.len() - 1)] - all[n])
            })
            .collect()
    };
    [late(&ys, td), late(&zs, 0.0)]
}

fn problem(
    (kind, is_late): (&str, bool),
    is_even: bool,
    is_first_order_hold: bool,
    (method, substeps): (IntegrationMethod, usize),
) -> ModelProblem {
    let model = Model::parse(&text(damping(kind), is_late)).unwrap();
    let time_s = clock(is_even);
    let recording = ModelRecording::to_simulate(&model, time_s, vec![(0..SAMPLES).map(input).collect()]).unwrap();
    let recording = if is_even { ModelRecording { step_s: vec![STEP_S], ..recording } } else { recording };
    let settings = ModelSettings { method: Some((method, substeps)), is_first_order_hold, ..ModelSettings::default() };
    ModelProblem::new(&model, ModelSpace::new(&model, 1), vec![recording], settings).unwrap()
}

use IntegrationMethod::{Exponential, RungeKutta};

/// Returns the errors of both outputs relative to their size.
fn errors(kind: &str, hold: bool, how: (IntegrationMethod, usize), values: &[f64]) -> [f64; 2] {
    let found = problem((kind, values[3] > 0.0), true, hold, how).simulate(values, 0, &[]).outputs;
    let expected = by_hand(kind, values, hold);
    std::array::from_fn(|n| {
        let error: Vec<f64> = found[n].iter().zip(&expected[n]).map(|(a, b)| a - b).collect();
        rms(&error) / rms(&expected[n])
    })
}

#[test]
fn sensors_and_inputs_are_those_of_a_fine_simulation() {
    for kind in ["affine", "cubic"] {
        for (filter, td) in [(0.0, 0.0), (0.0, 0.4), (0.0, 2.0), (0.3, 0.0), (3.0, 3.7), (20.0, 11.3)] {
            for hold in [false, true] {
                for (method, substeps) in [(Exponential, 1), (Exponential, 3), (RungeKutta, 2)] {
                    let error = errors(kind, hold, (method, substeps), &values(0.0, filter, td));
                    // k h = 0.3: the third derivative makes (k h)³/40 where the slope at the start is known; (k h)²/8 of the parts
                    // that a line between samples adds directly; the method itself some 1e-6.
                    let parts = count(substeps);
                    let line = if hold { 1.2e-2 / parts.powi(2) } else { 1e-3 / parts.powi(3) };
                    let limits = [1e-3 / parts.powi(3), line];
                    assert!(
                        (0..2).all(|n| error[n] < limits[n] + 2e-5),
                        "{kind} {filter} {td} {hold} {method:?} {substeps}: {error:?}"
                    );
                }
            }
        }
    }
}

#[test]
fn errors_behind_a_delayed_input_or_friction_fall_with_the_square_of_the_substep() {
    for (kind, tu) in [("affine", 1.3), ("stick", 0.0)] {
        let of = |substeps: usize| errors(kind, false, (Exponential, substeps), &values(tu, 2.0, 1.6));
        let (coarse, fine) = (of(2), of(16));
        // 64 times as small, less what moments within a substep add; the reference of friction has steps of h/400 of first order.
        assert!((0..2).all(|n| fine[n] < (coarse[n] / 20.0).max(6e-4)), "{kind}: {coarse:?} {fine:?}");
        assert!(coarse.iter().all(|error| *error < 2e-2), "{kind}: {coarse:?}");
    }
}

#[test]
fn neutral_values_have_no_effect() {
    let all = |filter: f64, td: f64| {
        let mut values = values(0.0, filter, td);
        (values[2], values[4], values[5]) = (0.0, 1.0, 0.0);
        values
    };
    for how in [(Exponential, 2), (RungeKutta, 1)] {
        for kind in ["affine", "cubic", "stick"] {
            let plain = text(damping(kind), true)
                .replace(", gain = \"g\", offset = \"b\", filter = \"Tf\", delay = \"td\"", "");
            let plain = plain.replace(", offset = \"u0\", delay = \"tu\"", "").replace(", filter = \"Tf\"", "");
            let lines: Vec<&str> = plain.lines().filter(|line| !line.contains("neutral")).collect();
            let model = Model::parse(&lines.join("\n")).unwrap();
            let with = problem((kind, true), true, false, how);
            let settings = ModelSettings { method: Some(how), ..ModelSettings::default() };
            let recordings = vec![with.recording(0).clone()];
            let count = model.parameters().len();
            let without = ModelProblem::new(&model, ModelSpace::new(&model, 1), recordings, settings).unwrap();
            let expected = without.simulate(&all(0.0, 0.0)[..count], 0, &[]).outputs;
            let found = with.simulate(&all(0.0, 0.0), 0, &[]).outputs;
            for (found, expected) in found.iter().zip(&expected) {
                let largest = found.iter().zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                // The delayed input with the delay 0 is a mean over each substep, with the rounding of its integral.
                assert!(largest < 1e-10, "{kind} {how:?}: {largest}");
            }
        }
    }
}

#[test]
fn derivatives_are_those_of_differences() {
    for (kind, is_even, hold) in
        [("affine", true, false), ("cubic", true, true), ("cubic", false, false), ("stick", true, false)]
    {
        for (filter, td) in [(0.7, 1.313), (5.0, 0.0), (0.0, 2.4)] {
            let problem = problem((kind, true), is_even, hold, (if is_even { Exponential } else { RungeKutta }, 2));
            let values = values(1.2371, filter, td);
            let unknowns: Vec<Unknown> = (0..values.len()).map(|n| Unknown::Parameter(n, 1.0)).collect();
            let found = problem.trajectory(&values, 0, &[], &unknowns);
            for n in 0..values.len() {
                // Of those that are 0 on one side, where they are defined.
                let (below, above) = if values[n] == 0.0 { (0.0, 1e-6) } else { (1e-6, 1e-6) };
                let size = if values[n] == 0.0 { STEP_S } else { values[n] };
                let moved = |by: f64| {
                    let mut values = values.clone();
                    values[n] += by * size;
                    problem.simulate(&values, 0, &[]).outputs
                };
                let (after, before) = (moved(above), moved(-below));
                for output in 0..2 {
                    let own: Vec<f64> =
                        found.sensitivities[output].iter().skip(n).step_by(values.len()).copied().collect();
                    let difference: Vec<f64> = after[output]
                        .iter()
                        .zip(&before[output])
                        .map(|(a, b)| (a - b) / ((above + below) * size))
                        .collect();
                    // An output with a jump of its input starts to be filtered with the jump: there is no derivative at 0.
                    if values[n] == 0.0 && output == 1 {
                        continue;
                    }
                    let error: Vec<f64> = own.iter().zip(&difference).map(|(a, b)| a - b).collect();
                    let limit = if values[n] == 0.0 { 2e-3 } else { 1e-6 };
                    assert!(
                        rms(&error) <= limit * rms(&difference).max(1e-6),
                        "{kind} {is_even} {hold} {filter} {td}: {n} {output}: {} of {}",
                        rms(&error),
                        rms(&difference)
                    );
                }
            }
        }
    }
}
