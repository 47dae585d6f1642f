//! A program on the samples of a recording.

use super::execute::execute;
use super::memory::{Clock, Memory};
use super::normal::{Directions, accumulate};
use super::register::{Register, WIDTH};
use crate::Level;
use motorfit_model::graph::{Leaf, evaluate};
use motorfit_model::program::{Instruction, Operation, Program, Uniforms};
use motorfit_model::step::MemoryKind;
use motorfit_motor::multiply_add;

/// Treatment of the outputs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Loss {
    /// Squares of the errors are summed.
    Squares,
    /// Squares are summed with the weights of the rows.
    WeightedSquares,
    /// Magnitudes are summed with the weights of the rows.
    WeightedMagnitudes,
    /// The outputs are kept.
    Keep,
    /// Normal equations are summed from the outputs and their derivatives.
    Normal(Directions),
}

/// Scalars of a recording, sample by sample.
#[derive(Debug, Clone, Default)]
pub struct Rows {
    /// Number of samples.
    pub samples: usize,
    /// Uniforms of the program, shape `[samples, uniforms]`.
    pub uniforms: Vec<f64>,
    /// Measured outputs, shape `[samples, outputs]`; 0 where the weight is 0.
    pub measured: Vec<f64>,
    /// Weights of the losses, shape `[samples, outputs]`; empty if all are 1.
    pub weights: Vec<f64>,
    /// Steps, for operations with a memory.
    pub clock: Clock,
}

impl Rows {
    /// Computes the uniforms of a program. `input(n, leaf)` is the value of a leaf at sample `n`.
    pub fn uniforms(of: &Uniforms, samples: usize, input: &impl Fn(usize, Leaf) -> f64) -> Vec<f64> {
        let mut values = Vec::new();
        let mut all = Vec::with_capacity(samples * of.roots.len());
        for n in 0..samples {
            all.extend(evaluate(&of.graph, &of.roots, &mut values, &|leaf| input(n, leaf)));
        }
        all
    }
}

/// Working memory of a run: registers, parameters by their numbers, sums or kept outputs.
#[derive(Debug, Default)]
pub(crate) struct Work<const C: usize> {
    registers: Vec<Register<C>>,
    memories: Vec<Memory<C>>,
    scalars: Vec<f64>,
    /// Values of the parameters.
    pub parameters: Vec<Register<C>>,
    /// Sums of the losses of each output; with [`Loss::Keep`] the outputs, shape `[samples, outputs]`; with [`Loss::Normal`] those of the
    /// last sample.
    pub outputs: Vec<Register<C>>,
    /// Sums of the normal equations, shape `[outputs, sums]`.
    pub sums: Vec<Register<C>>,
    /// Results of the setup.
    pub results: Vec<Register<C>>,
}

/// A program and the rows that it runs on.
pub(crate) struct Job<'a> {
    pub program: &'a Program,
    pub rows: &'a Rows,
    pub loss: Loss,
}

#[inline(always)]
fn run<const C: usize, const FMA: bool>(job: &Job<'_>, work: &mut Work<C>) {
    let Job { program, rows, loss } = *job;
    let Work { registers, memories, scalars, parameters, outputs, sums, results } = work;
    memories.clear();
    memories.resize_with(program.memories, Memory::new);
    registers.clear();
    registers.resize(program.registers, Register::ZERO);
    for (register, number) in &program.parameters {
        registers[usize::from(*register)] = parameters[usize::from(*number)];
    }
    let (constants, uniforms) = (program.constants.len(), program.uniforms.roots.len());
    scalars.clear();
    scalars.extend_from_slice(&program.constants);
    scalars.resize(constants + uniforms, 0.0);
    let registers = &mut registers[..];
    let width = program.outputs;
    outputs.clear();
    outputs.resize(if loss == Loss::Keep { width * rows.samples } else { width }, Register::ZERO);
    if let Loss::Normal(directions) = loss {
        sums.clear();
        sums.resize(width / 2 * directions.sums(), Register::ZERO);
    }
    // The setup takes the same loop, so that the instructions are compiled once.
    for n in std::iter::once(None).chain((0..rows.samples).map(Some)) {
        let sample = n.unwrap_or(0);
        if n.is_some() {
            scalars[constants..].copy_from_slice(&rows.uniforms[sample * uniforms..(sample + 1) * uniforms]);
        }
        for instruction in if n.is_some() { &program.body } else { &program.setup } {
            if instruction.operation.has_memory() {
                remember(instruction, registers, memories, &rows.clock);
                continue;
            }
            if instruction.operation != Operation::Output {
                execute::<C, FMA>(instruction, registers, scalars);
                continue;
            }
            let (output, from) = (usize::from(instruction.target), usize::from(instruction.registers[0]));
            let value = &registers[from];
            match loss {
                Loss::Keep => outputs[sample * width + output] = *value,
                Loss::Normal(_) => outputs[output] = *value,
                _ => {
                    let at = sample * width + output;
                    let weight = if loss == Loss::Squares { 1.0 } else { rows.weights[at] };
                    add::<C, FMA>(&mut outputs[output], value, (rows.measured[at], weight), loss);
                }
            }
        }
        if n.is_none() {
            results.clear();
            results.extend(program.results.iter().map(|register| registers[usize::from(*register)]));
            for (state, initial) in &program.states {
                registers[usize::from(*state)] = registers[usize::from(*initial)];
            }
        } else if let Loss::Normal(directions) = loss {
            let row = sample * width / 2..(sample + 1) * width / 2;
            let weights = rows.weights.get(row.clone()).unwrap_or_default();
            accumulate::<C, FMA>(sums, outputs, (&rows.measured[row], weights), directions);
        }
    }
}

