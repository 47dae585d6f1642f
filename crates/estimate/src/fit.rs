//! Normal equations of a joint fit. The sums of each recording and output are stored separately, so that weights can change
//! without a new simulation.

use super::fitted::{Block, Fitted, Place, Point, Sigma};
use motorfit_core::coordinate::Coordinate;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// A joint fit of the free parameters of a problem and the unknown initial states. The unknowns of the parameters are their
/// coordinates.
pub(crate) struct Fit<'a> {
    pub problem: &'a dyn Fitted,
    /// Coordinates of the free parameters.
    pub axes: Vec<Coordinate>,
    /// Number of unknowns: the free parameters, then the unknown initial states of each recording.
    pub unknowns: usize,
    /// The unknowns of each recording: its parameters in the order of the space, then its initial states.
    pub places: Vec<Vec<usize>>,
}

/// The sums of each recording and output.
#[derive(Clone)]
pub(crate) struct Normal(Vec<Vec<Block>>);

impl Normal {
    /// Returns eᵀe of an output of a recording.
    pub fn squares(&self, (recording, output): Place) -> f64 {
        self.0[recording][output].squares
    }

    /// Returns eᵀe of each output of all recordings.
    pub fn all_squares(&self) -> Sigma {
        self.0.iter().map(|of| of.iter().map(|block| block.squares).collect()).collect()
    }

    /// Returns the sum of eᵀe in units of σ² over recordings and outputs.
    pub fn cost(&self, sigma: &Sigma) -> f64 {
        self.weighed(sigma).map(|(_, block, sigma)| block.squares / (sigma * sigma)).sum()
    }

    /// Returns the sums with the number of their recording and their σ.
    fn weighed<'a>(&'a self, sigma: &'a Sigma) -> impl Iterator<Item = (usize, &'a Block, f64)> {
        let of = |(recording, (blocks, sigma)): (usize, (&'a Vec<Block>, &'a Vec<f64>))| {
            blocks.iter().zip(sigma).map(move |(block, sigma)| (recording, block, *sigma))
        };
        self.0.iter().zip(sigma).enumerate().flat_map(of)
    }
}

impl<'a> Fit<'a> {
    pub fn new(problem: &'a dyn Fitted) -> Self {
        let axes = problem.axes();
        let mut unknowns = axes.len();
        let places = |recording: usize| {
            let mut own: Vec<usize> = (0..axes.len()).filter(|axis| problem.acts(*axis, recording)).collect();
            let states = problem.states(recording);
            own.extend(unknowns..unknowns + states);
            unknowns += states;
            own
        };
        let places = (0..problem.recordings()).map(places).collect();
        Self { problem, axes, unknowns, places }
    }

    /// Returns each output of each recording that was measured.
    pub fn measured(&self) -> impl Iterator<Item = Place> {
        let (recordings, outputs) = (self.problem.recordings(), self.problem.outputs());
        let all = (0..recordings).flat_map(move |recording| (0..outputs).map(move |output| (recording, output)));
        all.filter(|of| self.problem.has(*of))
    }

    /// Returns a value for each output of each recording; 1 for one that was not measured.
    pub fn each(&self, value: impl Fn(Place) -> f64) -> Sigma {
        let of = |recording: usize| {
            let one =
                |output: usize| if self.problem.has((recording, output)) { value((recording, output)) } else { 1.0 };
            (0..self.problem.outputs()).map(one).collect()
        };
        (0..self.problem.recordings()).map(of).collect()
    }

    /// Returns the number of measured values that are not masked, over all outputs and recordings.
    pub fn count(&self) -> usize {
        self.measured().map(|of| self.problem.count(of)).sum()
    }

    /// Returns the unknowns at the parameters `values`, with initial states as measured.
    pub fn start(&self, values: &[f64]) -> DVector<f64> {
        let initial: Vec<Vec<f64>> = (0..self.problem.recordings()).map(|n| self.problem.initial(n)).collect();
        self.at(values, &initial)
    }

