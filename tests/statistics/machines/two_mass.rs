//! Random pairs of masses with a shaft and play, under random steps of the torque. The mode is 0 in the play, ±1 in contact under load,
//! and ±2 in contact where the damping would pull, so that the shaft transmits no torque.

use crate::machines::draw::{Machine, Numbers, is_inside};
use crate::machines::integrator::{Inputs, Mode, State, System};
use std::f64::consts::TAU;

pub struct TwoMass {
    pub motor: f64,
    pub load: f64,
    pub motor_friction: f64,
    pub load_friction: f64,
    pub stiffness: f64,
    pub damping: f64,
    pub gap: f64,
}

impl TwoMass {
    /// Returns the torque that pushes the masses apart at a side of the play; negative where the damping would pull.
    fn push(&self, &[q1, w1, q2, w2]: &State, side: i8) -> f64 {
        let side = f64::from(side);
        side * (self.stiffness * (q1 - q2 - side * self.gap) + self.damping * (w1 - w2))
    }
}

impl System for TwoMass {
    fn rate(&self, x: &State, u: &Inputs, [contact, _]: Mode) -> State {
        let shaft = if contact.abs() == 1 { f64::from(contact) * self.push(x, contact) } else { 0.0 };
        let &[_, w1, _, w2] = x;
        [w1, (u[0] - self.motor_friction * w1 - shaft) / self.motor, w2, (shaft - self.load_friction * w2) / self.load]
    }

    fn outputs(&self, x: &State, _: &Inputs) -> Vec<f64> {
        vec![x[1], x[3]]
    }

    fn guards(&self, x: &State, _: &Inputs, [contact, _]: Mode) -> [f64; 2] {
        let twist = x[0] - x[2];
        if contact == 0 {
            return [self.gap - twist.abs(), f64::INFINITY];
        }
        let side = contact.signum();
        let push = self.push(x, side);
        [f64::from(side) * twist - self.gap, if contact.abs() == 1 { push } else { -push }]
    }

    fn switch(&self, x: &State, u: &Inputs, _: Mode, _: [f64; 2]) -> (State, Mode) {
        (*x, self.start(x, u))
    }

    fn start(&self, x: &State, _: &Inputs) -> Mode {
        let twist = x[0] - x[2];
        let side = i8::from(twist > self.gap) - i8::from(twist < -self.gap);
        [if side == 0 || self.push(x, side) > 0.0 { side } else { 2 * side }, 0]
    }
}

fn parameters(numbers: &mut Numbers) -> TwoMass {
    loop {
        let motor = numbers.log_uniform(3e-5, 3e-2);
        let load = motor * numbers.log_uniform(0.3, 5.0);
        let common = motor * load / (motor + load);
        let frequency = TAU * numbers.log_uniform(5.0, 40.0);
        let of = TwoMass {
            motor,
            load,
            motor_friction: motor / numbers.log_uniform(1.0, 10.0),
            load_friction: load / numbers.log_uniform(1.0, 10.0),
            stiffness: frequency * frequency * common,
            damping: 2.0 * numbers.uniform(0.02, 0.15) * frequency * common,
            gap: numbers.log_uniform(0.004, 0.06),
        };
        let bounds = [
            (of.motor, [2e-6, 0.5]),
            (of.load, [2e-6, 0.5]),
            (of.motor_friction, [2e-7, 0.05]),
            (of.load_friction, [2e-7, 0.05]),
            (of.stiffness, [0.2, 5e3]),
            (of.damping, [2e-6, 0.5]),
        ];
        if is_inside(&bounds) {
            return of;
        }
    }
}

pub fn draw(numbers: &mut Numbers) -> Machine {
    let of = parameters(numbers);
    // The largest torque twists the shaft by 0.7 to 3 times half of the play.
    let torque = numbers.uniform(0.7, 3.0) * of.gap * of.stiffness * (of.motor + of.load) / of.load;
    let steps = numbers.steps((2500, 20), [50.0, 400.0], |numbers| numbers.uniform(-torque, torque));
    let load_angle = numbers.uniform(-0.8, 0.8) * of.gap;
    Machine {
        truth: vec![of.motor, of.load, of.motor_friction, of.load_friction, of.stiffness, of.damping, of.gap],
        system: Box::new(of),
        period_s: 1e-3,
        inputs: steps.into_iter().map(|torque| [torque, 0.0, 0.0]).collect(),
        initial: [0.0, 0.0, load_angle, 0.0],
    }
}
