//! Registers of lanes.

/// Lanes that an operation handles at once.
pub(crate) const WIDTH: usize = 8;

/// Values of eight lanes.
pub(crate) type Vector = [f64; WIDTH];

/// A register of `8 C` lanes.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(crate) struct Register<const C: usize>(pub [Vector; C]);

impl<const C: usize> Register<C> {
    /// Zero in every lane.
    pub const ZERO: Self = Self([[0.0; WIDTH]; C]);
    /// Number of lanes.
    pub const LANES: usize = WIDTH * C;

    /// Returns a register with a value in every lane.
    pub fn of(value: f64) -> Self {
        Self([[value; WIDTH]; C])
    }

    /// Returns the value of a lane.
    pub fn lane(&self, lane: usize) -> f64 {
        self.0[lane / WIDTH][lane % WIDTH]
    }

    /// Sets the value of a lane.
    pub fn set(&mut self, lane: usize, value: f64) {
        self.0[lane / WIDTH][lane % WIDTH] = value;
    }
}

impl<const C: usize> std::ops::Index<usize> for Register<C> {
    type Output = Vector;

    #[inline(always)]
    fn index(&self, part: usize) -> &Vector {
        &self.0[part]
    }
}

impl<const C: usize> std::ops::IndexMut<usize> for Register<C> {
    #[inline(always)]
    fn index_mut(&mut self, part: usize) -> &mut Vector {
        &mut self.0[part]
    }
}
