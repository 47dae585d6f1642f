//! Accuracy of the tables against the scalar oracle.

use super::block::UNSERVED;
use super::bounded::Bounded;
use super::evaluator::SAFETY;
use super::series::{Recorded, Series};
use super::shared::tables;
use super::tables::Tables;
use crate::cpu::Level;
use crate::criterion::{Criterion, Norm};
use crate::problem::{Model, Problem};
use motorfit_motor::{Discretization, Parameters, SimulationInput, Space, simulate};
use motorfit_record::{Record, Samples};
use rand::{RngExt as _, SeedableRng as _};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::sync::Arc;

const STEP_S: f64 = 1e-3;
const SAMPLES: usize = 1501;

/// Returns voltages: a step, a binary sequence, a slow sine, and a ramp after a rest.
fn voltages() -> Vec<Vec<f64>> {
    let mut numbers = Xoshiro256PlusPlus::seed_from_u64(1);
    let mut level = 10.0;
    let mut binary = |n: usize| {
        if n.is_multiple_of(7) && numbers.random::<bool>() {
            level = -level;
        }
        level
    };
    vec![
        vec![10.5; SAMPLES],
        (0..SAMPLES).map(&mut binary).collect(),
        (0..SAMPLES).map(|n| 8.0 * (0.02 * n as f64).sin()).collect(),
        (0..SAMPLES).map(|n| 0.01 * n.saturating_sub(100) as f64).collect(),
    ]
}

fn response(p: &Parameters, voltage: &[f64], initial: [f64; 2], hold: Discretization) -> [Vec<f64>; 2] {
    let input = SimulationInput { step_s: &[STEP_S], step_index: &[], voltage, voltage_end: &[], torque: &[] };
    simulate(p, &input, initial, hold)
}

/// Returns motors around one at several distances, over the box of Table 2, and over four decades.
fn motors(truth: [f64; 5], count: usize) -> Vec<[f64; 5]> {
    let mut numbers = Xoshiro256PlusPlus::seed_from_u64(2);
    let bounds = [[0.1, 1.0], [1e-3, 0.1], [5e-3, 0.1], [1e-5, 1e-3], [1e-5, 1e-3]];
    let one = |n: usize, p: usize, random: f64| match n % 5 {
        0 => truth[p] * (1.0 + 0.001 * (random - 0.5)),
        1 => truth[p] * (1.0 + 0.4 * (random - 0.5)),
        2 | 3 => bounds[p][0] + (bounds[p][1] - bounds[p][0]) * random,
        _ => truth[p] * 10f64.powf(4.0 * (random - 0.5)),
    };
    (0..count).map(|n| std::array::from_fn(|p| one(n, p, numbers.random::<f64>()))).collect()
}

/// Returns the sums of squared errors of the scalar simulation.
fn oracle(motor: &[f64; 5], recorded: &Recorded<'_>, hold: Discretization) -> [f64; 2] {
    let simulated = response(&Parameters::from_array(*motor), recorded.voltage, recorded.initial, hold);
    [0, 1].map(|c| recorded.measured.iter().zip(&simulated[c]).map(|(y, x)| (y[c] - x).powi(2)).sum())
}

/// Computes the sums of motors by tables.
fn sums_of(tables: &Tables, motors: &[[f64; 5]], sums: &mut [[Bounded; 2]]) {
    let rows = |first: usize, rows: &mut [[f64; 5]]| rows.copy_from_slice(&motors[first..first + rows.len()]);
    tables.sums(rows, |sums, own| *sums = own, sums);
}

/// Compares the sums with the oracle at every level; returns the number of channels that are accurate enough.
fn compared(motors: &[[f64; 5]], recorded: &Recorded<'_>, hold: Discretization) -> usize {
    let expected: Vec<[f64; 2]> = motors.iter().map(|motor| oracle(motor, recorded, hold)).collect();
    let size = [0, 1].map(|c| recorded.measured.iter().map(|y| y[c] * y[c]).sum::<f64>());
    let mut served = 0;
    for level in Level::available() {
        let tables = Tables::new(Series::new(recorded), level);
        let mut sums = vec![UNSERVED; motors.len()];
        sums_of(&tables, motors, &mut sums);
        served = 0;
        for ((motor, sums), expected) in motors.iter().zip(&sums).zip(&expected) {
            for c in 0..2 {
                let own = sums[c];
                served += usize::from(SAFETY * own.error <= 1e-9 * expected[c]);
                // The oracle's own errors: of its map, and of its sums, which are not compensated.
                let bound = SAFETY * own.error + 1e-12 * expected[c] + 1e-15 * size[c];
                assert!(
                    own.error.is_infinite() || (own.value - expected[c]).abs() <= bound,
                    "{hold:?} from {:?}, {}: channel {c} of {motor:?}: {own:?} for {}",
                    recorded.initial,
                    level.name(),
                    expected[c]
                );
            }
        }
    }
    served
}

