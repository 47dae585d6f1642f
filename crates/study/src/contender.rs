//! The evaluators that a throughput benchmark compares: those of the CPU and every GPU adapter in each precision.

use super::bench_problem::{model_problem, motor_problem};
use motorfit_core::candidates::Candidates;
use motorfit_core::clock::Instant;
use motorfit_core::numeric::count;
use motorfit_core::setting::text;
use motorfit_core::text::counted;
use motorfit_core::{Error, Result};
use motorfit_evaluate::model::ModelProblem;
use motorfit_evaluate::{Batch, Evaluator, Group, Level, PoleTables, Problem, Scalar, SearchProblem, Simd, cpu_name};
use motorfit_identify::device::{DeviceProblem, check_threads};
use motorfit_model::Model;
use std::sync::Arc;

/// Facts that identify an evaluator in the results of a benchmark.
#[derive(Debug, Clone, PartialEq)]
pub struct Contender {
    /// Full name: device, precision, and for a CPU the kernel and the number of threads.
    pub name: String,
    /// Name of the device.
    pub device: String,
    /// `cpu`, or the kind of adapter: `discrete`, `integrated`, `virtual`, `software` or `other`.
    pub kind: &'static str,
    /// Precision: `f32`, `f32-plain` or `f64`.
    pub precision: &'static str,
    /// Evaluator: `kernel` simulates on the CPU, `tables` are tables of poles, `shader` simulates on a GPU.
    pub evaluator: &'static str,
    /// Number of CPU threads; 0 for a GPU.
    pub threads: usize,
    /// Graphics API and driver of an adapter; `None` for a CPU.
    pub driver: Option<(String, String)>,
    /// Operations (multiply–adds, additions, multiplications) per candidate-step; `None` for tables, which do not simulate steps.
    pub operations: Option<f64>,
    /// Time to open and check the device \[s\].
    pub opening_s: f64,
}

impl Contender {
    /// Returns the facts of a kernel on threads of the CPU.
    pub(super) fn on_cpu(name: String, threads: usize, operations: f64) -> Self {
        Self {
            name,
            device: cpu_name(),
            kind: "cpu",
            precision: "f64",
            evaluator: "kernel",
            threads,
            driver: None,
            operations: Some(operations),
            opening_s: 0.0,
        }
    }
}

/// An evaluator with the threads that it runs on; `None` for a GPU.
pub(super) struct Runner<P> {
    evaluator: Box<dyn Evaluator<P>>,
    pool: Option<rayon::ThreadPool>,
}

/// A function that returns the problem of a recording with so many samples.
type ProblemOf<P> = Box<dyn Fn(usize) -> Result<P>>;

/// The evaluators of a benchmark, and the problems that they evaluate: of the DC motor or of a user's model.
pub struct Contenders<P: SearchProblem = Problem> {
    /// Facts of each evaluator.
    pub list: Vec<Contender>,
    /// Errors of the adapters that could not be opened.
    pub refused: Vec<String>,
    pub(super) runners: Vec<Runner<P>>,
    pub(super) problem: ProblemOf<P>,
    /// Operations of the kernel per candidate-step.
    operations: f64,
}

/// Operations of the SIMD kernel per candidate-step: 4 multiply–adds for the states, 2 subtractions and 2 multiply–adds
/// for the errors. The gain of the input is added once per segment of constant input.
const CPU_OPERATIONS: f64 = 8.0;

impl Contenders {
    /// Returns no evaluator of the DC motor yet.
    #[must_use]
    pub fn none() -> Self {
        Self::of(Box::new(motor_problem), CPU_OPERATIONS)
    }
}

impl<P: SearchProblem> Contenders<P> {
    fn of(problem: ProblemOf<P>, operations: f64) -> Self {
        Self { list: Vec::new(), refused: Vec::new(), runners: Vec::new(), problem, operations }
    }

    /// Adds an evaluator that runs on `threads` threads of the CPU.
    ///
    /// # Errors
    /// Returns a `Usage` error if the number of threads is out of range or the threads cannot be started.
    pub fn add_on_cpu(&mut self, name: String, evaluator: Box<dyn Evaluator<P>>, threads: usize) -> Result<()> {
        check_threads(Some(threads))?;
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let hint = || text!("Give fewer " [Threads] ".");
        let pool = Some(pool.map_err(|e| Error::usage(format!("threads cannot be started: {e}"), hint()))?);
        self.list.push(Contender::on_cpu(name, threads, self.operations));
        self.runners.push(Runner { evaluator, pool });
        Ok(())
    }

    /// Adds the SIMD kernel on one thread and on `threads` threads.
    fn add_kernels(&mut self, threads: usize) -> Result<()>
    where
        P: DeviceProblem,
    {
        for threads in up_to(threads) {
            let name = format!("{}, {} f64, {}", cpu_name(), Level::best().name(), counted(threads, "thread"));
            self.add_on_cpu(name, P::kernel(Simd::default()), threads)?;
        }
        Ok(())
    }
}

