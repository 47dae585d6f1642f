//! The kernel for the linear motor: simulates `L` candidates side by side through one recording.
//!
//! Cost per candidate and step: four multiply–adds for the state (`x⁺ = Φ x + g`, g constant over a run), two subtractions and
//! two multiply–adds for the errors, which are 8 operations on the FMA ports (6 on processors with separate ports for
//! additions). Inputs that change from sample to sample add one product for each state and input. `Φ = I + D` is rounded once
//! per candidate, which changes a trajectory by at most ε/(h·pole).
//!
//! The code uses plain arrays and no intrinsics; `at_level` compiles it once per SIMD level.

#![expect(clippy::needless_range_loop, reason = "a lane indexes several arrays alike; that is what vectorizes")]

use super::lanes::{Lanes, SUM_BLOCK, Samples, add_losses, advance, gain, phi, so_far};
use super::problem::{Problem, Scaling};
use super::segment::{Position, Segment};
use super::signals::Signals;
use motorfit_core::candidates::Candidates;
use motorfit_core::numeric::count;
use motorfit_motor::{Method, StepMaps, step_maps};

/// A block of candidates and their problem.
#[derive(Clone, Copy)]
pub(super) struct Block<'a> {
    pub problem: &'a Problem,
    pub candidates: Candidates<'a>,
    /// The order of the recordings; empty for that of the problem.
    pub order: &'a [usize],
}

impl Block<'_> {
    /// Returns the index of the recording that is simulated in a turn.
    #[inline(always)]
    pub(super) fn recording(&self, turn: usize) -> usize {
        self.order.get(turn).copied().unwrap_or(turn)
    }

    /// Returns the factor of the limits on totals that are summed in the order of the block. Each sum of n terms has a relative
    /// error of at most n ε / 2, so it differs by at most n ε from the sum in the order of the problem.
    #[inline(always)]
    pub(super) fn slack(&self) -> f64 {
        1.0 + 4.0 * f64::EPSILON * count(self.order.len())
    }

    /// Returns a lower bound on the total in the order of the problem, above the cutoff where `total` is above its limit.
    #[inline(always)]
    pub(super) fn at_least(&self, total: f64) -> f64 {
        total * (1.0 - 2.0 * f64::EPSILON * count(self.order.len()))
    }

    /// Returns the parameters of the candidates `ids` on a recording, shape `[parameters][candidates]`. Lanes without a candidate
    /// repeat the last one.
    #[inline(always)]
    pub(super) fn parameters<const L: usize>(&self, ids: &[usize], recording: usize) -> [[f64; L]; 5] {
        let row = |lane: usize| self.candidates.row(ids[lane.min(ids.len() - 1)]);
        self.problem.side_by_side::<L>(std::array::from_fn(row), recording)
    }
}

/// Candidates side by side at AVX-512, the fastest number that its registers can take (measured).
pub(super) const LANES_AVX512: usize = 24;
/// Candidates side by side at the other levels (measured); in WebAssembly fewer, for a page that loads sooner.
pub(super) const LANES: usize = if cfg!(target_arch = "wasm32") { 4 } else { 8 };
/// Candidates side by side at the portable level with extensions, or on irregular clocks: one vector in WebAssembly, where the code of
/// these kernels would be a fifth of the page's.
pub(super) const LANES_PORTABLE: usize = if cfg!(target_arch = "wasm32") { 2 } else { LANES };

/// A block of candidates within the simulation of one recording.
pub(super) struct State<const L: usize> {
    /// The candidate of each lane.
    pub ids: [usize; L],
    /// The total of each candidate over the recordings before, and that above which its cost is above its cutoff; −∞ for a lane
    /// without a candidate.
    pub before: [f64; L],
    pub limits: [f64; L],
    maps: StepMaps<L>,
    lanes: Lanes<L>,
    totals: [[f64; L]; 2],
}

impl<const L: usize> State<L> {
    /// Marks a lane without a candidate.
    pub const EMPTY: usize = usize::MAX;

    /// Returns the beginning of a recording for up to `L` candidates, given by their rows.
    #[inline(always)]
    pub(super) fn new(block: &Block<'_>, ids: &[usize], signals: &Signals, recording: usize) -> Self {
        let mut own = [Self::EMPTY; L];
        own[..ids.len()].copy_from_slice(ids);
        Self { ids: own, ..Self::of(signals, &block.parameters(ids, recording), block.problem.method()) }
    }

    #[inline(always)]
    fn of(signals: &Signals, parameters: &[[f64; L]; 5], method: Method) -> Self {
        let maps = step_maps(parameters, signals.step_s[0], method);
        let lanes =
            Lanes { x: signals.initial.map(|x| [x; L]), sums: [[0.0; L]; 2], phi: phi(&maps), gain: maps.torque };
        // NaN step maps must give a NaN cost even if the input is zero.
        let mut totals = [[0.0; L]; 2];
        for lane in 0..L {
            totals[0][lane] = 0.0 * maps.d.iter().map(|d| d[lane]).sum::<f64>();
        }
        Self { ids: [Self::EMPTY; L], before: [0.0; L], limits: [f64::NEG_INFINITY; L], maps, lanes, totals }
    }

