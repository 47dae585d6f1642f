//! The exponential of a matrix and the functions φ₁, φ₂, φ₃, by series and doubling, for many lanes side by side.
//!
//! Series at a norm of at most ½, then `φ₀(2z)−1 = d (2 + d)` with `d = φ₀(z)−1`, `φ₁(2z) = φ₁ + ½ d φ₁`, `φ₂(2z) = ¼ (d φ₂ + 2 φ₂ + φ₁)`,
//! `φ₃(2z) = ⅛ (d φ₃ + 2 φ₃ + φ₂ + ½ φ₁)` (N. J. Higham, Functions of Matrices, 2008, ch. 10). In `φ₀ − 1` slow poles keep their digits.

/// A number for each lane.
pub trait Lane: Copy {
    /// Zero in every lane.
    const ZERO: Self;
    /// Returns the sum.
    fn plus(self, other: Self) -> Self;
    /// Returns the product.
    fn times(self, other: Self) -> Self;
    /// Returns the product with a number.
    fn scaled(self, factor: f64) -> Self;
    /// Returns the sum with a number in every lane.
    fn shifted(self, by: f64) -> Self;
    /// Returns the magnitude in a lane.
    fn magnitude(self, lane: usize) -> f64;
    /// Returns the product with the factor of each lane.
    fn scaled_each(self, factor: impl Fn(usize) -> f64) -> Self;
    /// Returns `other` in the lanes for which `is_other` is true.
    fn or(self, other: Self, is_other: impl Fn(usize) -> bool) -> Self;
    /// Number of lanes.
    const LANES: usize;
}

impl<const L: usize> Lane for [f64; L] {
    const ZERO: Self = [0.0; L];

    fn plus(self, other: Self) -> Self {
        std::array::from_fn(|lane| self[lane] + other[lane])
    }

    fn times(self, other: Self) -> Self {
        std::array::from_fn(|lane| self[lane] * other[lane])
    }

    fn scaled(self, factor: f64) -> Self {
        self.map(|value| value * factor)
    }

    fn shifted(self, by: f64) -> Self {
        self.map(|value| value + by)
    }

    fn magnitude(self, lane: usize) -> f64 {
        self[lane].abs()
    }

    fn scaled_each(self, factor: impl Fn(usize) -> f64) -> Self {
        std::array::from_fn(|lane| self[lane] * factor(lane))
    }

    fn or(self, other: Self, is_other: impl Fn(usize) -> bool) -> Self {
        std::array::from_fn(|lane| if is_other(lane) { other[lane] } else { self[lane] })
    }

    const LANES: usize = L;
}

/// A value and its derivative in a direction.
#[derive(Debug, Clone, Copy)]
pub struct WithRate<T> {
    /// The value.
    pub value: T,
    /// The derivative of the value in the direction.
    pub rate: T,
}

impl<T: Lane> Lane for WithRate<T> {
    const ZERO: Self = Self { value: T::ZERO, rate: T::ZERO };

    fn plus(self, other: Self) -> Self {
        Self { value: self.value.plus(other.value), rate: self.rate.plus(other.rate) }
    }

    fn times(self, other: Self) -> Self {
        let rate = self.rate.times(other.value).plus(self.value.times(other.rate));
        Self { value: self.value.times(other.value), rate }
    }

    fn scaled(self, factor: f64) -> Self {
        Self { value: self.value.scaled(factor), rate: self.rate.scaled(factor) }
    }

    fn shifted(self, by: f64) -> Self {
        Self { value: self.value.shifted(by), ..self }
    }

    fn magnitude(self, lane: usize) -> f64 {
        self.value.magnitude(lane)
    }

    fn scaled_each(self, factor: impl Fn(usize) -> f64) -> Self {
        Self { value: self.value.scaled_each(&factor), rate: self.rate.scaled_each(&factor) }
    }

    fn or(self, other: Self, is_other: impl Fn(usize) -> bool) -> Self {
        Self { value: self.value.or(other.value, &is_other), rate: self.rate.or(other.rate, &is_other) }
    }

    const LANES: usize = T::LANES;
}

/// `φ₀ − 1`, φ₁, φ₂ and φ₃ of a matrix, row by row.
pub(crate) struct Matrices<T> {
    size: usize,
    pub change: Vec<T>,
    phi: [Vec<T>; 3],
}

