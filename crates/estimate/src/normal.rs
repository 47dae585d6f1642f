//! Normal equations of a joint fit. The sums of each recording and channel are stored separately, so that weights can
//! change without a new simulation.

use super::linear_steps::INITIAL;
use super::output_error::products;
use super::sensitivity::{self, Products};
use motorfit_evaluate::{Problem, Signals};
use motorfit_motor::Axis;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// σ of current \[A\] and speed \[rad/s\] of each recording.
pub(super) type Sigma = Vec<[f64; 2]>;

/// Returns the sum of squared errors, the last diagonal entry of the sums.
fn squares(sums: &Products) -> f64 {
    sums[(sums.nrows() - 1, sums.nrows() - 1)]
}

/// A joint fit of the free parameters of a problem and the free initial states. The unknowns of the parameters are their
/// coordinates: logarithms for the five of the motor.
pub(super) struct Fit<'a> {
    pub problem: &'a Problem,
    /// Number of unknowns: the free parameters, then current and speed at the start of each recording whose initial state
    /// is free.
    pub unknowns: usize,
    /// For each recording, pairs of the index of an unknown and the index of its entry in a row.
    entries: Vec<Vec<(usize, usize)>>,
}

/// The sums JᵀJ, Jᵀe and eᵀe of each recording and channel, with sensitivities J and residuals e.
#[derive(Clone)]
pub(super) struct Normal(Vec<[Products; 2]>);

impl Normal {
    /// Returns eᵀe of a channel of a recording, including the samples before the first active one.
    pub(super) fn squares(&self, recording: usize, channel: usize) -> f64 {
        squares(&self.0[recording][channel])
    }

    /// Returns eᵀe of each channel of all recordings.
    pub(super) fn all_squares(&self) -> Vec<[f64; 2]> {
        (0..self.0.len()).map(|n| [0, 1].map(|channel| self.squares(n, channel))).collect()
    }

    /// Returns true if all sums are finite, that is, the motor did not diverge.
    pub(super) fn is_finite(&self) -> bool {
        self.0.iter().flatten().all(|sums| sums.iter().all(|v| v.is_finite()))
    }

    /// Returns the sum of eᵀe in units of σ² over recordings and channels.
    pub(super) fn cost(&self, sigma: &Sigma) -> f64 {
        let pairs = self.0.iter().zip(sigma).flat_map(|(of, sigma)| of.iter().zip(sigma));
        pairs.map(|(of, sigma)| squares(of) / (sigma * sigma)).sum()
    }
}

impl<'a> Fit<'a> {
    pub(super) fn new(problem: &'a Problem) -> Self {
        let axes = problem.space().free();
        let mut unknowns = axes.len();
        let mut entries = Vec::with_capacity(problem.signals().len());
        for (recording, signals) in problem.signals().iter().enumerate() {
            let covers = |axis: &Axis| axis.scope.covers(u32::try_from(recording).unwrap_or(u32::MAX));
            let own = axes.iter().enumerate().filter(|(_, axis)| covers(axis));
            // Rows of the linear motor have an entry for each of the five parameters, rows of extended motors for the free
            // ones only.
            let linear = problem.features().is_linear();
            let entry =
                |(n, (axis, of)): (usize, (usize, &Axis))| (axis, if linear { of.parameter as usize } else { n });
            let mut own: Vec<(usize, usize)> = own.enumerate().map(entry).collect();
            if signals.initial_is_free {
                let first = if linear { INITIAL } else { own.len() };
                own.extend([(unknowns, first), (unknowns + 1, first + 1)]);
                unknowns += 2;
            }
            entries.push(own);
        }
        Self { problem, unknowns, entries }
    }

    /// Returns the indices of the unknowns of a recording: its axes in their order, then its initial state if that is free.
    pub(super) fn unknowns_of(&self, recording: usize) -> Vec<usize> {
        self.entries[recording].iter().map(|entry| entry.0).collect()
    }

    /// Returns the number of measured values that are not masked, over all channels and recordings.
    pub(super) fn count(&self) -> usize {
        let counting =
            |s: &Signals| (0..2).filter(|&channel| s.has(channel)).map(|channel| s.count(channel)).sum::<usize>();
        self.problem.signals().iter().map(|s| counting(s)).sum()
    }

    /// Returns the unknowns at the parameters `values`, with initial states as measured.
    pub(super) fn start(&self, values: &[f64]) -> DVector<f64> {
        let initial: Vec<[f64; 2]> = self.problem.signals().iter().map(|s| s.initial).collect();
        self.at(values, &initial)
    }

    /// Returns the unknowns at the parameters `values` and the initial states `initial` of the recordings.
    pub(super) fn at(&self, values: &[f64], initial: &[[f64; 2]]) -> DVector<f64> {
        let pairs = self.problem.signals().iter().zip(initial);
        let states = pairs.filter(|(s, _)| s.initial_is_free).flat_map(|(_, state)| *state);
        let coordinates = self.problem.space().free().iter().zip(values).map(|(axis, value)| axis.coordinate(*value));
        DVector::from_iterator(self.unknowns, coordinates.chain(states))
    }

    /// Returns the values of the free parameters, clamped to their bounds because the coordinates round.
    pub(super) fn values(&self, unknowns: &DVector<f64>) -> Vec<f64> {
        let axes = self.problem.space().free();
        axes.iter().zip(unknowns.iter()).map(|(axis, v)| axis.value(*v)).collect()
    }

    /// Returns the initial state of every recording.
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

    /// Returns the sums of one recording, including the samples before the first active one; the sums of unmeasured channels
    /// are zero.
    fn one(&self, recording: usize, values: &[f64], initial: [f64; 2]) -> [Products; 2] {
        let signals: &Signals = &self.problem.signals()[recording];
        let mut sums = if self.problem.features().is_linear() {
            let parameters = self.problem.parameters(values, recording);
            products(signals, &parameters, initial, self.problem.method())
                .map(|sums| DMatrix::from_fn(sums.len(), sums.len(), |a, b| sums[a][b]))
        } else {
            let axes = self.problem.space().free().len();
            let own: Vec<usize> = self.entries[recording].iter().map(|entry| entry.0).filter(|n| *n < axes).collect();
            sensitivity::products(self.problem, recording, &own, values, initial)
        };
        let idle = self.problem.idle_sums(signals);
        for (channel, of) in sums.iter_mut().enumerate() {
            let error = of.nrows() - 1;
            if signals.has(channel) {
                of[(error, error)] += idle[channel];
            } else {
                of.fill(0.0);
            }
        }
        sums
    }

    /// Returns JᵀJ and Jᵀe summed over recordings and channels, each divided by its σ².
    pub(super) fn weighted(&self, normal: &Normal, sigma: &Sigma) -> (DMatrix<f64>, DVector<f64>) {
        let mut matrix = DMatrix::zeros(self.unknowns, self.unknowns);
        let mut gradient = DVector::zeros(self.unknowns);
        for ((entries, sums), sigma) in self.entries.iter().zip(&normal.0).zip(sigma) {
            for (sums, sigma) in sums.iter().zip(sigma) {
                let weight = 1.0 / (sigma * sigma);
                for &(row, a) in entries {
                    for &(column, b) in entries {
                        matrix[(row, column)] += weight * sums[(a, b)];
                    }
                    gradient[row] += weight * sums[(a, sums.nrows() - 1)];
                }
            }
        }
        (matrix, gradient)
    }
}