/// Adds the loss of an output at a sample.
#[inline(always)]
fn add<const C: usize, const FMA: bool>(
    sums: &mut Register<C>,
    value: &Register<C>,
    (measured, weight): (f64, f64),
    loss: Loss,
) {
    for part in 0..C {
        for lane in 0..WIDTH {
            let error = measured - value[part][lane];
            let sum = &mut sums[part][lane];
            match loss {
                Loss::Squares => *sum = multiply_add::<FMA>(error, error, *sum),
                Loss::WeightedMagnitudes => *sum += weight * error.abs(),
                _ => *sum += weight * error * error,
            }
        }
    }
}

/// Executes an operation with a memory.
fn remember<const C: usize>(
    instruction: &Instruction,
    registers: &mut [Register<C>],
    memories: &mut [Memory<C>],
    clock: &Clock,
) {
    let (number, substep) = instruction.memory();
    let Some(memory) = memories.get_mut(number) else { return };
    let none = Register::ZERO;
    let register = |n: usize| &registers[usize::from(instruction.registers[n])];
    let (kind, is_rate) = match instruction.operation {
        Operation::MemoryRate(kind) => (kind, true),
        Operation::Memory(kind) => (kind, false),
        _ => return,
    };
    let of = |n: usize| if is_rate { [register(2 * n), register(2 * n + 1)] } else { [register(n), &none] };
    let at = (clock, substep);
    let result = match kind {
        MemoryKind::Delay => memory.delayed(at, [of(0), of(1), of(2)], None),
        MemoryKind::LinearDelay => memory.delayed(at, [of(0), of(1), of(2)], Some(of(3))),
        MemoryKind::Average => memory.averaged(clock, [of(0), of(1)]),
        MemoryKind::Sensor => memory.sensor.show(at, [of(0), of(1), of(2)]),
        MemoryKind::Track => memory.sensor.track(at, [of(0), of(1), of(2)], None),
        MemoryKind::SmoothTrack => memory.sensor.track(at, [of(0), of(2), of(3)], Some(of(1))),
    };
    registers[usize::from(instruction.target)] = result[usize::from(is_rate)];
}

/// Working memory of one of the widths that programs run with.
pub(crate) trait RunProgram {
    /// Runs a program with the instructions of a level.
    fn run_at(&mut self, job: &Job<'_>, level: Level);

    /// Runs a program with the fastest instructions of this machine.
    fn run(&mut self, job: &Job<'_>) {
        self.run_at(job, Level::best());
    }
}

/// Defines the runs of registers with `C` parts, one for each level.
macro_rules! runs {
    ($($module:ident $c:literal)*) => { $(
        mod $module {
            use crate::at_level;
            use crate::interpreter::run::{Job, Work, run};

            at_level! {
                pub(super) fn avx512(job: &Job<'_>, work: &mut Work<$c>) = avx512 { run::<$c, true>(job, work) } else avx2
            }

            at_level! {
                pub(super) fn avx2(job: &Job<'_>, work: &mut Work<$c>) = avx2 { run::<$c, true>(job, work) } else portable
            }

            pub(super) fn portable(job: &Job<'_>, work: &mut Work<$c>) {
                run::<$c, false>(job, work);
            }
        }

        impl RunProgram for Work<$c> {
            fn run_at(&mut self, job: &Job<'_>, level: Level) {
                match level {
                    Level::Avx512 => $module::avx512(job, self),
                    Level::Avx2 => $module::avx2(job, self),
                    Level::Portable => $module::portable(job, self),
                }
            }
        }
    )* };
}

runs! { narrow 1 double 2 half 4 wide 8 }
