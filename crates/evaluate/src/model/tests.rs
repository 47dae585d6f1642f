//! Every back end of a model against a plain simulation of its equations with fine steps.

#![allow(clippy::unwrap_used, reason = "a test may stop")]

use super::trajectory::Unknown;
use super::*;
use crate::Level;
use motorfit_core::numeric::{count, rms};
use motorfit_model::{BuiltIn, IntegrationMethod, Model, reference};
use motorfit_motor::Parameters;

/// Returns the inputs of a built-in model, its step \[s\], and the values of its parameters.
fn case(of: BuiltIn) -> (Vec<Vec<f64>>, f64, Vec<f64>) {
    const SAMPLES: usize = 400;
    let square = |period: usize, high: f64, low: f64| -> Vec<f64> {
        (0..SAMPLES).map(|n| if (n / period).is_multiple_of(2) { high } else { low }).collect()
    };
    let zero = vec![0.0; SAMPLES];
    // Before the first sample a delayed signal has its first value, in the motor's own simulation that at rest.
    let after_rest = |mut input: Vec<f64>| {
        input[..20].fill(0.0);
        input
    };
    match of {
        BuiltIn::Pmsm => (
            vec![square(90, 1.0, -0.5), square(70, 6.0, -3.0), square(50, 0.02, 0.0)],
            1e-4,
            vec![0.5, 1e-3, 1.5e-3, 0.05, 1e-4, 2e-4],
        ),
        BuiltIn::TwoMass => (vec![square(50, 0.2, -0.2)], 1e-3, vec![1e-3, 2e-3, 1e-3, 1e-3, 20.0, 0.01, 0.01]),
        BuiltIn::ServoPendulum => {
            (vec![square(150, 1.0, -0.5)], 1e-3, vec![0.5, 0.01, 0.005, 0.05, 0.03, 0.3, 0.3, 1.5, 20.0, 0.5])
        }
        BuiltIn::DcThermal => {
            (vec![square(90, 6.0, -3.0), vec![25.0; SAMPLES]], 1e-3, vec![1.0, 1.0, 0.05, 1e-5, 1e-5, 5.0, 4.0, 1e-3])
        }
        BuiltIn::Mechanism => (vec![square(90, 6.0, -3.0)], 1e-2, vec![0.25, 2.1, 0.32, 0.015]),
        BuiltIn::Elevator => (vec![square(90, 6.0, -3.0)], 1e-2, vec![0.18, 0.62, 3.9, 0.21, 0.0043]),
        BuiltIn::Arm => (vec![square(90, 2.0, -1.0)], 1e-2, vec![0.2, 0.75, 1.4, 0.09, 0.1, 0.015]),
        BuiltIn::DcMotor => (vec![after_rest(square(70, 6.0, -3.0)), square(33, 0.01, 0.0)], 1e-3, motor()),
        BuiltIn::DcExtended => (
            vec![after_rest(square(70, 6.0, -3.0)), zero],
            1e-3,
            [motor(), vec![0.02, 0.005, 0.004, 0.1, 0.3, 0.2, 5.0, 0.9]].concat(),
        ),
        other => panic!("{other:?} has no case"),
    }
}

fn motor() -> Vec<f64> {
    Parameters::M2.to_array().to_vec()
}

/// Makes a problem whose only candidate is given, and whose outputs are measured as zero.
fn problem(
    model: &Model,
    (inputs, step_s): (&[Vec<f64>], f64),
    space: ModelSpace,
    method: IntegrationMethod,
    substeps: usize,
) -> ModelProblem {
    let time_s: Vec<f64> = (0..inputs[0].len()).map(|n| count(n) * step_s).collect();
    let recording = ModelRecording {
        measured: model.outputs().iter().map(|_| Some(time_s.clone())).collect(),
        time_s,
        step_s: vec![step_s],
        inputs: inputs.to_vec(),
        counting: Vec::new(),
        effective_sample_ratio: 1.0,
        name: None,
        assumed: None,
    };
    let settings = ModelSettings { method: Some((method, substeps)), ..ModelSettings::default() };
    ModelProblem::new(model, space, vec![recording], settings).unwrap()
}

