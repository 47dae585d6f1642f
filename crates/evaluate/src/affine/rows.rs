//! Inputs and measured outputs of a recording, step by step.

use super::coefficients::AffineProgram;
use motorfit_core::numeric::count;

/// Steps of changing inputs whose gains are computed together.
pub(super) const CHUNK: usize = 32;
/// Steps of constant inputs from which on their gain is computed once.
const CONSTANT_MIN: usize = 4;

/// Consecutive steps, at most [`CHUNK`] of them if their inputs change.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Piece {
    pub from: usize,
    pub to: usize,
    pub is_constant: bool,
}

/// A recording for a kernel. A step is a substep; those that do not begin at a sample have the weight 0.
#[derive(Debug, Clone)]
pub(crate) struct AffineRows {
    pub(super) pieces: Vec<Piece>,
    /// Values of the taps, shape `[steps, taps]`.
    pub(super) inputs: Vec<f64>,
    /// Measured outputs in the order of the kernel, shape `[steps, outputs]`.
    pub(super) measured: Vec<f64>,
    /// Weights of the squared errors, shape `[steps, outputs]`; empty if all are 1.
    pub(super) weights: Vec<f64>,
}

impl AffineRows {
    /// Makes the rows of a recording of `samples` samples. `input` gives the number of an input and of a sample its value; `measured`
    /// and `weights` have the shape `[samples, outputs]` of the model, `weights` is empty if all are 1.
    pub fn new(
        program: &AffineProgram,
        samples: usize,
        input: impl Fn(usize, usize) -> f64,
        [measured, weights]: [&[f64]; 2],
    ) -> Self {
        let (layout, outputs) = (&program.layout, program.layout.outputs.len());
        let substeps = layout.substeps;
        let is_weighted = substeps > 1 || !weights.is_empty();
        let mut rows = Self { pieces: Vec::new(), inputs: Vec::new(), measured: Vec::new(), weights: Vec::new() };
        for n in 0..samples {
            for substep in 0..substeps {
                for tap in &layout.taps {
                    rows.inputs.push(if program.is_first_order_hold {
                        let fraction = count(substep + usize::from(tap.is_end)) / count(substeps);
                        let [start, end] = [n, (n + 1).min(samples - 1)].map(|n| input(tap.input, n));
                        (1.0 - fraction) * start + fraction * end
                    } else {
                        input(tap.input, n)
                    });
                }
                let of = |values: &[f64], output: &usize| {
                    if substep == 0 { values.get(n * outputs + output).copied().unwrap_or(1.0) } else { 0.0 }
                };
                rows.measured.extend(layout.outputs.iter().map(|output| of(measured, output)));
                if is_weighted {
                    rows.weights.extend(layout.outputs.iter().map(|output| of(weights, output)));
                }
            }
        }
        rows.pieces = pieces(&rows.inputs, layout.taps.len(), samples * substeps);
        rows
    }
}

/// Divides steps where their inputs change.
fn pieces(inputs: &[f64], taps: usize, steps: usize) -> Vec<Piece> {
    let row = |n: usize| &inputs[n * taps..(n + 1) * taps];
    let mut pieces: Vec<Piece> = Vec::new();
    let mut from = 0;
    while from < steps {
        let to = (from + 1..steps).find(|n| row(*n) != row(from)).unwrap_or(steps);
        if to - from >= CONSTANT_MIN {
            pieces.push(Piece { from, to, is_constant: true });
        } else {
            for n in from..to {
                match pieces.last_mut() {
                    Some(last) if !last.is_constant && last.to - last.from < CHUNK => last.to = n + 1,
                    _ => pieces.push(Piece { from: n, to: n + 1, is_constant: false }),
                }
            }
        }
        from = to;
    }
    pieces
}
