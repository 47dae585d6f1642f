//! The four sequences of coefficients whose power series are computed together.

use motorfit_core::numeric::{count, whole};

/// Number of sequences that are summed together.
pub(super) const SEQUENCES: usize = 4;
/// Coefficients of four sequences, one row for each power.
pub(super) type Rows = [[f64; SEQUENCES]];
/// Values of four functions at a point: real parts, then imaginary parts.
pub(super) type PointValues = [f64; 2 * SEQUENCES];

/// Exponent at which a power no longer counts: e⁻⁴⁰ is 4e-18.
const NEGLIGIBLE: f64 = 40.0;

/// Returns the number of rows that count where no λ decays more slowly than `e^{−decay}` per step.
pub(super) fn rows_that_count(rows: &Rows, decay: f64) -> usize {
    if decay <= 0.0 {
        return rows.len();
    }
    // The power 0 always counts.
    whole((1.0 + NEGLIGIBLE / decay).ceil().min(count(rows.len())))
}
