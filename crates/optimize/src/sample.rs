//! Samples of a box: uniform, Latin hypercube, Sobol' sequence, grid. Each point is a function of its index, so that samples of 10⁸ points
//! need no memory and do not depend on the number of threads.

use super::sobol::{SOBOL_AXES_MAX, SobolAxis};
use motorfit_core::{Error, Result};
use rand::{Rng as _, SeedableRng as _};
use rand_xoshiro::SplitMix64;
use rayon::prelude::*;

/// Sampling scheme of a box.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sampling {
    /// Independent points, uniform in the box.
    Uniform,
    /// Latin hypercube: each axis is cut into as many intervals as there are points, and each interval holds one point.
    LatinHypercube,
    /// Sobol' sequence with a random digital shift: any number of successive points fills the box evenly. At most
    /// [`SOBOL_AXES_MAX`] axes.
    Sobol,
    /// Full factorial grid from bound to bound with equally many points on each axis, or the middle for a single point; the
    /// last axis varies fastest.
    Grid,
}

/// A sample of a box.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    sampling: Sampling,
    bounds: Vec<(f64, f64)>,
    count: u64,
    /// Number of points on each axis of a grid.
    side: u64,
    /// Height and width of the rectangle of indices that are shuffled.
    rectangle: [u64; 2],
    /// Random keys of each axis: for the position within an interval, and for the order of the intervals.
    keys: Vec<[u64; 2]>,
    /// The sequence on each axis; empty for other schemes.
    sobol: Vec<SobolAxis>,
}

/// Largest number of points of a sample; indices up to it are exact in double precision.
pub const POINTS_MAX: u64 = 1 << 53;
/// Number of points below which the permutation uses more rounds.
const FEW: u64 = 1 << 20;
/// Number of rows that a thread fills at a time.
const TASK: usize = 1024;

impl Sample {
    /// Makes a sample of `number` points of the box, or of a grid with `number` points on each axis.
    ///
    /// # Errors
    /// Returns `Usage` if the sample has no points or more than [`POINTS_MAX`], the box has no axis or too many for a Sobol'
    /// sequence, or bounds are not finite or reversed.
    pub fn new(sampling: Sampling, number: u64, bounds: Vec<(f64, f64)>, seed: u64) -> Result<Self> {
        let axes = u32::try_from(bounds.len()).unwrap_or(u32::MAX);
        let count = if sampling == Sampling::Grid { number.checked_pow(axes) } else { Some(number) };
        let count = count.filter(|count| (1..=POINTS_MAX).contains(count) && axes > 0);
        let Some(count) = count else {
            let message = format!("a sample of {number} points over {axes} axes is empty or too large");
            return Err(Error::usage(message, format!("Give 1 to {POINTS_MAX} points in total.")));
        };
        if let Some((axis, (min, max))) =
            (0..).zip(&bounds).find(|(_, (min, max))| !(min <= max && (max - min).is_finite()))
        {
            let axis: usize = axis;
            let message =
                format!("found the bounds {min:?} and {max:?} of axis {axis}, expected finite bounds, the lower first");
            return Err(Error::usage(message, "Correct the bounds."));
        }
        let mut generator = SplitMix64::seed_from_u64(seed);
        let keys = bounds.iter().map(|_| [generator.next_u64(), generator.next_u64()]).collect();
        let sequences = if sampling == Sampling::Sobol { bounds.len() } else { 0 };
        let Some(sobol) = (0..sequences).map(SobolAxis::new).collect() else {
            let message = format!("a Sobol' sequence has at most {SOBOL_AXES_MAX} axes, this box has {}", bounds.len());
            return Err(Error::usage(message, "Take a Latin hypercube, or fix parameters."));
        };
        let height = count.isqrt();
        let rectangle = [height, count.div_ceil(height)];
        Ok(Self { sampling, bounds, count, side: number, rectangle, keys, sobol })
    }