#[test]
fn steps_follow_the_equations() {
    // Errors relative to the rms of the output. Affine equations are exact; others have the error of order 4, that of the bounces of
    // a backlash, and that of reactions, which begin and end with a step (order 1).
    for (of, limits) in [
        (BuiltIn::DcMotor, [1e-12, 1e-6]),
        (BuiltIn::DcExtended, [1e-2, 1e-2]),
        (BuiltIn::DcThermal, [3e-3, 3e-3]),
        (BuiltIn::Mechanism, [1e-2, 1e-2]),
        (BuiltIn::Elevator, [1e-2, 1e-2]),
        (BuiltIn::Arm, [1e-2, 1e-2]),
        (BuiltIn::Pmsm, [1e-5, 1e-5]),
        (BuiltIn::ServoPendulum, [1e-2, 1e-2]),
        (BuiltIn::TwoMass, [2e-2, 2e-2]),
    ] {
        let model = of.model().unwrap();
        let (inputs, step_s, values) = case(of);
        let open = vec![0.05; motorfit_model::step::open_states(&model).len()];
        let expected = reference::simulate(&model, &values, &open, &inputs, step_s, 64);
        for (method, limit) in IntegrationMethod::ALL.into_iter().zip(limits) {
            for substeps in [1, 3] {
                let problem = problem(&model, (&inputs, step_s), ModelSpace::all_fixed(&values), method, substeps);
                let found = problem.simulate(&[], 0, &open).outputs;
                for ((found, expected), output) in found.iter().zip(&expected).zip(model.outputs()) {
                    let error: Vec<f64> = found.iter().zip(expected).map(|(a, b)| a - b).collect();
                    let error = rms(&error) / rms(expected);
                    assert!(error < limit, "{} {} {method:?} {substeps}: {error:e}", of.name(), output.name);
                }
            }
        }
    }
}

#[test]
fn every_level_computes_the_same() {
    use crate::interpreter::{Job, RunProgram as _, Work};
    for of in BuiltIn::ALL {
        let model = of.model().unwrap();
        let (inputs, step_s, values) = case(of);
        let problem =
            problem(&model, (&inputs, step_s), ModelSpace::all_fixed(&values), IntegrationMethod::RungeKutta, 1);
        let programs = &problem.programs[0];
        let run = |level: Level| {
            let mut work = Work::<8>::default();
            work.parameters = values
                .iter()
                .copied()
                .chain(std::iter::repeat(0.0))
                .take(programs.step.all_parameters())
                .map(crate::interpreter::Register::of)
                .collect();
            let prepared = &problem.recordings[0];
            work.run_at(&Job { program: &programs.program, rows: &prepared.rows, loss: prepared.loss }, level);
            work.outputs.iter().map(|sum| sum.lane(3)).collect::<Vec<f64>>()
        };
        let portable = run(Level::Portable);
        for level in Level::available() {
            for (own, portable) in run(level).iter().zip(&portable) {
                // Fused operations round otherwise; a bounce of the backlash amplifies that.
                assert!((own / portable - 1.0).abs() < 1e-6, "{} {level:?}: {own} {portable}", of.name());
            }
        }
    }
}

