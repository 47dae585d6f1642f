//! Random position servos with a pendulum: steps of the reference, then a slow sum of sines through standstills. The mode is the
//! direction of motion, 0 at rest, and the side on which the voltage is limited.

use crate::machines::draw::{Machine, Numbers, is_inside};
use crate::machines::integrator::{Inputs, Mode, State, System, sign};
use motorfit::numeric::count;
use std::f64::consts::TAU;

pub struct Servo {
    pub weight: f64,
    pub inertia: f64,
    pub friction: f64,
    pub coulomb: f64,
    pub stribeck: f64,
    pub stribeck_speed: f64,
    pub constant: f64,
    pub resistance: f64,
    pub proportional: f64,
    pub derivative: f64,
}

const SUPPLY: f64 = 24.0;

impl Servo {
    fn demand(&self, x: &State, u: &Inputs) -> f64 {
        self.proportional * (u[0] - x[0]) - self.derivative * x[1]
    }

    /// Returns the torque without friction.
    fn torque(&self, x: &State, u: &Inputs, limited: i8) -> f64 {
        let volts = if limited == 0 { self.demand(x, u) } else { f64::from(limited) * SUPPLY };
        self.constant * (volts - self.constant * x[1]) / self.resistance - self.weight * x[0].sin()
    }

    fn limited(&self, x: &State, u: &Inputs) -> i8 {
        let demand = self.demand(x, u);
        if demand.abs() > SUPPLY { sign(demand) } else { 0 }
    }

    /// Returns the direction in which a machine at rest begins to move.
    fn breakaway(&self, x: &State, u: &Inputs, limited: i8) -> i8 {
        let torque = self.torque(&[x[0], 0.0, 0.0, 0.0], u, limited);
        if torque.abs() <= self.coulomb + self.stribeck { 0 } else { sign(torque) }
    }
}

impl System for Servo {
    fn rate(&self, x: &State, u: &Inputs, [motion, limited]: Mode) -> State {
        if motion == 0 {
            return [0.0; 4];
        }
        let w = x[1];
        let stribeck = self.stribeck * (-(w / self.stribeck_speed).powi(2)).exp();
        let friction = f64::from(motion) * (self.coulomb + stribeck) + self.friction * w;
        [w, (self.torque(x, u, limited) - friction) / self.inertia, 0.0, 0.0]
    }

    fn outputs(&self, x: &State, u: &Inputs) -> Vec<f64> {
        let volts = self.demand(x, u).clamp(-SUPPLY, SUPPLY);
        vec![x[0], (volts - self.constant * x[1]) / self.resistance]
    }

    fn guards(&self, x: &State, u: &Inputs, [motion, limited]: Mode) -> [f64; 2] {
        if motion == 0 {
            return [f64::INFINITY; 2];
        }
        let demand = self.demand(x, u);
        let limit = if limited == 0 { SUPPLY - demand.abs() } else { f64::from(limited) * demand - SUPPLY };
        [f64::from(motion) * x[1], limit]
    }

    fn switch(&self, x: &State, u: &Inputs, [mut motion, mut limited]: Mode, guards: [f64; 2]) -> (State, Mode) {
        let mut x = *x;
        if guards[1] < 0.0 {
            limited = self.limited(&x, u);
        }
        if guards[0] < 0.0 {
            x[1] = 0.0;
            motion = self.breakaway(&x, u, limited);
        }
        (x, [motion, limited])
    }

    fn enter(&self, x: &State, u: &Inputs, mode: Mode) -> Mode {
        let limited = self.limited(x, u);
        let is_moving = x[1].abs() > 0.0;
        [if is_moving { mode[0] } else { self.breakaway(x, u, limited) }, limited]
    }

    fn start(&self, x: &State, u: &Inputs) -> Mode {
        [sign(x[1]), self.limited(x, u)]
    }
}

fn parameters(numbers: &mut Numbers) -> Servo {
    loop {
        let (resistance, constant) = (numbers.log_uniform(0.5, 8.0), numbers.log_uniform(0.05, 1.0));
        let (frequency, damping) = (numbers.log_uniform(5.0, 25.0), numbers.uniform(0.4, 1.0));
        let proportional = numbers.log_uniform(30.0, 200.0);
        let stall = SUPPLY * constant / resistance;
        let inertia = proportional * constant / (resistance * frequency * frequency);
        let friction = numbers.log_uniform(0.01, 0.1) * constant * constant / resistance;
        let of = Servo {
            weight: stall * numbers.uniform(0.1, 0.4),
            inertia,
            friction,
            coulomb: stall * numbers.uniform(0.02, 0.08),
            stribeck: stall * numbers.uniform(0.02, 0.08),
            stribeck_speed: numbers.log_uniform(0.05, 2.0),
            constant,
            resistance,
            proportional,
            derivative: (2.0 * damping * frequency * inertia - friction) * resistance / constant - constant,
        };
        let bounds = [
            (of.weight, [2e-3, 6.0]),
            (of.inertia, [2e-5, 0.5]),
            (of.friction, [2e-6, 0.06]),
            (of.coulomb, [0.0, 0.8]),
            (of.stribeck, [0.0, 0.8]),
            (of.derivative, [2e-3, 12.0]),
            (of.constant, [0.02, 1.2]),
            (of.resistance, [0.2, 10.0]),
        ];
        if is_inside(&bounds) {
            return of;
        }
    }
}

pub fn draw(numbers: &mut Numbers) -> Machine {
    let of = parameters(numbers);
    let (samples, period_s) = (3000, 2e-3);
    let half = samples / 2;
    let mut reference = numbers.steps((half, 20), [150.0, 600.0], |numbers| numbers.uniform(-2.5, 2.5));
    let sines = [[0.1, 0.25], [0.3, 0.5], [0.6, 1.0]]
        .map(|[from, to]| (numbers.uniform(0.2, 0.6), TAU * numbers.uniform(from, to)));
    let sum = |time_s: f64| sines.iter().map(|(amplitude, frequency)| amplitude * (frequency * time_s).sin()).sum();
    reference.extend((half..samples).map(|n| -> f64 { sum(period_s * count(n - half)) }));
    Machine {
        truth: vec![
            of.weight,
            of.inertia,
            of.friction,
            of.coulomb,
            of.stribeck,
            of.stribeck_speed,
            of.constant,
            of.resistance,
            of.proportional,
            of.derivative,
        ],
        system: Box::new(of),
        period_s,
        inputs: reference.into_iter().map(|angle| [angle, 0.0, 0.0]).collect(),
        initial: [0.0; 4],
    }
}
