//! Segments of a recording under one step: runs over which inputs stay the same, and segments over which only they change.

/// Samples over which the step and all inputs stay the same.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Run {
    /// First sample.
    pub start: usize,
    /// One past the last sample.
    pub end: usize,
    /// Index of the step.
    pub step: u16,
    /// Voltage at the start and at the end of each step \[V\]; the latter 0 where the method does not use it.
    pub voltage: [f64; 2],
    /// Load torque \[N·m\].
    pub torque: f64,
}

impl Run {
    /// Returns whether its setup costs more than to read inputs at every sample (measured).
    fn is_short(&self) -> bool {
        self.end - self.start < 16
    }

    /// Joins runs of equal step and inputs.
    pub(super) fn joined(runs: impl Iterator<Item = Self>) -> Vec<Self> {
        let mut joined: Vec<Self> = Vec::new();
        for run in runs {
            match joined.last_mut().filter(|last| Self { start: run.start, end: run.end, ..**last } == run) {
                Some(last) => last.end = run.end,
                None => joined.push(run),
            }
        }
        joined
    }
}

/// Samples under the same step: a run, or short runs one after the other.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Segment {
    /// With the inputs of the first sample.
    pub run: Run,
    /// True if the inputs stay the same.
    pub constant: bool,
}

impl Segment {
    /// Returns long runs each by itself, short ones together.
    pub(super) fn of(runs: &[Run]) -> Vec<Self> {
        let mut segments: Vec<Self> = Vec::new();
        for run in runs {
            let joins = |last: &&mut Self| {
                run.is_short() && (!last.constant || last.run.is_short()) && last.run.step == run.step
            };
            match segments.last_mut().filter(joins) {
                Some(last) => (last.run.end, last.constant) = (run.end, false),
                None => segments.push(Self { run: *run, constant: true }),
            }
        }
        segments
    }
}
