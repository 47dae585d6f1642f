//! The normal equations of a joint fit: one set per channel, so that weights can change without a new simulation.

use super::output_error::{ERROR, INITIAL, products};
use crate::evaluate::{Problem, Signals};
use crate::motor::Axis;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// A joint fit of the free parameters of a problem (their logarithms) and of the initial states that are free.
pub(super) struct Fit<'a> {
    pub problem: &'a Problem,
    /// Unknowns: the free parameters, then current and speed at the start of each recording that leaves them free.
    pub unknowns: usize,
    /// Values measured in each channel, over all recordings.
    pub counts: [usize; 2],
}

/// JᵀJ, Jᵀe and eᵀe of each channel.
#[derive(Clone)]
pub(super) struct Normal {
    pub matrix: [DMatrix<f64>; 2],
    pub gradient: [DVector<f64>; 2],
    pub squares: [f64; 2],
}

impl Normal {
    fn zero(unknowns: usize) -> Self {
        Self {
            matrix: [0, 1].map(|_| DMatrix::zeros(unknowns, unknowns)),
            gradient: [0, 1].map(|_| DVector::zeros(unknowns)),
            squares: [0.0; 2],
        }
    }

    fn add(&mut self, other: &Self) {
        for channel in 0..2 {
            self.matrix[channel] += &other.matrix[channel];
            self.gradient[channel] += &other.gradient[channel];
            self.squares[channel] += other.squares[channel];
        }
    }

    /// The equations of both channels, each divided by its σ².
    pub(super) fn weighted(&self, sigma: [f64; 2]) -> (DMatrix<f64>, DVector<f64>, f64) {
        let [a, b] = sigma.map(|s| 1.0 / (s * s));
        (
            &self.matrix[0] * a + &self.matrix[1] * b,
            &self.gradient[0] * a + &self.gradient[1] * b,
            self.squares[0] * a + self.squares[1] * b,
        )
    }

    /// Whether the motor has a trajectory at all.
    pub(super) fn is_finite(&self) -> bool {
        let finite = |channel: usize| self.matrix[channel].iter().chain(&self.gradient[channel]).all(|v| v.is_finite());
        self.squares.iter().all(|v| v.is_finite()) && finite(0) && finite(1)
    }
}

impl<'a> Fit<'a> {
    pub(super) fn new(problem: &'a Problem) -> Self {
        let signals = problem.signals();
        let count = |channel: usize| signals.iter().filter(|s| s.has(channel)).map(|s| s.len()).sum();
        let unknowns = problem.space().free().len() + 2 * signals.iter().filter(|s| s.initial_is_free).count();
        Self { problem, unknowns, counts: [count(0), count(1)] }
    }

    /// The unknowns at the parameters `values`, with initial states as measured.
    pub(super) fn start(&self, values: &[f64]) -> DVector<f64> {
        let states = self.problem.signals().iter().filter(|s| s.initial_is_free).flat_map(|s| s.initial);
        DVector::from_iterator(self.unknowns, values.iter().map(|v| v.ln()).chain(states))
    }

    /// The values of the free parameters.
    pub(super) fn values(&self, unknowns: &DVector<f64>) -> Vec<f64> {
        unknowns.iter().take(self.problem.space().free().len()).map(|v| v.exp()).collect()
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
        let signals = self.problem.signals();
        let mut free = self.problem.space().free().len();
        let mut place = |s: &Signals| {
            free += 2 * usize::from(s.initial_is_free);
            free - 2 * usize::from(s.initial_is_free)
        };
        let places: Vec<usize> = signals.iter().map(|s| place(s)).collect();
        let one = |recording: usize| self.one(recording, &values, initial[recording], places[recording]);
        if signals.len() == 1 {
            return one(0);
        }
        // Added up in the order of the recordings, whatever thread was first.
        let parts: Vec<Normal> = (0..signals.len()).into_par_iter().map(one).collect();
        parts.iter().fold(Normal::zero(self.unknowns), |mut sum, part| {
            sum.add(part);
            sum
        })
    }

    /// The equations of one recording, whose initial state stands at `place`.
    fn one(&self, recording: usize, values: &[f64], initial: [f64; 2], place: usize) -> Normal {
        let signals: &Signals = &self.problem.signals()[recording];
        let parameters = self.problem.parameters(values, recording);
        let sums = products(signals, &parameters, initial, self.problem.model().discretization);
        let covers = |axis: &Axis| axis.scope.covers(u32::try_from(recording).unwrap_or(u32::MAX));
        let axes = self.problem.space().free().iter().enumerate().filter(|(_, axis)| covers(axis));
        let mut places: Vec<(usize, usize)> = axes.map(|(n, axis)| (n, axis.parameter as usize)).collect();
        if signals.initial_is_free {
            places.extend([(place, INITIAL), (place + 1, INITIAL + 1)]);
        }
        let mut normal = Normal::zero(self.unknowns);
        for channel in (0..2).filter(|&channel| signals.has(channel)) {
            for &(row, a) in &places {
                for &(column, b) in &places {
                    normal.matrix[channel][(row, column)] = sums[channel][a][b];
                }
                normal.gradient[channel][row] = sums[channel][a][ERROR];
            }
            normal.squares[channel] = signals.rest[channel] + sums[channel][ERROR][ERROR];
        }
        normal
    }
}
