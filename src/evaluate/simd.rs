//! The SIMD evaluator: blocks of candidates over the threads of the current rayon pool.

use super::extended;
use super::kernel::{self, Block};
use super::{Batch, Evaluator, Group, Level, Problem, cpu_name};
use crate::Result;
use rayon::prelude::*;

/// SIMD f64 on all threads of the rayon pool that calls it (one thread: no hand-over at all).
#[derive(Debug, Clone, Copy)]
pub struct Simd {
    level: Level,
}

impl Default for Simd {
    fn default() -> Self {
        Self { level: Level::best() }
    }
}

impl Simd {
    /// At a feature level of this machine; one that it lacks becomes the best that it has.
    #[must_use]
    pub fn at(level: Level) -> Self {
        Self { level: if level.is_available() { level } else { Level::best() } }
    }

    /// The feature level.
    #[must_use]
    pub fn level(&self) -> Level {
        self.level
    }

    /// Candidates of a block.
    fn lanes(self, problem: &Problem) -> usize {
        match (self.level, problem.extent().is_linear()) {
            (Level::Avx512, _) => kernel::LANES_AVX512,
            (Level::Avx2, false) => extended::LANES_AVX2,
            _ => kernel::LANES,
        }
    }

    fn run(self, group: &Group<'_>, first: usize, costs: &mut [f64]) {
        let width = group.candidates.width();
        let candidates = &group.candidates.values()[first * width..(first + costs.len()) * width];
        let block = Block { problem: group.problem, candidates, width };
        if !group.problem.extent().is_linear() {
            return match self.level {
                Level::Avx512 => extended::avx512(&block, costs),
                Level::Avx2 => extended::avx2(&block, costs),
                Level::Portable => extended::portable(&block, costs),
            };
        }
        match self.level {
            Level::Avx512 => kernel::avx512(&block, costs),
            Level::Avx2 => kernel::avx2(&block, costs),
            Level::Portable => kernel::portable(&block, costs),
        }
    }
}

impl Evaluator for Simd {
    fn evaluate(&mut self, batch: &Batch<'_>, costs: &mut [f64]) -> Result<()> {
        batch.check(costs)?;
        let simd = *self;
        let mut rest = costs;
        let mut parts = Vec::with_capacity(batch.groups.len());
        for group in batch.groups {
            let (own, others) = rest.split_at_mut(group.candidates.count());
            parts.push((group, simd.lanes(group.problem), own));
            rest = others;
        }
        if rayon::current_num_threads() == 1 {
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
        let threads = rayon::current_num_threads();
        format!("{} ({}, {threads} thread{})", cpu_name(), self.level.name(), if threads == 1 { "" } else { "s" })
    }
}
