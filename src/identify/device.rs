//! What evaluates a search: the CPU, or a GPU where it is asked for or the work is large enough for one to win.

use super::{IdentifySpec, Warning};
use crate::Result;
use crate::candidates::Candidates;
use crate::evaluate::{Batch, Evaluator, Group, Problem, Scalar, Simd};
use std::sync::Arc;

#[cfg(feature = "gpu")]
use crate::evaluate::gpu::{self, Gpu, Precision};

/// What evaluates.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum DeviceSpec {
    /// A GPU where the work is large enough for one to win and a real one answers, else the CPU.
    #[default]
    Auto,
    /// The CPU.
    Cpu,
    /// The best GPU adapter, a software one if there is nothing else.
    Gpu,
    /// A GPU adapter by its place in the list.
    GpuIndex(usize),
    /// A GPU adapter by a part of its name.
    GpuName(String),
}

/// With which numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PrecisionSpec {
    /// f64 where the device has it.
    #[default]
    Auto,
    /// f32 in deviations from the best so far; leaders are evaluated again in f64. On a GPU only.
    F32,
    /// f64.
    F64,
}

/// Candidate-steps of one generation and of a whole search from which on `auto` looks for a GPU: opening one takes
/// some tenths of a second, in which a few cores do 1e9, and a small batch does not fill it.
#[cfg(feature = "gpu")]
const GPU_GENERATION_STEPS: u64 = 200_000_000;
#[cfg(feature = "gpu")]
const GPU_SEARCH_STEPS: u64 = 20_000_000_000;

/// How many of the lowest costs of a call in f32 are evaluated again in f64: the leaders of every search.
const LEADERS: usize = 3;

/// An evaluator with the reference of its run.
pub(super) struct Evaluation {
    evaluator: Box<dyn Evaluator>,
    kind: &'static str,
    precision: &'static str,
    /// Lowest cost so far and its candidate.
    reference: Option<(f64, Vec<f64>)>,
    pub warnings: Option<Warning>,
}

impl Evaluation {
    pub(super) fn new(spec: &IdentifySpec, problem: &Problem) -> Result<Self> {
        let cpu = |warnings| Self {
            evaluator: Box::new(Simd::default()),
            kind: "cpu",
            precision: "f64",
            reference: None,
            warnings,
        };
        #[cfg(feature = "gpu")]
        {
            let precision = match spec.precision {
                PrecisionSpec::Auto => None,
                PrecisionSpec::F32 => Some(Precision::F32),
                PrecisionSpec::F64 => Some(Precision::F64),
            };
            let open = |selector: &gpu::Selector| {
                let gpu = Gpu::open(selector, precision)?;
                let (software, precision) = (gpu.facts().kind == "software", gpu.precision().name());
                let message = format!("{} is a software adapter: slower than --device cpu", gpu.facts().name);
                let warnings = software.then_some(Warning { code: "software_adapter", message });
                Ok(Self { evaluator: Box::new(gpu), kind: "gpu", precision, reference: None, warnings })
            };
            match &spec.device {
                DeviceSpec::Gpu => return open(&gpu::Selector::Best),
                DeviceSpec::GpuIndex(index) => return open(&gpu::Selector::Index(*index)),
                DeviceSpec::GpuName(name) => return open(&gpu::Selector::Name(name.clone())),
                DeviceSpec::Auto if is_large(spec, problem) => {
                    // A real adapter only; one that fails is said, and the CPU takes over.
                    if let Some(real) = gpu::list().into_iter().find(|a| a.kind != "software") {
                        return Ok(open(&gpu::Selector::Index(real.index)).unwrap_or_else(|error| {
                            let message = format!("{error}; the CPU evaluates instead");
                            cpu(Some(Warning { code: "gpu_failed", message }))
                        }));
                    }
                }
                DeviceSpec::Auto | DeviceSpec::Cpu => {}
            }
        }
        #[cfg(not(feature = "gpu"))]
        if !matches!(spec.device, DeviceSpec::Auto | DeviceSpec::Cpu) {
            return Err(crate::Error::new(
                crate::ErrorKind::Device,
                "this build has no GPU evaluation",
                "Build with the feature gpu, or use --device cpu.",
            ));
        }
        if spec.precision == PrecisionSpec::F32 {
            return Err(crate::Error::usage(
                "the CPU evaluates in f64 only",
                "Add --device gpu, or leave --precision out.",
            ));
        }
        let _ = problem;
        Ok(cpu(None))
    }

    pub(super) fn kind(&self) -> &'static str {
        self.kind
    }

    pub(super) fn precision(&self) -> &'static str {
        self.precision
    }

    pub(super) fn name(&self) -> String {
        self.evaluator.name()
    }

    /// Costs of all populations; in f32 the lowest are replaced by those of the oracle.
    pub(super) fn evaluate(
        &mut self,
        problem: &Arc<Problem>,
        populations: &[Candidates<'_>],
        costs: &mut [f64],
    ) -> Result<()> {
        let reference = self.reference.as_ref().map(|(_, values)| values.as_slice());
        let groups: Vec<Group<'_>> =
            populations.iter().map(|&candidates| Group { problem, candidates, reference }).collect();
        self.evaluator.evaluate(&Batch { groups: &groups }, costs)?;
        if self.precision == "f32" {
            let mut rest = costs;
            for population in populations {
                let (own, others) = rest.split_at_mut(population.count());
                self.check_leaders(problem, *population, own);
                rest = others;
            }
        }
        Ok(())
    }

    fn check_leaders(&mut self, problem: &Problem, population: Candidates<'_>, costs: &mut [f64]) {
        let mut order: Vec<usize> = (0..costs.len()).collect();
        let leaders = LEADERS.min(order.len());
        if leaders < order.len() {
            order.select_nth_unstable_by(leaders, |a, b| costs[*a].total_cmp(&costs[*b]));
        }
        for &row in &order[..leaders] {
            costs[row] = Scalar::cost(problem, population.row(row));
            if costs[row] < self.reference.as_ref().map_or(f64::INFINITY, |(cost, _)| *cost) {
                self.reference = Some((costs[row], population.row(row).to_vec()));
            }
        }
    }

    /// The device's cost of a candidate less the oracle's; `None` on the CPU.
    pub(super) fn cost_difference(&mut self, problem: &Arc<Problem>, values: &[f64]) -> Result<Option<f64>> {
        if self.kind == "cpu" {
            return Ok(None);
        }
        let reference = self.reference.as_ref().map(|(_, values)| values.as_slice());
        let groups = [Group { problem, candidates: Candidates::new(values, values.len()), reference }];
        let mut cost = [0.0];
        self.evaluator.evaluate(&Batch { groups: &groups }, &mut cost)?;
        Ok(Some(cost[0] - Scalar::cost(problem, values)))
    }
}

/// Whether a search is large enough for a GPU to win.
#[cfg(feature = "gpu")]
fn is_large(spec: &IdentifySpec, problem: &Problem) -> bool {
    let generation = (spec.population as u64).saturating_mul(problem.active() as u64);
    generation >= GPU_GENERATION_STEPS && generation.saturating_mul(spec.generations as u64) >= GPU_SEARCH_STEPS
}
