//! Fits of single recordings of a joint fit, each from the joint optimum, and what they gain.

use super::descent::Descent;
use super::ended::Ended;
use super::fit::Fit;
use super::fitted::{Block, Fitted, Place, Point};
use super::refined::Refined;
use super::weights::first_sigma;
use motorfit_core::coordinate::Coordinate;
use motorfit_core::numeric::count;
use motorfit_evaluate::Problem;
use nalgebra::DMatrix;
use rayon::prelude::*;

/// The fit of one recording alone.
#[derive(Debug, Clone, PartialEq)]
pub struct Separate {
    /// The free parameters of the joint fit that act on the recording.
    pub axes: Vec<usize>,
    /// Estimate of these; its only recording is this one.
    pub refined: Ended,
    /// Twice the log-likelihood ratio of the separate fit to the joint one.
    pub gain: f64,
    /// Variance inflation by the correlation of the residuals.
    pub inflation: f64,
}

/// Returns the fit of each recording of a joint fit of the motor alone, from the joint optimum; `None` if one fails.
#[must_use]
pub fn separate_fits(problem: &Problem, shared: &Refined) -> Option<Vec<Separate>> {
    separate(problem, &shared.into())
}

/// Returns the fit of each recording alone, from the joint optimum; `None` if one fails.
pub(crate) fn separate(problem: &dyn Fitted, shared: &Ended) -> Option<Vec<Separate>> {
    let all = || (0..problem.recordings()).into_par_iter().map(|n| alone(problem, shared, n)).collect();
    if shared.suits(problem) { all() } else { None }
}

fn alone(problem: &dyn Fitted, shared: &Ended, recording: usize) -> Option<Separate> {
    let axes: Vec<usize> = (0..shared.values.len()).filter(|axis| problem.acts(*axis, recording)).collect();
    let only = Only { problem, recording, axes: &axes, values: &shared.values };
    let fit = Fit::new(&only);
    let start: Vec<f64> = axes.iter().map(|axis| shared.values[*axis]).collect();
    let (search, converged) = Descent::new(&fit, &fit.start(&start), &first_sigma(&fit))?.weighed();
    let refined = search.finish(converged, true);
    let inflation = refined.uncertainty.variance_inflation();
    let sums = |squares: &[f64]| {
        squares.iter().zip(&refined.sigmas[0]).map(|(squares, sigma)| squares / (sigma * sigma)).sum::<f64>()
    };
    let gain = (sums(&shared.squares[recording]) - sums(&refined.squares[0])).max(0.0) / inflation;
    // With an estimated σ twice the log-likelihood ratio is `N ln(1 + g/N)`, which is less than the decrease g.
    let effective = (count(fit.count()) / inflation).max(1.0);
    Some(Separate { axes, gain: effective * (gain / effective).ln_1p(), refined, inflation })
}

/// One recording of a problem, with the parameters that act on it.
struct Only<'a> {
    problem: &'a dyn Fitted,
    recording: usize,
    axes: &'a [usize],
    /// Values of all free parameters of the problem.
    values: &'a [f64],
}

impl Only<'_> {
    fn all(&self, values: &[f64]) -> Vec<f64> {
        let mut all = self.values.to_vec();
        self.axes.iter().zip(values).for_each(|(axis, value)| all[*axis] = *value);
        all
    }

    fn place(&self, of: Place) -> Place {
        (self.recording, of.1)
    }
}

impl Fitted for Only<'_> {
    fn axes(&self) -> Vec<Coordinate> {
        let all = self.problem.axes();
        self.axes.iter().map(|axis| all[*axis]).collect()
    }

    fn acts(&self, _: usize, _: usize) -> bool {
        true
    }

    fn recordings(&self) -> usize {
        1
    }

    fn outputs(&self) -> usize {
        self.problem.outputs()
    }

    fn has(&self, of: Place) -> bool {
        self.problem.has(self.place(of))
    }

    fn samples(&self, _: usize) -> usize {
        self.problem.samples(self.recording)
    }

    fn count(&self, of: Place) -> usize {
        self.problem.count(self.place(of))
    }

    fn rms(&self, of: Place) -> f64 {
        self.problem.rms(self.place(of))
    }

    fn noise(&self, of: Place) -> f64 {
        self.problem.noise(self.place(of))
    }

    fn deviation(&self, of: Place) -> f64 {
        self.problem.deviation(self.place(of))
    }

    fn effective_sample_ratio(&self, _: usize) -> f64 {
        self.problem.effective_sample_ratio(self.recording)
    }

    fn initial(&self, _: usize) -> Vec<f64> {
        self.problem.initial(self.recording)
    }

    fn states(&self, _: usize) -> usize {
        self.problem.states(self.recording)
    }

    fn has_kinks(&self) -> bool {
        self.problem.has_kinks()
    }

    fn side_by_side(&self) -> usize {
        self.problem.side_by_side()
    }

    fn blocks(&self, points: &[Point], _: usize) -> Vec<Option<Vec<Block>>> {
        let point = |of: &Point| {
            let mut initial = vec![Vec::new(); self.problem.recordings()];
            initial[self.recording].clone_from(&of.initial[0]);
            Point { values: self.all(&of.values), initial }
        };
        self.problem.blocks(&points.iter().map(point).collect::<Vec<_>>(), self.recording)
    }

    fn residuals(&self, values: &[f64], _: usize, initial: &[f64]) -> Vec<Vec<f64>> {
        self.problem.residuals(&self.all(values), self.recording, initial)
    }

    fn shaped(&self, values: &[f64], _: usize, initial: &[f64], filters: &[Vec<f64>]) -> Vec<DMatrix<f64>> {
        self.problem.shaped(&self.all(values), self.recording, initial, filters)
    }
}
