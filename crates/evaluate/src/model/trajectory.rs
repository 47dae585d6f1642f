//! Trajectories of one candidate on a recording, and their derivatives with respect to the unknowns.
//!
//! Each lane of a tangent program carries one direction of a candidate: a free parameter in its coordinate, or the initial value of an
//! open state. All lanes of a candidate compute the same values.

use super::problem::ModelProblem;
use super::programs::Programs;
use crate::interpreter::{Job, Loss, Register, Rows, RunProgram, Vector, WIDTH, Work};
use motorfit_model::step::WithRate;

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
#[doc(hidden)]
pub enum Unknown {
    /// A parameter of the model, which changes at the rate.
    Parameter(usize, f64),
    /// An open initial state, by its place among them.
    Initial(usize),
}

/// A candidate on a recording: its parameters, the initial values of its open states, and the directions of its derivatives.
#[derive(Debug, Clone, Copy)]
#[doc(hidden)]
pub struct Point<'a> {
    /// Values of the parameters in their units, shape `[parameters]`.
    pub values: &'a [f64],
    /// Initial values of the open states in their units, shape `[open states]`.
    pub open: &'a [f64],
    /// Directions of the derivatives.
    pub unknowns: &'a [Unknown],
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

    /// Returns the initial values of the open states of each recording, as measured or 0.
    #[must_use]
    #[doc(hidden)]
    pub fn open_initials(&self) -> Vec<Vec<f64>> {
        self.recordings.iter().map(|recording| recording.open.clone()).collect()
    }

    /// Returns the problem whose candidates begin at other initial values of the open states of each recording.
    #[doc(hidden)]
    #[must_use]
    pub fn with_open_initials(&self, initial: &[Vec<f64>]) -> Self {
        let mut other = self.clone();
        for (recording, open) in other.recordings.iter_mut().zip(initial) {
            recording.open.iter_mut().zip(open).for_each(|(own, value)| *own = *value);
        }
        other
    }

    /// Simulates a candidate with its derivatives in the given directions.
    #[doc(hidden)]
    pub fn trajectory(&self, free: &[f64], recording: usize, open: &[f64], unknowns: &[Unknown]) -> Trajectory {
        self.trajectory_at(Point { values: &self.space.values(free, recording), open, unknowns }, recording)
    }

    pub(super) fn trajectory_at(&self, point: Point<'_>, recording: usize) -> Trajectory {
        let Point { unknowns, .. } = point;
        let samples = self.recordings[recording].recording.len();
        let outputs = self.model.outputs.len();
        let mut result =
            Trajectory { outputs: Vec::new(), sensitivities: vec![vec![0.0; samples * unknowns.len()]; outputs] };
        let mut from = 0;
        loop {
            let left = &unknowns[from..];
            let part = &left[..left.len().min(Register::<2>::LANES)];
            let point = Point { unknowns: part, ..point };
            match part.len() {
                0..=WIDTH => self.part::<1>(point, recording, from, &mut result),
                _ => self.part::<2>(point, recording, from, &mut result),
            }
            from += part.len();
            if from >= unknowns.len() {
                return result;
            }
        }
    }

    /// Simulates with the derivatives of some directions, of which the first has the number `first`.
    fn part<const C: usize>(&self, point: Point<'_>, recording: usize, first: usize, result: &mut Trajectory)
    where
        Work<C>: RunProgram,
    {
        let prepared = &self.recordings[recording];
        let programs = &self.programs[prepared.programs];
        let mut work = Work::<C>::default();
        self.load_tangents(&mut work, programs, &[point], Register::<C>::LANES);
        let (program, rows) = match point.unknowns.is_empty() {
            true => (&programs.program, &prepared.rows),
            false => (&programs.tangent, &prepared.tangent_rows),
        };
        work.run(&Job { program, rows, loss: Loss::Keep });
        let (outputs, width) = (self.model.outputs.len(), program.outputs);
        if result.outputs.is_empty() {
            let value = |output: usize| (0..rows.samples).map(|n| work.outputs[n * width + output].lane(0)).collect();
            result.outputs = (0..outputs).map(value).collect();
        }
        if point.unknowns.is_empty() {
            return;
        }
        let count = result.sensitivities.first().map_or(0, |all| all.len() / rows.samples.max(1));
        for (output, all) in result.sensitivities.iter_mut().enumerate() {
            for n in 0..rows.samples {
                let register = &work.outputs[n * width + outputs + output];
                for lane in 0..point.unknowns.len() {
                    all[n * count + first + lane] = register.lane(lane);
                }
            }
        }
    }

    /// Loads the parameters of candidates and their rates, a direction a lane; each takes `width` lanes, and those beyond them repeat the
    /// last one.
    pub(super) fn load_tangents<const C: usize>(
        &self,
        work: &mut Work<C>,
        programs: &Programs,
        points: &[Point<'_>],
        width: usize,
    ) where
        Work<C>: RunProgram,
    {
        let own = self.model.parameters.len();
        let all = programs.step.all_parameters();
        work.parameters.clear();
        work.parameters.resize(2 * all, Register::ZERO);
        for lane in 0..Register::<C>::LANES {
            let point = &points[(lane / width).min(points.len() - 1)];
            for (number, value) in point.values.iter().chain(point.open).enumerate() {
                work.parameters[number].set(lane, *value);
            }
        }
        for (place, point) in points.iter().enumerate() {
            for (lane, unknown) in point.unknowns.iter().enumerate() {
                let lane = width * place + lane;
                match *unknown {
                    Unknown::Parameter(number, rate) => work.parameters[all + number].set(lane, rate),
                    Unknown::Initial(place) => work.parameters[all + own + place].set(lane, 1.0),
                }
            }
        }
        let (Some(extras), Some(matrices)) = (&programs.step.extras, &programs.tangent_matrices) else { return };
        work.run(&Job { program: matrices, rows: &Rows::default(), loss: Loss::Squares });
        let (entries, rates) = work.results.split_at(work.results.len() / 2);
        let first = programs.step.parameters;
        for part in 0..C {
            let both = entries.iter().zip(rates);
            let roots: Vec<WithRate<Vector>> =
                both.map(|(value, rate)| WithRate { value: value[part], rate: rate[part] }).collect();
            extras.compute(&roots, |number, of| {
                work.parameters[first + number][part] = of.value;
                work.parameters[all + first + number][part] = of.rate;
            });
        }
    }
}
