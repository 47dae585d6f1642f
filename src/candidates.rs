//! The table of candidates that optimizers propose and evaluators read.

/// Candidates, one a row: `values[row * width + axis]`, in the unit of each axis.
#[derive(Debug, Clone, Copy)]
pub struct Candidates<'a> {
    values: &'a [f64],
    width: usize,
}

impl<'a> Candidates<'a> {
    /// A view of row-major `values` with `width` values a candidate.
    ///
    /// # Panics
    /// When `values` is not a whole number of rows, which is a fault of the calling program.
    #[must_use]
    pub fn new(values: &'a [f64], width: usize) -> Self {
        assert!(
            if width == 0 { values.is_empty() } else { values.len().is_multiple_of(width) },
            "{} values are not whole rows of {width}",
            values.len()
        );
        Self { values, width }
    }

    /// Returns the number of candidates.
    #[must_use]
    pub fn count(&self) -> usize {
        self.values.len().checked_div(self.width).unwrap_or(0)
    }

    /// Values a candidate.
    #[must_use]
    pub fn width(&self) -> usize {
        self.width
    }

    /// All values, row after row.
    #[must_use]
    pub fn values(&self) -> &'a [f64] {
        self.values
    }

    /// Returns the candidates `from..to`.
    ///
    /// # Panics
    /// When there are not so many, as slices do.
    #[must_use]
    pub fn rows(&self, from: usize, to: usize) -> Self {
        Self { values: &self.values[from * self.width..to * self.width], width: self.width }
    }

    /// Returns one candidate.
    ///
    /// # Panics
    /// When there is no such row, as slices do.
    #[must_use]
    pub fn row(&self, row: usize) -> &'a [f64] {
        &self.values[row * self.width..(row + 1) * self.width]
    }
}
