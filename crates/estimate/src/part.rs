//! A part of a problem as a problem of its own.

use super::fitted::{Block, Fitted, Place, Point};
use motorfit_core::coordinate::Coordinate;
use nalgebra::DMatrix;

/// A part of a problem: one recording or all, and some of the free parameters, with the others held.
pub(super) struct Part<'a> {
    pub problem: &'a dyn Fitted,
    /// The only recording; `None` for all.
    pub recording: Option<usize>,
    /// The free parameters of the problem that are free here.
    pub axes: &'a [usize],
    /// Values of all free parameters of the problem.
    pub values: &'a [f64],
}

impl Part<'_> {
    fn all(&self, values: &[f64]) -> Vec<f64> {
        let mut all = self.values.to_vec();
        self.axes.iter().zip(values).for_each(|(axis, value)| all[*axis] = *value);
        all
    }

    /// Returns the number of a recording in the problem.
    fn number(&self, recording: usize) -> usize {
        self.recording.unwrap_or(recording)
    }

    fn place(&self, of: Place) -> Place {
        (self.number(of.0), of.1)
    }
}

impl Fitted for Part<'_> {
    fn axes(&self) -> Vec<Coordinate> {
        let all = self.problem.axes();
        self.axes.iter().map(|axis| all[*axis]).collect()
    }

    fn acts(&self, axis: usize, recording: usize) -> bool {
        self.problem.acts(self.axes[axis], self.number(recording))
    }

    fn recordings(&self) -> usize {
        if self.recording.is_some() { 1 } else { self.problem.recordings() }
    }

    fn outputs(&self) -> usize {
        self.problem.outputs()
    }

    fn has(&self, of: Place) -> bool {
        self.problem.has(self.place(of))
    }

    fn samples(&self, recording: usize) -> usize {
        self.problem.samples(self.number(recording))
    }

    fn count(&self, of: Place) -> usize {
        self.problem.count(self.place(of))
    }

    fn measured(&self, of: Place) -> Vec<f64> {
        self.problem.measured(self.place(of))
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

    fn effective_sample_ratio(&self, recording: usize) -> f64 {
        self.problem.effective_sample_ratio(self.number(recording))
    }

    fn initial(&self, recording: usize) -> Vec<f64> {
        self.problem.initial(self.number(recording))
    }

    fn states(&self, recording: usize) -> usize {
        self.problem.states(self.number(recording))
    }

    fn has_kinks(&self) -> bool {
        self.problem.has_kinks()
    }

    fn side_by_side(&self) -> usize {
        self.problem.side_by_side()
    }

    fn blocks(&self, points: &[Point], recording: usize) -> Vec<Option<Vec<Block>>> {
        let number = self.number(recording);
        let point = |of: &Point| {
            let mut initial = vec![Vec::new(); self.problem.recordings()];
            initial[number].clone_from(&of.initial[recording]);
            Point { values: self.all(&of.values), initial }
        };
        self.problem.blocks(&points.iter().map(point).collect::<Vec<_>>(), number)
    }

    fn residuals(&self, values: &[f64], recording: usize, initial: &[f64]) -> Vec<Vec<f64>> {
        self.problem.residuals(&self.all(values), self.number(recording), initial)
    }

    fn shaped(&self, values: &[f64], recording: usize, initial: &[f64], filters: &[Vec<f64>]) -> Vec<DMatrix<f64>> {
        self.problem.shaped(&self.all(values), self.number(recording), initial, filters)
    }
}
