//! The coefficients of a block of candidates.

#![expect(clippy::needless_range_loop, reason = "a lane indexes several arrays alike; that is what vectorizes")]

use crate::interpreter::{Job, Loss, Register, Rows, RunProgram as _, Work};
use motorfit_model::Model;
use motorfit_model::program::{Program, Roots, compile};
use motorfit_model::step::{AffineStep, Step, StepSettings};

/// Registers of a block.
pub(super) const PARTS: usize = 8;

/// An affine step with the program of its initial states and limits.
#[derive(Debug, Clone)]
pub(crate) struct AffineProgram {
    pub(super) layout: AffineStep,
    pub(super) begin: Program,
    pub(super) is_first_order_hold: bool,
}

impl AffineProgram {
    /// Returns the program of a step; `None` if the kernel does not suit it. The graph of the step gains nodes.
    pub fn new(step: &mut Step, model: &Model, settings: &StepSettings) -> Option<Self> {
        let layout = step.affine_step(model, settings.substeps.max(1))?;
        let roots =
            Roots { next: &[], milestones: &[], initial: &[], outputs: &[], results: &layout.roots, memories: &[] };
        let begin = compile(&mut step.graph, &roots)?;
        Some(Self { layout, begin, is_first_order_hold: settings.is_first_order_hold })
    }

    /// Computes initial states and limits from the parameters.
    pub(super) fn begin(&self, work: &mut Work<PARTS>) {
        work.run(&Job { program: &self.begin, rows: &Rows::default(), loss: Loss::Squares });
    }
}

/// Values of `L` candidates.
pub(super) type Values<const L: usize> = [f64; L];

/// Coefficients of a step with `N` states of `L` candidates, in the order of the kernel.
#[repr(align(64))]
pub(super) struct Coefficients<const N: usize, const L: usize> {
    pub phi: [[Values<L>; N]; N],
    /// Gain of what does not change.
    pub bias: [Values<L>; N],
    /// True for each state with a reaction.
    pub acts: [bool; N],
    /// Largest magnitude that the reaction of a state subtracts from it, and the change of each other state by a unit of it.
    pub limits: [Values<L>; N],
    pub adds: [[Values<L>; N]; N],
    /// Gain of each tap on each state.
    pub taps: Vec<[Values<L>; N]>,
    pub initial: [Values<L>; N],
}

impl<const N: usize, const L: usize> Coefficients<N, L> {
    /// Takes the coefficients of the candidates from lane `first` on.
    #[inline(always)]
    pub fn new(
        layout: &AffineStep,
        (parameters, results): (&[Register<PARTS>], &[Register<PARTS>]),
        first: usize,
    ) -> Self {
        let zero = [0.0; L];
        let mut own = Self {
            phi: [[zero; N]; N],
            bias: [zero; N],
            acts: [false; N],
            limits: [zero; N],
            adds: [[zero; N]; N],
            taps: Vec::with_capacity(layout.taps.len()),
            initial: [zero; N],
        };
        let states = &layout.states;
        for row in 0..N {
            own.initial[row] = lanes(&results[states[row]], first);
            for column in 0..N {
                own.phi[row][column] = lanes(&parameters[layout.change + states[row] * N + states[column]], first);
            }
            for lane in 0..L {
                own.phi[row][row][lane] += 1.0;
            }
        }
        let column = |place: usize| -> [Values<L>; N] {
            let mut column = [zero; N];
            for row in 0..N {
                column[row] = lanes(&parameters[place + states[row]], first);
            }
            column
        };
        if let Some(place) = layout.constant {
            own.bias = column(place);
        }
        for tap in &layout.taps {
            own.taps.push(column(tap.place));
        }
        for (number, reaction) in layout.reactions.iter().enumerate() {
            let (gain, of) = (column(reaction.place), reaction.own);
            let limit: Values<L> = lanes(&results[N + number], first);
            own.acts[of] = true;
            for lane in 0..L {
                own.limits[of][lane] = limit[lane] * gain[of][lane].abs();
            }
            for other in 0..N {
                for lane in 0..L {
                    own.adds[of][other][lane] = -gain[other][lane] / gain[of][lane];
                }
            }
        }
        own
    }

    /// Returns the gain of the values of all taps.
    #[inline(always)]
    pub fn gain<const FMA: bool>(&self, inputs: &[f64]) -> [Values<L>; N] {
        let mut gain = self.bias;
        for (tap, input) in self.taps.iter().zip(inputs) {
            for row in 0..N {
                for lane in 0..L {
                    gain[row][lane] = motorfit_motor::multiply_add::<FMA>(tap[row][lane], *input, gain[row][lane]);
                }
            }
        }
        gain
    }
}

/// Returns the values of `L` lanes of a register, from the lane `first` on.
#[inline(always)]
fn lanes<const L: usize>(register: &Register<PARTS>, first: usize) -> Values<L> {
    let mut values = [0.0; L];
    for lane in 0..L {
        values[lane] = register.lane(first + lane);
    }
    values
}
