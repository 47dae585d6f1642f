//! Proves: mechanisms are identified from logs as robots write them: control loops that jitter or are late, velocities that are delayed
//! or filtered by a motor controller, voltages that are logged after they act, weights that rest on a stop, tests in which nothing moves;
//! duty cycles and velocities without a unit cost the trust.
//! Does not prove: logs of real robots, of which none is in the project.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may stop and print")]

use crate::support::wpilog::{Log, Mechanism, Routine, Rows, TESTS, simulated, volts, write};
use motorfit::identify::TrustLevel;
use motorfit::identify::mechanism::{
    MechanismFit, MechanismKind, MechanismSpec, identify_mechanism, mechanism_signals,
};
use motorfit::record::{ReadOptions, Record, read_bytes};
use rand::SeedableRng as _;
use rand_distr::{Distribution as _, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::ops::ControlFlow;

const LIFT: Mechanism = Mechanism { ks: 0.18, kv: 3.9, ka: 0.21, kg: 0.62, offset: None, noise: 0.01 };
const WHEEL: Mechanism = Mechanism { ks: 0.25, kv: 2.1, ka: 0.32, kg: 0.0, offset: None, noise: 0.02 };

fn rows(of: &Mechanism, test: &str, seed: u64) -> Rows {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    simulated(of, 0.0, &volts(test), 0.02, &mut || StandardNormal.sample(&mut random))
}

fn records(rows: &dyn Fn(&str) -> Rows) -> Vec<Record> {
    let mut log = Log::new();
    write(&mut log, &Routine::default(), rows, 1_000_000);
    read_bytes(&log.bytes, None, &ReadOptions { signals: mechanism_signals(false), ..ReadOptions::default() }).unwrap()
}

fn fit(records: &[Record]) -> MechanismFit {
    identify_mechanism(records, &MechanismSpec::default(), &mut |_| ControlFlow::Continue(())).unwrap()
}

/// Asserts that estimates are within four standard errors of the truth.
fn is_near(fit: &MechanismFit, truths: &[(&str, f64)], context: &str) {
    for (name, truth) in truths {
        let estimate = fit.estimate(name).unwrap();
        let (value, error) = (estimate.value.unwrap(), estimate.std_error.unwrap());
        assert!((value - truth).abs() < 4.0 * error, "{context}: {name} {value} ± {error}, expected {truth}");
    }
}

const OF_WHEEL: [(&str, f64); 3] = [("kS", 0.25), ("kV", 2.1), ("kA", 0.32)];

/// Returns rows whose position and velocity are those of some rows before; before a test the mechanism rests.
fn delayed(rows: Rows, by: usize) -> Rows {
    let rest = [0.0, 0.0, rows[0][2], 0.0];
    let at = |n: usize| n.checked_sub(by).map_or(rest, |n| rows[n]);
    (0..rows.len()).map(|n| [rows[n][0], rows[n][1], at(n)[2], at(n)[3]]).collect()
}

#[test]
fn a_delay_is_estimated_although_a_test_begins_with_its_step() {
    for by in [1, 2, 4] {
        let found = fit(&records(&|test| delayed(rows(&WHEEL, test, 3), by)));
        let delay = 0.02 * by as f64;
        is_near(&found, &[&OF_WHEEL[..], &[("td", delay)]].concat(), &format!("a delay of {delay} s"));
        assert_eq!(found.found.trust.level, TrustLevel::Good, "{:?}", found.found.trust.reasons);
    }
}

#[test]
fn a_voltage_that_is_logged_late_is_taken_earlier() {
    let late = |test: &str| {
        let rows = rows(&WHEEL, test, 5);
        let before = |n: usize| n.checked_sub(1).map_or(0.0, |n| rows[n][1]);
        (0..rows.len()).map(|n| [rows[n][0], before(n), rows[n][2], rows[n][3]]).collect()
    };
    let found = fit(&records(&late));
    is_near(&found, &OF_WHEEL, "a late voltage");
    let delay = found.estimate("td").unwrap();
    assert!((delay.value.unwrap() + 0.02).abs() < 4.0 * delay.std_error.unwrap(), "{delay:?}");
    assert!(found.found.warnings.iter().any(|warning| warning.code == "late_voltage"));
}

#[test]
fn a_loop_that_jitters_or_is_late_costs_neither_trust_nor_time() {
    for (name, is_late) in [("jitter", false), ("late periods", true)] {
        let mut log = Log::new();
        let mut random = Xoshiro256PlusPlus::seed_from_u64(11);
        let entries = [
            ("sysid-test-state-wheel", "string", ""),
            ("voltage-m-wheel", "double", "Volt"),
            ("position-m-wheel", "double", "Radian"),
            ("velocity-m-wheel", "double", "Radian per Second"),
        ];
        let [state, voltage, position, velocity] =
            entries.map(|(name, kind, metadata)| log.start(name, kind, metadata));
        let mut now = 1_000_000;
        for test in TESTS {
            let mut random_of_test = Xoshiro256PlusPlus::seed_from_u64(now);
            // Simulated with a step of 2 ms, so that the loop can run at any multiple of it.
            let fine: Vec<f64> = volts(test).into_iter().flat_map(|volts| [volts; 10]).collect();
            let mut at = 0;
            let mut held = fine.clone();
            let mut ticks = Vec::new();
            while at < fine.len() {
                let normal: f64 = StandardNormal.sample(&mut random);
                let step = if is_late && ticks.len() % 40 == 39 {
                    30
                } else {
                    10 + i32::from(normal > 1.0) - i32::from(normal < -1.0)
                };
                let end = fine.len().min(at + usize::try_from(step).unwrap());
                held[at..end].fill(fine[at]);
                ticks.push(at);
                at = end;
            }
            let rows = simulated(&WHEEL, 0.0, &held, 0.002, &mut || StandardNormal.sample(&mut random_of_test));
            for n in &ticks {
                let at = now + 2000 * *n as u64;
                log.double(voltage, at, rows[*n][1]);
                log.double(position, at + 60, rows[*n][2]);
                log.double(velocity, at + 90, rows[*n][3]);
                log.text(state, at + 120, test);
            }
            now += 2000 * fine.len() as u64;
            log.text(state, now, "none");
            now += 1_000_000;
        }
        let options = ReadOptions { signals: mechanism_signals(false), ..ReadOptions::default() };
        let found = fit(&read_bytes(&log.bytes, None, &options).unwrap());
        is_near(&found, &OF_WHEEL, name);
        assert_eq!(found.found.trust.level, TrustLevel::Good, "{name}: {:?}", found.found.trust.reasons);
    }
}

#[test]
fn a_weight_that_rests_on_a_stop_is_no_fault() {
    let resting = |test: &str| {
        let moving = rows(&LIFT, test, 9);
        let at = moving[0][2];
        // Half a second on the stop, with less voltage than what holds the weight.
        let rest = (0..25).map(|n| [0.02 * f64::from(n), 0.02 * f64::from(n), at, 0.0]);
        let moving = moving.iter().map(|row| [row[0] + 0.5, row[1], row[2], row[3]]);
        rest.chain(moving).collect::<Rows>()
    };
    let found = fit(&records(&resting));
    assert_eq!(found.kind, MechanismKind::Elevator);
    is_near(&found, &[("kS", 0.18), ("kG", 0.62), ("kV", 3.9), ("kA", 0.21)], "a stop");
    assert_eq!(found.found.trust.level, TrustLevel::Good, "{:?}", found.found.trust.reasons);
}

#[test]
fn a_test_in_which_nothing_moves_has_no_part_in_the_fit() {
    let off = Mechanism { ks: 100.0, ..WHEEL };
    let all = records(&|test| rows(if test == TESTS[2] { &off } else { &WHEEL }, test, 13));
    let found = fit(&all);
    is_near(&found, &OF_WHEEL, "a motor that was off");
    assert_eq!((found.fitted(&all).len(), found.recordings.len()), (3, 3));
    assert_eq!(found.found.trust.level, TrustLevel::Check);
}

#[test]
fn a_duty_cycle_and_a_velocity_without_a_unit_cost_the_trust() {
    let duty =
        fit(&records(&|test| rows(&WHEEL, test, 17).into_iter().map(|[t, v, q, w]| [t, v / 12.0, q, w]).collect()));
    let mut log = Log::new();
    let routine = Routine { units: ["", ""], ..Routine::default() };
    write(&mut log, &routine, &|test| rows(&WHEEL, test, 17), 1_000_000);
    let options = ReadOptions { signals: mechanism_signals(false), ..ReadOptions::default() };
    let assumed = fit(&read_bytes(&log.bytes, None, &options).unwrap());
    for (found, code) in [(duty, "voltage_small"), (assumed, "unit_assumed")] {
        assert!(found.found.trust.reasons.iter().any(|reason| reason.code == code), "{:?}", found.found.trust.reasons);
        assert!(found.found.trust.reasons.iter().all(|reason| reason.code != "units_assumed"), "one fault, one reason");
        assert_eq!(found.found.trust.level, TrustLevel::Check);
    }
}
