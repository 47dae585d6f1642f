//! Residuals of a model and their derivatives as normal equations.
//!
//! Unknowns are the coordinates of the free parameters, then the initial values of the open states of each recording.

use motorfit_core::numeric::{peak, standard_deviation};
use motorfit_core::{Error, Result};
use motorfit_evaluate::model::{ModelProblem, OutputSums, Point, Trajectory, Unknown};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// A problem with the unknowns of a fit.
pub(super) struct Fit<'a> {
    pub problem: &'a ModelProblem,
    /// True if the initial values of open states are unknowns.
    pub estimates_initial: bool,
}

/// Normal equations of one output of one recording, without weights.
#[derive(Debug, Clone)]
pub(super) struct Block {
    pub recording: usize,
    pub output: usize,
    /// Number of residuals.
    pub count: usize,
    /// Sum of squared residuals.
    pub squares: f64,
    matrix: DMatrix<f64>,
    gradient: DVector<f64>,
}

/// Normal equations of all measured outputs.
#[derive(Debug, Clone)]
pub(super) struct Normal {
    pub blocks: Vec<Block>,
}

impl Block {
    /// Returns the derivatives of half the sum of squares, without a weight and with the other sign.
    pub fn gradient(&self) -> &DVector<f64> {
        &self.gradient
    }
}

impl Normal {
    /// Returns the weighted sum of squares; `sigma` has a value for each block.
    pub fn cost(&self, sigma: &[f64]) -> f64 {
        self.blocks.iter().zip(sigma).map(|(block, sigma)| block.squares / (sigma * sigma)).sum()
    }

    /// Returns the root mean square of the residuals of each block.
    pub fn rms(&self) -> Vec<f64> {
        self.blocks
            .iter()
            .map(|block| (block.squares / motorfit_core::numeric::count(block.count.max(1))).sqrt())
            .collect()
    }
}

