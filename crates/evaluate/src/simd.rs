//! The SIMD evaluator: distributes blocks of candidates over the threads of the current rayon pool.

use super::cpu::{Level, cpu_name};
use super::evaluator::{Batch, Evaluator, Group};
use super::kernel::{self, Block};
use super::order::hardest_first;
use super::problem::Problem;
use super::{extended, irregular, packed};
use motorfit_core::Result;
use rayon::prelude::*;

/// Number of candidate-steps of a linear motor, about 0.1 ms, below which a thread outside of a pool does the work itself,
/// because waking the threads of a pool takes as long.
const PARALLEL_MIN: usize = 250_000;
/// Number of candidate-steps of a linear motor with AVX-512 that takes about 0.1 ms.
const PARALLEL_MIN_AVX512: usize = 750_000;
/// From this number of groups per thread on, groups are not divided: the threads are busy with whole ones.
const GROUPS_PER_THREAD: usize = 4;
/// Number of blocks from which on candidates are divided at whole blocks.
const BLOCKS_MIN: usize = 8;
/// About the ratio of the time of a step with extensions, or on an irregular clock, to that of the linear motor.
const EXTENDED_COST: usize = 2;

/// The SIMD evaluator, in f64 on all threads of the current rayon pool. With a single thread, and for small batches of one
/// group from outside of a pool, the calling thread does the work itself.
#[derive(Debug, Clone, Copy)]
pub struct Simd {
    level: Level,
    alone: bool,
}

impl Default for Simd {
    fn default() -> Self {
        Self { level: Level::best(), alone: false }
    }
}

impl Simd {
    /// Returns an evaluator at a SIMD level. If this machine lacks the level, the best available one is used.
    #[must_use]
    pub fn at(level: Level) -> Self {
        Self { level: if level.is_available() { level } else { Level::best() }, alone: false }
    }

    /// Returns an evaluator that uses only the calling thread.
    #[must_use]
    pub fn alone() -> Self {
        Self { alone: true, ..Self::default() }
    }

    /// Returns true if a thread outside of a pool evaluates a batch of `candidates` itself.
    #[must_use]
    pub fn is_small(problem: &Problem, candidates: usize) -> bool {
        Self::default().takes_one_thread(problem, candidates)
    }

    fn takes_one_thread(self, problem: &Problem, candidates: usize) -> bool {
        let factor = if kind(problem, candidates) == Kind::Even { 1 } else { EXTENDED_COST };
        let least = if self.level == Level::Avx512 { PARALLEL_MIN_AVX512 } else { PARALLEL_MIN };
        candidates.saturating_mul(problem.active()).saturating_mul(factor) < least
    }

    /// Returns a description of the processor, its SIMD level and the number of threads.
    #[must_use]
    pub fn name(self) -> String {
        let threads = self.threads();
        format!("{} ({}, {threads} thread{})", cpu_name(), self.level.name(), if threads == 1 { "" } else { "s" })
    }

    /// Returns the number of threads that the evaluator may use.
    fn threads(self) -> usize {
        if self.alone { 1 } else { rayon::current_num_threads() }
    }

    /// Returns the number of candidates in a block.
    fn lanes(self, problem: &Problem, candidates: usize) -> usize {
        match (self.level, kind(problem, candidates)) {
            (Level::Avx512, Kind::ExtendedEven) => extended::LANES_WIDE,
            (Level::Avx512, _) => kernel::LANES_AVX512,
            (Level::Avx2, Kind::Extended | Kind::ExtendedEven) => extended::LANES_AVX2,
            (Level::Portable, Kind::Extended | Kind::ExtendedEven | Kind::Irregular) => kernel::LANES_PORTABLE,
            _ => kernel::LANES,
        }
    }

