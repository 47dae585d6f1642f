//! Sobol' sequence (I. M. Sobol' 1967) with the direction numbers of S. Joe and F. Y. Kuo, Constructing Sobol sequences with better
//! two-dimensional projections, SIAM Journal on Scientific Computing 30 (2008), in the order of I. A. Antonov and V. M. Saleev (1979).

/// Largest number of axes.
pub const SOBOL_AXES_MAX: usize = DIRECTIONS.len() + 1;

/// Number of binary digits of a coordinate, those of the integers that are exact in double precision.
const DIGITS: usize = 53;

/// Coefficients of the primitive polynomial of each axis but the first, as a binary number without the first and the last one, and the
/// initial direction numbers.
const DIRECTIONS: [(u64, &[u64]); 31] = [
    (0, &[1]),
    (1, &[1, 3]),
    (1, &[1, 3, 1]),
    (2, &[1, 1, 1]),
    (1, &[1, 1, 3, 3]),
    (4, &[1, 3, 5, 13]),
    (2, &[1, 1, 5, 5, 17]),
    (4, &[1, 1, 5, 5, 5]),
    (7, &[1, 1, 7, 11, 19]),
    (11, &[1, 1, 5, 1, 1]),
    (13, &[1, 1, 1, 3, 11]),
    (14, &[1, 3, 5, 5, 31]),
    (1, &[1, 3, 3, 9, 7, 49]),
    (13, &[1, 1, 1, 15, 21, 21]),
    (16, &[1, 3, 1, 13, 27, 49]),
    (19, &[1, 1, 1, 15, 7, 5]),
    (22, &[1, 3, 1, 15, 13, 25]),
    (25, &[1, 1, 5, 5, 19, 61]),
    (1, &[1, 3, 7, 11, 23, 15, 103]),
    (4, &[1, 3, 7, 13, 13, 15, 69]),
    (7, &[1, 1, 3, 13, 7, 35, 63]),
    (8, &[1, 3, 5, 9, 1, 25, 53]),
    (14, &[1, 3, 1, 13, 9, 35, 107]),
    (19, &[1, 3, 1, 5, 27, 61, 31]),
    (21, &[1, 1, 5, 11, 19, 41, 61]),
    (28, &[1, 3, 5, 3, 3, 13, 69]),
    (31, &[1, 1, 7, 13, 1, 19, 1]),
    (32, &[1, 3, 7, 5, 13, 19, 59]),
    (37, &[1, 1, 3, 9, 25, 29, 41]),
    (41, &[1, 3, 5, 13, 23, 1, 55]),
    (42, &[1, 3, 7, 3, 13, 59, 17]),
];

/// The sequence on one axis.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct SobolAxis([u64; DIGITS]);

impl SobolAxis {
    /// Returns the sequence on an axis; `None` from [`SOBOL_AXES_MAX`] on.
    pub fn new(axis: usize) -> Option<Self> {
        let of_digit = |digit: usize| 1 << (DIGITS - 1 - digit);
        let Some(row) = axis.checked_sub(1) else { return Some(Self(std::array::from_fn(of_digit))) };
        let (coefficients, initial) = DIRECTIONS.get(row)?;
        let degree = initial.len();
        let mut directions = [0; DIGITS];
        for digit in 0..DIGITS {
            directions[digit] = match initial.get(digit) {
                Some(number) => number * of_digit(digit),
                None => (1..degree)
                    .fold(directions[digit - degree] ^ (directions[digit - degree] >> degree), |sum, k| {
                        sum ^ (((coefficients >> (degree - 1 - k)) & 1) * directions[digit - k])
                    }),
            };
        }
        Some(Self(directions))
    }

    /// Returns the binary digits of a point.
    pub fn at(&self, index: u64) -> u64 {
        let gray = index ^ (index >> 1);
        self.0
            .iter()
            .enumerate()
            .filter(|(digit, _)| gray >> digit & 1 == 1)
            .fold(0, |sum, (_, direction)| sum ^ direction)
    }

    /// Returns the binary digits of the point with a number above 0 from those of the one before.
    #[inline]
    pub fn next(&self, before: u64, index: u64) -> u64 {
        before ^ self.0[index.trailing_zeros() as usize % DIGITS]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_box_of_a_net_holds_one_point() {
        // The first two axes are a (0, m, 2)-net: each box of 2ᵏ by 2ᵐ⁻ᵏ parts holds one of the first 2ᵐ points.
        let axes = [0, 1].map(|axis| SobolAxis::new(axis).unwrap());
        let count = 1 << 10;
        for wide in 0..=10 {
            let part = |axis: usize, index: u64, bits: usize| axes[axis].at(index) >> (DIGITS - bits);
            let place = |index: u64| (part(0, index, wide) << (10 - wide)) + part(1, index, 10 - wide);
            let mut places: Vec<u64> = (0..count).map(place).collect();
            places.sort_unstable();
            assert!(places.into_iter().eq(0..count), "2^{wide} parts of the first axis");
        }
    }

    #[test]
    fn successive_points_are_those_of_their_numbers() {
        for axis in 0..SOBOL_AXES_MAX {
            let axis = SobolAxis::new(axis).unwrap();
            let mut point = axis.at((1 << 40) - 3);
            for index in (1 << 40) - 2..(1 << 40) + 5 {
                point = axis.next(point, index);
                assert_eq!(point, axis.at(index));
            }
        }
        assert_eq!(SobolAxis::new(SOBOL_AXES_MAX), None);
    }
}
