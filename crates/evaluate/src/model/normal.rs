//! Normal equations of candidates on a recording: several candidates side by side take little more time than one.

use super::problem::ModelProblem;
use super::trajectory::{Point, Trajectory};
use crate::interpreter::{Directions, Job, Loss, Register, RunProgram, WIDTH, Work};

/// Sums of one measured output over the samples that count, without weights.
#[derive(Debug, Clone, PartialEq)]
#[doc(hidden)]
pub struct OutputSums {
    /// Number of the output.
    pub output: usize,
    /// Sum of squared residuals.
    pub squares: f64,
    /// Products of the derivatives with each other, shape `[unknowns][unknowns]`.
    pub products: Vec<f64>,
    /// Products of the derivatives with the residuals.
    pub gradient: Vec<f64>,
}

/// Lanes of the widest run.
const LANES: usize = Register::<8>::LANES;

impl ModelProblem {
    /// Returns how many candidates with so many unknowns are computed side by side.
    #[doc(hidden)]
    pub fn side_by_side(unknowns: usize) -> usize {
        (LANES / Directions { number: unknowns }.width()).max(1)
    }

    /// Returns the sums of candidates on a recording, for each of its measured outputs, shape `[candidates][outputs]`. All candidates
    /// have the same number of unknowns.
    #[doc(hidden)]
    pub fn normal_sums(&self, recording: usize, points: &[Point<'_>]) -> Vec<Vec<OutputSums>> {
        let Some(first) = points.first() else { return Vec::new() };
        let directions = Directions { number: first.unknowns.len() };
        if directions.number > LANES {
            return points.iter().map(|point| self.sums_of_trajectory(recording, *point)).collect();
        }
        let some = |points: &[Point<'_>]| match (directions.width() * points.len()).div_ceil(WIDTH) {
            1 => self.sums_with::<1>(recording, points, directions),
            2 => self.sums_with::<2>(recording, points, directions),
            3 | 4 => self.sums_with::<4>(recording, points, directions),
            _ => self.sums_with::<8>(recording, points, directions),
        };
        points.chunks(Self::side_by_side(directions.number)).flat_map(some).collect()
    }

    fn sums_with<const C: usize>(
        &self,
        recording: usize,
        points: &[Point<'_>],
        directions: Directions,
    ) -> Vec<Vec<OutputSums>>
    where
        Work<C>: RunProgram,
    {
        let prepared = &self.recordings[recording];
        let programs = &self.programs[prepared.programs];
        let mut work = Work::<C>::default();
        let (number, width) = (directions.number, directions.width());
        self.load_tangents(&mut work, programs, points, width);
        work.run(&Job { program: &programs.tangent, rows: &prepared.tangent_rows, loss: Loss::Normal(directions) });
        let of = |place: usize, output: usize| {
            let sums = &work.sums[output * directions.sums()..(output + 1) * directions.sums()];
            let lanes = |row: usize| (0..number).map(move |lane| sums[row].lane(place * width + lane));
            OutputSums {
                output,
                squares: sums[number + 1].lane(place * width),
                products: (0..number).flat_map(lanes).collect(),
                gradient: lanes(number).collect(),
            }
        };
        (0..points.len()).map(|place| self.measured(recording).map(|output| of(place, output)).collect()).collect()
    }

    /// Returns the numbers of the measured outputs of a recording.
    fn measured(&self, recording: usize) -> impl Iterator<Item = usize> {
        let measured = self.recordings[recording].recording.measured.iter().enumerate();
        measured.filter(|(_, signal)| signal.is_some()).map(|(output, _)| output)
    }

    /// Returns the sums of a candidate from its trajectory, for any number of unknowns.
    pub(super) fn sums_of_trajectory(&self, recording: usize, point: Point<'_>) -> Vec<OutputSums> {
        let trajectory = self.trajectory_at(point, recording);
        self.measured(recording).map(|output| self.sums_of_output(recording, output, &trajectory, point)).collect()
    }

    fn sums_of_output(&self, recording: usize, output: usize, trajectory: &Trajectory, point: Point<'_>) -> OutputSums {
        let own = &self.recordings[recording].recording;
        let measured = own.measured[output].as_deref().unwrap_or_default();
        let size = point.unknowns.len();
        let mut sums = OutputSums { output, squares: 0.0, products: vec![0.0; size * size], gradient: vec![0.0; size] };
        for n in (0..own.len()).filter(|n| own.counts(output, *n)) {
            let error = measured[n] - trajectory.outputs[output][n];
            let row = trajectory.sensitivities.get(output).map_or(&[][..], |all| &all[n * size..(n + 1) * size]);
            sums.squares += error * error;
            for (a, first) in row.iter().enumerate() {
                sums.gradient[a] += first * error;
                for (b, second) in row.iter().enumerate() {
                    sums.products[a * size + b] += first * second;
                }
            }
        }
        sums
    }
}
