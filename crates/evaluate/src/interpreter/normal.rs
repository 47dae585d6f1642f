//! Normal equations of candidates side by side: sums of the products of derivatives and errors over the samples.
//!
//! Cost per output, sample and eight lanes: one fused operation and eight loads for each derivative of a candidate, and two
//! more operations.

use super::register::{Register, Vector, WIDTH};
use motorfit_motor::multiply_add;

/// Derivatives of each candidate, a direction a lane: those of the first candidate in the first lanes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Directions {
    /// Number of derivatives of a candidate.
    pub number: usize,
}

impl Directions {
    /// Returns the number of lanes of a candidate.
    pub fn width(self) -> usize {
        self.number.max(1)
    }

    /// Returns the number of sums of an output: the rows of the matrix of products, the products with the error, and the squared error.
    pub fn sums(self) -> usize {
        self.number + 2
    }
}

/// Adds `factor × other` to a sum.
#[inline(always)]
fn add<const FMA: bool>(sum: &mut Vector, factor: &Vector, other: &Vector) {
    for lane in 0..WIDTH {
        sum[lane] = multiply_add::<FMA>(factor[lane], other[lane], sum[lane]);
    }
}

/// Adds the products of a sample. `values` are the outputs, then their derivatives; an output with the weight 0 was not measured.
#[inline(always)]
pub(super) fn accumulate<const C: usize, const FMA: bool>(
    sums: &mut [Register<C>],
    values: &[Register<C>],
    (measured, weights): (&[f64], &[f64]),
    directions: Directions,
) {
    let (number, width) = (directions.number, directions.width());
    for (output, sums) in sums.chunks_exact_mut(directions.sums()).enumerate() {
        if weights.get(output) == Some(&0.0) {
            continue;
        }
        let (value, rates) = (&values[output], &values[measured.len() + output]);
        let (products, with_error) = sums.split_at_mut(number);
        for part in 0..C {
            let error = value[part].map(|value| measured[output] - value);
            add::<FMA>(&mut with_error[0][part], &error, &rates[part]);
            add::<FMA>(&mut with_error[1][part], &error, &error);
        }
        for (row, sum) in products.iter_mut().enumerate() {
            for part in 0..C {
                // In each lane the derivative of its own candidate; lanes beyond the last whole candidate are not read.
                let own = |lane: usize| rates.lane(((part * WIDTH + lane) / width * width + row).min(WIDTH * C - 1));
                add::<FMA>(&mut sum[part], &std::array::from_fn(own), &rates[part]);
            }
        }
    }
}
