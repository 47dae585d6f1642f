//! The evaluators of the DC motor, and the prediction which is the fastest.

#[cfg(feature = "gpu")]
use super::evaluator_spec::EvaluatorSpec;
use super::evaluator_spec::{Expected, STEPS};
#[cfg(feature = "gpu")]
use super::problem::OnGpu;
use super::problem::{DeviceProblem, Problems};
#[cfg(feature = "gpu")]
use super::settings::{DeviceSettings, PrecisionSpec};
#[cfg(feature = "gpu")]
use super::throughput_profile::{AdapterThroughput, Work};
#[cfg(feature = "gpu")]
use motorfit_core::Result;
use motorfit_core::numeric::whole;
use motorfit_estimate::descend;
use motorfit_evaluate::{Evaluator, PoleTables, Problem, Simd};
#[cfg(feature = "gpu")]
use motorfit_gpu::{self as gpu, Gpu, Precision, Selector};
use motorfit_optimize::{LocalOptimum, LocalSearch};

/// Smallest number of candidate-steps in one generation for which `auto` opens a GPU that was not measured: a smaller batch
/// does not use the GPU fully.
#[cfg(feature = "gpu")]
const GPU_GENERATION_STEPS: u64 = 200_000_000;
/// Smallest number of candidate-steps in a search for which `auto` opens a GPU that was not measured: opening takes some tenths
/// of a second, in which a few cores evaluate 1e9.
#[cfg(feature = "gpu")]
const GPU_SEARCH_STEPS: u64 = 20_000_000_000;
/// Largest ratio of a GPU's throughput to that of all cores which is expected of a GPU that was not measured: an H200 against 16 threads
/// with AVX-512 on 100,001 samples.
#[cfg(feature = "gpu")]
const GPU_SPEEDUP_MAX: u64 = 25;
/// Size of batches of a discrete GPU relative to those of the CPU; smaller ones would not use it fully.
#[cfg(feature = "gpu")]
const BATCH_FACTOR_DISCRETE: usize = 100;
/// Size of batches of other GPUs in hardware relative to those of the CPU.
#[cfg(feature = "gpu")]
const BATCH_FACTOR_OTHER: usize = 10;

impl LocalSearch for Problems<Problem> {
    fn descend(&self, run: usize, start: &[f64], evaluations: u64) -> LocalOptimum {
        let (values, cost, evaluations) = descend(self.of(run), start, evaluations);
        LocalOptimum { values, cost, evaluations }
    }
}

impl DeviceProblem for Problem {
    const BLOCK: usize = 1;

    fn kernel(simd: Simd) -> Box<dyn Evaluator<Self>> {
        Box::new(simd)
    }

    fn tables() -> Option<Box<dyn Evaluator<Self>>> {
        Some(Box::new(PoleTables::default()))
    }

    fn steps_of_tables(&self) -> Option<usize> {
        PoleTables::serves(self).then(|| whole(STEPS) * self.signals().len())
    }

    fn prefers_tables(&self, expected: Expected) -> bool {
        expected.prefers_tables(self)
    }

    fn local_search(problems: &Problems<Self>) -> Option<&dyn LocalSearch> {
        Some(problems)
    }

    #[cfg(feature = "gpu")]
    fn open_gpu(&self, selector: &Selector, precision: Option<Precision>) -> Result<Option<OnGpu<Self>>> {
        let gpu = Gpu::open(selector, precision)?;
        let facts = gpu.facts().clone();
        Ok(Some((Box::new(gpu), facts)))
    }

    #[cfg(feature = "gpu")]
    fn batch_factor(adapter: &str) -> usize {
        match adapter {
            "discrete" => BATCH_FACTOR_DISCRETE,
            "software" => 1,
            _ => BATCH_FACTOR_OTHER,
        }
    }

    /// Predicts by the throughput profile for measured adapters, and by the size of the work for others.
    #[cfg(feature = "gpu")]
    fn faster_adapter(&self, settings: &DeviceSettings, problems: usize) -> Option<usize> {
        worth_opening(settings, self, problems)
    }
}

/// Returns the index of a hardware adapter that is predicted to be faster than the CPU with its evaluator for the work, or `None` if there
/// is none or the work is too small. The prediction is based on the throughput profile for measured adapters, and on the size of the work
/// for others.
#[cfg(feature = "gpu")]
fn worth_opening(settings: &DeviceSettings, problem: &Problem, problems: usize) -> Option<usize> {
    let equivalent_samples = || settings.expected(problems).equivalent_samples(problem);
    let work = Work {
        samples: problem.active() as u64,
        population: settings.population as u64,
        generations: settings.generations as u64,
        threads: rayon::current_num_threads(),
        equivalent_samples: (settings.evaluator == EvaluatorSpec::Auto).then(equivalent_samples).flatten(),
    };
    let throughput_profile =
        settings.throughput_profile.as_ref().filter(|throughput_profile| throughput_profile.is_current());
    let precision = (settings.precision == PrecisionSpec::F64).then_some("f64");
    let faster = throughput_profile.and_then(|throughput_profile| throughput_profile.faster(work, precision));
    if faster.is_none() && !is_large(work) {
        return None;
    }
    let is = |a: &gpu::AdapterFacts, known: &AdapterThroughput| {
        a.name == known.name && a.driver == known.driver && a.backend == known.backend
    };
    let real: Vec<gpu::AdapterFacts> = gpu::list().into_iter().filter(|a| a.kind != "software").collect();
    let measured =
        |a: &&gpu::AdapterFacts| throughput_profile.is_some_and(|p| p.adapters.iter().any(|known| is(a, known)));
    let chosen = faster.and_then(|faster| real.iter().find(|a| is(a, faster)));
    let unknown = || real.iter().filter(|_| is_large(work)).find(|a| !measured(a));
    chosen.or_else(unknown).map(|a| a.index)
}

/// Returns true if a search is large enough for a GPU that was not measured to be faster.
#[cfg(feature = "gpu")]
fn is_large(work: Work) -> bool {
    let on_cpu = work.equivalent_samples.unwrap_or(work.samples);
    let candidates = work.population.saturating_mul(work.generations);
    work.population.saturating_mul(work.samples) >= GPU_GENERATION_STEPS
        && candidates.saturating_mul(on_cpu) >= GPU_SEARCH_STEPS
        && work.samples <= GPU_SPEEDUP_MAX.saturating_mul(on_cpu)
}
