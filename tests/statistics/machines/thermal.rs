//! Random DC motors whose winding warms up by 30 to 90 K under random steps of the voltage.

use crate::machines::draw::{Machine, Numbers, is_inside};
use crate::machines::integrator::{Inputs, Mode, State, System, simulated};
use motorfit::numeric::peak;

#[derive(Clone, Copy)]
struct Thermal {
    resistance: f64,
    inductance: f64,
    constant: f64,
    friction: f64,
    inertia: f64,
    heat_capacity: f64,
    thermal_resistance: f64,
    loss: f64,
}

const AMBIENT: f64 = 25.0;

impl System for Thermal {
    fn rate(&self, &[i, w, temperature, _]: &State, &[v, ambient, _]: &Inputs, _: Mode) -> State {
        let rise = temperature - 25.0;
        let resistance = self.resistance * (1.0 + 0.003_93 * rise);
        let constant = self.constant * (1.0 - self.loss * rise);
        let cooling = (temperature - ambient) / self.thermal_resistance;
        [
            (v - resistance * i - constant * w) / self.inductance,
            (constant * i - self.friction * w) / self.inertia,
            (resistance * i * i - cooling) / self.heat_capacity,
            0.0,
        ]
    }

    fn outputs(&self, x: &State, _: &Inputs) -> Vec<f64> {
        x[..3].to_vec()
    }
}

fn parameters(numbers: &mut Numbers) -> Thermal {
    loop {
        let (resistance, constant) = (numbers.log_uniform(0.3, 5.0), numbers.log_uniform(5e-3, 0.3));
        let (electrical_s, mechanical_s) = (numbers.log_uniform(3e-3, 0.02), numbers.log_uniform(0.02, 0.3));
        let thermal_s = numbers.log_uniform(1.0, 12.0);
        let thermal_resistance = numbers.log_uniform(0.5, 30.0);
        let damping = constant * constant / resistance;
        let of = Thermal {
            resistance,
            inductance: resistance * electrical_s,
            constant,
            friction: damping * numbers.log_uniform(0.01, 0.1),
            inertia: damping * mechanical_s,
            heat_capacity: thermal_s / thermal_resistance,
            thermal_resistance,
            loss: numbers.uniform(3e-4, 2.7e-3),
        };
        let bounds = [
            (of.resistance, [0.15, 7.0]),
            (of.inductance, [8e-5, 0.06]),
            (of.constant, [2e-3, 0.6]),
            (of.friction, [2e-7, 6e-3]),
            (of.inertia, [2e-7, 6e-3]),
            (of.heat_capacity, [0.15, 600.0]),
            (of.thermal_resistance, [0.15, 60.0]),
        ];
        if is_inside(&bounds) {
            return of;
        }
    }
}

const INITIAL: State = [0.0, 0.0, AMBIENT, 0.0];
const PERIOD_S: f64 = 2e-3;

pub fn draw(numbers: &mut Numbers) -> Machine {
    let of = parameters(numbers);
    let shape = numbers.steps((5000, 20), [50.0, 700.0], |numbers| {
        if numbers.is_likely(0.15) { 0.0 } else { numbers.sign() * numbers.uniform(0.3, 1.0) }
    });
    let rise = numbers.uniform(30.0, 90.0);
    let inputs = |volts: f64| -> Vec<Inputs> { shape.iter().map(|share| [volts * share, AMBIENT, 0.0]).collect() };
    // The highest temperature grows about as the square of the voltage.
    let mut volts = (60.0 / of.thermal_resistance * of.resistance).sqrt();
    for _ in 0..12 {
        let outputs = simulated(&of, &INITIAL, &inputs(volts), (PERIOD_S, 2.0));
        volts *= (rise / (peak(&outputs[2]) - AMBIENT).max(1e-6)).sqrt();
    }
    Machine {
        system: Box::new(of),
        // The inductance is in mH.
        truth: vec![
            of.resistance,
            1e3 * of.inductance,
            of.constant,
            of.friction,
            of.inertia,
            of.heat_capacity,
            of.thermal_resistance,
            of.loss,
        ],
        period_s: PERIOD_S,
        inputs: inputs(volts),
        initial: INITIAL,
    }
}