    /// Returns the unknowns at the parameters `values` and the initial states `initial` of the recordings.
    pub fn at(&self, values: &[f64], initial: &[Vec<f64>]) -> DVector<f64> {
        let states = initial.iter().enumerate();
        let states = states.flat_map(|(n, state)| state.iter().take(self.problem.states(n)).copied());
        let coordinates = self.axes.iter().zip(values).map(|(axis, value)| axis.of(*value));
        DVector::from_iterator(self.unknowns, coordinates.chain(states))
    }

    /// Returns the values of the free parameters, clamped to their bounds because the coordinates round.
    pub fn values(&self, unknowns: &DVector<f64>) -> Vec<f64> {
        self.axes.iter().zip(unknowns.iter()).map(|(axis, v)| axis.value(*v)).collect()
    }

    /// Returns the initial states of every recording.
    pub fn initial(&self, unknowns: &DVector<f64>) -> Vec<Vec<f64>> {
        let of = |recording: usize| match self.problem.states(recording) {
            0 => self.problem.initial(recording),
            _ => self.places[recording].iter().filter(|n| **n >= self.axes.len()).map(|n| unknowns[*n]).collect(),
        };
        (0..self.problem.recordings()).map(of).collect()
    }

    /// Returns the normal equations of points side by side; `None` for one at which the machine diverges.
    pub fn normals(&self, unknowns: &[DVector<f64>]) -> Vec<Option<Normal>> {
        let point = |at: &DVector<f64>| Point { values: self.values(at), initial: self.initial(at) };
        let points: Vec<Point> = unknowns.iter().map(point).collect();
        let recordings = self.problem.recordings();
        if let ([_], 1) = (&points[..], recordings) {
            return self.problem.blocks(&points, 0).into_iter().map(|of| Some(Normal(vec![of?]))).collect();
        }
        // As many side by side as the lanes hold, but no fewer parts than there are threads.
        let threads = rayon::current_num_threads().div_ceil(recordings.max(1)).min(points.len());
        let parts = points.len().div_ceil(self.problem.side_by_side()).max(threads).max(1);
        let side = points.len().div_ceil(parts).max(1);
        let tasks: Vec<(usize, &[Point])> =
            points.chunks(side).flat_map(|part| (0..recordings).map(move |recording| (recording, part))).collect();
        let blocks: Vec<_> = tasks.par_iter().map(|(recording, part)| self.problem.blocks(part, *recording)).collect();
        let mut all = vec![Some(Normal(Vec::with_capacity(recordings))); points.len()];
        for (task, of_part) in blocks.into_iter().enumerate() {
            for (place, own) in of_part.into_iter().enumerate() {
                let normal = &mut all[task / recordings * side + place];
                match (normal.as_mut(), own) {
                    (Some(so_far), Some(own)) => so_far.0.push(own),
                    _ => *normal = None,
                }
            }
        }
        all
    }

    /// Returns the normal equations of a point; `None` if the machine diverges there.
    pub fn normal(&self, unknowns: &DVector<f64>) -> Option<Normal> {
        self.normals(std::slice::from_ref(unknowns)).pop().flatten()
    }

    /// Returns JᵀJ and Jᵀe summed over recordings and outputs, each divided by its σ².
    pub fn weighted(&self, normal: &Normal, sigma: &Sigma) -> (DMatrix<f64>, DVector<f64>) {
        let mut matrix = DMatrix::zeros(self.unknowns, self.unknowns);
        let mut gradient = DVector::zeros(self.unknowns);
        for (recording, block, sigma) in normal.weighed(sigma) {
            let weight = 1.0 / (sigma * sigma);
            for (a, &row) in self.places[recording].iter().enumerate() {
                for (b, &column) in self.places[recording].iter().enumerate() {
                    matrix[(row, column)] += weight * block.matrix[(a, b)];
                }
                gradient[row] += weight * block.gradient[a];
            }
        }
        (matrix, gradient)
    }
}
