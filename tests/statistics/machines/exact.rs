//! The integrator against closed forms: friction, play, delays, and halved steps.

use crate::machines::dc_extended::DcExtended;
use crate::machines::draw::{CHANGE, Machine, Numbers};
use crate::machines::integrator::{Inputs, State, simulated};
use crate::machines::servo::Servo;
use crate::machines::two_mass::TwoMass;
use crate::machines::{dc_extended, pmsm, servo, thermal, two_mass};
use motorfit::model::BuiltIn;
use motorfit::numeric::count;
use nalgebra::{Matrix3, Vector3};

const PERIOD_S: f64 = 1e-3;

/// A motor without friction, brushes and limits of the drive.
const LINEAR: DcExtended = DcExtended {
    resistance: 0.4,
    inductance: 2e-3,
    constant: 0.03,
    friction: 1e-4,
    inertia: 1e-4,
    coulomb: 0.0,
    load: 0.0,
    dead_time_s: 0.0,
    offset: 0.0,
    brush_drop: 0.0,
    deadband: 0.0,
    saturation: 48.0,
    negative_gain: 1.0,
};

fn largest_difference(signal: &[f64], expected: impl Fn(f64) -> f64) -> f64 {
    signal.iter().enumerate().map(|(n, value)| (value - expected(count(n) * PERIOD_S)).abs()).fold(0.0, f64::max)
}

#[test]
fn halved_steps_change_no_trajectory() {
    type Draw = fn(&mut Numbers) -> Machine;
    let all: [(BuiltIn, Draw); 5] = [
        (BuiltIn::Pmsm, pmsm::draw),
        (BuiltIn::DcThermal, thermal::draw),
        (BuiltIn::ServoPendulum, servo::draw),
        (BuiltIn::TwoMass, two_mass::draw),
        (BuiltIn::DcExtended, dc_extended::draw),
    ];
    for (of, draw) in all {
        for number in 0..3 {
            let machine = draw(&mut Numbers::new(of.name(), number));
            let clean = machine.simulated();
            println!("{} {number}: {} substeps, change {:.1e}", of.name(), clean.substeps, clean.change);
            assert!(clean.change < CHANGE, "{} {number}: {}", of.name(), clean.change);
            // A last halving by chance alone: four times as many substeps stay as near.
            let fine = simulated(
                &*machine.system,
                &machine.initial,
                &machine.inputs,
                (machine.period_s, 4.0 * clean.substeps),
            );
            for ((fine, signal), sigma) in fine.iter().zip(&clean.outputs).zip(&clean.sigma) {
                let squares: f64 = fine.iter().zip(signal).map(|(a, b)| (a - b).powi(2)).sum();
                let change = (squares / count(fine.len())).sqrt() / sigma;
                assert!(change < CHANGE, "{} {number}: {change}", of.name());
            }
        }
    }
}

#[test]
fn friction_stops_a_motor_at_the_exact_time_and_holds_it() {
    // Without back-EMF and viscous friction the speed falls on a line.
    let motor = DcExtended { constant: 0.0, friction: 0.0, coulomb: 0.02, load: 0.013, ..LINEAR };
    let initial: State = [0.0, 50.0, 0.0, 0.0];
    let speed = |of: &DcExtended| simulated(of, &initial, &[[0.0; 3]; 400], (PERIOD_S, 1.0)).remove(1);
    let slope = (0.02 + 0.013) / 1e-4;
    // Rounding of 151 steps, and 1e-13 of a step at the stop.
    assert!(largest_difference(&speed(&motor), |t| (50.0 - slope * t).max(0.0)) < 1e-11);
    // A load above Coulomb friction starts it again, in the other direction.
    let motor = DcExtended { load: 0.033, ..motor };
    let (stop_s, slope) = (50.0 * 1e-4 / 0.053, (0.033 - 0.02) / 1e-4);
    let expected = |t: f64| if t < stop_s { 50.0 - 0.053 / 1e-4 * t } else { -slope * (t - stop_s) };
    assert!(largest_difference(&speed(&motor), expected) < 1e-11);
}

#[test]
fn a_pendulum_stays_below_the_breakaway_and_falls_above_it() {
    let servo = |weight: f64| Servo {
        weight,
        inertia: 0.01,
        friction: 0.0,
        coulomb: 0.05,
        stribeck: 0.03,
        stribeck_speed: 0.2,
        constant: 0.0,
        resistance: 1.0,
        proportional: 1.0,
        derivative: 0.0,
    };
    let initial: State = [0.5, 0.0, 0.0, 0.0];
    let angle = |weight: f64| simulated(&servo(weight), &initial, &[[0.0; 3]; 3000], (PERIOD_S, 4.0)).remove(0);
    // Friction at rest is 0.08 N m, that in motion falls to 0.05 N m.
    let at_rest = 0.08 / 0.5_f64.sin();
    assert!(largest_difference(&angle(0.999 * at_rest), |_| 0.5) <= 0.0);
    assert!(angle(1.001 * at_rest)[499] < 0.5);
    // It falls until the weight is below the friction at rest, and stays there.
    let weight = 1.2 * at_rest;
    let angles = angle(weight);
    let end = angles[2999];
    assert!(end < 0.3 && (weight * end.sin()).abs() <= 0.08, "{end}");
    assert!(angles[2000..].iter().all(|angle| (angle - end).abs() <= 0.0));
}

