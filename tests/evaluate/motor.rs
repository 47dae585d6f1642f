//! Proves: the step response of the paper's motor equals that of an independent prototype in every printed digit; step maps
//! agree with 60-digit matrix exponentials (1e-13), those of motors side by side bit by bit with those of each alone, the logarithm with
//! the exponential, sensitivities with central differences;
//! figures of a response are those of its formula.
//! Does not prove: populations, criteria or files.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may stop and print")]
#![allow(
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    clippy::cast_precision_loss,
    clippy::float_cmp,
    reason = "small numbers; exact equality is meant"
)]

use motorfit::experiment::{Excitation, simulated};
use motorfit::motor::{
    Discretization, Parameters, SimulationInput, StepMap, matrix_logarithm, response, simulate, step_maps,
};

const M2: Parameters = Parameters::M2;

/// Returns true if `value` rounds to `printed`.
fn agrees(value: f64, printed: &str) -> bool {
    let digits = printed.split_once('.').map_or(0, |(_, d)| d.len());
    format!("{value:.digits$}") == printed
}

#[test]
fn nominal_response_to_every_digit() {
    let step = Excitation::step(10.5, 1.0, 3.0, 0.001).unwrap();
    for (method, peak, settled2, settled5) in [
        (Discretization::Zoh, "7.879231", "1.115", "1.099"),
        (Discretization::Rk4, "7.879229", "1.115", "1.099"),
        (Discretization::Euler, "8.180814", "1.113", "1.099"),
    ] {
        let record = simulated(&M2, &step, method).unwrap();
        assert_eq!(record.len(), 3001);
        let (time, current) = (&record.samples().time_s, record.measured()[0].unwrap());
        let figures = response(time, current, 0.02).unwrap();
        assert!(agrees(figures.peak, peak), "{method:?}: {} is not {peak}", figures.peak);
        assert!(agrees(figures.peak_time_s, "1.015"), "{method:?}: {}", figures.peak_time_s);
        assert!(agrees(figures.settling_time_s.unwrap(), settled2), "{method:?}: {:?}", figures.settling_time_s);
        let five = response(time, current, 0.05).unwrap().settling_time_s.unwrap();
        assert!(agrees(five, settled5), "{method:?}: {five}");
    }
}

#[test]
fn steady_state_is_that_of_the_equations() {
    let [current, speed] = M2.steady_state(10.5, 0.0);
    assert!(agrees(current, "1.182047") && agrees(speed, "128.0935"), "{current} {speed}");
    let record = simulated(&M2, &Excitation::step(10.5, 1.0, 3.0, 0.001).unwrap(), Discretization::Zoh).unwrap();
    let last = record.measured().map(|m| m.unwrap()[3000]);
    // 2 s after the step the transient has decayed to e^-124, and the rounding errors of some 10^3 steps remain.
    assert!((last[0] / current - 1.0).abs() < 1e-12 && (last[1] / speed - 1.0).abs() < 1e-12);
    let loaded = M2.steady_state(10.5, 0.05);
    assert!((M2.r * loaded[0] + M2.k * loaded[1] - 10.5).abs() < 1e-12);
    assert!((M2.k * loaded[0] - M2.b * loaded[1] - 0.05).abs() < 1e-15);
}

/// Returns a step map in energy coordinates, with states weighted by √L and √J.
fn weighted(map: &StepMap, p: &Parameters) -> [[f64; 3]; 4] {
    let s = [p.l.sqrt(), p.j.sqrt()];
    let gain = |g: [f64; 2]| [s[0] * g[0], s[1] * g[1]];
    let (start, end, torque) = (gain(map.taps[0]), gain(map.taps[1]), gain(map.torque));
    [
        [map.d[0], map.d[1] * s[0] / s[1], 0.0],
        [map.d[2] * s[1] / s[0], map.d[3], 0.0],
        [start[0] + end[0], start[1] + end[1], end[0] + end[1]],
        [torque[0], torque[1], 0.0],
    ]
}

#[test]
fn step_maps_agree_with_sixty_digit_exponentials() {
    let golden = include_str!("../golden/step_maps.csv");
    let (mut rows, mut worst) = (0, 0.0_f64);
    for line in golden.lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        let number = |n: usize| cells[n].parse::<f64>().unwrap();
        let method = match cells[0] {
            "zoh" => Discretization::Zoh,
            "foh" => Discretization::Foh,
            "rk4" => Discretization::Rk4,
            _ => Discretization::Euler,
        };
        let p = Parameters::from_array([number(2), number(3), number(4), number(5), number(6)]);
        let golden = StepMap {
            d: [number(7), number(8), number(9), number(10)],
            taps: [[number(11), number(12)], [number(13), number(14)]],
            torque: [number(15), number(16)],
        };
        let map = StepMap::new(&p, number(1), method);
        for (ours, theirs) in weighted(&map, &p).iter().zip(&weighted(&golden, &p)) {
            // Relative to the largest entry of its group, because smaller entries are not resolved in f64 by any
            // method. 1e-13 is some hundred rounding errors.
            let size = theirs.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
            let error = ours.iter().zip(theirs).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs())) / size.max(1e-300);
            worst = worst.max(error);
            assert!(error <= 1e-13, "{error:e} in {line}\n{map:?}");
        }
        rows += 1;
    }
    assert_eq!(rows, 740);
    println!("worst relative error of {rows} step maps: {worst:.1e}");
}