#[test]
fn derivatives_are_those_of_differences() {
    for of in BuiltIn::ALL {
        let model = of.model().unwrap();
        let (inputs, step_s, mut values) = case(of);
        if of == BuiltIn::DcExtended {
            // A multiple of the step is a kink of the delayed signal.
            values[7] = 0.0043;
        }
        let open = vec![0.02; motorfit_model::step::open_states(&model).len()];
        for method in IntegrationMethod::ALL {
            let free = ModelSpace::new(&model, 1);
            let problem = problem(&model, (&inputs, step_s), free, method, 1);
            let unknowns: Vec<Unknown> = (0..values.len())
                .map(|n| Unknown::Parameter(n, values[n].abs().max(1e-3)))
                .chain((0..open.len()).map(Unknown::Initial))
                .collect();
            let found = problem.trajectory(&values, 0, &open, &unknowns);
            for (n, unknown) in unknowns.iter().enumerate() {
                let moved = |step: f64| {
                    let (mut values, mut open) = (values.clone(), open.clone());
                    match *unknown {
                        Unknown::Parameter(p, rate) => values[p] += step * rate,
                        Unknown::Initial(place) => open[place] += step,
                    }
                    problem.simulate(&values, 0, &open).outputs
                };
                let step = 1e-6;
                let (after, before) = (moved(step), moved(-step));
                for output in 0..model.outputs().len() {
                    let difference: Vec<f64> =
                        after[output].iter().zip(&before[output]).map(|(a, b)| (a - b) / (2.0 * step)).collect();
                    let own: Vec<f64> =
                        found.sensitivities[output].iter().skip(n).step_by(unknowns.len()).copied().collect();
                    let size = rms(&difference).max(1e-3 * rms(&found.outputs[output])).max(1e-9);
                    // At a kink (a stick, a bounce) the difference spans both sides: the samples after it are few.
                    let mut errors: Vec<f64> = own.iter().zip(&difference).map(|(a, b)| (a - b).abs() / size).collect();
                    let most = motorfit_core::numeric::order_statistic(&mut errors, 0.9);
                    assert!(most < 1e-3, "{} {method:?} {unknown:?} output {output}: {most:e}", of.name());
                }
            }
        }
    }
}

#[test]
fn sums_of_candidates_side_by_side_are_those_of_their_trajectories() {
    for of in BuiltIn::ALL {
        let model = of.model().unwrap();
        let (inputs, step_s, values) = case(of);
        let free = ModelSpace::new(&model, 1);
        let mut problem = problem(&model, (&inputs, step_s), free, IntegrationMethod::RungeKutta, 1);
        let states = motorfit_model::step::open_states(&model).len();
        let mut recording = problem.recording(0).clone();
        // Residuals of the size of the signals; one output that was not measured, and samples that do not count.
        let simulated = problem.simulate(&values, 0, &vec![0.0; states]).outputs;
        let noisy = |n: usize, value: &f64| value * (1.0 + 0.3 * (n as f64 * 0.7).sin()) + 1e-3;
        let measured = |signal: &Vec<f64>| signal.iter().enumerate().map(|(n, value)| noisy(n, value)).collect();
        recording.measured = simulated.iter().map(|signal| Some(measured(signal))).collect();
        for is_masked in [false, true] {
            if is_masked {
                let counting = |of: usize| (0..recording.len()).map(|n| !(20 + of..60).contains(&n)).collect();
                recording.counting = (0..recording.measured.len()).map(counting).collect();
                recording.measured[0] = None;
            }
            let settings = problem.settings();
            let settings = ModelSettings { method: Some((IntegrationMethod::RungeKutta, 1)), ..settings };
            let Ok(own) = ModelProblem::new(&model, ModelSpace::new(&model, 1), vec![recording.clone()], settings)
            else {
                // The only output was left out.
                continue;
            };
            problem = own;
            let open = vec![0.02; states];
            let candidates: Vec<Vec<f64>> =
                (0..9).map(|n| values.iter().map(|value| value * (1.0 + 0.01 * f64::from(n))).collect()).collect();
            let slope = |value: &f64| value.abs().max(1e-3);
            for directions in [1, values.len(), values.len() + states] {
                let unknowns = |values: &[f64]| -> Vec<Unknown> {
                    let own = values.iter().map(slope).enumerate().map(|(n, rate)| Unknown::Parameter(n, rate));
                    own.chain((0..states).map(Unknown::Initial)).take(directions).collect()
                };
                let all: Vec<Vec<Unknown>> = candidates.iter().map(|values| unknowns(values)).collect();
                let point = |(values, unknowns)| Point { values, open: &open, unknowns };
                let points: Vec<Point<'_>> =
                    candidates.iter().zip(&all).map(|(values, unknowns)| point((&values[..], &unknowns[..]))).collect();
                for count in [1, 2, 5, 9] {
                    for (own, point) in problem.normal_sums(0, &points[..count]).iter().zip(&points) {
                        assert_same(own, &problem.sums_of_trajectory(0, *point), of.name());
                    }
                }
            }
        }
    }
}

