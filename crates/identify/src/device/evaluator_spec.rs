//! Choice between the SIMD kernel and the tables of poles.

use motorfit_core::named::named;
use motorfit_core::numeric::count;
#[cfg(feature = "gpu")]
use motorfit_core::numeric::whole_u64;
use motorfit_evaluate::{PoleTables, Problem};

named! {
    /// The evaluator of costs on the CPU.
    pub enum EvaluatorSpec (default Auto) {
        /// tables of poles where the candidates to come are worth their computation, else the kernel.
        Auto = "auto",
        /// simulation of every candidate with SIMD.
        Kernel = "kernel",
        /// tables of poles, where a candidate takes the same time whatever the length of the recording.
        Tables = "tables",
    }
}

/// Time of a candidate with tables, relative to a step of the kernel: 82 ns and 0.25 ns with AVX-512, 98 ns and 0.45 ns with AVX2.
pub(super) const STEPS: f64 = 330.0;
/// Number of cells in which the candidates of Table 2's box lie.
const CELLS: f64 = 210.0;
/// Time to build a cell on first use for a recording of [`CELL_SAMPLES`] samples, relative to a step of the kernel: 35 µs with AVX-512
/// and 48 µs with AVX2 at 3001 samples, 420 and 730 µs at 10⁵.
const CELL_STEPS: f64 = 140_000.0;
const CELL_SAMPLES: f64 = 3001.0;
/// Growth of the time of a cell with the length of the recording.
const CELL_EXPONENT: f64 = 0.72;
/// Part of the steps that the kernel takes in searches whose cutoffs end simulations early: with the Grey Wolf Optimizer a quarter at 3001
/// samples and a sixth at 30,001.
const SIMULATED: f64 = 0.2;
/// Gain from which on the tables are chosen.
const GAIN_MIN: f64 = 1.2;

/// Candidates to come on the recordings of a problem.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Expected {
    /// Candidates of a generation.
    pub population: usize,
    pub generations: usize,
    /// True if every cost is needed; false if cutoffs end simulations early.
    pub needs_all_costs: bool,
}

impl Expected {
    /// Returns the predicted times with the kernel and with tables, in steps of the kernel.
    fn times(self, problem: &Problem) -> [f64; 2] {
        let [population, generations] = [self.population, self.generations].map(count);
        let recordings = count(problem.signals().len()).max(1.0);
        let samples = count(problem.active()) / recordings;
        let cells = CELLS.min(population * generations);
        let simulated = if self.needs_all_costs { 1.0 } else { SIMULATED };
        let kernel = population * generations * samples * simulated;
        let tables =
            generations * population * STEPS + cells * CELL_STEPS * (samples / CELL_SAMPLES).powf(CELL_EXPONENT);
        [kernel * recordings, tables * recordings]
    }

    /// Returns true if tables are predicted to be faster for a problem that they serve. The prediction depends on the work alone, so that
    /// results do not depend on threads.
    pub(super) fn prefers_tables(self, problem: &Problem) -> bool {
        let [kernel, tables] = self.times(problem);
        PoleTables::serves(problem) && GAIN_MIN * tables < kernel
    }

    /// Returns the number of samples whose complete simulation takes the CPU as long as a candidate with tables, their cells included;
    /// `None` where tables are not preferred.
    #[cfg(feature = "gpu")]
    pub(super) fn equivalent_samples(self, problem: &Problem) -> Option<u64> {
        let candidates = (count(self.population) * count(self.generations)).max(1.0);
        self.prefers_tables(problem).then(|| whole_u64(self.times(problem)[1] / candidates))
    }
}
