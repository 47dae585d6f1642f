//! Proves: each extension follows its equation in the scalar simulation.

use super::{driven, excitation, with};
use motorfit::experiment::{Excitation, simulated};
use motorfit::motor::{Discretization, Extended, Parameter, Parameters};

const M2: Parameters = Parameters::M2;

fn signals(record: &motorfit::record::Record) -> [Vec<f64>; 2] {
    record.measured().map(|signal| signal.unwrap().to_vec())
}

/// Returns the largest difference of two signals from sample `from` on.
fn apart(a: &[f64], b: &[f64], from: usize) -> f64 {
    a.iter().zip(b).skip(from).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()))
}

#[test]
fn the_motor_sticks_up_to_the_friction_torque() {
    // At standstill the torque is K v/R. Below Tc the motor sticks, and the current is v/R.
    let torque = 0.04;
    let volts = torque * M2.r / M2.k;
    let still = driven(&with(&[(Parameter::Coulomb, torque)]), &excitation(500, 1e-3, |_| 0.99 * volts));
    let [current, speed] = signals(&still);
    assert!(speed.iter().all(|w| *w == 0.0), "it moves");
    assert!((current[499] - 0.99 * volts / M2.r).abs() < 1e-6, "{}", current[499]);
    let moving = driven(&with(&[(Parameter::Coulomb, torque)]), &excitation(2000, 1e-3, |_| 1.01 * volts));
    // The steady state is that under a load torque Tc.
    let [steady_current, steady_speed] = M2.steady_state(1.01 * volts, torque);
    let [current, speed] = signals(&moving);
    assert!((speed[1999] - steady_speed).abs() < 1e-6 * steady_speed + 1e-9, "{} {steady_speed}", speed[1999]);
    assert!((current[1999] - steady_current).abs() < 1e-6);
}

#[test]
fn friction_stops_a_motor_for_good() {
    // After a pulse the motor stops and sticks; without Coulomb friction it would never stop.
    let pulse = excitation(3000, 1e-3, |n| if n < 300 { 8.0 } else { 0.0 });
    let [current, speed] = signals(&driven(&with(&[(Parameter::Coulomb, 0.01)]), &pulse));
    let stopped = speed.iter().rposition(|w| *w != 0.0).unwrap() + 1;
    assert!((300..1000).contains(&stopped), "stops at {stopped}");
    assert!(speed[stopped..].iter().all(|w| *w == 0.0) && current[2999].abs() < 1e-12);
}

/// Returns current and speed at the samples of a clock of 1 ms, simulated with steps `fine` times shorter under the same input.
fn with_finer_steps(motor: &Extended, samples: u32, fine: u32, volts: impl Fn(u32) -> f64) -> [Vec<f64>; 2] {
    let held = |n: u32| volts(n / fine);
    let record = driven(motor, &excitation(samples * fine, 1e-3 / f64::from(fine), held));
    signals(&record).map(|signal| signal.iter().step_by(fine as usize).copied().collect())
}

#[test]
fn friction_converges_with_the_step() {
    // Reversals and stops under an input with a zero-order hold of 1 ms. A friction of one sign over a step in which the speed passes
    // zero would be off by up to 2 Tc h/J = 0.15 rad/s; with its change of sign the error is of second order in the step.
    let motor = with(&[(Parameter::Coulomb, 0.01)]);
    let volts = |n: u32| 3.0 * (0.009 * f64::from(n)).sin() + 1.5 * (0.031 * f64::from(n)).sin();
    let [one, two, finest] = [1, 2, 64].map(|fine| with_finer_steps(&motor, 2000, fine, volts)[1].clone());
    let crossings = one.windows(2).filter(|w| w[0] * w[1] < 0.0).count();
    let (coarse, finer) = (apart(&one, &finest, 0), apart(&two, &finest, 0));
    println!("{crossings} crossings, off by {coarse:.2e} and {finer:.2e} rad/s");
    assert!(crossings > 3 && coarse < 0.01 && finer < 0.4 * coarse, "{coarse} {finer}");
}

#[test]
fn reactions_change_their_sign_where_a_late_voltage_turns_the_motor() {
    // A square voltage that is late by a fraction of a step turns current and speed, often within a step in which it changes. With
    // reactions of one sign over each step the current would be off by up to 2 vb h/L = 0.2 A, 0.05 A rms around the reversals.
    let motor = with(&[(Parameter::Coulomb, 0.01), (Parameter::BrushDrop, 0.8), (Parameter::DeadTime, 3.37e-3)]);
    let volts = |n: u32| if n < 20 { 0.0 } else { [7.0, -5.0, 0.0, -8.0, 3.0, -2.0][(n / 61 % 6) as usize] };
    let [one, two, finest] = [1, 2, 64].map(|fine| with_finer_steps(&motor, 2000, fine, volts));
    for channel in 0..2 {
        let off = |a: &[Vec<f64>; 2]| {
            let squares = a[channel].iter().zip(&finest[channel]).map(|(a, b)| (a - b).powi(2));
            (squares.sum::<f64>() / 2000.0).sqrt()
        };
        let (coarse, finer) = (off(&one), off(&two));
        println!("channel {channel}: off by {coarse:.2e} and {finer:.2e} rms");
        assert!(coarse < [2e-3, 8e-3][channel] && finer < 0.5 * coarse, "{coarse} {finer}");
    }
}

