//! A user's model as estimators see it.

use crate::fitted::{Block, Fitted, Place, Point};
use crate::shaped::shaped_rows;
use motorfit_core::coordinate::Coordinate;
use motorfit_core::{Error, Result};
use motorfit_evaluate::criterion::COST_MAX;
use motorfit_evaluate::model::{ModelAxis, ModelProblem, OutputSums, Point as OfRecording, Unknown};
use nalgebra::{DMatrix, DVector};

/// Checks values of the free parameters and initial values of the recordings.
pub(super) fn check(problem: &ModelProblem, values: &[f64], initial: &[Vec<f64>]) -> Result<()> {
    let open = problem.open_initial(0).len();
    let axes = problem.space().free.len();
    if values.len() == axes
        && initial.len() == problem.recordings()
        && initial.iter().all(|own| own.len() == open)
        && values.iter().chain(initial.iter().flatten()).all(|value| value.is_finite())
    {
        return Ok(());
    }
    let message = format!("a start of {} parameters and {} recordings", values.len(), initial.len());
    let hint = format!(
        "Give {axes} finite values, and {open} initial values for each of {} recordings.",
        problem.recordings()
    );
    Err(Error::usage(message, hint))
}

/// Returns the directions of the unknowns that a recording depends on.
fn directions(problem: &ModelProblem, values: &[f64], recording: usize) -> Vec<Unknown> {
    let axes = problem.space().free.iter().zip(values);
    let own = axes.filter(|(axis, _)| axis.recording.is_none_or(|of| of == recording));
    let parameters = own.map(|(axis, value)| Unknown::Parameter(axis.parameter, axis.range().slope(*value)));
    parameters.chain((0..problem.states(recording)).map(Unknown::Initial)).collect()
}

impl Fitted for ModelProblem {
    fn axes(&self) -> Vec<Coordinate> {
        self.space().free.iter().map(ModelAxis::range).collect()
    }

    fn acts(&self, axis: usize, recording: usize) -> bool {
        self.space().free[axis].recording.is_none_or(|of| of == recording)
    }

    fn recordings(&self) -> usize {
        Self::recordings(self)
    }

    fn outputs(&self) -> usize {
        self.model().outputs().len()
    }

    fn has(&self, (recording, output): Place) -> bool {
        self.recording(recording).measured[output].is_some()
    }

    fn samples(&self, recording: usize) -> usize {
        self.recording(recording).len()
    }

    fn count(&self, (recording, output): Place) -> usize {
        self.recording(recording).count(output)
    }

    fn measured(&self, (recording, output): Place) -> Vec<f64> {
        self.recording(recording).counted(output).unwrap_or_default()
    }

    fn rms(&self, of: Place) -> f64 {
        self.statistics(of).map_or(0.0, |signal| signal.rms)
    }

    fn noise(&self, of: Place) -> f64 {
        self.statistics(of).map_or(0.0, |signal| signal.noise)
    }

    fn deviation(&self, of: Place) -> f64 {
        self.statistics(of).map_or(1.0, |signal| signal.deviation)
    }

    fn effective_sample_ratio(&self, recording: usize) -> f64 {
        self.recording(recording).effective_sample_ratio
    }

    fn initial(&self, recording: usize) -> Vec<f64> {
        self.open_initial(recording).to_vec()
    }

    fn states(&self, recording: usize) -> usize {
        if self.settings().has_known_initial { 0 } else { self.open_initial(recording).len() }
    }

    fn has_kinks(&self) -> bool {
        self.model().reactions() > 0
    }

    fn side_by_side(&self) -> usize {
        let own = (0..self.space().free.len()).filter(|axis| self.acts(*axis, 0)).count();
        Self::side_by_side(own + self.states(0))
    }

    fn blocks(&self, points: &[Point], recording: usize) -> Vec<Option<Vec<Block>>> {
        let space = self.space();
        let unknowns: Vec<Vec<Unknown>> =
            points.iter().map(|point| directions(self, &point.values, recording)).collect();
        let values: Vec<Vec<f64>> = points.iter().map(|point| space.values(&point.values, recording)).collect();
        let lane =
            |n: usize| OfRecording { values: &values[n], open: &points[n].initial[recording], unknowns: &unknowns[n] };
        let lanes: Vec<OfRecording<'_>> = (0..points.len()).map(lane).collect();
        let size = unknowns.first().map_or(0, Vec::len);
        let blocks = |sums: Vec<OutputSums>| {
            let mut all: Vec<Block> = (0..self.outputs()).map(|_| Block::none(size)).collect();
            for OutputSums { output, squares, products, gradient } in sums {
                let matrix = DMatrix::from_row_slice(size, size, &products);
                all[output] = Block { matrix, gradient: DVector::from_vec(gradient), squares };
            }
            all.iter().all(|block| block.is_finite() && block.squares <= COST_MAX).then_some(all)
        };
        self.normal_sums(recording, &lanes).into_iter().map(blocks).collect()
    }

    fn residuals(&self, values: &[f64], recording: usize, initial: &[f64]) -> Vec<Vec<f64>> {
        let own = self.recording(recording);
        let simulated = self.simulate(values, recording, initial).outputs;
        let of = |(output, (measured, simulated)): (usize, (&Option<Vec<f64>>, &Vec<f64>))| {
            let Some(measured) = measured else { return Vec::new() };
            (0..own.len()).filter(|n| own.counts(output, *n)).map(|n| measured[n] - simulated[n]).collect()
        };
        own.measured.iter().zip(&simulated).enumerate().map(of).collect()
    }

    fn shaped(&self, values: &[f64], recording: usize, initial: &[f64], filters: &[Vec<f64>]) -> Vec<DMatrix<f64>> {
        let own = self.recording(recording);
        let unknowns = directions(self, values, recording);
        let trajectory = self.trajectory(values, recording, initial, &unknowns);
        let width = unknowns.len();
        let of = |output: usize| {
            let Some(rows) = trajectory.sensitivities.get(output).filter(|_| self.has((recording, output))) else {
                return DMatrix::zeros(width, width);
            };
            let is_scattered = own.is_scattered(output);
            let row = |n: usize| match own.counts(output, n) {
                true => Some(&rows[n * width..(n + 1) * width]),
                // The residuals are those of the samples that count; a masked sample is a row of zeros.
                false if is_scattered => None,
                false => Some(&[][..]),
            };
            shaped_rows((0..own.len()).filter_map(row), width, &filters[output])
        };
        (0..self.outputs()).map(of).collect()
    }
}
