//! The DC motor as estimators see it: outputs are the current and the speed.

use super::fitted::{Block, Fitted, Place, Point, state};
use super::linear_steps::INITIAL;
use super::output_error::{self, products};
use super::sensitivity::{self, Case};
use super::shaped::shaped_products;
use super::weights::first;
use motorfit_core::coordinate::Coordinate;
use motorfit_evaluate::{Problem, Signals};
use motorfit_motor::Axis;
use nalgebra::{DMatrix, DVector};

/// Returns the first σ of each channel of a recording; 1 for a channel that was not measured.
pub(super) fn first_sigma(signals: &Signals) -> [f64; 2] {
    [0, 1].map(|channel| if signals.has(channel) { first(signals.noise(channel), signals.rms(channel)) } else { 1.0 })
}

/// Returns the free axes that act on a recording.
fn own(problem: &Problem, recording: usize) -> Vec<usize> {
    (0..problem.space().free().len()).filter(|axis| problem.acts(*axis, recording)).collect()
}

impl Fitted for Problem {
    fn axes(&self) -> Vec<Coordinate> {
        self.space().free().iter().map(Axis::range).collect()
    }

    fn acts(&self, axis: usize, recording: usize) -> bool {
        self.space().free()[axis].scope.covers(u32::try_from(recording).unwrap_or(u32::MAX))
    }

    fn recordings(&self) -> usize {
        self.signals().len()
    }

    fn outputs(&self) -> usize {
        2
    }

    fn has(&self, (recording, channel): Place) -> bool {
        self.signals()[recording].has(channel)
    }

    fn samples(&self, recording: usize) -> usize {
        self.signals()[recording].len()
    }

    fn count(&self, (recording, channel): Place) -> usize {
        self.signals()[recording].count(channel)
    }

    fn measured(&self, (recording, channel): Place) -> Vec<f64> {
        let signals = &self.signals()[recording];
        if !signals.has(channel) {
            return Vec::new();
        }
        let measured = signals.measured(channel).enumerate();
        measured.filter(|(n, _)| signals.counts(channel, *n)).map(|(_, y)| y).collect()
    }

    fn rms(&self, (recording, channel): Place) -> f64 {
        self.signals()[recording].rms(channel)
    }

    fn noise(&self, (recording, channel): Place) -> f64 {
        self.signals()[recording].noise(channel)
    }

    fn deviation(&self, (recording, channel): Place) -> f64 {
        self.signals()[recording].deviation(channel)
    }

    fn effective_sample_ratio(&self, recording: usize) -> f64 {
        self.signals()[recording].effective_sample_ratio
    }

    fn initial(&self, recording: usize) -> Vec<f64> {
        self.signals()[recording].initial.to_vec()
    }

    fn states(&self, recording: usize) -> usize {
        if self.signals()[recording].initial_is_free { 2 } else { 0 }
    }

    fn has_kinks(&self) -> bool {
        false
    }

    fn side_by_side(&self) -> usize {
        1
    }

    fn blocks(&self, points: &[Point], recording: usize) -> Vec<Option<Vec<Block>>> {
        let one = |point: &Point| {
            let blocks = blocks(self, recording, &point.values, state(&point.initial[recording]));
            blocks.iter().all(Block::is_finite).then_some(blocks)
        };
        points.iter().map(one).collect()
    }

    fn residuals(&self, values: &[f64], recording: usize, initial: &[f64]) -> Vec<Vec<f64>> {
        let signals = &self.signals()[recording];
        residuals(self, values, (recording, initial), |channel, n| signals.counts(channel, n))
    }

    fn all_residuals(&self, values: &[f64], recording: usize, initial: &[f64]) -> Vec<Vec<f64>> {
        let signals = &self.signals()[recording];
        residuals(self, values, (recording, initial), |channel, n| signals.is_measured(channel, n))
    }

    fn shaped(&self, values: &[f64], recording: usize, initial: &[f64], filters: &[Vec<f64>]) -> Vec<DMatrix<f64>> {
        let own = own(self, recording);
        let case = Case { problem: self, recording, own: &own, values, initial: state(initial) };
        shaped_products(&case, &[0, 1].map(|channel: usize| filters[channel].clone())).to_vec()
    }
}

/// Returns the residuals of each channel at some of its samples.
fn residuals(
    problem: &Problem,
    values: &[f64],
    (recording, initial): (usize, &[f64]),
    is_taken: impl Fn(usize, usize) -> bool,
) -> Vec<Vec<f64>> {
    let signals = &problem.signals()[recording];
    let model = problem.simulate(values, recording, state(initial));
    let of = |channel: usize| {
        let pairs = signals.measured(channel).zip(&model[channel]).enumerate();
        pairs.filter(|(n, _)| is_taken(channel, *n)).map(|(_, (y, x))| y - x).collect()
    };
    (0..2).map(|channel| if signals.has(channel) { of(channel) } else { Vec::new() }).collect()
}

/// Returns the sums of one recording, including the samples before the first active one.
fn blocks(problem: &Problem, recording: usize, values: &[f64], initial: [f64; 2]) -> Vec<Block> {
    let signals: &Signals = &problem.signals()[recording];
    let own = own(problem, recording);
    let states = problem.states(recording);
    let idle = problem.idle_sums(signals);
    let block = |channel: usize, sum: &dyn Fn(usize, usize) -> f64, rows: &[usize], error: usize| {
        if !signals.has(channel) {
            return Block::none(rows.len());
        }
        Block {
            matrix: DMatrix::from_fn(rows.len(), rows.len(), |a, b| sum(rows[a], rows[b])),
            gradient: DVector::from_fn(rows.len(), |a, _| sum(rows[a], error)),
            squares: sum(error, error) + idle[channel],
        }
    };
    if problem.features().is_linear() {
        // Rows of the linear motor have an entry for each of the five parameters, rows of extended motors for the free ones only.
        let parameters = own.iter().map(|n| problem.space().free()[*n].parameter as usize);
        let rows: Vec<usize> = parameters.chain(INITIAL..INITIAL + states).collect();
        let sums = products(signals, &problem.parameters(values, recording), initial, problem.method());
        let of = |channel: usize| block(channel, &|a, b| sums[channel][a][b], &rows, output_error::ERROR);
        return vec![of(0), of(1)];
    }
    let rows: Vec<usize> = (0..own.len() + states).collect();
    let sums = sensitivity::products(problem, recording, &own, values, initial);
    let of = |channel: usize| block(channel, &|a, b| sums[channel][(a, b)], &rows, rows.len());
    vec![of(0), of(1)]
}
