//! The evaluators that a throughput benchmark compares: those of the CPU and every GPU adapter in each precision.

use super::subject::{BenchProblem, Engine, model_problem};
use motorfit_core::clock::Instant;
use motorfit_core::numeric::count;
use motorfit_core::setting::text;
use motorfit_core::text::counted;
use motorfit_core::{Error, Result};
use motorfit_evaluate::model::ModelSimd;
use motorfit_evaluate::{Evaluator, Level, PoleTables, Scalar, Simd, cpu_name};
use motorfit_identify::device::{DeviceSpec, ModelDevice, PrecisionSpec, check_threads};
use motorfit_model::Model;

/// An evaluator that is benchmarked, with the facts that identify it in the results.
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
    engine: Engine,
    pool: Option<rayon::ThreadPool>,
}

/// Operations of the SIMD kernel per candidate-step: 4 multiply–adds for the states, 2 subtractions and 2 multiply–adds
/// for the errors. The gain of the input is added once per segment of constant input.
const CPU_OPERATIONS: f64 = 8.0;

impl Contender {
    /// Creates an entry for an evaluator that runs on `threads` threads of the CPU.
    ///
    /// # Errors
    /// Returns a `Usage` error if the number of threads is out of range or the threads cannot be started.
    pub fn on_cpu(name: String, evaluator: Box<dyn Evaluator>, threads: usize) -> Result<Self> {
        Self::of_engine(name, Engine::Motor(evaluator), (threads, CPU_OPERATIONS))
    }

    /// Creates the entry of tables of poles on `threads` threads of the CPU.
    fn of_tables(threads: usize) -> Result<Self> {
        let name =
            format!("{}, tables of poles, {} f64, {}", cpu_name(), Level::best().name(), counted(threads, "thread"));
        let own = Self::on_cpu(name, Box::new(PoleTables::default()), threads)?;
        Ok(Self { evaluator: "tables", operations: None, ..own })
    }

    fn of_engine(name: String, engine: Engine, (threads, operations): (usize, f64)) -> Result<Self> {
        check_threads(Some(threads))?;
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let hint = || text!("Give fewer " [Threads] ".");
        let pool = pool.map_err(|e| Error::usage(format!("threads cannot be started: {e}"), hint()))?;
        Ok(Self {
            name,
            device: cpu_name(),
            kind: "cpu",
            precision: "f64",
            evaluator: "kernel",
            threads,
            driver: None,
            operations: Some(operations),
            opening_s: 0.0,
            engine,
            pool: Some(pool),
        })
    }

    /// Returns the mean time of one evaluation over `repeats` evaluations \[s\].
    pub(super) fn seconds(
        &mut self,
        (problem, values): (&BenchProblem, &[f64]),
        costs: &mut [f64],
        repeats: usize,
    ) -> Result<f64> {
        self.run(|engine| {
            let begun = Instant::now();
            for _ in 0..repeats {
                engine.evaluate(problem, values, costs)?;
            }
            Ok(begun.elapsed().as_secs_f64() / count(repeats))
        })
    }

    /// Returns the time that the device computes in one evaluation and the time of that evaluation end to end \[s\];
    /// `None` if the device has no clock.
    pub(super) fn kernel_seconds(
        &mut self,
        (problem, values): (&BenchProblem, &[f64]),
        costs: &mut [f64],
    ) -> Result<Option<[f64; 2]>> {
        self.run(|engine| {
            let begun = Instant::now();
            let kernel = engine.evaluate_timed(problem, values, costs)?;
            Ok(kernel.map(|kernel| [kernel, begun.elapsed().as_secs_f64()]))
        })
    }

    fn run<T: Send>(&mut self, work: impl FnOnce(&mut Engine) -> Result<T> + Send) -> Result<T> {
        let Self { engine, pool, .. } = self;
        match pool {
            Some(pool) => pool.install(|| work(engine)),
            None => work(engine),
        }
    }
}

/// The evaluators of a benchmark, and the errors of the adapters that could not be opened.
pub type Contenders = (Vec<Contender>, Vec<String>);

