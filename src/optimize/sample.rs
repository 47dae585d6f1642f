//! Points of a box by their number: uniform, a Latin hypercube, a grid. Any row can be had without those before it, so
//! that a hundred million need no memory and any number of threads gives the same.

use crate::{Error, Result};
use rand::{Rng as _, SeedableRng as _};
use rand_xoshiro::SplitMix64;
use rayon::prelude::*;

/// How points are laid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sampling {
    /// Independent, uniform in the box.
    Uniform,
    /// Each axis is cut into as many parts as there are points, and each part is used once.
    LatinHypercube,
    /// So many points an axis, from bound to bound, the last axis fastest.
    Grid,
}

/// A sample of a box.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    sampling: Sampling,
    bounds: Vec<(f64, f64)>,
    count: u64,
    /// Points an axis, for a grid.
    side: u64,
    /// Of each axis, for the place in its part and for the order of the parts.
    keys: Vec<[u64; 2]>,
}

/// Rows that a thread fills at once.
const TASK: usize = 1024;

impl Sample {
    /// `number` points of the box; for a grid, `number` an axis.
    ///
    /// # Errors
    /// `Usage` when there are none, more than 2^53, or the box is empty.
    pub fn new(sampling: Sampling, number: u64, bounds: Vec<(f64, f64)>, seed: u64) -> Result<Self> {
        let axes = u32::try_from(bounds.len()).unwrap_or(u32::MAX);
        let count = if sampling == Sampling::Grid { number.checked_pow(axes) } else { Some(number) };
        let count = count.filter(|count| (1..=1 << 53).contains(count) && axes > 0);
        let Some(count) = count else {
            let message = format!("a sample of {number} points over {axes} axes is none, or too many");
            return Err(Error::usage(message, "Give 1 to 9007199254740992 points in all."));
        };
        let mut generator = SplitMix64::seed_from_u64(seed);
        let keys = bounds.iter().map(|_| [generator.next_u64(), generator.next_u64()]).collect();
        Ok(Self { sampling, bounds, count, side: number, keys })
    }

    /// How many points.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Fills `values` with whole rows from the row `first` on.
    pub fn fill(&self, first: u64, values: &mut [f64]) {
        let width = self.bounds.len();
        values.par_chunks_mut(TASK * width).enumerate().for_each(|(task, values)| {
            for (n, row) in values.chunks_exact_mut(width).enumerate() {
                self.row(first + (task * TASK + n) as u64, row);
            }
        });
    }

    fn row(&self, index: u64, row: &mut [f64]) {
        let mut place = index;
        for (axis, (value, &(min, max))) in row.iter_mut().zip(&self.bounds).enumerate().rev() {
            let share = match self.sampling {
                Sampling::Uniform => self.unit(index, axis),
                Sampling::LatinHypercube => {
                    (real(self.shuffled(index, axis)) + self.unit(index, axis)) / real(self.count)
                }
                Sampling::Grid => {
                    let step = place % self.side;
                    place /= self.side;
                    if self.side == 1 { 0.5 } else { real(step) / real(self.side - 1) }
                }
            };
            *value = (min + (max - min) * share).clamp(min, max);
        }
    }

    /// Uniform in [0, 1).
    fn unit(&self, index: u64, axis: usize) -> f64 {
        real(bits(self.keys[axis][0] ^ index) >> 11) / real(1 << 53)
    }

    /// A permutation of the row numbers: four rounds of a Feistel cipher over the next power of four, walked on while
    /// it leads outside (M. Luby, C. Rackoff 1988; J. Black, P. Rogaway 2002).
    fn shuffled(&self, index: u64, axis: usize) -> u64 {
        let half = (u64::BITS - (self.count - 1).leading_zeros()).div_ceil(2).max(1);
        let mask = (1_u64 << half) - 1;
        let mut number = index;
        loop {
            let (mut left, mut right) = (number >> half, number & mask);
            for round in 0..4 {
                let mixed = bits(self.keys[axis][1] ^ right ^ (round << 60)) & mask;
                (left, right) = (right, left ^ mixed);
            }
            number = (left << half) | right;
            if number < self.count {
                return number;
            }
        }
    }
}