/// Norm up to which the series is used.
const NORM: f64 = 0.5;
/// Most doublings: matrices beyond the resulting norm give values that are not finite.
const DOUBLINGS_MAX: u32 = 60;
/// Terms of the series of φ₃: the first omitted one is below 2^−53 of the sum at the norm ½.
const TERMS: u32 = 12;

fn product<T: Lane>(a: &[T], b: &[T], size: usize) -> Vec<T> {
    let mut result = vec![T::ZERO; size * size];
    for row in 0..size {
        for column in 0..size {
            let mut sum = T::ZERO;
            for inner in 0..size {
                sum = sum.plus(a[row * size + inner].times(b[inner * size + column]));
            }
            result[row * size + column] = sum;
        }
    }
    result
}

/// Returns the number of doublings after which `h` times the matrix of a lane has a norm of at most [`NORM`].
fn doublings<T: Lane>(matrix: &[T], size: usize, (h, lane): (f64, usize)) -> u32 {
    let row_norm = |row: &[T]| row.iter().map(|value| h * value.magnitude(lane)).sum::<f64>();
    let norm = matrix.chunks(size.max(1)).map(row_norm).fold(0.0, f64::max);
    let mut doublings = 0;
    while doublings < DOUBLINGS_MAX && norm * 0.5_f64.powi(doublings.cast_signed()) > NORM {
        doublings += 1;
    }
    doublings
}

/// Returns the functions of `h` times a matrix, row by row.
pub(crate) fn phi_functions<T: Lane>(matrix: &[T], size: usize, h: f64) -> Matrices<T> {
    // Each lane has its own number, so that its result does not depend on the others.
    let doublings: Vec<u32> = (0..T::LANES).map(|lane| doublings(matrix, size, (h, lane))).collect();
    let scale = |lane: usize| h * 0.5_f64.powi(doublings[lane].cast_signed());
    let z: Vec<T> = matrix.iter().map(|value| value.scaled_each(scale)).collect();
    let with_identity = |mut matrix: Vec<T>, value: f64| {
        (0..size).for_each(|n| matrix[n * size + n] = matrix[n * size + n].shifted(value));
        matrix
    };
    // φ₃ = Σ zⁿ/(n+3)! by Horner's rule, the others from it.
    let mut factorial: f64 = (1..=TERMS + 3).map(f64::from).product();
    let mut third = with_identity(vec![T::ZERO; size * size], 1.0 / factorial);
    for n in (0..TERMS).rev() {
        factorial /= f64::from(n + 4);
        third = with_identity(product(&third, &z, size), 1.0 / factorial);
    }
    let mut second = with_identity(product(&third, &z, size), 0.5);
    let mut first = with_identity(product(&second, &z, size), 1.0);
    let mut change = product(&first, &z, size);
    for done in 0..doublings.iter().copied().max().unwrap_or(0) {
        let doubles = |lane: usize| done < doublings[lane];
        let [d1, d2, d3, dd] = [&first, &second, &third, &change].map(|of| product(&change, of, size));
        for n in 0..size * size {
            let next = d3[n].plus(third[n].scaled(2.0)).plus(second[n]).plus(first[n].scaled(0.5)).scaled(0.125);
            third[n] = third[n].or(next, doubles);
            second[n] = second[n].or(d2[n].plus(second[n].scaled(2.0)).plus(first[n]).scaled(0.25), doubles);
            first[n] = first[n].or(first[n].plus(d1[n].scaled(0.5)), doubles);
            change[n] = change[n].or(change[n].scaled(2.0).plus(dd[n]), doubles);
        }
    }
    Matrices { size, change, phi: [first, second, third] }
}

impl<T: Lane> Matrices<T> {
    /// Returns `w₁ φ₁ + w₂ φ₂ + w₃ φ₃` times a vector.
    pub fn apply(&self, weights: [f64; 3], vector: &[T]) -> Vec<T> {
        let row = |row: usize| {
            let products = (0..self.size).map(|n| self.combined(weights, row * self.size + n).times(vector[n]));
            products.fold(T::ZERO, T::plus)
        };
        (0..self.size).map(row).collect()
    }