impl Fit<'_> {
    /// Checks values of the free parameters and initial values of the recordings.
    pub fn check(&self, values: &[f64], initial: &[Vec<f64>]) -> Result<()> {
        let open = self.problem.open_initial(0).len();
        if values.len() == self.axes()
            && initial.len() == self.problem.recordings()
            && initial.iter().all(|own| own.len() == open)
            && values.iter().chain(initial.iter().flatten()).all(|value| value.is_finite())
        {
            return Ok(());
        }
        let message = format!("a start of {} parameters and {} recordings", values.len(), initial.len());
        let hint = format!(
            "Give {} finite values, and {open} initial values for each of {} recordings.",
            self.axes(),
            self.problem.recordings()
        );
        Err(Error::usage(message, hint))
    }

    /// Returns the number of unknowns.
    pub fn unknowns(&self) -> usize {
        self.axes() + self.problem.recordings() * self.states()
    }

    /// Returns the number of free parameters.
    pub fn axes(&self) -> usize {
        self.problem.space().free.len()
    }

    /// Returns the number of initial values of each recording that are unknown.
    fn states(&self) -> usize {
        if self.estimates_initial { self.problem.open_initial(0).len() } else { 0 }
    }

    /// Returns the unknowns for parameters and the initial values of each recording.
    pub fn at(&self, values: &[f64], initial: &[Vec<f64>]) -> DVector<f64> {
        let axes = self.problem.space().free.iter().zip(values).map(|(axis, value)| axis.coordinate(*value));
        let states = initial.iter().flat_map(|open| open.iter().copied().take(self.states()));
        DVector::from_iterator(self.unknowns(), axes.chain(states))
    }

    /// Returns the values of the free parameters.
    pub fn values(&self, at: &DVector<f64>) -> Vec<f64> {
        self.problem.space().free.iter().zip(at.iter()).map(|(axis, coordinate)| axis.value(*coordinate)).collect()
    }

    /// Returns the initial values of a recording.
    pub fn initial(&self, at: &DVector<f64>, recording: usize) -> Vec<f64> {
        if !self.estimates_initial {
            return self.problem.open_initial(recording).to_vec();
        }
        let first = self.axes() + recording * self.states();
        (first..first + self.states()).map(|n| at[n]).collect()
    }

    /// Returns the unknowns that a recording depends on, as their numbers and as directions.
    pub fn directions(&self, at: &DVector<f64>, recording: usize) -> (Vec<usize>, Vec<Unknown>) {
        let values = self.values(at);
        let mut directions = Vec::new();
        for (n, axis) in self.problem.space().free.iter().enumerate() {
            if axis.recording.is_none_or(|of| of == recording) {
                directions.push((n, Unknown::Parameter(axis.parameter, axis.slope(values[n]))));
            }
        }
        let first = self.axes() + recording * self.states();
        directions.extend((0..self.states()).map(|place| (first + place, Unknown::Initial(place))));
        directions.into_iter().unzip()
    }

    /// Returns the trajectory of a recording with its derivatives.
    pub fn trajectory(&self, at: &DVector<f64>, recording: usize) -> Trajectory {
        let (_, directions) = self.directions(at, recording);
        self.problem.trajectory(&self.values(at), recording, &self.initial(at, recording), &directions)
    }

    /// Returns the divisor of each block: the standard deviation of the measured output, so that all outputs count alike.
    pub fn deviations(&self, normal: &Normal) -> Vec<f64> {
        let one = |block: &Block| {
            let signal = self.problem.recording(block.recording).counted(block.output).unwrap_or_default();
            let deviation = standard_deviation(&signal);
            if deviation > 0.0 { deviation } else { peak(&signal).max(1e-9) }
        };
        normal.blocks.iter().map(one).collect()
    }

    /// Returns the normal equations of candidates side by side; `None` for one that diverges.
    pub fn normals(&self, ats: &[DVector<f64>]) -> Vec<Option<Normal>> {
        let mut normals = vec![Some(Normal { blocks: Vec::new() }); ats.len()];
        let Some(first) = ats.first() else { return normals };
        let recordings = self.problem.recordings();
        // As many side by side as the lanes hold, but no fewer parts than there are threads.
        let side = ModelProblem::side_by_side(self.directions(first, 0).0.len());
        let threads = rayon::current_num_threads().div_ceil(recordings.max(1));
        let parts = ats.len().div_ceil(side).max(threads.min(ats.len()));
        let side = ats.len().div_ceil(parts);
        let parts = ats.len().div_ceil(side);
        let tasks = (0..recordings).flat_map(|recording| (0..parts).map(move |part| (recording, part)));
        let tasks: Vec<(usize, usize)> = tasks.collect();
        let blocks: Vec<Vec<Option<Vec<Block>>>> = tasks
            .par_iter()
            .map(|(recording, part)| {
                let end = ((part + 1) * side).min(ats.len());
                self.blocks(&ats[part * side..end], *recording)
            })
            .collect();
        for ((_, part), blocks) in tasks.into_iter().zip(blocks) {
            for (normal, blocks) in normals[part * side..].iter_mut().zip(blocks) {
                match (normal.as_mut(), blocks) {
                    (Some(normal), Some(blocks)) => normal.blocks.extend(blocks),
                    _ => *normal = None,
                }
            }
        }
        normals
    }

    /// Returns the normal equations of the outputs of a recording for each candidate.
    fn blocks(&self, ats: &[DVector<f64>], recording: usize) -> Vec<Option<Vec<Block>>> {
        struct Own {
            values: Vec<f64>,
            open: Vec<f64>,
            unknowns: Vec<Unknown>,
        }
        let mut numbers = Vec::new();
        let mut all = Vec::new();
        for at in ats {
            let (own, unknowns) = self.directions(at, recording);
            let values = self.problem.space().values(&self.values(at), recording);
            all.push(Own { values, open: self.initial(at, recording), unknowns });
            numbers = own;
        }
        let points: Vec<Point<'_>> =
            all.iter().map(|Own { values, open, unknowns }| Point { values, open, unknowns }).collect();
        let sums = self.problem.normal_sums(recording, &points);
        sums.into_iter()
            .map(|outputs| outputs.into_iter().map(|sums| self.block(sums, recording, &numbers)).collect())
            .collect()
    }

    /// Returns a block from its sums; `None` if the model diverges.
    fn block(&self, sums: OutputSums, recording: usize, numbers: &[usize]) -> Option<Block> {
        let OutputSums { output, squares, products, gradient } = sums;
        let is_finite = squares.is_finite() && products.iter().chain(&gradient).all(|value| value.is_finite());
        if !is_finite || squares > motorfit_evaluate::criterion::COST_MAX {
            return None;
        }
        let (unknowns, size) = (self.unknowns(), numbers.len());
        let (mut matrix, mut all) = (DMatrix::zeros(unknowns, unknowns), DVector::zeros(unknowns));
        for a in 0..size {
            all[numbers[a]] = gradient[a];
            for b in 0..size {
                matrix[(numbers[a], numbers[b])] = products[a * size + b];
            }
        }
        let count = self.problem.recording(recording).count(output);
        Some(Block { recording, output, count, squares, matrix, gradient: all })
    }

    /// Returns the matrix and the gradient of the weighted sum of squares.
    pub fn weighted(&self, normal: &Normal, sigma: &[f64]) -> (DMatrix<f64>, DVector<f64>) {
        let unknowns = self.unknowns();
        let (mut matrix, mut gradient) = (DMatrix::zeros(unknowns, unknowns), DVector::zeros(unknowns));
        for (block, sigma) in normal.blocks.iter().zip(sigma) {
            let weight = 1.0 / (sigma * sigma);
            matrix += &block.matrix * weight;
            gradient += &block.gradient * weight;
        }
        (matrix, gradient)
    }
}