/// Returns the evaluators of this machine: the scalar kernel, the SIMD kernel and tables of poles on one thread and on `threads` threads,
/// and with `adapters` every GPU adapter in each of its precisions; `plain` adds f32 without the deviation form.
///
/// # Errors
/// Returns a `Usage` error if the number of threads is out of range or the threads cannot be started.
pub fn contenders(threads: usize, adapters: bool, plain: bool) -> Result<Contenders> {
    check_threads(Some(threads))?;
    let simd = |threads: usize| Contender::on_cpu(simd_name(threads), Box::new(Simd::default()), threads);
    let scalar = format!("{}, scalar f64, 1 thread", cpu_name());
    let mut list = vec![Contender::on_cpu(scalar, Box::new(Scalar), 1)?, simd(1)?];
    if threads > 1 {
        list.push(simd(threads)?);
    }
    list.push(Contender::of_tables(1)?);
    if threads > 1 {
        list.push(Contender::of_tables(threads)?);
    }
    let mut refused = Vec::new();
    if adapters {
        gpus(&mut list, &mut refused, plain);
    }
    Ok((list, refused))
}

fn simd_name(threads: usize) -> String {
    format!("{}, {} f64, {}", cpu_name(), Level::best().name(), counted(threads, "thread"))
}

/// Samples of the recording with which shaders of a model are checked.
const SAMPLES: usize = 300;

/// Returns the evaluators of a model: the interpreter on one thread and on `threads` threads, and with `adapters` the best GPU adapter
/// in f32 and f64.
///
/// # Errors
/// Returns a `Usage` error if the number of threads is out of range or the threads cannot be started, and the errors of
/// [`ModelProblem::new`](motorfit_evaluate::model::ModelProblem::new).
pub fn model_contenders(model: &Model, threads: usize, adapters: bool) -> Result<Contenders> {
    check_threads(Some(threads))?;
    let problem = model_problem(model, SAMPLES)?;
    let operations = count(problem.work());
    let simd = |threads: usize| {
        Contender::of_engine(simd_name(threads), Engine::Model(Box::new(ModelSimd)), (threads, operations))
    };
    let mut list = vec![simd(1)?];
    if threads > 1 {
        list.push(simd(threads)?);
    }
    let mut refused = Vec::new();
    for precision in [PrecisionSpec::F32, PrecisionSpec::F64].into_iter().filter(|_| adapters) {
        let begun = Instant::now();
        match ModelDevice::open(&DeviceSpec::Gpu, precision, &problem) {
            Ok(device) if device.kind == "gpu" => {
                let (kind, precision) = (device.evaluator.kind(), device.evaluator.precision());
                let own = Contender {
                    name: format!("{}, {kind} adapter, {precision}", device.evaluator.name()),
                    device: device.evaluator.name(),
                    kind,
                    precision,
                    evaluator: "shader",
                    threads: 0,
                    driver: device.evaluator.driver(),
                    operations: Some(operations),
                    opening_s: begun.elapsed().as_secs_f64(),
                    engine: Engine::Model(device.evaluator),
                    pool: None,
                };
                list.push(own);
            }
            Ok(device) => refused.extend(device.warnings.iter().map(|warning| warning.message.to_string())),
            Err(error) => refused.push(error.to_string()),
        }
    }
    Ok((list, refused))
}

#[cfg(feature = "gpu")]
fn gpus(list: &mut Vec<Contender>, refused: &mut Vec<String>, plain: bool) {
    use motorfit_gpu::{Gpu, Precision, Selector};
    for adapter in motorfit_gpu::list() {
        let precisions =
            [plain.then_some(Precision::F32Plain), Some(Precision::F32), adapter.f64.then_some(Precision::F64)];
        for precision in precisions.into_iter().flatten() {
            let begun = Instant::now();
            match Gpu::open(&Selector::Index(adapter.index), Some(precision)) {
                Ok(gpu) => list.push(Contender {
                    name: format!("{}, {} adapter, {}", adapter.name, adapter.kind, precision.name()),
                    device: adapter.name.clone(),
                    kind: adapter.kind,
                    precision: precision.name(),
                    evaluator: "shader",
                    threads: 0,
                    driver: Some((adapter.backend.clone(), adapter.driver.clone())),
                    operations: Some(precision.operations()),
                    opening_s: begun.elapsed().as_secs_f64(),
                    engine: Engine::Motor(Box::new(gpu)),
                    pool: None,
                }),
                Err(error) => refused.push(error.to_string()),
            }
        }
    }
}

#[cfg(not(feature = "gpu"))]
fn gpus(_: &mut Vec<Contender>, refused: &mut Vec<String>, _: bool) {
    refused.push("this build has no GPU evaluation".to_owned());
}
