//! Random DC motors with friction, brushes and a drive, under random steps of the voltage. The mode is the sign of the current and that
//! of the speed, 0 where the brush drop or Coulomb friction hold them at zero.

use crate::machines::draw::{Machine, Numbers, is_inside};
use crate::machines::integrator::{Inputs, Mode, State, System, sign};

#[derive(Clone, Copy)]
pub struct DcExtended {
    pub resistance: f64,
    pub inductance: f64,
    pub constant: f64,
    pub friction: f64,
    pub inertia: f64,
    pub coulomb: f64,
    pub load: f64,
    pub dead_time_s: f64,
    pub offset: f64,
    pub brush_drop: f64,
    pub deadband: f64,
    pub saturation: f64,
    pub negative_gain: f64,
}

impl DcExtended {
    fn volts(&self, u: &Inputs) -> f64 {
        let gain = if u[0] < 0.0 { -self.negative_gain } else { 1.0 };
        gain * (u[0].abs().min(self.saturation) - self.deadband).max(0.0) + self.offset
    }

    /// Returns the voltage that drives a current at zero.
    fn drive(&self, x: &State, u: &Inputs) -> f64 {
        self.volts(u) - self.constant * x[1]
    }

    /// Returns the torque that drives a speed at zero.
    fn torque(&self, x: &State, u: &Inputs) -> f64 {
        self.constant * x[0] - self.load - u[1]
    }

    fn breakaway(&self, x: &State, u: &Inputs) -> Mode {
        let of = |drive: f64, limit: f64| if drive.abs() <= limit { 0 } else { sign(drive) };
        [of(self.drive(x, u), self.brush_drop), of(self.torque(x, u), self.coulomb)]
    }
}

impl System for DcExtended {
    fn rate(&self, x: &State, u: &Inputs, [current, motion]: Mode) -> State {
        let brushes = f64::from(current) * self.brush_drop;
        let friction = self.friction * x[1] + f64::from(motion) * self.coulomb;
        let of = |mode: i8, rate: f64| if mode == 0 { 0.0 } else { rate };
        [
            of(current, (self.drive(x, u) - self.resistance * x[0] - brushes) / self.inductance),
            of(motion, (self.torque(x, u) - friction) / self.inertia),
            0.0,
            0.0,
        ]
    }

    fn outputs(&self, x: &State, _: &Inputs) -> Vec<f64> {
        x[..2].to_vec()
    }

    fn delay_s(&self) -> f64 {
        self.dead_time_s
    }

    fn guards(&self, x: &State, u: &Inputs, mode: Mode) -> [f64; 2] {
        let held = [self.brush_drop - self.drive(x, u).abs(), self.coulomb - self.torque(x, u).abs()];
        std::array::from_fn(|n| if mode[n] == 0 { held[n] } else { f64::from(mode[n]) * x[n] })
    }

    fn switch(&self, x: &State, u: &Inputs, mode: Mode, guards: [f64; 2]) -> (State, Mode) {
        let (mut x, mut after) = (*x, mode);
        for n in 0..2 {
            if guards[n] < 0.0 && mode[n] != 0 {
                x[n] = 0.0;
                after[n] = self.breakaway(&x, u)[n];
            } else if guards[n] < 0.0 {
                after[n] = sign([self.drive(&x, u), self.torque(&x, u)][n]);
            }
        }
        (x, after)
    }

    fn enter(&self, x: &State, u: &Inputs, mode: Mode) -> Mode {
        let at_rest = self.breakaway(x, u);
        std::array::from_fn(|n| if x[n].abs() > 0.0 { mode[n] } else { at_rest[n] })
    }

    fn start(&self, x: &State, _: &Inputs) -> Mode {
        [sign(x[0]), sign(x[1])]
    }
}

fn parameters(numbers: &mut Numbers) -> DcExtended {
    loop {
        let (resistance, constant) = (numbers.log_uniform(0.15, 0.7), numbers.log_uniform(8e-3, 0.06));
        let (electrical_s, mechanical_s) = (numbers.log_uniform(3e-3, 0.02), numbers.log_uniform(0.03, 0.3));
        let (stall, damping) = (10.0 * constant / resistance, constant * constant / resistance);
        let of = DcExtended {
            resistance,
            inductance: resistance * electrical_s,
            constant,
            friction: numbers.log_uniform(0.02, 0.15) * damping,
            inertia: mechanical_s * damping,
            coulomb: stall * numbers.uniform(0.02, 0.1),
            load: stall * numbers.uniform(-0.1, 0.1),
            dead_time_s: numbers.uniform(0.002, 0.015),
            offset: numbers.uniform(-0.5, 0.5),
            brush_drop: numbers.uniform(0.2, 1.2),
            deadband: numbers.uniform(0.2, 1.2),
            saturation: numbers.uniform(8.0, 20.0),
            negative_gain: numbers.uniform(0.7, 1.4),
        };
        let bounds = [
            (of.resistance, [0.12, 0.85]),
            (of.inductance, [1.2e-3, 0.08]),
            (of.constant, [6e-3, 0.085]),
            (of.friction, [1.2e-5, 8e-4]),
            (of.inertia, [1.2e-5, 8e-4]),
            (of.coulomb, [0.0, 0.09]),
            (of.load, [-0.09, 0.09]),
        ];
        if is_inside(&bounds) {
            return of;
        }
    }
}

pub fn draw(numbers: &mut Numbers) -> Machine {
    let of = parameters(numbers);
    let volts = numbers.steps((4000, 20), [30.0, 400.0], |numbers| {
        let kind = numbers.uniform(0.0, 1.0);
        // Zero, about the deadband and the brush drop, or up to beyond the saturation.
        let [from, to] = match kind {
            0.0..0.12 => return 0.0,
            0.12..0.4 => [0.8, 4.0],
            _ => [0.2 * of.saturation, 1.4 * of.saturation],
        };
        numbers.sign() * numbers.uniform(from, to)
    });
    Machine {
        truth: vec![
            of.resistance,
            of.inductance,
            of.constant,
            of.friction,
            of.inertia,
            of.coulomb,
            of.load,
            of.dead_time_s,
            of.offset,
            of.brush_drop,
            of.deadband,
            of.saturation,
            of.negative_gain,
        ],
        system: Box::new(of),
        period_s: 1e-3,
        inputs: volts.into_iter().map(|volts| [volts, 0.0, 0.0]).collect(),
        initial: [0.0; 4],
    }
}
