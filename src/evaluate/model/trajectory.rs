//! Trajectories of one candidate on a recording, and their derivatives with respect to the unknowns.
//!
//! Each lane of a tangent program carries one direction: a free parameter in its coordinate, or the initial value of an open state.
//! All lanes compute the same values.

use super::problem::ModelProblem;
use super::programs::Programs;
use crate::evaluate::interpreter::{Job, Loss, Register, Rows, Work};
use crate::model::step::WithRate;

/// Outputs of a candidate on a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory {
    /// Values, shape `[outputs][samples]`, in the units of the outputs.
    pub outputs: Vec<Vec<f64>>,
    /// Derivatives with respect to each unknown, shape `[outputs][samples × unknowns]`; empty if they were not asked for.
    pub sensitivities: Vec<Vec<f64>>,
}

/// A direction of a derivative.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Unknown {
    /// A parameter of the model, which changes at the rate.
    Parameter(usize, f64),
    /// An open initial state, by its place among them.
    Initial(usize),
}

impl ModelProblem {
    /// Simulates a candidate on a recording from its own initial state; `open` are the initial values of the states that are measured
    /// or free, in their units.
    ///
    /// # Panics
    /// Panics if a length does not fit the problem.
    #[must_use]
    pub fn simulate(&self, free: &[f64], recording: usize, open: &[f64]) -> Trajectory {
        self.trajectory(free, recording, open, &[])
    }

    /// Returns the initial values of the open states of a recording, as measured or 0.
    ///
    /// # Panics
    /// Panics if there is no such recording.
    #[must_use]
    pub fn open_initial(&self, recording: usize) -> &[f64] {
        &self.recordings[recording].open
    }

    /// Simulates a candidate with its derivatives in the given directions.
    pub(crate) fn trajectory(&self, free: &[f64], recording: usize, open: &[f64], unknowns: &[Unknown]) -> Trajectory {
        let samples = self.recordings[recording].recording.len();
        let outputs = self.model.outputs.len();
        let mut result = Trajectory {
            outputs: Vec::new(),
            sensitivities: vec![vec![0.0; samples * unknowns.len()]; if unknowns.is_empty() { 0 } else { outputs }],
        };
        let values = self.space.values(free, recording);
        let mut from = 0;
        loop {
            let left = &unknowns[from..];
            if left.len() <= Register::<1>::LANES {
                self.part::<1>((&values, open), recording, (left, from), &mut result);
            } else {
                let part = &left[..left.len().min(Register::<2>::LANES)];
                self.part::<2>((&values, open), recording, (part, from), &mut result);
            }
            from += left.len().min(Register::<2>::LANES);
            if from >= unknowns.len() {
                return result;
            }
        }
    }

    /// Simulates with the derivatives of some directions, of which the first has the number `first`.
    fn part<const C: usize>(
        &self,
        (values, open): (&[f64], &[f64]),
        recording: usize,
        (unknowns, first): (&[Unknown], usize),
        result: &mut Trajectory,
    ) where
        Work<C>: Runs,
    {
        let prepared = &self.recordings[recording];
        let programs = &self.programs[prepared.programs];
        let mut work = Work::<C>::default();
        self.load_tangents(&mut work, programs, (values, open), unknowns);
        let is_plain = unknowns.is_empty();
        let (program, rows) = match is_plain {
            true => (&programs.program, &prepared.rows),
            false => (&programs.tangent, &prepared.tangent_rows),
        };
        work.go(&Job { program, rows, loss: Loss::Keep });
        let (outputs, width) = (self.model.outputs.len(), program.outputs);
        if result.outputs.is_empty() {
            let value = |output: usize| (0..rows.samples).map(|n| work.outputs[n * width + output].lane(0)).collect();
            result.outputs = (0..outputs).map(value).collect();
        }
        let count = result.sensitivities.first().map_or(0, |all| all.len() / rows.samples.max(1));
        for (output, all) in result.sensitivities.iter_mut().enumerate() {
            for n in 0..rows.samples {
                let register = &work.outputs[n * width + outputs + output];
                for lane in 0..unknowns.len() {
                    all[n * count + first + lane] = register.lane(lane);
                }
            }
        }
    }

    /// Loads parameters and their rates, a direction a lane.
    fn load_tangents<const C: usize>(
        &self,
        work: &mut Work<C>,
        programs: &Programs,
        (values, open): (&[f64], &[f64]),
        unknowns: &[Unknown],
    ) where
        Work<C>: Runs,
    {
        let own = self.model.parameters.len();
        let all = programs.step.all_parameters();
        work.parameters.clear();
        work.parameters.resize(2 * all, Register::ZERO);
        for (number, value) in values.iter().chain(open).enumerate() {
            work.parameters[number] = Register::of(*value);
        }
        for (lane, unknown) in unknowns.iter().enumerate() {
            match *unknown {
                Unknown::Parameter(number, rate) => work.parameters[all + number].set(lane, rate),
                Unknown::Initial(place) => work.parameters[all + own + place].set(lane, 1.0),
            }
        }
        let (Some(extras), Some(matrices)) = (&programs.step.extras, &programs.tangent_matrices) else { return };
        work.go(&Job { program: matrices, rows: &Rows::default(), loss: Loss::Squares });
        // At most 16 lanes; those beyond are zero.
        let lanes = |register: &Register<C>| -> [f64; 16] {
            std::array::from_fn(|lane| if lane < Register::<C>::LANES { register.lane(lane) } else { 0.0 })
        };
        let (entries, rates) = work.results.split_at(work.results.len() / 2);
        let roots: Vec<WithRate<[f64; 16]>> = entries
            .iter()
            .zip(rates)
            .map(|(value, rate)| WithRate { value: lanes(value), rate: lanes(rate) })
            .collect();
        let first = programs.step.parameters;
        extras.compute(&roots, |number, of| {
            for lane in 0..Register::<C>::LANES {
                work.parameters[first + number].set(lane, of.value[lane]);
                work.parameters[all + first + number].set(lane, of.rate[lane]);
            }
        });
    }
}

/// Working memory of one of the widths that programs run with.
trait Runs {
    fn go(&mut self, job: &Job<'_>);
}

impl Runs for Work<1> {
    fn go(&mut self, job: &Job<'_>) {
        self.run(job);
    }
}

impl Runs for Work<2> {
    fn go(&mut self, job: &Job<'_>) {
        self.run(job);
    }
}
