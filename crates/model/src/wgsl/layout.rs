//! Layout of the buffers of a shader.

use crate::program::Program;

/// Numbers before the first row: the sampling period, and the time at which the inputs first change \[s\].
pub const HEAD: usize = 2;

/// Places of the numbers in the buffers of a shader.
///
/// The buffer of rows has a head of [`HEAD`] numbers and a row for each sample: the uniforms of the program, then the measured
/// outputs, then their weights if errors are weighted. The buffer of parameters has the shape `[parameters, candidates]`, that of
/// states `[states + outputs + 1, candidates]`: states between rounds, sums of errors, and a mark of candidates that diverge.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Layout {
    /// Number of uniforms of a row.
    pub uniforms: usize,
    /// Numbers of the outputs that were measured.
    pub measured: Vec<usize>,
    /// True if a row has the weights of the errors.
    pub is_weighted: bool,
    /// Number of states.
    pub states: usize,
    /// Numbers of the parameters in the order of the buffer.
    pub parameters: Vec<usize>,
}

impl Layout {
    /// Creates the layout of a program. Outputs for which `measured` is false or missing have no place in a row.
    pub fn new(program: &Program, measured: &[bool], is_weighted: bool) -> Self {
        Self {
            uniforms: program.uniforms.roots.len(),
            measured: (0..program.outputs).filter(|n| measured.get(*n).copied().unwrap_or(false)).collect(),
            is_weighted,
            states: program.states.len(),
            parameters: program.parameters.iter().map(|(_, number)| usize::from(*number)).collect(),
        }
    }

    /// Returns the length of a row.
    pub fn row(&self) -> usize {
        self.uniforms + self.measured.len() * if self.is_weighted { 2 } else { 1 }
    }

    /// Returns the numbers that are kept for a candidate between rounds.
    pub fn kept(&self) -> usize {
        self.states + self.measured.len() + 1
    }
}