#[test]
fn masses_with_play_collide_elastically() {
    let masses = TwoMass {
        motor: 0.001,
        load: 0.003,
        motor_friction: 0.0,
        load_friction: 0.0,
        stiffness: 30.0,
        damping: 0.0,
        gap: 0.02,
    };
    let speeds = simulated(&masses, &[0.0, 1.0, 0.0, 0.0], &[[0.0; 3]; 100], (PERIOD_S, 16.0));
    // The contact begins at 20 ms and lasts half a period of the shaft; between and after are constant speeds.
    let frequency = (30.0_f64 * (1.0 / 0.001 + 1.0 / 0.003)).sqrt();
    let relative = |t: f64| {
        let phase = frequency * (t - 0.02);
        if phase < 0.0 { 1.0 } else { phase.min(std::f64::consts::PI).cos() }
    };
    let until_the_other_side = 0.02 + std::f64::consts::PI / frequency + 0.04;
    let samples = motorfit::numeric::whole(until_the_other_side / PERIOD_S);
    assert!(samples > 70, "{samples}");
    // The common speed is 1/4. A Runge–Kutta step of 1/320 of a period has a relative error of 1e-9.
    let error = largest_difference(&speeds[0][..samples], |t| 0.25 + 0.75 * relative(t));
    assert!(error < 1e-7, "{error:e}");
    let error = largest_difference(&speeds[1][..samples], |t| 0.25 - 0.25 * relative(t));
    assert!(error < 1e-7, "{error:e}");
}

#[test]
fn a_shaft_whose_damping_would_pull_transmits_no_torque() {
    // In contact, moving apart: only the spring pushes the masses, until the damping is larger.
    let masses = TwoMass {
        motor: 0.001,
        load: 0.003,
        motor_friction: 0.0,
        load_friction: 0.0,
        stiffness: 1.0,
        damping: 1.0,
        gap: 0.02,
    };
    let speeds = simulated(&masses, &[0.021, 0.0, 0.0, 1.0], &[[0.0; 3]; 20], (PERIOD_S, 4.0));
    assert!(largest_difference(&speeds[0], |_| 0.0) <= 0.0 && largest_difference(&speeds[1], |_| 1.0) <= 0.0);
}

/// Returns the state of the linear motor after a duration with a constant voltage, by the matrix exponential.
fn exact(of: &DcExtended, x: &Vector3<f64>, volts: f64, duration: f64) -> Vector3<f64> {
    let rates = Matrix3::new(
        -of.resistance / of.inductance,
        -of.constant / of.inductance,
        1.0 / of.inductance,
        of.constant / of.inertia,
        -of.friction / of.inertia,
        0.0,
        0.0,
        0.0,
        0.0,
    );
    // Within a sampling period no entry is above 0.5: 20 terms of the series are exact but for rounding.
    let terms = (1..=20).scan(Vector3::new(x[0], x[1], volts), |term, n| {
        *term = rates * *term * (duration / count(n));
        Some(*term)
    });
    terms.fold(Vector3::new(x[0], x[1], volts), |sum, term| sum + term)
}

#[test]
fn a_linear_motor_with_a_dead_time_follows_the_matrix_exponential() {
    let volts = |n: usize| if (n / 40).is_multiple_of(2) { 0.0 } else { 6.0 + count(n / 80) };
    let inputs: Vec<Inputs> = (0..400).map(|n| [volts(n), 0.0, 0.0]).collect();
    for (periods, shift, part) in [(0.0, 0, 0.0), (3.0, 3, 0.0), (2.3, 2, 0.3)] {
        let motor = DcExtended { dead_time_s: periods * PERIOD_S, ..LINEAR };
        let found = simulated(&motor, &[0.0; 4], &inputs, (PERIOD_S, 16.0));
        let mut x = Vector3::<f64>::zeros();
        for (n, (current, speed)) in found[0].iter().zip(&found[1]).enumerate() {
            // A step of 1/80 of the electrical time constant has a relative error of 1e-11; currents are up to 15 A, speeds 200 rad/s.
            let error = (x[0] - current).abs().max((x[1] - speed).abs());
            assert!(error < 1e-7, "dead time of {periods} periods, sample {n}: {error:e}");
            let [before, after] = [shift + 1, shift].map(|by| if n < by { 0.0 } else { volts(n - by) });
            x = exact(&motor, &exact(&motor, &x, before, part * PERIOD_S), after, (1.0 - part) * PERIOD_S);
        }
    }
}