/// Asserts that the maps of `N` motors side by side are those of each alone.
fn assert_side_by_side<const N: usize>(h: f64, method: Discretization) {
    // From slow motors to stiff ones, so that steps are halved from never to a dozen times.
    let mut side_by_side = [[0.0; N]; 5];
    for lane in 0..N {
        let [r, l, k, b, j] = M2.to_array();
        let stiffness = 4.0_f64.powi((lane * 7 % 11) as i32 - 5);
        let own = [r, l / stiffness, k, b, j / (1.0 + (lane % 3) as f64)];
        side_by_side.iter_mut().zip(own).for_each(|(all, value)| all[lane] = value);
    }
    let maps = step_maps(&side_by_side, h, method);
    for lane in 0..N {
        let alone = StepMap::new(&Parameters::from_array(side_by_side.map(|all| all[lane])), h, method);
        let own = StepMap {
            d: maps.d.map(|of| of[lane]),
            taps: maps.taps.map(|tap| tap.map(|of| of[lane])),
            torque: maps.torque.map(|of| of[lane]),
        };
        assert_eq!(own, alone, "motor {lane} of {N}, {method:?}, {h} s");
    }
}

#[test]
fn maps_side_by_side_are_those_of_each_motor_alone() {
    for method in [Discretization::Zoh, Discretization::Foh, Discretization::Rk4] {
        for h in [1e-5, 1e-3, 1e-2, 1.0] {
            assert_side_by_side::<3>(h, method);
            assert_side_by_side::<8>(h, method);
            assert_side_by_side::<16>(h, method);
            assert_side_by_side::<24>(h, method);
        }
    }
}

#[test]
fn the_logarithm_inverts_the_exponential() {
    let mut worst = 0.0_f64;
    for seed in 0..1000_u32 {
        // A low-discrepancy sequence over the bounds of Table 2 and h from 0.1 to 3 ms, where Φ still determines the poles.
        let u = |axis: u32| {
            (0.5 + f64::from(seed + 1)
                * [0.754_877_666, 0.569_840_29, 0.430_159_7, 0.324_717_95, 0.819_172_5, 0.671_043_6][axis as usize])
                .fract()
        };
        let t = |(a, b): (f64, f64), axis: u32| a + (b - a) * u(axis);
        let bounds = motorfit::motor::Space::table2().bounds();
        let p = Parameters::from_array([0, 1, 2, 3, 4].map(|axis| t(bounds[axis], axis as u32)));
        let h = 1e-4 * 30f64.powf(u(5));
        let map = StepMap::new(&p, h, Discretization::Zoh);
        let phi = [1.0 + map.d[0], map.d[1], map.d[2], 1.0 + map.d[3]];
        let a = matrix_logarithm(phi, h).unwrap();
        let expected = [-p.r / p.l, -p.k / p.l, p.k / p.j, -p.b / p.j];
        // In energy coordinates. Rounding of Φ = I + D by ε is amplified by the logarithm: the error is of the order
        // ε ‖Φ⁻¹‖/(h‖A‖), with ‖Φ⁻¹‖ up to exp(h‖A‖).
        let s = (p.j / p.l).sqrt();
        let scale = [1.0, 1.0 / s, s, 1.0];
        let size = (0..4).fold(0.0, |m: f64, n| m.max((expected[n] / scale[n]).abs()));
        let error = (0..4).fold(0.0, |m: f64, n| m.max(((a[n] - expected[n]) / scale[n]).abs())) / size;
        worst = worst.max(error * h * size / (f64::EPSILON * (h * size).exp()));
    }
    println!("worst error of the logarithm: {worst:.1} ε exp(h‖A‖)/(h‖A‖)");
    assert!(worst < 8.0, "{worst}");
    let log = matrix_logarithm;
    assert!(log([1.0, 0.0, 0.0, -0.5], 0.001).is_none(), "a negative determinant");
    assert!(log([-0.5, 0.0, 0.0, -0.6], 0.001).is_none(), "negative eigenvalues");
    assert!(log([f64::NAN, 0.0, 0.0, 1.0], 0.001).is_none());
    let identity = log([1.0, 0.0, 0.0, 1.0], 0.001).unwrap();
    assert!(identity.iter().all(|v| v.abs() < 1e-300), "{identity:?}");
}

