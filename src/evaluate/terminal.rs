//! What drives `L` candidates side by side: the voltage behind the drive and the load.

#![expect(clippy::needless_range_loop, reason = "a lane indexes several arrays alike; that is what vectorizes")]

use super::kernel::multiply_add;
use super::reaction::Pair;
use crate::motor::{Extended, Parameter, StepMaps, Terminal};

/// The drives and the loads of a block of candidates.
pub(super) struct Terminals<const L: usize> {
    drives: [[f64; L]; 4],
    load: [f64; L],
}

impl<const L: usize> Terminals<L> {
    pub(super) fn new(motors: &[Extended; L]) -> Self {
        let mut terminals = Self { drives: [[0.0; L]; 4], load: [0.0; L] };
        for (lane, motor) in motors.iter().enumerate() {
            let Terminal { deadband, saturation, reverse_gain, offset } = Terminal::of(motor);
            for (drives, value) in terminals.drives.iter_mut().zip([deadband, saturation, reverse_gain, offset]) {
                drives[lane] = value;
            }
            terminals.load[lane] = motor.get(Parameter::Load);
        }
        terminals
    }

    /// What the drives make of a voltage.
    #[inline(always)]
    fn of(&self, voltage: f64) -> [f64; L] {
        let mut given = [0.0; L];
        for lane in 0..L {
            given[lane] = self.drive(lane).gives(voltage);
        }
        given
    }

    /// The drive of one candidate.
    #[inline(always)]
    pub(super) fn drive(&self, lane: usize) -> Terminal<f64> {
        let [deadband, saturation, reverse_gain, offset] = &self.drives;
        Terminal {
            deadband: deadband[lane],
            saturation: saturation[lane],
            reverse_gain: reverse_gain[lane],
            offset: offset[lane],
        }
    }

    /// What the voltage at the start of a step and, for lines, at its end, and a torque add to both states.
    #[inline(always)]
    pub(super) fn gain<const FMA: bool>(
        &self,
        maps: &StepMaps<L>,
        [start, end, torque]: [f64; 3],
        lines: bool,
    ) -> Pair<L> {
        let end = if lines { self.of(end) } else { [0.0; L] };
        gain::<L, FMA>(maps, &[self.of(start), end], &self.torque(torque))
    }

    /// The loads with a torque besides.
    #[inline(always)]
    pub(super) fn torque(&self, torque: f64) -> [f64; L] {
        let mut loads = self.load;
        for lane in 0..L {
            loads[lane] += torque;
        }
        loads
    }
}

/// What voltages and torque add to both states.
#[inline(always)]
pub(super) fn gain<const L: usize, const FMA: bool>(
    maps: &StepMaps<L>,
    [start, end]: &Pair<L>,
    torque: &[f64; L],
) -> Pair<L> {
    let mut gain = [[0.0; L]; 2];
    for axis in 0..2 {
        for lane in 0..L {
            let held =
                multiply_add::<FMA>(maps.taps[0][axis][lane], start[lane], maps.torque[axis][lane] * torque[lane]);
            gain[axis][lane] = multiply_add::<FMA>(maps.taps[1][axis][lane], end[lane], held);
        }
    }
    gain
}
