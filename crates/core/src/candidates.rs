//! The table of candidates that optimizers propose and evaluators read.

/// Candidates as rows of a matrix, shape `[count, width]`: `values[row * width + axis]`, in the unit of each axis.
#[derive(Debug, Clone, Copy)]
pub struct Candidates<'a> {
    values: &'a [f64],
    width: usize,
    /// One for each candidate; empty without cutoffs.
    cutoffs: &'a [f64],
}

impl<'a> Candidates<'a> {
    /// Creates a view of row-major `values` with `width` values per candidate.
    ///
    /// # Panics
    /// Panics if the length of `values` is not a multiple of `width`.
    #[must_use]
    pub fn new(values: &'a [f64], width: usize) -> Self {
        assert!(
            if width == 0 { values.is_empty() } else { values.len().is_multiple_of(width) },
            "{} values do not fill rows of {width}",
            values.len()
        );
        Self { values, width, cutoffs: &[] }
    }

    /// Adds cutoffs, one for each candidate. For a candidate whose cost is above its cutoff, an evaluator may return any other value
    /// between the two.
    ///
    /// # Panics
    /// Panics if there is not one for each candidate.
    #[must_use]
    pub fn with_cutoffs(self, cutoffs: &'a [f64]) -> Self {
        assert!(cutoffs.len() == self.count(), "{} cutoffs for {} candidates", cutoffs.len(), self.count());
        Self { cutoffs, ..self }
    }

    /// Returns the cutoffs, one for each candidate; none if every cost is needed.
    #[must_use]
    pub fn cutoffs(&self) -> &'a [f64] {
        self.cutoffs
    }

    /// Returns the number of candidates.
    #[must_use]
    pub fn count(&self) -> usize {
        self.values.len().checked_div(self.width).unwrap_or(0)
    }

    /// Returns the number of values per candidate.
    #[must_use]
    pub fn width(&self) -> usize {
        self.width
    }

    /// Returns all values, row by row.
    #[must_use]
    pub fn values(&self) -> &'a [f64] {
        self.values
    }

    /// Returns the candidates `from..to`.
    ///
    /// # Panics
    /// Panics if the range is reversed or ends beyond [`Candidates::count`].
    #[must_use]
    pub fn rows(&self, from: usize, to: usize) -> Self {
        let cutoffs = self.cutoffs.get(from..to).unwrap_or_default();
        Self { values: &self.values[from * self.width..to * self.width], width: self.width, cutoffs }
    }

    /// Returns the candidate at index `row`, one value per axis.
    ///
    /// # Panics
    /// Panics if `row` is not less than [`Candidates::count`].
    #[must_use]
    pub fn row(&self, row: usize) -> &'a [f64] {
        &self.values[row * self.width..(row + 1) * self.width]
    }
}