    /// Returns the number of points.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Fills `values` with rows from the index `first` on, row-major.
    ///
    /// # Panics
    /// Panics if the length of `values` is not a multiple of the row length, or the rows exceed the sample.
    pub fn fill(&self, first: u64, values: &mut [f64]) {
        let width = self.bounds.len();
        let rows = (values.len() / width) as u64;
        assert!(values.len().is_multiple_of(width), "{} values are not whole rows of {width}", values.len());
        let end = first.checked_add(rows).filter(|end| *end <= self.count);
        assert!(end.is_some(), "{rows} rows from row {first} on of a sample of {}", self.count);
        values.par_chunks_mut(TASK * width).enumerate().for_each(|(task, values)| {
            let first = first + (task * TASK) as u64;
            // Filling axis by axis makes the iterations of a loop independent of each other.
            for axis in 0..width {
                let own = values[axis..].iter_mut().step_by(width);
                match self.sampling {
                    Sampling::Uniform => self.column(axis, first, own, |index| self.unit(index, axis)),
                    Sampling::LatinHypercube if self.count < FEW => {
                        self.column(axis, first, own, |index| self.stratum::<8>(index, axis));
                    }
                    Sampling::LatinHypercube => self.column(axis, first, own, |index| self.stratum::<2>(index, axis)),
                    Sampling::Sobol => {
                        let (sequence, shift) = (&self.sobol[axis], self.keys[axis][0] >> 11);
                        let mut point = sequence.at(first);
                        self.column(axis, first, own, |index| {
                            if index > first {
                                point = sequence.next(point, index);
                            }
                            real(point ^ shift) / real(1 << 53)
                        });
                    }
                    Sampling::Grid => self.column(axis, first, own, |index| self.step(index, axis)),
                }
            }
        });
    }

    /// Fills one axis of the rows from `first` on; `share` gives the position of each row between the bounds.
    #[inline]
    fn column<'v>(
        &self,
        axis: usize,
        first: u64,
        values: impl Iterator<Item = &'v mut f64>,
        mut share: impl FnMut(u64) -> f64,
    ) {
        let (min, max) = self.bounds[axis];
        for (index, value) in (first..).zip(values) {
            *value = (min + (max - min) * share(index)).clamp(min, max);
        }
    }

    /// Returns the position of a row of a Latin hypercube, in \[0, 1).
    #[inline]
    fn stratum<const PAIRS: u64>(&self, index: u64, axis: usize) -> f64 {
        (real(self.shuffled::<PAIRS>(index, axis)) + self.unit(index, axis)) / real(self.count)
    }

    /// Returns the position of a row of a grid, in \[0, 1\].
    fn step(&self, index: u64, axis: usize) -> f64 {
        let mut place = index;
        for _ in axis + 1..self.bounds.len() {
            place /= self.side;
        }
        let step = place % self.side;
        if self.side == 1 { 0.5 } else { real(step) / real(self.side - 1) }
    }

    /// Returns the uniform random number of a row and axis, in \[0, 1).
    fn unit(&self, index: u64, axis: usize) -> f64 {
        real(bits(self.keys[axis][0] ^ index) >> 11) / real(1 << 53)
    }

    /// Returns a random permutation of the row indices: rounds of a Feistel cipher over the smallest rectangle that holds
    /// them, repeated while the result is outside, which is rare (M. Luby, C. Rackoff 1988; J. Black, P. Rogaway 2002). Two
    /// pairs of rounds suffice for long sides; short sides need more for a random order.
    #[inline]
    fn shuffled<const PAIRS: u64>(&self, index: u64, axis: usize) -> u64 {
        let [height, width] = self.rectangle;
        let key = self.keys[axis][1];
        let (mut row, mut column) = (index / width, index % width);
        loop {
            for round in 0..PAIRS {
                row = rotated(row, column ^ key ^ (round << 58), height);
                column = rotated(column, row ^ !key ^ (round << 58), width);
            }
            let number = row * width + column;
            if number < self.count {
                return number;
            }
        }
    }
}