#[test]
fn a_torque_brakes_and_a_ramp_is_exact_with_foh() {
    // A first-order hold is exact for a voltage ramp, so two half steps end in the state of one full step.
    let ramp = |period: f64, count: usize| -> Vec<f64> { (0..count).map(|n| 5.0 * n as f64 * period).collect() };
    let (coarse, fine) = (ramp(0.01, 101), ramp(0.005, 201));
    let run = |voltage: &[f64], h: f64| {
        let drive = SimulationInput { step_s: &[h], step_index: &[], voltage, voltage_end: &[], torque: &[] };
        let [current, speed] = simulate(&M2, &drive, [0.0; 2], Discretization::Foh);
        (current[current.len() - 1], speed[speed.len() - 1])
    };
    let (a, b) = (run(&coarse, 0.01), run(&fine, 0.005));
    assert!((a.0 - b.0).abs() < 1e-12 && (a.1 - b.1).abs() < 1e-10, "{a:?} {b:?}");
    let voltage = vec![0.0; 4000];
    let torque = vec![0.01; 4000];
    let drive =
        SimulationInput { step_s: &[0.001], step_index: &[], voltage: &voltage, voltage_end: &[], torque: &torque };
    let [_, speed] = simulate(&M2, &drive, [0.0; 2], Discretization::Zoh);
    let steady = M2.steady_state(0.0, 0.01);
    assert!(steady[1] < 0.0 && (speed[3999] / steady[1] - 1.0).abs() < 1e-12);
}

#[test]
fn response_figures_of_a_known_signal() {
    let time: Vec<f64> = (0..100).map(|n| f64::from(n) * 0.1).collect();
    let mut signal = vec![1.0; 100];
    signal[..5].copy_from_slice(&[0.0, 0.5, 1.5, 0.9, 1.03]);
    let r = response(&time, &signal, 0.02).unwrap();
    assert!((r.peak - 1.5).abs() < 1e-15 && (r.peak_time_s - 0.2).abs() < 1e-12);
    assert!((r.overshoot_percent.unwrap() - 50.0).abs() < 1e-9);
    assert!((r.settling_time_s.unwrap() - 0.5).abs() < 1e-12);
    assert!((response(&time, &signal, 0.05).unwrap().settling_time_s.unwrap() - 0.4).abs() < 1e-12);
    let model = response(&time, &vec![1.1; 100], 0.02).unwrap();
    assert!((model.steady_state - r.steady_state - 0.1).abs() < 1e-12);
    assert!(response(&[], &[], 0.02).is_none() && response(&[0.0], &[f64::NAN], 0.02).is_none());
    signal[99] = 2.0;
    assert_eq!(response(&time, &signal, 0.02).unwrap().settling_time_s, None, "it leaves the band at the end");
}

#[test]
fn sensitivities_are_the_derivatives() {
    let stiff = Parameters { r: 2.0, l: 1e-5, k: 0.01, b: 1e-6, j: 1e-7 };
    let repeated = Parameters { r: 0.1, l: 0.01, k: 0.0, b: 1e-3, j: 1e-4 };
    for (motor, h) in [(Parameters::M2, 1e-3), (Parameters::M2, 5e-2), (stiff, 1e-3), (repeated, 1e-3)] {
        for method in [Discretization::Zoh, Discretization::Foh, Discretization::Rk4, Discretization::Euler] {
            let (map, slopes) = StepMap::with_sensitivities(&motor, h, method);
            assert_eq!(map, StepMap::new(&motor, h, method), "the map itself, to the last bit");
            let entries = |m: &StepMap| [&m.d[..], &m.taps[0], &m.taps[1], &m.torque].concat();
            for p in 0..5 {
                // The error of central differences is step²/6 of the third derivative plus ε/step, some 1e-9 here.
                let step: f64 = 1e-5;
                let moved = |sign: f64| {
                    let mut values = motor.to_array();
                    values[p] *= (sign * step).exp();
                    entries(&StepMap::new(&Parameters::from_array(values), h, method))
                };
                let (up, down) = (moved(1.0), moved(-1.0));
                let size = entries(&map).iter().fold(0.0, |m: f64, v| m.max(v.abs()));
                for (n, slope) in entries(&slopes[p]).into_iter().enumerate() {
                    let difference = (up[n] - down[n]) / (2.0 * step);
                    assert!((slope - difference).abs() <= 2e-8 * size, "{method:?}, {p}, {n}: {slope} {difference}");
                }
            }
        }
    }
}