#[test]
fn sums_do_not_depend_on_the_candidates_beside_them() {
    // Descents are distributed over the threads, and results must not depend on their number.
    let methods = [IntegrationMethod::RungeKutta, IntegrationMethod::Exponential];
    for (of, method) in BuiltIn::ALL.into_iter().flat_map(|of| methods.map(|method| (of, method))) {
        let model = of.model().unwrap();
        let (inputs, step_s, values) = case(of);
        let problem = problem(&model, (&inputs, step_s), ModelSpace::new(&model, 1), method, 1);
        let open = vec![0.02; motorfit_model::step::open_states(&model).len()];
        // Candidates so far apart that a number of squarings taken from all of them would differ.
        let candidates: Vec<Vec<f64>> =
            (0..9).map(|n| values.iter().map(|value| value * 3.0_f64.powi(n % 5 - 2)).collect()).collect();
        let unknowns: Vec<Unknown> = (0..values.len()).map(|n| Unknown::Parameter(n, values[n].abs())).collect();
        let points: Vec<Point<'_>> =
            candidates.iter().map(|values| Point { values, open: &open, unknowns: &unknowns }).collect();
        let bits = |sums: &[OutputSums]| -> Vec<u64> {
            let all = |of: &OutputSums| [vec![of.squares], of.products.clone(), of.gradient.clone()].concat();
            sums.iter().flat_map(all).map(|sum| if sum.is_nan() { 0 } else { sum.to_bits() }).collect()
        };
        let is_finite =
            |point: &Point<'_>| problem.normal_sums(0, &[*point])[0].iter().all(|of| of.squares.is_finite());
        assert!(points.iter().filter(|point| is_finite(point)).count() >= 5, "{} {method:?}", of.name());
        let alone: Vec<Vec<u64>> = points.iter().map(|point| bits(&problem.normal_sums(0, &[*point])[0])).collect();
        for count in [2, 3, 5, 9] {
            for (n, sums) in problem.normal_sums(0, &points[..count]).iter().enumerate() {
                assert_eq!(bits(sums), alone[n], "{} {method:?}: {n} of {count}", of.name());
            }
        }
    }
}

/// Asserts that sums are equal up to rounding: a bounce of the backlash amplifies that of other lanes' order of operations.
fn assert_same(own: &[OutputSums], expected: &[OutputSums], name: &str) {
    assert_eq!(own.len(), expected.len());
    for (own, expected) in own.iter().zip(expected) {
        let size = expected.gradient.len();
        assert!((own.squares / expected.squares - 1.0).abs() < 1e-6, "{name}: {} {}", own.squares, expected.squares);
        for a in 0..size {
            let scale = |b: usize| (expected.products[a * size + a] * expected.products[b * size + b]).sqrt();
            let bound = 1e-6 * (expected.products[a * size + a] * expected.squares).sqrt();
            assert!((own.gradient[a] - expected.gradient[a]).abs() <= bound, "{name} gradient {a}");
            for b in 0..size {
                let error = own.products[a * size + b] - expected.products[a * size + b];
                assert!(error.abs() <= 1e-6 * scale(b), "{name} product {a} {b}: {error:e}");
            }
        }
    }
}