    /// Simulates at most `samples` samples from a position on an even clock and returns the position after them.
    #[inline(always)]
    pub(super) fn advance<const FMA: bool, const ABSOLUTE: bool, const WEIGHTED: bool>(
        &mut self,
        problem: &Problem,
        signals: &Signals,
        mut at: Position,
        mut samples: usize,
    ) -> Position {
        let is_simple = !problem.method().uses_next_input() && signals.torque.is_empty();
        let segments = signals.active_segments();
        while samples > 0
            && let Some(Segment { run, constant }) = segments.get(at.segment)
        {
            if at.next == run.start {
                self.lanes.gain = gain::<L, 3>(&self.maps, [run.voltage[0], run.voltage[1], run.torque]);
            }
            let end = run.end.min(at.part + SUM_BLOCK);
            let (from, to) = (at.next, end.min(at.next.saturating_add(samples)));
            let (of, lanes, maps) = (Samples::of(signals, from, to), &mut self.lanes, &self.maps);
            if *constant {
                run_samples::<L, FMA, ABSOLUTE, WEIGHTED, 0>(lanes, maps, of, std::iter::repeat([0.0; 3]));
            } else if is_simple {
                let volts = signals.voltage[from..to].iter().map(|&voltage| [voltage, 0.0, 0.0]);
                run_samples::<L, FMA, ABSOLUTE, WEIGHTED, 1>(lanes, maps, of, volts);
            } else {
                let inputs = (from..to).map(|n| signals.inputs(n));
                run_samples::<L, FMA, ABSOLUTE, WEIGHTED, 3>(lanes, maps, of, inputs);
            }
            samples -= to - from;
            at.next = to;
            if to == end {
                at.summed += end - at.part;
                if at.summed >= SUM_BLOCK {
                    self.flush();
                    at.summed = 0;
                }
                at.part = end;
                if end == run.end {
                    let start = segments.get(at.segment + 1).map_or(end, |next| next.run.start);
                    at = Position { segment: at.segment + 1, part: start, next: start, ..at };
                }
            }
        }
        at
    }

    /// Adds the sums of a block of samples to the totals. Summation in blocks bounds the rounding error by the block length.
    #[inline(always)]
    fn flush(&mut self) {
        self.totals = so_far(&self.totals, &self.lanes.sums);
        self.lanes.sums = [[0.0; L]; 2];
    }

    /// Returns the number of candidates within their limits.
    #[inline(always)]
    pub(super) fn within(&self, scaling: Scaling) -> usize {
        let (sums, mut count) = (so_far(&self.totals, &self.lanes.sums), 0);
        for lane in 0..L {
            let total = self.before[lane] + scaling.total([sums[0][lane], sums[1][lane]]);
            count += usize::from(total <= self.limits[lane]);
        }
        count
    }

    /// Returns the weighted sums of errors of a lane so far, per channel.
    pub(super) fn sums(&self, lane: usize) -> [f64; 2] {
        [0, 1].map(|channel| self.totals[channel][lane] + self.lanes.sums[channel][lane])
    }

    /// Moves the candidate of a lane of another block to the lane `own`.
    pub(super) fn take(&mut self, own: usize, from: &mut Self, lane: usize) {
        self.ids[own] = from.ids[lane];
        for (to, from) in self.values().into_iter().zip(from.values()) {
            to[own] = from[lane];
        }
    }

    /// Returns all numbers of the candidates.
    fn values(&mut self) -> [&mut [f64; L]; 24] {
        let Self {
            before,
            limits,
            maps: StepMaps { d: [a, b, c, d], taps: [[e, f], [g, h]], torque: [i, j] },
            lanes,
            totals,
            ..
        } = self;
        let Lanes { x: [k, l], sums: [m, n], phi: [o, p, q, r], gain: [s, t] } = lanes;
        let [u, v] = totals;
        [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, before, limits]
    }
}

/// Simulates samples with the same step map. The first `CHANGING` inputs change from sample to sample, the others are constant.
#[inline(always)]
fn run_samples<const L: usize, const FMA: bool, const ABSOLUTE: bool, const WEIGHTED: bool, const CHANGING: usize>(
    lanes: &mut Lanes<L>,
    maps: &StepMaps<L>,
    samples: Samples<'_>,
    inputs: impl Iterator<Item = [f64; 3]>,
) {
    // The black box forces the lanes through memory; otherwise the compiler splits them into scalars.
    let lanes = std::hint::black_box(lanes);
    let Lanes { mut x, mut sums, phi, gain: mut drive } = *lanes;
    for (n, (measured, inputs)) in samples.measured.iter().zip(inputs).enumerate() {
        let weight = if WEIGHTED { samples.weight[n] } else { [1.0; 2] };
        if CHANGING > 0 {
            drive = gain::<L, CHANGING>(maps, inputs);
        }
        add_losses::<L, FMA, ABSOLUTE, WEIGHTED>(&mut sums, &x, *measured, weight);
        advance::<L, FMA>(&mut x, &phi, &drive);
    }
    (lanes.x, lanes.sums) = (x, sums);
}