#[test]
fn brushes_reduce_the_voltage_by_their_drop() {
    // Below vb no current flows; above it v − vb acts on the motor.
    let brushes = with(&[(Parameter::BrushDrop, 0.8)]);
    let [current, _] = signals(&driven(&brushes, &excitation(200, 1e-3, |_| 0.7)));
    assert!(current.iter().all(|i| *i == 0.0), "current flows");
    let [current, speed] = signals(&driven(&brushes, &excitation(2000, 1e-3, |_| 5.8)));
    let [i, w] = M2.steady_state(5.0, 0.0);
    assert!((current[1999] - i).abs() < 1e-8 && (speed[1999] - w).abs() < 1e-6, "{} {}", current[1999], speed[1999]);
    // The response is odd.
    let [turned, _] = signals(&driven(&brushes, &excitation(2000, 1e-3, |_| -5.8)));
    assert!(apart(&current.iter().map(|i| -i).collect::<Vec<_>>(), &turned, 0) < 1e-12);
}

#[test]
fn integer_delays_shift_the_input() {
    let volts = |n: u32| if n < 40 { 0.0 } else { 6.0 + f64::from(n / 37 % 5) };
    for steps in [0, 1, 7, 120] {
        let late = driven(&with(&[(Parameter::DeadTime, f64::from(steps) * 1e-3)]), &excitation(900, 1e-3, volts));
        let shifted = excitation(900, 1e-3, |n| n.checked_sub(steps).map_or(0.0, volts));
        let exact = driven(&with(&[]), &shifted);
        for (a, b) in signals(&late).iter().zip(signals(&exact)) {
            assert!(apart(a, &b, 0) < 1e-9, "{steps} steps: off by {:e}", apart(a, &b, 0));
        }
    }
}

#[test]
fn fractional_delays_are_those_of_a_finer_simulation() {
    // Delays of 3.3 and −0.6 periods. The oracle is a simulation with a tenth of the period, in which they are integers:
    // equal up to rounding, also if the period is much longer than the electrical time constant.
    for (h, late, stiff) in [(1e-3, 33, 1.0), (1e-3, -6, 1.0), (0.01, 33, 0.1), (0.01, -6, 0.1), (0.01, -10, 0.1)] {
        let base = Parameters { l: stiff * M2.l, ..M2 };
        let volts = |n: i64| if n < 100 { 0.0 } else { [10.5, 4.0, -7.0][usize::try_from(n / 100).unwrap() % 3] };
        let motor = Extended::from(&base).with(Parameter::DeadTime, h * f64::from(late) / 10.0);
        let seen = driven(&motor, &excitation(800, h, |n| volts(i64::from(n))));
        let shifted = excitation(8000, 0.1 * h, |n| volts((i64::from(n) - i64::from(late)).div_euclid(10)));
        let finer = driven(&Extended::from(&base), &shifted);
        let exact = signals(&finer).map(|s| s.into_iter().step_by(10).collect::<Vec<_>>());
        for (a, b) in signals(&seen).iter().zip(&exact) {
            assert!(apart(a, b, 0) < 1e-9, "{h} s, {late} tenths: off by {:e}", apart(a, b, 0));
        }
    }
}

#[test]
fn delays_on_an_irregular_clock_are_those_of_a_finer_simulation() {
    // An irregular subset of the samples of a fine regular clock, with a zero-order hold between them. The oracle is the
    // simulation on the fine clock, also for a negative dead time.
    let kept: Vec<u32> = (0..200_u32)
        .scan(0, |n, step| {
            *n += 3 + step * step % 7;
            Some(*n)
        })
        .collect();
    let volts = |n: usize| 9.0 * (0.7 * n as f64).sin();
    for late in [-5, 4, 13] {
        let time_s = kept.iter().map(|n| f64::from(n - kept[0]) * 1e-3).collect();
        let coarse = Excitation { time_s, voltage: (0..kept.len()).map(volts).collect(), torque: None };
        let motor = with(&[(Parameter::DeadTime, f64::from(late) * 1e-3)]);
        let seen = simulated(motor, &coarse, Discretization::Zoh).unwrap();
        let count = kept[kept.len() - 1] - kept[0] + 1;
        let held = |n: u32| {
            let now = i64::from(n + kept[0]) - i64::from(late);
            kept.partition_point(|k| i64::from(*k) <= now).checked_sub(1).map_or(0.0, volts)
        };
        let fine = signals(&driven(&with(&[]), &excitation(count, 1e-3, held)));
        for (ours, fine) in signals(&seen).iter().zip(&fine) {
            let exact: Vec<f64> = kept.iter().map(|n| fine[(n - kept[0]) as usize]).collect();
            assert!(apart(ours, &exact, 0) < 1e-9, "{late} ms: off by {:e}", apart(ours, &exact, 0));
        }
    }
}

