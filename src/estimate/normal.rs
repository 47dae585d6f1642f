//! The normal equations of a joint fit. The sums of each recording and channel are kept apart, so that weights can
//! change without a new simulation.

use super::output_error::{ERROR, INITIAL, Products, products};
use crate::evaluate::{Problem, Signals};
use crate::motor::Axis;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// σ of current and speed of each recording.
pub(super) type Sigma = Vec<[f64; 2]>;

/// A joint fit of the free parameters of a problem (their logarithms) and of the initial states that are free.
pub(super) struct Fit<'a> {
    pub problem: &'a Problem,
    /// Unknowns: the free parameters, then current and speed at the start of each recording that leaves them free.
    pub unknowns: usize,
    /// Of each recording, which unknown belongs to which entry of its rows.
    places: Vec<Vec<(usize, usize)>>,
}

/// JᵀJ, Jᵀe and eᵀe of each recording and channel.
pub(super) struct Normal(Vec<[Products; 2]>);

impl Normal {
    /// eᵀe of a channel of a recording, samples at rest included.
    pub(super) fn squares(&self, recording: usize, channel: usize) -> f64 {
        self.0[recording][channel][ERROR][ERROR]
    }

    /// Whether the motor has a trajectory at all.
    pub(super) fn is_finite(&self) -> bool {
        self.0.iter().flatten().flatten().flatten().all(|v| v.is_finite())
    }

    /// eᵀe in units of σ².
    pub(super) fn cost(&self, sigma: &Sigma) -> f64 {
        let squares = self.0.iter().zip(sigma).flat_map(|(of, sigma)| of.iter().zip(sigma));
        squares.map(|(of, sigma)| of[ERROR][ERROR] / (sigma * sigma)).sum()
    }
}

impl<'a> Fit<'a> {
    pub(super) fn new(problem: &'a Problem) -> Self {
        let axes = problem.space().free();
        let mut unknowns = axes.len();
        let mut places = Vec::with_capacity(problem.signals().len());
        for (recording, signals) in problem.signals().iter().enumerate() {
            let covers = |axis: &Axis| axis.scope.covers(u32::try_from(recording).unwrap_or(u32::MAX));
            let own = axes.iter().enumerate().filter(|(_, axis)| covers(axis));
            let mut own: Vec<(usize, usize)> = own.map(|(n, axis)| (n, axis.parameter as usize)).collect();
            if signals.initial_is_free {
                own.extend([(unknowns, INITIAL), (unknowns + 1, INITIAL + 1)]);
                unknowns += 2;
            }
            places.push(own);
        }
        Self { problem, unknowns, places }
    }

    /// Values measured in all recordings.
    pub(super) fn count(&self) -> usize {
        let counting =
            |s: &Signals| (0..2).filter(|&channel| s.has(channel)).map(|channel| s.count(channel)).sum::<usize>();
        self.problem.signals().iter().map(|s| counting(s)).sum()
    }

    /// The unknowns at the parameters `values`, with initial states as measured.
    pub(super) fn start(&self, values: &[f64]) -> DVector<f64> {
        let states = self.problem.signals().iter().filter(|s| s.initial_is_free).flat_map(|s| s.initial);
        DVector::from_iterator(self.unknowns, values.iter().map(|v| v.ln()).chain(states))
    }

    /// The values of the free parameters: the way through the logarithm must not lead out of the bounds.
    pub(super) fn values(&self, unknowns: &DVector<f64>) -> Vec<f64> {
        let axes = self.problem.space().free();
        axes.iter().zip(unknowns.iter()).map(|(axis, v)| v.exp().max(axis.min).min(axis.max)).collect()
    }

    /// The initial state of every recording.
    pub(super) fn initial(&self, unknowns: &DVector<f64>) -> Vec<[f64; 2]> {
        let mut next = self.problem.space().free().len();
        let mut take = || {
            next += 2;
            [unknowns[next - 2], unknowns[next - 1]]
        };
        self.problem.signals().iter().map(|s| if s.initial_is_free { take() } else { s.initial }).collect()
    }

    pub(super) fn normal(&self, unknowns: &DVector<f64>) -> Normal {
        let (values, initial) = (self.values(unknowns), self.initial(unknowns));
        let one = |recording: usize| self.one(recording, &values, initial[recording]);
        match self.problem.signals().len() {
            1 => Normal(vec![one(0)]),
            count => Normal((0..count).into_par_iter().map(one).collect()),
        }
    }

    /// The sums of one recording.
    fn one(&self, recording: usize, values: &[f64], initial: [f64; 2]) -> [Products; 2] {
        let signals: &Signals = &self.problem.signals()[recording];
        let parameters = self.problem.parameters(values, recording);
        let mut sums = products(signals, &parameters, initial, self.problem.model().discretization);
        for (channel, of) in sums.iter_mut().enumerate() {
            if signals.has(channel) {
                of[ERROR][ERROR] += signals.rest[channel];
            } else {
                *of = Products::default();
            }
        }
        sums
    }

    /// JᵀJ and Jᵀe of all recordings and channels, each divided by its σ².
    pub(super) fn weighted(&self, normal: &Normal, sigma: &Sigma) -> (DMatrix<f64>, DVector<f64>) {
        let mut matrix = DMatrix::zeros(self.unknowns, self.unknowns);
        let mut gradient = DVector::zeros(self.unknowns);
        for ((places, sums), sigma) in self.places.iter().zip(&normal.0).zip(sigma) {
            for (sums, sigma) in sums.iter().zip(sigma) {
                let weight = 1.0 / (sigma * sigma);
                for &(row, a) in places {
                    for &(column, b) in places {
                        matrix[(row, column)] += weight * sums[a][b];
                    }
                    gradient[row] += weight * sums[a][ERROR];
                }
            }
        }
        (matrix, gradient)
    }
}
