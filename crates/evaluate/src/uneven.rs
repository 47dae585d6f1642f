//! Delayed inputs of `L` candidates side by side on an irregular clock, where the voltage may change several times within a step.

use super::signals::Signals;
use super::step::{Pair, Step};
use super::taps::Torques;
use motorfit_motor::{
    Aligned, Bend, CHUNK, Change, DelayedVoltage, Dynamics, Extended, Method, SimulationSettings, TransitionIntegrals,
    multiply_add,
};

/// The delayed inputs of a block of candidates.
pub(super) struct Uneven<'a, const L: usize> {
    lanes: Vec<Lane<'a>>,
    dynamics: Dynamics<L>,
    method: Method,
    /// True if pieces of equal voltages are taken together, as under a zero-order hold.
    holds: bool,
    /// Voltages at both ends of each step if the first piece continued to its end \[V\].
    voltages: Aligned<[Pair<L>; CHUNK]>,
    /// The first change within each step, the second, and so on.
    changes: Vec<Box<[LaneChanges<L>; CHUNK]>>,
    /// Largest number of changes of a candidate within each step.
    counts: [usize; CHUNK],
    /// Contribution of the changes within each step to both states, and the fraction of the step at which the first acts.
    added: Box<[Aligned<Pair<L>>; CHUNK]>,
    bends: Box<[Aligned<[f64; L]>; CHUNK]>,
}

/// The delayed voltage of a candidate.
struct Lane<'a> {
    delayed: DelayedVoltage<'a, f64>,
    /// Index of the piece that acts.
    cursor: usize,
    /// Ends of the runs of equal voltages from the one that the piece is in.
    run_ends: &'a [usize],
}

/// One change of the voltage of each candidate within a step; zero for a candidate without.
#[derive(Clone, Copy)]
#[repr(align(64))]
struct LaneChanges<const L: usize> {
    jump: [f64; L],
    bend: [f64; L],
    left: [f64; L],
}

impl<'a, const L: usize> Uneven<'a, L> {
    #[inline(always)]
    pub(super) fn new(motors: &Extended<[f64; L]>, signals: &'a Signals, settings: SimulationSettings) -> Self {
        let (drive, time) = (signals.drive(), signals.times());
        let holds = !signals.has_slopes() && !settings.method.uses_next_input();
        let run_ends = if holds { signals.voltage_ends() } else { &[] };
        let delayed = |lane| DelayedVoltage::new(&motors.lane(lane), drive, settings, time.clone());
        let lanes = (0..L).map(|lane| Lane { delayed: delayed(lane), cursor: 0, run_ends }).collect();
        Self {
            holds,
            lanes,
            dynamics: Dynamics::new(&motors.motor, settings.method.input),
            method: settings.method,
            voltages: Aligned([[[0.0; L]; 2]; CHUNK]),
            changes: Vec::new(),
            counts: [0; CHUNK],
            added: Box::new([Aligned([[0.0; L]; 2]); CHUNK]),
            bends: Box::new([Aligned([0.0; L]); CHUNK]),
        }
    }

    /// Returns true if the voltage of a candidate changes within a step of the last piece.
    #[inline(always)]
    pub(super) fn has_bend(&self, step: usize) -> bool {
        self.counts[step] > 0
    }

    /// Returns the change of the voltage of a candidate within a step of the last piece; `None` if no voltage changes.
    #[inline(always)]
    pub(super) fn bend(&self, step: usize, lane: usize) -> Option<Bend<f64>> {
        let Aligned(added) = &self.added[step];
        let bend = || Bend { at: self.bends[step].0[lane], added: [added[0][lane], added[1][lane]] };
        self.has_bend(step).then(bend)
    }

    /// Writes the contributions of the inputs at samples `start..end`.
    #[inline(always)]
    pub(super) fn next<const FMA: bool>(
        &mut self,
        signals: &Signals,
        (steps, torques): (&[Step<L>], &Torques<'_, L>),
        [start, end]: [usize; 2],
        gains: &mut [Pair<L>; CHUNK],
    ) {
        self.counts = [0; CHUNK];
        for lane in 0..L {
            self.collect(signals, lane, [start, end]);
        }
        for (n, gain) in (start..end).zip(gains.iter_mut()) {
            let own = steps[usize::from(signals.step_of(n))].gain::<FMA>(&self.voltages.0[n - start], &torques.at(n));
            *gain = self.with_changes::<FMA>(own, n - start);
            if self.has_bend(n - start) {
                for axis in 0..2 {
                    for lane in 0..L {
                        self.added[n - start].0[axis][lane] = gain[axis][lane] - own[axis][lane];
                    }
                }
            }
        }
    }

    /// Collects the voltages of a candidate at the steps `start..end`, and their changes within these steps.
    #[inline(always)]
    fn collect(&mut self, signals: &Signals, lane: usize, [start, end]: [usize; 2]) {
        let Self { lanes, holds, voltages: Aligned(voltages), changes, counts, bends, .. } = self;
        let Lane { delayed, cursor, run_ends } = &mut lanes[lane];
        let mut n = start;
        while n < end {
            let (until, constant) = if *holds {
                let until = delayed.constant_until([n, end], cursor, run_ends);
                (until, delayed.output(*cursor))
            } else {
                delayed.advance(n, cursor);
                let constant = delayed.constant(n, *cursor);
                (n + usize::from(constant.is_some()), constant.map_or(0.0, |volts| delayed.nonlinearity.output(volts)))
            };
            for voltages in &mut voltages[n - start..until - start] {
                (voltages[0][lane], voltages[1][lane]) = (constant, constant);
            }
            if until > n {
                n = until;
                continue;
            }
            let (mut within, mut count, at) = (delayed.changes(n, *cursor), 0, n - start);
            (voltages[at][0][lane], voltages[at][1][lane]) = (within.ends[0], within.ends[1]);
            while let Some(Change { jump, bend, left }) = delayed.next_change(&mut within) {
                if count == changes.len() {
                    changes.push(Box::new([LaneChanges { jump: [0.0; L], bend: [0.0; L], left: [0.0; L] }; CHUNK]));
                }
                let own = &mut changes[count][at];
                if count == counts[at] {
                    (own.jump, own.bend, own.left) =
                        ([0.0; L], [0.0; L], [signals.step_s[usize::from(signals.step_of(n))]; L]);
                    counts[at] += 1;
                }
                (own.jump[lane], own.bend[lane], own.left[lane]) = (jump, bend, left);
                if count == 0 {
                    bends[at].0[lane] = delayed.bend_at(n, left);
                }
                count += 1;
            }
            if delayed.has_movement(&within) {
                bends[at].0[lane] = 0.0;
            }
            n += 1;
        }
    }

    /// Returns the contribution to both states with that of the changes within a step.
    #[inline(always)]
    fn with_changes<const FMA: bool>(&self, mut gain: Pair<L>, at: usize) -> Pair<L> {
        for changes in &self.changes[..self.counts[at]] {
            let LaneChanges { jump, bend, left } = &changes[at];
            let integrals = TransitionIntegrals::<L, 2>::new(&self.dynamics, *left, self.method);
            let [step, ramp] = integrals.responses(&self.dynamics);
            for axis in 0..2 {
                for lane in 0..L {
                    let bent = multiply_add::<FMA>(bend[lane], ramp[axis][lane], gain[axis][lane]);
                    gain[axis][lane] = multiply_add::<FMA>(jump[lane], step[axis][lane], bent);
                }
            }
        }
        gain
    }
}
