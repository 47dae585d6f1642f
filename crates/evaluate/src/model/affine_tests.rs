//! The kernel of affine models against the interpreter.

#![allow(clippy::unwrap_used, reason = "a test may stop")]

use super::*;
use crate::Level;
use crate::affine::AffineJob;
use crate::interpreter::{Job, RunProgram as _, Work};
use motorfit_core::numeric::count;
use motorfit_model::{IntegrationMethod, Model};
use rand::{RngExt as _, SeedableRng as _};
use rand_xoshiro::Xoshiro256PlusPlus;

const SAMPLES: usize = 300;

/// Returns a chain of states that are driven at the first one. The last state is the first output, and the first states are the others.
/// With friction the last state sticks, and the first one too if it is an output: reactions act in the order of the states.
fn chain(states: usize, outputs: usize, has_friction: bool) -> Model {
    let mut text = "format = 1\nname = \"chain\"\n[inputs]\nu = { unit = \"V\" }\nv = { unit = \"V\" }\n[parameters]\n\
        a = { unit = \"1/s\", min = 1, max = 30 }\nb = { unit = \"1/s\", min = 5, max = 60 }\n\
        c = { unit = \"V/s\", min = -3, max = 3 }\nf = { unit = \"V/s\", min = 1, max = 40 }\n[states]\n"
        .to_owned();
    for n in 1..=states {
        let before = if n == 1 { "(u - 0.3*v)".to_owned() } else { format!("x{}", n - 1) };
        let after = if n < states { format!(" + 0.2*b*x{}", n + 1) } else { " + c".to_owned() };
        let sticks = has_friction && (n == states || (n == 1 && outputs == 2));
        let stick = if sticks { format!(" - stick(x{n}, f)") } else { String::new() };
        text += &format!("x{n} = {{ unit = \"V\", d = \"b*{before} - a*x{n}{after}{stick}\", initial = 0 }}\n");
    }
    text += "[outputs]\n";
    for n in 0..outputs {
        let state = if n == 0 { states } else { n };
        text += &format!("y{n} = {{ value = \"x{state}\", unit = \"V\" }}\n");
    }
    if !has_friction {
        // A parameter must reach an output.
        text = text.lines().filter(|line| !line.starts_with("f =")).collect::<Vec<_>>().join("\n");
    }
    Model::parse(&text).unwrap()
}

/// Returns a recording with constant and changing inputs; with a mask, one sample in seven of the first output does not count, and one in
/// five of the second.
fn recording(model: &Model, has_mask: bool) -> ModelRecording {
    let mut numbers = Xoshiro256PlusPlus::seed_from_u64(3);
    let mut signal = |n: usize| if n % 100 < 60 { [6.0, -4.0][n / 30 % 2] } else { numbers.random_range(-6.0..6.0) };
    let time_s: Vec<f64> = (0..SAMPLES).map(|n| 1e-2 * count(n)).collect();
    ModelRecording {
        step_s: vec![1e-2],
        inputs: (0..2).map(|_| (0..SAMPLES).map(&mut signal).collect()).collect(),
        measured: model.outputs().iter().map(|_| Some(time_s.clone())).collect(),
        counting: match has_mask {
            true => (0..model.outputs().len())
                .map(|of| (0..SAMPLES).map(|n| n % (7 - 2 * (of % 2)) != 2).collect())
                .collect(),
            false => Vec::new(),
        },
        effective_sample_ratio: 1.0,
        name: None,
        assumed: None,
        time_s,
    }
}

/// Compares the sums of 64 candidates at every level with those of the interpreter.
fn compare(model: &Model, settings: ModelSettings, has_mask: bool) {
    let space = ModelSpace::new(model, 1);
    let problem = ModelProblem::new(model, space, vec![recording(model, has_mask)], settings).unwrap();
    let mut numbers = Xoshiro256PlusPlus::seed_from_u64(5);
    let mut candidate = || problem.space.free.iter().map(|axis| axis.at(numbers.random::<f64>())).collect::<Vec<f64>>();
    let candidates: Vec<Vec<f64>> = (0..64).map(|_| candidate()).collect();
    let rows: Vec<&[f64]> = candidates.iter().map(Vec::as_slice).collect();
    let (programs, prepared) = (&problem.programs[0], &problem.recordings[0]);
    let mut work = Work::<8>::default();
    problem.load(&mut work, programs, (&rows, 0));
    work.run(&Job { program: &programs.program, rows: &prepared.rows, loss: prepared.loss });
    let expected = work.outputs.clone();
    let (program, rows) = (programs.affine.as_ref().unwrap(), prepared.affine_rows.as_ref().unwrap());
    for level in Level::available() {
        AffineJob { program, rows }.run_at(&mut work, level);
        for (own, expected) in work.outputs.iter().zip(&expected) {
            for lane in 0..64 {
                // Sums of 300 squares; the kernel rounds 1 + D once and multiplies gains in another order.
                let (own, expected) = (own.lane(lane), expected.lane(lane));
                let name = model.states().len();
                assert!((own / expected - 1.0).abs() < 1e-10, "{name} states, {level:?}: {own} {expected}");
            }
        }
    }
}

#[test]
fn the_kernel_of_affine_models_computes_what_the_interpreter_does() {
    for has_friction in [false, true] {
        for states in 1..=2 {
            for outputs in 1..=states {
                let model = chain(states, outputs, has_friction);
                for is_first_order_hold in [false, true] {
                    for substeps in [1, 3] {
                        let method = Some((IntegrationMethod::Exponential, substeps));
                        let settings = ModelSettings { method, is_first_order_hold, ..ModelSettings::default() };
                        compare(&model, settings, states % 2 == 0);
                        compare(&model, settings, states % 2 == 1);
                    }
                }
            }
        }
    }
}

#[test]
fn equations_that_do_not_suit_the_kernel_run_as_programs() {
    let text = chain(2, 1, false).text().to_owned();
    let third = chain(3, 1, false).text().to_owned();
    let replaced = [
        ("value = \"x2\"", "value = \"2*x2\""),
        ("a*x2", "a*x2*abs(x2)*1e-3/1e-3"),
        ("value = \"x2\"", "value = \"x2\", average = \"0.1/a\""),
    ];
    let others = replaced.map(|(of, to)| (text.replace(of, to), to));
    for (changed, to) in others.into_iter().chain([(third, "a third state")]) {
        assert_ne!(changed, text);
        let Ok(model) = Model::parse(&changed) else { continue };
        let settings = ModelSettings { method: Some((IntegrationMethod::Exponential, 1)), ..ModelSettings::default() };
        let problem = ModelProblem::new(&model, ModelSpace::new(&model, 1), vec![recording(&model, false)], settings);
        assert!(problem.unwrap().programs[0].affine.is_none(), "{to}");
    }
}