#[test]
fn latency_delays_the_first_change_only() {
    let volts = |n: u32| match n {
        0..100 => 0.0,
        100..300 => 4.0,
        300..500 => 9.0,
        _ => -3.0,
    };
    let late = driven(&with(&[(Parameter::Latency, 0.055)]), &excitation(800, 1e-3, volts));
    let exact = driven(&with(&[]), &excitation(800, 1e-3, |n| if n < 155 { 0.0 } else { volts(n) }));
    for (a, b) in signals(&late).iter().zip(signals(&exact)) {
        assert!(apart(a, &b, 0) < 1e-9);
    }
    // Latency and dead time add for the first change of the input.
    let both = with(&[(Parameter::Latency, 0.055), (Parameter::DeadTime, 0.02)]);
    let shifted = |n: u32| if n < 175 { 0.0 } else { volts(n - 20) };
    let (late, exact) =
        (driven(&both, &excitation(800, 1e-3, volts)), driven(&with(&[]), &excitation(800, 1e-3, shifted)));
    for (a, b) in signals(&late).iter().zip(signals(&exact)) {
        assert!(apart(a, &b, 0) < 1e-9);
    }
}

#[test]
fn delayed_first_order_holds_stay_linear() {
    // With a first-order hold a delayed ramp is a later ramp.
    let ramp = |late: f64| Excitation {
        time_s: (0..600_u32).map(|n| f64::from(n) * 1e-3).collect(),
        voltage: (0..600_u32).map(|n| 0.02 * (f64::from(n) - late).max(0.0)).collect(),
        torque: None,
    };
    let late = with(&[(Parameter::DeadTime, 0.0274)]);
    let ours = simulated(late, &ramp(0.0), Discretization::Foh).unwrap();
    let exact = simulated(&M2, &ramp(27.4), Discretization::Foh).unwrap();
    for (a, b) in signals(&ours).iter().zip(signals(&exact)) {
        // In the oracle the ramp begins at a sample instead of within the step.
        assert!(apart(a, &b, 0) < 2e-3 && apart(a, &b, 200) < 1e-7, "{:e} {:e}", apart(a, &b, 0), apart(a, &b, 200));
    }
}

#[test]
fn deadband_saturation_and_gain_change_the_voltage() {
    let told = |n: u32| -8.0 + 0.02 * f64::from(n);
    let drive = with(&[(Parameter::Deadband, 1.5), (Parameter::Saturation, 6.0), (Parameter::NegativeGain, 0.8)]);
    let given = |v: f64| {
        let size = (v.abs().min(6.0) - 1.5).max(0.0);
        if v < 0.0 { -0.8 * size } else { size }
    };
    let (ours, exact) =
        (driven(&drive, &excitation(800, 1e-3, told)), driven(&with(&[]), &excitation(800, 1e-3, |n| given(told(n)))));
    for (a, b) in signals(&ours).iter().zip(signals(&exact)) {
        assert!(apart(a, &b, 0) < 1e-11);
    }
    // An offset adds to the voltage, a load to the torque.
    let offset = driven(&with(&[(Parameter::Offset, 0.3)]), &excitation(800, 1e-3, told));
    let more = driven(&with(&[]), &excitation(800, 1e-3, |n| told(n) + 0.3));
    assert!(apart(&signals(&offset)[1], &signals(&more)[1], 0) < 1e-10);
    let load = driven(&with(&[(Parameter::Load, 0.02)]), &excitation(800, 1e-3, told));
    let torque = Excitation { torque: Some(vec![0.02; 800]), ..excitation(800, 1e-3, told) };
    assert!(apart(&signals(&load)[1], &signals(&driven(&with(&[]), &torque))[1], 0) < 1e-10);
}