    /// Returns the number of candidates of a group, one of `groups`, that are evaluated together. With cutoffs they are several
    /// blocks, whose candidates are packed into fewer as some of them leave; a few groups are divided evenly among the threads.
    fn together(self, group: &Group<'_>, groups: usize) -> usize {
        let count = group.candidates.count();
        let lanes = self.lanes(group.problem, count);
        let is_packed = !group.candidates.cutoffs().is_empty() && kind(group.problem, count) == Kind::Even;
        if !is_packed {
            return lanes;
        }
        let shares = if groups < GROUPS_PER_THREAD * self.threads() { self.threads() } else { 1 };
        let parts = shares * count.div_ceil(shares.saturating_mul(packed::PACK)).max(1);
        let even = count.div_ceil(parts);
        // Of few blocks, whole ones would leave one thread with most of the candidates.
        let whole = if even < BLOCKS_MIN * lanes { even } else { even.next_multiple_of(lanes) };
        whole.clamp(lanes, packed::PACK)
    }

    fn run(self, group: &Group<'_>, first: usize, costs: &mut [f64]) {
        let candidates = group.candidates.rows(first, first + costs.len());
        let block = Block { problem: group.problem, candidates, order: order(group) };
        let run = match (kind(group.problem, group.candidates.count()), self.level) {
            (Kind::Even, Level::Avx512) => packed::avx512,
            (Kind::Even, Level::Avx2) => packed::avx2,
            (Kind::Even, Level::Portable) => packed::portable,
            (Kind::Irregular, Level::Avx512) => irregular::avx512,
            (Kind::Irregular, Level::Avx2) => irregular::avx2,
            (Kind::Irregular, Level::Portable) => irregular::portable,
            (Kind::ExtendedEven, Level::Avx512) => extended::avx512_even,
            (Kind::Extended, Level::Avx512) => extended::avx512,
            (Kind::Extended | Kind::ExtendedEven, Level::Avx2) => extended::avx2,
            (Kind::Extended | Kind::ExtendedEven, Level::Portable) => extended::portable,
        };
        run(&block, costs);
    }
}

/// The kernels.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// The linear motor on even clocks.
    Even,
    /// The linear motor, some recordings of which have an irregular clock.
    Irregular,
    /// Motors with extensions.
    Extended,
    /// Motors with extensions but without moving averages, on even clocks, in a number that fills the wider blocks.
    ExtendedEven,
}

fn kind(problem: &Problem, candidates: usize) -> Kind {
    let lanes = |of: usize| candidates.div_ceil(of).saturating_mul(of);
    let is_many = lanes(extended::LANES_WIDE) <= lanes(kernel::LANES_AVX512).saturating_add(candidates / 10);
    let (features, is_even) =
        (problem.features(), problem.signals().iter().all(|signals| signals.step_index.is_empty()));
    match (features.is_linear(), is_even) {
        (true, true) => Kind::Even,
        (true, false) => Kind::Irregular,
        (false, true) if !features.is_averaged() && is_many => Kind::ExtendedEven,
        (false, _) => Kind::Extended,
    }
}

/// Returns the order of the recordings; empty for that of the problem, as without cutoffs.
fn order<'a>(group: &Group<'a>) -> &'a [usize] {
    if group.candidates.cutoffs().is_empty() {
        return &[];
    }
    let problem: &Problem = group.problem;
    problem.order(|problem| hardest_first(problem, &mut Simd::alone()))
}

impl Evaluator for Simd {
    fn evaluate(&mut self, batch: &Batch<'_>, costs: &mut [f64]) -> Result<()> {
        batch.check(costs)?;
        let simd = *self;
        let mut rest = costs;
        let mut parts = Vec::with_capacity(batch.groups.len());
        for group in batch.groups {
            let (own, others) = rest.split_at_mut(group.candidates.count());
            parts.push((group, simd.together(group, batch.groups.len()), own));
            rest = others;
        }
        let is_small = |group: &Group<'_>| simd.takes_one_thread(group.problem, group.candidates.count());
        let is_outside = rayon::current_thread_index().is_none();
        if simd.threads() == 1 || is_outside && matches!(batch.groups, [one] if is_small(one)) {
            for (group, lanes, costs) in parts {
                costs.chunks_mut(lanes).enumerate().for_each(|(n, costs)| simd.run(group, n * lanes, costs));
            }
        } else {
            parts.into_par_iter().for_each(|(group, lanes, costs)| {
                costs.par_chunks_mut(lanes).enumerate().for_each(|(n, costs)| simd.run(group, n * lanes, costs));
            });
        }
        Ok(())
    }

    fn name(&self) -> String {
        Self::name(*self)
    }
}
