//! The kernels for each number of states and outputs and each SIMD level.

use super::coefficients::{AffineProgram, Coefficients, PARTS};
use super::kernel::sums;
use super::rows::AffineRows;
use crate::Level;
use crate::interpreter::{Register, Work};

/// Lanes of a block.
const LANES: usize = Register::<PARTS>::LANES;
/// Candidates side by side: without and with reactions, whose latency is longer.
const AVX512: [usize; 2] = [16, 16];
const OTHERS: [usize; 2] = [8, 16];

/// A program and the rows that it runs on.
pub(crate) struct AffineJob<'a> {
    pub program: &'a AffineProgram,
    pub rows: &'a AffineRows,
}

impl AffineJob<'_> {
    /// Computes the sums of the squared errors of each output of the model from the parameters of a block.
    pub fn run_at(&self, work: &mut Work<PARTS>, level: Level) {
        self.program.begin(work);
        work.outputs.clear();
        work.outputs.resize(self.program.layout.outputs.len(), Register::ZERO);
        run(self, work, level);
    }

    /// Computes the sums with the fastest instructions of this machine.
    pub fn run(&self, work: &mut Work<PARTS>) {
        self.run_at(work, Level::best());
    }
}

#[inline(always)]
fn candidates<
    const N: usize,
    const M: usize,
    const L: usize,
    const FMA: bool,
    const WEIGHTED: bool,
    const REACTS: bool,
>(
    job: &AffineJob<'_>,
    work: &mut Work<PARTS>,
) {
    let layout = &job.program.layout;
    let mut first = 0;
    while first < LANES {
        let of = Coefficients::<N, L>::new(layout, (&work.parameters, &work.results), first);
        let sums = sums::<N, M, L, FMA, WEIGHTED, REACTS>(&of, job.rows);
        for (sums, output) in sums.iter().zip(&layout.outputs) {
            for (lane, sum) in sums.iter().enumerate() {
                work.outputs[*output].set(first + lane, *sum);
            }
        }
        first += L;
    }
}

#[inline(always)]
fn with_outputs<const N: usize, const M: usize, const A: usize, const B: usize, const FMA: bool>(
    job: &AffineJob<'_>,
    work: &mut Work<PARTS>,
) {
    match (job.program.layout.reactions.is_empty(), job.rows.weights.is_empty()) {
        (true, true) => candidates::<N, M, A, FMA, false, false>(job, work),
        (true, false) => candidates::<N, M, A, FMA, true, false>(job, work),
        (false, true) => candidates::<N, M, B, FMA, false, true>(job, work),
        (false, false) => candidates::<N, M, B, FMA, true, true>(job, work),
    }
}

/// Defines the kernels for each number of states, with the numbers of outputs that they have.
macro_rules! kernels {
    ($($module:ident $states:literal [$($outputs:literal)*] $most:literal)*) => {
        $(
            mod $module {
                use crate::affine::run::{AVX512, AffineJob, OTHERS, PARTS, with_outputs};
                use crate::at_level;
                use crate::interpreter::Work;

                #[inline(always)]
                fn any<const A: usize, const B: usize, const FMA: bool>(job: &AffineJob<'_>, work: &mut Work<PARTS>) {
                    match job.program.layout.outputs.len() {
                        $($outputs => with_outputs::<$states, $outputs, A, B, FMA>(job, work),)*
                        _ => with_outputs::<$states, $most, A, B, FMA>(job, work),
                    }
                }

                at_level! {
                    pub(super) fn avx512(job: &AffineJob<'_>, work: &mut Work<PARTS>) = avx512 {
                        any::<{ AVX512[0] }, { AVX512[1] }, true>(job, work)
                    } else avx2
                }

                at_level! {
                    pub(super) fn avx2(job: &AffineJob<'_>, work: &mut Work<PARTS>) = avx2 {
                        any::<{ OTHERS[0] }, { OTHERS[1] }, true>(job, work)
                    } else portable
                }

                pub(super) fn portable(job: &AffineJob<'_>, work: &mut Work<PARTS>) {
                    any::<{ OTHERS[0] }, { OTHERS[1] }, false>(job, work);
                }
            }
        )*

        fn run(job: &AffineJob<'_>, work: &mut Work<PARTS>, level: Level) {
            match (job.program.layout.states.len(), level) {
                $(
                    ($states, Level::Avx512) => $module::avx512(job, work),
                    ($states, Level::Avx2) => $module::avx2(job, work),
                    ($states, Level::Portable) => $module::portable(job, work),
                )*
                // The layout has at most two states.
                _ => {}
            }
        }
    };
}

kernels! { one 1 [] 1 two 2 [1] 2 }