impl<P: SearchProblem> Runner<P> {
    /// Returns the mean time of one evaluation over `repeats` evaluations \[s\].
    pub(super) fn seconds(
        &mut self,
        (problem, values): (&Arc<P>, Candidates<'_>),
        costs: &mut [f64],
        repeats: usize,
    ) -> Result<f64> {
        self.run(|evaluator| {
            let begun = Instant::now();
            for _ in 0..repeats {
                evaluator.costs(problem, values, costs)?;
            }
            Ok(begun.elapsed().as_secs_f64() / count(repeats))
        })
    }

    /// Returns the time that the device computes in one evaluation and the time of that evaluation end to end \[s\];
    /// `None` if the device has no clock.
    pub(super) fn kernel_seconds(
        &mut self,
        (problem, candidates): (&Arc<P>, Candidates<'_>),
        costs: &mut [f64],
    ) -> Result<Option<[f64; 2]>> {
        let groups = [Group { problem, candidates, reference: None }];
        self.run(|evaluator| {
            let begun = Instant::now();
            let kernel = evaluator.evaluate_timed(&Batch { groups: &groups }, costs)?;
            Ok(kernel.map(|kernel| [kernel, begun.elapsed().as_secs_f64()]))
        })
    }

    fn run<T: Send>(&mut self, work: impl FnOnce(&mut dyn Evaluator<P>) -> Result<T> + Send) -> Result<T> {
        let Self { evaluator, pool } = self;
        match pool {
            Some(pool) => pool.install(|| work(evaluator.as_mut())),
            None => work(evaluator.as_mut()),
        }
    }
}

/// Returns one thread, and all if they are more.
fn up_to(threads: usize) -> impl Iterator<Item = usize> {
    [1, threads].into_iter().take(if threads > 1 { 2 } else { 1 })
}

/// Returns the evaluators of this machine: the scalar kernel, the SIMD kernel and tables of poles on one thread and on `threads` threads,
/// and with `adapters` every GPU adapter in each of its precisions; `plain` adds f32 without the deviation form.
///
/// # Errors
/// Returns a `Usage` error if the number of threads is out of range or the threads cannot be started.
pub fn contenders(threads: usize, adapters: bool, plain: bool) -> Result<Contenders> {
    check_threads(Some(threads))?;
    let mut own = Contenders::none();
    own.add_on_cpu(format!("{}, scalar f64, 1 thread", cpu_name()), Box::new(Scalar), 1)?;
    own.add_kernels(threads)?;
    for threads in up_to(threads) {
        let (cpu, level, threads_text) = (cpu_name(), Level::best().name(), counted(threads, "thread"));
        let name = format!("{cpu}, tables of poles, {level} f64, {threads_text}");
        own.add_on_cpu(name, Box::new(PoleTables::default()), threads)?;
        if let Some(tables) = own.list.last_mut() {
            (tables.evaluator, tables.operations) = ("tables", None);
        }
    }
    if adapters {
        add_gpus(&mut own, &motor_problem(SAMPLES)?, plain);
    }
    Ok(own)
}

/// Samples of the recording with which shaders of a model are checked.
const SAMPLES: usize = 300;

/// Returns the evaluators of a model: the interpreter on one thread and on `threads` threads, and with `adapters` every GPU adapter
/// in each of its precisions.
///
/// # Errors
/// Returns a `Usage` error if the number of threads is out of range or the threads cannot be started, and the errors of
/// [`ModelProblem::new`].
pub fn model_contenders(model: &Model, threads: usize, adapters: bool) -> Result<Contenders<ModelProblem>> {
    check_threads(Some(threads))?;
    let (problem, model) = (model_problem(model, SAMPLES)?, model.clone());
    let mut own = Contenders::of(Box::new(move |samples| model_problem(&model, samples)), count(problem.work()));
    own.add_kernels(threads)?;
    if adapters {
        add_gpus(&mut own, &problem, false);
    }
    Ok(own)
}

#[cfg(feature = "gpu")]
fn add_gpus<P: DeviceProblem>(own: &mut Contenders<P>, problem: &P, plain: bool) {
    use motorfit_gpu::{Precision, Selector};
    for adapter in motorfit_gpu::list() {
        let precisions =
            [plain.then_some(Precision::F32Plain), Some(Precision::F32), adapter.f64.then_some(Precision::F64)];
        for precision in precisions.into_iter().flatten() {
            let begun = Instant::now();
            match problem.open_gpu(&Selector::Index(adapter.index), Some(precision)) {
                Ok(Some((evaluator, _))) => {
                    own.list.push(Contender {
                        name: format!("{}, {} adapter, {}", adapter.name, adapter.kind, precision.name()),
                        device: adapter.name.clone(),
                        kind: adapter.kind,
                        precision: precision.name(),
                        evaluator: "shader",
                        threads: 0,
                        driver: Some((adapter.backend.clone(), adapter.driver.clone())),
                        operations: Some(if problem.user_model().is_some() {
                            own.operations
                        } else {
                            precision.operations()
                        }),
                        opening_s: begun.elapsed().as_secs_f64(),
                    });
                    own.runners.push(Runner { evaluator, pool: None });
                }
                Ok(None) => own.refused.push(motorfit_identify::device::NO_SHADER.to_owned()),
                Err(error) => own.refused.push(error.to_string()),
            }
        }
    }
}

#[cfg(not(feature = "gpu"))]
fn add_gpus<P: SearchProblem>(own: &mut Contenders<P>, _: &P, _: bool) {
    own.refused.push("this build has no GPU evaluation".to_owned());
}
