//! Random permanent-magnet machines: voltages of random steps, with and without a load torque.

use crate::machines::draw::{Machine, Numbers, is_inside};
use crate::machines::integrator::{Inputs, Mode, State, System};

struct Pmsm {
    resistance: f64,
    inductance_d: f64,
    inductance_q: f64,
    flux: f64,
    friction: f64,
    inertia: f64,
}

const POLE_PAIRS: f64 = 4.0;

impl System for Pmsm {
    fn rate(&self, &[id, iq, w, _]: &State, &[vd, vq, load]: &Inputs, _: Mode) -> State {
        let electrical = POLE_PAIRS * w;
        let flux_d = self.inductance_d * id + self.flux;
        let torque = 1.5 * POLE_PAIRS * (self.flux + (self.inductance_d - self.inductance_q) * id) * iq;
        [
            (vd - self.resistance * id + electrical * self.inductance_q * iq) / self.inductance_d,
            (vq - self.resistance * iq - electrical * flux_d) / self.inductance_q,
            (torque - self.friction * w - load) / self.inertia,
            0.0,
        ]
    }

    fn outputs(&self, x: &State, _: &Inputs) -> Vec<f64> {
        x[..3].to_vec()
    }
}

fn parameters(numbers: &mut Numbers) -> Pmsm {
    loop {
        let (resistance, flux) = (numbers.log_uniform(0.05, 5.0), numbers.log_uniform(5e-3, 0.3));
        let (electrical_s, mechanical_s) = (numbers.log_uniform(1e-3, 0.01), numbers.log_uniform(5e-3, 0.08));
        // Buried magnets, or magnets on the surface.
        let saliency = if numbers.is_likely(0.6) { numbers.uniform(1.2, 2.5) } else { numbers.uniform(0.9, 1.1) };
        let inductance_d = resistance * electrical_s / saliency.sqrt();
        let inductance_q = inductance_d * saliency;
        let inertia = mechanical_s * 1.5 * POLE_PAIRS * POLE_PAIRS * flux * flux / resistance;
        let friction = inertia / numbers.log_uniform(0.3, 4.0);
        let bounds = [
            (resistance, [0.04, 6.0]),
            (inductance_d, [2e-5, 0.06]),
            (inductance_q, [2e-5, 0.06]),
            (flux, [2e-3, 0.6]),
            (friction, [2e-7, 6e-3]),
            (inertia, [2e-7, 0.05]),
        ];
        if is_inside(&bounds) {
            return Pmsm { resistance, inductance_d, inductance_q, flux, friction, inertia };
        }
    }
}

pub fn draw(numbers: &mut Numbers) -> Machine {
    let of = parameters(numbers);
    let samples = 4000;
    let volts = of.flux * numbers.uniform(200.0, 1500.0);
    let along_q = numbers.steps((samples, 20), [20.0, 500.0], |numbers| numbers.uniform(-volts, volts));
    let along_d = numbers.steps((samples, 40), [20.0, 300.0], |numbers| 0.4 * numbers.uniform(-volts, volts));
    let mut load = vec![0.0; samples];
    if numbers.is_likely(0.5) {
        let stall = 1.5 * POLE_PAIRS * of.flux * volts / of.resistance;
        load = numbers.steps((samples, 300), [300.0, 1000.0], |numbers| 0.3 * numbers.uniform(-stall, stall));
    }
    Machine {
        truth: vec![of.resistance, of.inductance_d, of.inductance_q, of.flux, of.friction, of.inertia],
        system: Box::new(of),
        period_s: 1e-4,
        inputs: (0..samples).map(|n| [along_d[n], along_q[n], load[n]]).collect(),
        initial: [0.0; 4],
    }
}
