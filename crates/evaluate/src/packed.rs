//! The linear motor on even clocks, any number of candidates in blocks: those whose costs are known to be above their cutoffs
//! leave, and the others move together into fewer blocks.
//!
//! Errors are not negative and rounding to nearest preserves order, so the cost of the sums so far is a lower bound of the cost,
//! exactly; in another order of the recordings after [`Block::at_least`]. The states of a candidate do not depend on its lane.

use super::at_level::at_each_level;
use super::cutoff::{FIRST, next_due, total_above};
use super::kernel::{Block, LANES, LANES_AVX512, State};
use super::problem::{Problem, Scaling};
use super::segment::Position;
use super::signals::Signals;

at_each_level!(run with [LANES_AVX512, LANES, LANES] candidates);

/// Largest number of candidates that are packed together. Their states, 0.2 kB each, stay in the cache.
pub(super) const PACK: usize = 240;

/// Candidates of one problem in any number of blocks.
struct Pack<'a> {
    block: Block<'a>,
    /// Totals above which the costs are above the cutoffs.
    limits: Vec<f64>,
    /// The totals over the recordings so far.
    totals: Vec<f64>,
    /// The contributions of each recording, shape `[recordings][candidates]`; empty if the totals are summed in the order of the
    /// problem.
    parts: Vec<f64>,
    /// Candidates that may be within their limits.
    live: Vec<usize>,
}

/// Writes the costs of any number of candidates.
#[inline(always)]
fn run<const L: usize, const FMA: bool>(block: &Block<'_>, costs: &mut [f64]) {
    let problem = block.problem;
    let limit =
        |n: usize| block.candidates.cutoffs().get(n).map_or(f64::INFINITY, |cutoff| total_above(block, *cutoff));
    let (count, limits) = (costs.len(), (0..costs.len()).map(limit).collect());
    let parts = vec![0.0; block.order.len() * count];
    let mut pack = Pack { block: *block, limits, totals: vec![0.0; count], parts, live: (0..count).collect() };
    for turn in 0..problem.signals().len() {
        let recording = block.recording(turn);
        let signals = &problem.signals()[recording];
        match (problem.criterion().is_absolute(), signals.weight.is_empty()) {
            (false, true) => pack.simulate::<L, FMA, false, false>(signals, recording),
            (false, false) => pack.simulate::<L, FMA, false, true>(signals, recording),
            (true, true) => pack.simulate::<L, FMA, true, false>(signals, recording),
            (true, false) => pack.simulate::<L, FMA, true, true>(signals, recording),
        }
    }
    if !pack.parts.is_empty() {
        for total in &mut pack.totals {
            *total = block.at_least(*total);
        }
        for &id in &pack.live {
            pack.totals[id] = pack.parts[id..].iter().step_by(count).sum();
        }
    }
    for (cost, total) in costs.iter_mut().zip(pack.totals) {
        *cost = problem.cost(total);
    }
}

impl Pack<'_> {
    /// Adds the contribution of a recording to the totals; that of the samples so far for a candidate that leaves.
    #[inline(always)]
    fn simulate<const L: usize, const FMA: bool, const ABSOLUTE: bool, const WEIGHTED: bool>(
        &mut self,
        signals: &Signals,
        recording: usize,
    ) {
        let problem: &Problem = self.block.problem;
        let mut states: Vec<State<L>> = Vec::with_capacity(self.live.len().div_ceil(L));
        for ids in self.live.chunks(L) {
            let mut state = State::new(&self.block, ids, signals, recording);
            for (lane, &id) in ids.iter().enumerate() {
                (state.before[lane], state.limits[lane]) = (self.totals[id], self.limits[id]);
            }
            states.push(state);
        }
        let scaling = problem.scaling(signals);
        let (mut at, mut done) = (Position::first(signals.active_segments()), 0);
        let mut due = if self.limits.iter().any(|limit| limit.is_finite()) { FIRST } else { usize::MAX };
        while !at.is_end(signals.active_segments()) && !states.is_empty() {
            let mut next = at;
            for state in &mut states {
                next = state.advance::<FMA, ABSOLUTE, WEIGHTED>(problem, signals, at, due - done);
            }
            (at, done) = (next, due);
            if !at.is_end(signals.active_segments()) {
                let mut count = 0;
                for state in &states {
                    count += state.within(scaling);
                }
                if count.div_ceil(L) < states.len() {
                    self.leave(&mut states, scaling);
                }
                due = next_due(done);
            }
        }
        self.live.clear();
        for state in &states {
            for (lane, &id) in state.ids.iter().enumerate().filter(|(_, id)| **id != State::<L>::EMPTY) {
                let part = scaling.total(state.sums(lane));
                self.totals[id] += part;
                if let Some(own) = self.parts.get_mut(recording * self.limits.len() + id) {
                    *own = part;
                }
                // A candidate that diverged stays out as well.
                if self.totals[id] <= self.limits[id] {
                    self.live.push(id);
                }
            }
        }
    }

    /// Takes out the candidates beyond their limits and packs the others.
    fn leave<const L: usize>(&mut self, states: &mut Vec<State<L>>, scaling: Scaling) {
        let mut count = 0_usize;
        for state in states.iter_mut() {
            for lane in 0..L {
                let total = state.before[lane] + scaling.total(state.sums(lane));
                if total <= state.limits[lane] {
                    count += 1;
                } else if state.ids[lane] != State::<L>::EMPTY {
                    self.totals[state.ids[lane]] = total;
                    (state.ids[lane], state.limits[lane]) = (State::<L>::EMPTY, f64::NEG_INFINITY);
                }
            }
        }
        let blocks = count.div_ceil(L);
        let (kept, others) = states.split_at_mut(blocks);
        let is_free = |state: &State<L>, lane: usize| state.ids[lane] == State::<L>::EMPTY;
        let mut free = (0..blocks * L).map(|slot| (slot / L, slot % L));
        for from in others {
            for lane in 0..L {
                if is_free(from, lane) {
                    continue;
                }
                if let Some((to, own)) = free.find(|&(state, lane)| is_free(&kept[state], lane)) {
                    kept[to].take(own, from, lane);
                }
            }
        }
        states.truncate(blocks);
    }
}