    /// Returns a column of `w₁ φ₁ + w₂ φ₂ + w₃ φ₃`.
    pub fn column(&self, weights: [f64; 3], column: usize) -> Vec<T> {
        (0..self.size).map(|row| self.combined(weights, row * self.size + column)).collect()
    }

    fn combined(&self, weights: [f64; 3], at: usize) -> T {
        let parts = self.phi.iter().zip(weights).filter(|(_, weight)| *weight != 0.0);
        parts.fold(T::ZERO, |sum, (phi, weight)| sum.plus(phi[at].scaled(weight)))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may stop")]

    use super::*;

    /// φ functions of a scalar in closed form, with `exp_m1` and series for small arguments.
    fn closed(z: f64) -> [f64; 4] {
        let series = |first: u32| {
            let mut term = 1.0 / (1..=first).map(f64::from).product::<f64>();
            let mut sum = term;
            for n in 1..40 {
                term *= z / f64::from(first + n);
                sum += term;
            }
            sum
        };
        if z.abs() < 1.0 {
            return [z.exp_m1(), series(1), series(2), series(3)];
        }
        let first = z.exp_m1() / z;
        let second = (first - 1.0) / z;
        [z.exp_m1(), first, second, (second - 0.5) / z]
    }

    #[test]
    fn functions_of_numbers_and_of_a_nilpotent_matrix() {
        for z in [-1e-9, -0.3, -1.0, -7.0, -300.0, 0.0, 0.4, 3.0] {
            let found = phi_functions(&[[z]], 1, 1.0);
            let expected = closed(z);
            let got = [found.change[0][0], found.phi[0][0][0], found.phi[1][0][0], found.phi[2][0][0]];
            for (got, expected) in got.iter().zip(expected) {
                // Rounding doubles with every doubling: 10 of them here.
                assert!((got - expected).abs() <= 2e-13 * expected.abs(), "{z}: {got} {expected}");
            }
        }
        // z² = 0: φ₀ − 1 = z, φ₁ = 1 + z/2, φ₂ = 1/2 + z/6.
        let found = phi_functions(&[[0.0], [4.0], [0.0], [0.0]], 2, 2.0);
        assert_eq!(found.change.iter().map(|v| v[0]).collect::<Vec<_>>(), [0.0, 8.0, 0.0, 0.0]);
        assert_eq!(found.phi[0].iter().map(|v| v[0]).collect::<Vec<_>>(), [1.0, 4.0, 0.0, 1.0]);
        assert!((found.phi[1][1][0] - 8.0 / 6.0).abs() < 1e-15);
    }

    #[test]
    fn a_lane_does_not_depend_on_the_others() {
        let alone = phi_functions(&[[-0.3], [0.2], [0.1], [-0.2]], 2, 0.7);
        let beside = phi_functions(&[[-0.3, -900.0], [0.2, 7.0], [0.1, 3.0], [-0.2, -40.0]], 2, 0.7);
        for n in 0..4 {
            assert_eq!(alone.change[n][0].to_bits(), beside.change[n][0].to_bits());
            assert_eq!(alone.phi[2][n][0].to_bits(), beside.phi[2][n][0].to_bits());
        }
    }

    #[test]
    fn rates_are_those_of_differences() {
        let at = |t: f64| vec![[-3.0 - t], [0.7], [-2.0 * t], [-40.0]];
        let dual: Vec<WithRate<[f64; 1]>> = at(1.0)
            .iter()
            .zip([[-1.0], [0.0], [-2.0], [0.0]])
            .map(|(value, rate)| WithRate { value: *value, rate })
            .collect();
        let found = phi_functions(&dual, 2, 0.5);
        let step = 1e-5;
        let [after, before] = [1.0 + step, 1.0 - step].map(|t| phi_functions(&at(t), 2, 0.5));
        for n in 0..4 {
            for (own, after, before) in [
                (found.change[n], after.change[n], before.change[n]),
                (found.phi[2][n], after.phi[2][n], before.phi[2][n]),
            ] {
                let difference = (after[0] - before[0]) / (2.0 * step);
                assert!((own.rate[0] - difference).abs() < 1e-9, "{n}");
            }
        }
    }
}