#[test]
fn sensors_measure_moving_averages() {
    let volts = |n: u32| if n % 90 < 50 { 7.0 } else { -2.0 };
    let plain = signals(&driven(&with(&[]), &excitation(600, 1e-3, volts)));
    let averaged = signals(&driven(
        &with(&[(Parameter::CurrentAverage, 8.0), (Parameter::SpeedAverage, 32.25)]),
        &excitation(600, 1e-3, volts),
    ));
    for (n, (current_seen, speed_seen)) in averaged[0].iter().zip(&averaged[1]).enumerate() {
        let back = |signal: &[f64], k: usize| n.checked_sub(k).map_or(0.0, |at| signal[at]);
        let current: f64 = (0..8).map(|k| back(&plain[0], k)).sum::<f64>() / 8.0;
        let speed = ((0..32).map(|k| back(&plain[1], k)).sum::<f64>() + 0.25 * back(&plain[1], 32)) / 32.25;
        assert!((current_seen - current).abs() < 1e-11 && (speed_seen - speed).abs() < 1e-10, "sample {n}");
    }
}

/// Returns an excitation of `volts(t)` \[V\] with the period `h` \[s\], for a first-order hold.
fn lined(count: u32, h: f64, volts: impl Fn(f64) -> f64) -> Excitation {
    excitation(count, h, |n| volts(f64::from(n) * h))
}

#[test]
fn a_jump_at_the_first_sample_stays_a_jump() {
    // The first sample of a motor at rest has a voltage: it is a jump from zero, which stays a jump when delayed, and
    // does not become a ramp over the step before. The response to a constant voltage is the undelayed one, shifted.
    let constant = lined(900, 1e-3, |_| 6.0);
    let on_time = |h: f64, count| simulated(&M2, &lined(count, h, |_| 6.0), Discretization::Foh).unwrap();
    let exact = signals(&on_time(1e-3, 900));
    let late = simulated(with(&[(Parameter::DeadTime, 7e-3)]), &constant, Discretization::Foh).unwrap();
    for (late, exact) in signals(&late).iter().zip(&exact) {
        assert!(late[..=7].iter().all(|v| *v == 0.0) && late[8] != 0.0, "{:?}", &late[..10]);
        assert!(apart(&late[7..], exact, 0) < 1e-9, "{:e}", apart(&late[7..], exact, 0));
    }
    // A delay of 2.4 periods. The oracle has a tenth of the period, in which the delay is an integer.
    let late = simulated(with(&[(Parameter::DeadTime, 2.4e-3)]), &constant, Discretization::Foh).unwrap();
    let fine = signals(&on_time(1e-4, 9000));
    let off: Vec<f64> = signals(&late)
        .iter()
        .zip(&fine)
        .map(|(late, fine)| {
            let shifted: Vec<f64> = (0..900_usize).map(|n| (10 * n).checked_sub(24).map_or(0.0, |m| fine[m])).collect();
            apart(late, &shifted, 0)
        })
        .collect();
    println!("off by {:.1e} A, {:.1e} rad/s", off[0], off[1]);
    assert!(off[0] < 1e-9 && off[1] < 1e-9, "{off:?}");
}

#[test]
fn latency_of_a_first_order_hold_ends_in_a_jump() {
    // Until the first change of the input plus the latency, the voltage keeps its value; then it jumps to the current value
    // of the ramp. A dead time delays both. The oracle is a zero-order hold at the midpoints of steps of a fiftieth of a
    // period, with an error of order h²/24; the jump is at the edge of a step.
    const FINE: u32 = 50;
    let ramp = |t: f64| (43.0 * (t - 0.1)).clamp(0.0, 8.0);
    for (latency, dead_time) in [(0.055, 0.0), (0.0323, 0.0), (0.04, 0.0125)] {
        let motor = with(&[(Parameter::Latency, latency), (Parameter::DeadTime, dead_time)]);
        let late = simulated(motor, &lined(600, 1e-3, ramp), Discretization::Foh).unwrap();
        // The first change of the input is the sample beyond 5 % of its range: 0.43 V at 110 ms.
        let moves = 0.11;
        let acts = |t: f64| {
            let t = t - dead_time;
            if t < 0.0 {
                0.0
            } else if t < moves + latency {
                ramp(t.min(moves - 1e-3))
            } else {
                ramp(t)
            }
        };
        let h = 1e-3 / f64::from(FINE);
        let held = excitation(600 * FINE, h, |n| acts((f64::from(n) + 0.5) * h));
        let exact =
            signals(&driven(&with(&[]), &held)).map(|s| s.into_iter().step_by(FINE as usize).collect::<Vec<_>>());
        let off: Vec<f64> = signals(&late).iter().zip(&exact).map(|(a, b)| apart(a, b, 0)).collect();
        println!("latency {latency}, dead time {dead_time}: off by {:.1e} A, {:.1e} rad/s", off[0], off[1]);
        assert!(off[0] < 2e-3 && off[1] < 2e-3, "{off:?}");
    }
}