/// Returns `number`, below `size`, advanced modulo `size` by a hash of `by`.
#[inline]
fn rotated(number: u64, by: u64, size: u64) -> u64 {
    let hashed = (by ^ (by >> 32)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let hashed = (hashed ^ (hashed >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let step = ((u128::from(hashed) * u128::from(size)) >> 64) as u64;
    let sum = number + step;
    // For a sum below `size` the difference wraps to a larger number, which avoids an unpredictable branch.
    sum.min(sum.wrapping_sub(size))
}

/// Returns the random bits of a number by SplitMix64 (G. L. Steele, D. Lea, C. H. Flood 2014). It is implemented here
/// because a call into its crate is not inlined and takes longer than everything else.
#[inline]
fn bits(number: u64) -> u64 {
    let z = number.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Returns an integer up to 2^53 as a real number.
fn real(n: u64) -> f64 {
    motorfit_core::numeric::real(n.cast_signed())
}

#[cfg(test)]
mod tests {
    use super::*;
    use motorfit_core::numeric::{whole, whole_u64};

    fn rows(sampling: Sampling, number: u64, seed: u64) -> Vec<Vec<f64>> {
        let sample = Sample::new(sampling, number, vec![(0.0, 1.0), (10.0, 20.0)], seed).unwrap();
        let count = usize::try_from(sample.count()).unwrap();
        let mut values = vec![0.0; 2 * count];
        sample.fill(0, &mut values);
        values.chunks(2).map(<[f64]>::to_vec).collect()
    }

    #[test]
    fn a_hypercube_has_one_point_in_each_interval_of_each_axis() {
        for count in [1, 2, 3, 5, 64, 1000] {
            for (axis, (min, width)) in [(0.0, 1.0), (10.0, 10.0)].into_iter().enumerate() {
                let rows = rows(Sampling::LatinHypercube, count, 7);
                let stratum = |row: &Vec<f64>| whole_u64((row[axis] - min) / width * real(count));
                let mut parts: Vec<u64> = rows.iter().map(stratum).collect();
                parts.sort_unstable();
                assert_eq!(parts, (0..count).collect::<Vec<_>>(), "{count} points, axis {axis}");
            }
        }
    }

    #[test]
    fn the_order_of_intervals_is_a_random_permutation() {
        // Over 2000 seeds each of 7 rows falls into each of 7 intervals equally often. χ² with 36 degrees of freedom
        // exceeds 75 with probability 1.5e-4.
        let seeds = 2000_u32;
        let order = |seed: u32| -> Vec<usize> {
            let rows = rows(Sampling::LatinHypercube, 7, u64::from(seed));
            rows.iter().map(|row| whole(row[0] * 7.0)).collect()
        };
        let mut counts = [[0_u32; 7]; 7];
        let mut steps = [0_u32; 6];
        for order in (0..seeds).map(order) {
            order.iter().enumerate().for_each(|(row, stratum)| counts[row][*stratum] += 1);
            order.windows(2).for_each(|pair| steps[(pair[1] + 7 - pair[0]) % 7 - 1] += 1);
        }
        let chi2 = |counts: &[u32], expected: f64| {
            counts.iter().map(|n| (f64::from(*n) - expected).powi(2) / expected).sum::<f64>()
        };
        let by_place = chi2(counts.as_flattened(), f64::from(seeds) / 7.0);
        assert!(by_place < 75.0, "{by_place}");
        // All cyclic steps from a row to the next are equally likely: χ² with 5 degrees of freedom exceeds 30 with
        // probability 1.5e-5.
        let by_step = chi2(&steps, f64::from(seeds));
        assert!(by_step < 30.0, "{by_step}");
    }

    #[test]
    fn bits_are_those_of_the_generator() {
        for number in [0, 1, 7, u64::MAX, 0x1234_5678_9abc_def0] {
            assert_eq!(bits(number), SplitMix64::seed_from_u64(number).next_u64());
        }
    }

    #[test]
    fn uniform_points_are_uniform_and_independent() {
        let rows = rows(Sampling::Uniform, 100_000, 1);
        let mean = |f: &dyn Fn(&Vec<f64>) -> f64| rows.iter().map(f).sum::<f64>() / 100_000.0;
        let (x, y) = (|r: &Vec<f64>| r[0] - 0.5, |r: &Vec<f64>| (r[1] - 15.0) / 10.0);
        // Standard deviations of the mean, variance and covariance: 0.0009, 0.0002, 0.0003. The limits are five times
        // these.
        assert!(mean(&x).abs() < 0.005 && mean(&y).abs() < 0.005);
        assert!((mean(&|r| x(r) * x(r)) - 1.0 / 12.0).abs() < 0.0012);
        assert!(mean(&|r| x(r) * y(r)).abs() < 0.0014);
        let next = rows.windows(2).map(|w| x(&w[0]) * x(&w[1])).sum::<f64>() / 100_000.0;
        assert!(next.abs() < 0.0014, "neighbours are independent: {next}");
        assert_ne!(rows, self::rows(Sampling::Uniform, 100_000, 2));
    }

    #[test]
    fn rows_do_not_depend_on_others_and_a_grid_spans_the_bounds() {
        for sampling in [Sampling::Uniform, Sampling::LatinHypercube, Sampling::Sobol, Sampling::Grid] {
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
        assert!(Sample::new(Sampling::Sobol, 9, vec![(0.0, 1.0); SOBOL_AXES_MAX + 1], 1).is_err());
        assert!(Sample::new(Sampling::Uniform, 0, vec![(0.0, 1.0)], 1).is_err());
    }
}