#[test]
fn sums_are_within_their_bounds_of_the_oracle() {
    let m2 = Parameters::M2.to_array();
    // A step of a hundred electrical time constants.
    let stiff = [m2[0], m2[1] / 1000.0, m2[2], m2[3], m2[4]];
    let mut numbers = Xoshiro256PlusPlus::seed_from_u64(3);
    for truth in [m2, stiff] {
        let motors = motors(truth, 500);
        let truth = Parameters::from_array(truth);
        for (n, voltage) in voltages().iter().enumerate() {
            for (initial, hold) in [
                ([0.0; 2], Discretization::Zoh),
                ([2.0, 30.0], Discretization::Zoh),
                ([0.0; 2], Discretization::Foh),
                ([-1.0, 5.0], Discretization::Foh),
            ] {
                let [current, speed] = response(&truth, voltage, initial, hold);
                let mut noise = |sigma: f64| sigma * (numbers.random::<f64>() - 0.5);
                let measured: Vec<[f64; 2]> =
                    current.iter().zip(&speed).map(|(i, w)| [i + noise(0.2), w + noise(2.0)]).collect();
                let is_first_order_hold = hold == Discretization::Foh;
                let recorded = Recorded { step_s: STEP_S, voltage, measured: &measured, initial, is_first_order_hold };
                let served = compared(&motors, &recorded, hold);
                // All but the fifth of the motors that is within 0.05 % of the truth, where the noise is below 50 dB.
                assert!(served >= 800, "voltage {n}, {hold:?}, {initial:?}: {served} of 1000 served");
            }
        }
    }
}

#[test]
fn sums_of_motors_with_equal_poles_are_accurate() {
    // K² = L J (R/L − B/J)²/4 gives a double pole; others differ by a relative 1e-12 to 1e-1.
    let voltage = &voltages()[1];
    let measured: Vec<[f64; 2]> = (0..SAMPLES).map(|n| [(0.01 * n as f64).sin(), (0.02 * n as f64).cos()]).collect();
    let recorded =
        Recorded { step_s: STEP_S, voltage, measured: &measured, initial: [0.0; 2], is_first_order_hold: false };
    let [r, l, _, b, j] = Parameters::M2.to_array();
    let k = (l * j).sqrt() * (r / l - b / j).abs() / 2.0;
    let motors: Vec<[f64; 5]> = (0..60)
        .map(|n| {
            let apart = 10f64.powf(-12.0 + 0.2 * f64::from(n));
            [r, l, k * (1.0 + if n % 2 == 0 { apart } else { -apart }), b, j]
        })
        .collect();
    let tables = Tables::new(Series::new(&recorded), Level::best());
    let mut sums = vec![UNSERVED; motors.len()];
    sums_of(&tables, &motors, &mut sums);
    for (motor, sums) in motors.iter().zip(&sums) {
        for (own, expected) in sums.iter().zip(oracle(motor, &recorded, Discretization::Zoh)) {
            assert!(own.error < 1e-9 * expected, "{motor:?}: {own:?}");
            assert!((own.value / expected - 1.0).abs() < 1e-10, "{motor:?}: {own:?} for {expected}");
        }
    }
}

#[test]
fn a_corrupted_table_has_wrong_sums() {
    let voltage = &voltages()[1];
    let [current, speed] = response(&Parameters::M2, voltage, [0.0; 2], Discretization::Zoh);
    let measured: Vec<[f64; 2]> = current.iter().zip(&speed).map(|(i, w)| [*i + 0.1, *w + 1.0]).collect();
    let recorded =
        Recorded { step_s: STEP_S, voltage, measured: &measured, initial: [0.0; 2], is_first_order_hold: false };
    let motors = motors(Parameters::M2.to_array(), 100);
    let tables = Tables::new(Series::new(&recorded), Level::best());
    let mut sums = vec![UNSERVED; motors.len()];
    let mut wrong = || {
        sums_of(&tables, &motors, &mut sums);
        let is_wrong = |(motor, sums): &(&[f64; 5], &[Bounded; 2])| {
            let expected = oracle(motor, &recorded, Discretization::Zoh);
            (0..2).any(|c| (sums[c].value - expected[c]).abs() > 1e-8 * expected[c])
        };
        motors.iter().zip(&sums).filter(is_wrong).count()
    };
    assert_eq!(wrong(), 0);
    tables.corrupt(1e-6);
    assert!(wrong() > 50);
}

#[test]
fn recordings_with_the_same_samples_share_tables() {
    let record = |shift: f64| {
        let all = |f: &dyn Fn(f64) -> f64| Some((0..100).map(|n| f(f64::from(n))).collect::<Vec<f64>>());
        let samples = Samples {
            time_s: all(&|n| 0.001 * n).unwrap_or_default(),
            voltage: vec![5.0; 100],
            current: all(&|n| (0.1 * n + shift).sin()),
            speed: all(&|n| (0.2 * n).cos()),
            ..Samples::default()
        };
        Record::new(samples).unwrap()
    };
    let problem = |shift: f64, discretization, norm| {
        let (model, criterion) =
            (Model { discretization, ..Model::default() }, Criterion { norm, ..Criterion::default() });
        Problem::new(&[record(shift)], model, Space::table2(), criterion).unwrap()
    };
    let of = |problem: &Problem, level| tables(problem, &problem.signals()[0], level);
    let first = problem(0.0, Discretization::Zoh, Norm::Nrmse);
    let same = [first.clone(), problem(0.0, Discretization::Zoh, Norm::Ise)];
    let others = [problem(1e-9, Discretization::Zoh, Norm::Nrmse), problem(0.0, Discretization::Foh, Norm::Nrmse)];
    let level = Level::Portable;
    let own = of(&first, level);
    assert!(same.iter().all(|problem| Arc::ptr_eq(&own, &of(problem, level))));
    assert!(others.iter().all(|problem| !Arc::ptr_eq(&own, &of(problem, level))));
    // They stay when the problem is gone.
    drop((first, same));
    assert!(Arc::ptr_eq(&own, &of(&problem(0.0, Discretization::Zoh, Norm::Nrmse), level)));
}
