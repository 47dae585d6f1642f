//! Stretches of a recording over which inputs stay the same, or over which only they change.

use super::Signals;
use crate::motor::Discretization;

/// A stretch of samples over which the step and all inputs stay the same.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Span {
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

impl Span {
    /// Whether what changes at its start costs more than to take inputs from sample to sample (measured).
    fn is_short(&self) -> bool {
        self.end - self.start < 16
    }
}

/// A stretch of samples under the same step: a span, or short spans one after the other.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stretch {
    /// With the inputs of the first sample.
    pub span: Span,
    /// Whether the inputs stay the same.
    pub held: bool,
}

/// The spans of a recording.
pub(super) fn spans(signals: &Signals, method: Discretization) -> Vec<Span> {
    let here = |n: usize| {
        let [start, end, torque] = signals.inputs(n);
        let voltage = [start, if method.uses_next_input() { end } else { 0.0 }];
        Span { start: n, end: n + 1, step: signals.step_of(n), voltage, torque }
    };
    let (mut spans, mut span) = (Vec::new(), here(0));
    for next in (1..signals.len()).map(here) {
        if (Span { start: next.start, end: next.end, ..span }) == next {
            span.end = next.end;
        } else {
            spans.push(span);
            span = next;
        }
    }
    spans.push(span);
    spans
}

/// Spans, short ones together.
pub(super) fn stretches(spans: &[Span]) -> Vec<Stretch> {
    let mut stretches: Vec<Stretch> = Vec::new();
    for span in spans {
        let joins = |last: &&mut Stretch| {
            span.is_short() && (!last.held || last.span.is_short()) && last.span.step == span.step
        };
        match stretches.last_mut().filter(joins) {
            Some(last) => (last.span.end, last.held) = (span.end, false),
            None => stretches.push(Stretch { span: *span, held: true }),
        }
    }
    stretches
}
