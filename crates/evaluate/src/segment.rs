//! Runs of samples with the same step length and the same inputs, and segments of samples with the same step length.

/// A run of consecutive samples with the same step length and the same inputs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Run {
    /// Index of the first sample.
    pub start: usize,
    /// Index after the last sample.
    pub end: usize,
    /// Index of the step length.
    pub step: u16,
    /// Voltage at the start and at the end of each step \[V\]; the latter is 0 if the discretization does not use it.
    pub voltage: [f64; 2],
    /// Load torque \[N·m\].
    pub torque: f64,
}

impl Run {
    /// Returns true if reading the inputs at every sample is faster than the setup of a run. The limit was measured.
    fn is_short(&self) -> bool {
        self.end - self.start < 16
    }

    /// Joins adjacent runs with the same step length and inputs.
    #[doc(hidden)]
    pub fn joined(runs: impl Iterator<Item = Self>) -> Vec<Self> {
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

/// Consecutive samples with the same step length: one run, or several short runs.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Segment {
    /// The range of samples, with the inputs of the first one.
    pub run: Run,
    /// True if the inputs are constant over the segment.
    pub constant: bool,
}

impl Segment {
    /// Returns the segments of runs: each long run alone, adjacent short runs together.
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

/// A place within the segments of a recording, where a simulation pauses.
#[derive(Debug, Clone, Copy)]
pub(super) struct Position {
    /// Index of the segment.
    pub segment: usize,
    /// First sample of the current part of the segment, which has at most a block of sums, and the next sample.
    pub part: usize,
    pub next: usize,
    /// Number of samples in parts that are complete but not in the totals.
    pub summed: usize,
}

impl Position {
    /// Returns the beginning.
    pub(super) fn first(segments: &[Segment]) -> Self {
        let start = segments.first().map_or(0, |segment| segment.run.start);
        Self { segment: 0, part: start, next: start, summed: 0 }
    }

    /// Returns true after the last segment.
    pub(super) fn is_end(&self, segments: &[Segment]) -> bool {
        self.segment >= segments.len()
    }
}