/// The random bits that belong to a number.
fn bits(number: u64) -> u64 {
    SplitMix64::seed_from_u64(number).next_u64()
}

fn real(n: u64) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "at most 2^53")]
    let real = n as f64;
    real
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(sampling: Sampling, number: u64, seed: u64) -> Vec<Vec<f64>> {
        let sample = Sample::new(sampling, number, vec![(0.0, 1.0), (10.0, 20.0)], seed).unwrap();
        let count = usize::try_from(sample.count()).unwrap();
        let mut values = vec![0.0; 2 * count];
        sample.fill(0, &mut values);
        values.chunks(2).map(<[f64]>::to_vec).collect()
    }

    #[test]
    fn a_hypercube_uses_every_part_of_every_axis_once() {
        for count in [1, 2, 3, 5, 64, 1000] {
            for (axis, (min, width)) in [(0.0, 1.0), (10.0, 10.0)].into_iter().enumerate() {
                let rows = rows(Sampling::LatinHypercube, count, 7);
                #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "small")]
                let part = |row: &Vec<f64>| ((row[axis] - min) / width * real(count)).floor() as u64;
                let mut parts: Vec<u64> = rows.iter().map(part).collect();
                parts.sort_unstable();
                assert_eq!(parts, (0..count).collect::<Vec<_>>(), "{count} points, axis {axis}");
            }
        }
    }

    #[test]
    fn uniform_points_are_uniform_and_independent() {
        let rows = rows(Sampling::Uniform, 100_000, 1);
        let mean = |f: &dyn Fn(&Vec<f64>) -> f64| rows.iter().map(f).sum::<f64>() / 100_000.0;
        let (x, y) = (|r: &Vec<f64>| r[0] - 0.5, |r: &Vec<f64>| (r[1] - 15.0) / 10.0);
        // Mean 0 ± 0.0009, variance 1/12 ± 0.0002, covariance 0 ± 0.0003: five standard deviations.
        assert!(mean(&x).abs() < 0.005 && mean(&y).abs() < 0.005);
        assert!((mean(&|r| x(r) * x(r)) - 1.0 / 12.0).abs() < 0.0012);
        assert!(mean(&|r| x(r) * y(r)).abs() < 0.0014);
        let next = rows.windows(2).map(|w| x(&w[0]) * x(&w[1])).sum::<f64>() / 100_000.0;
        assert!(next.abs() < 0.0014, "neighbours are independent: {next}");
        assert_ne!(rows, self::rows(Sampling::Uniform, 100_000, 2));
    }

    #[test]
    fn any_row_can_be_had_alone_and_a_grid_goes_from_bound_to_bound() {
        for sampling in [Sampling::Uniform, Sampling::LatinHypercube, Sampling::Grid] {
            let sample = Sample::new(sampling, 100, vec![(0.0, 1.0), (10.0, 20.0)], 3).unwrap();
            let (mut all, mut late) = (vec![0.0; 200], vec![0.0; 20]);
            sample.fill(0, &mut all);
            sample.fill(57, &mut late);
            assert_eq!(late, all[114..134], "{sampling:?}");
        }
        let grid = rows(Sampling::Grid, 3, 1);
        assert_eq!(grid.len(), 9);
        assert_eq!((&grid[0], &grid[1], &grid[8]), (&vec![0.0, 10.0], &vec![0.0, 15.0], &vec![1.0, 20.0]));
        assert!(Sample::new(Sampling::Grid, 1 << 30, vec![(0.0, 1.0); 2], 1).is_err());
        assert!(Sample::new(Sampling::Uniform, 0, vec![(0.0, 1.0)], 1).is_err());
    }
}
