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

/// How many of the lowest costs of a call in f32 are evaluated again in f64 at least: the leaders of every search.
const LEADERS: usize = 3;

/// Candidate-steps between two questions to the observer: some tenth of a second of a few cores, or of a real GPU.
const SLICE_STEPS: usize = 500_000_000;
#[cfg(feature = "gpu")]
const SLICE_STEPS_GPU: usize = 100 * SLICE_STEPS;

/// An evaluator with the reference of its run.
pub(super) struct Evaluation {
    evaluator: Box<dyn Evaluator>,
    kind: &'static str,
    precision: &'static str,
    /// Lowest cost so far and its candidate.
    reference: Option<(f64, Vec<f64>)>,
    /// Whether the CPU may take over.
    auto: bool,
    slice_steps: usize,
    pub warnings: Vec<Warning>,
}

impl Evaluation {
    #[cfg_attr(not(feature = "gpu"), expect(unused_variables, reason = "only a GPU depends on the size of the work"))]
    pub(super) fn new(spec: &IdentifySpec, problem: &Problem) -> Result<Self> {
        let cpu = |warnings: Option<Warning>| Self {
            evaluator: Box::new(Simd::default()),
            kind: "cpu",
            precision: "f64",
            reference: None,
            auto: false,
            slice_steps: SLICE_STEPS,
            warnings: warnings.into_iter().collect(),
        };
        if spec.precision == PrecisionSpec::F32 && matches!(spec.device, DeviceSpec::Auto | DeviceSpec::Cpu) {
            return Err(crate::Error::usage(
                "f32 is for GPUs: the CPU evaluates in f64 only",
                "Add --device gpu, or leave --precision out.",
            ));
        }
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
                let warnings = warnings.into_iter().collect();
                let auto = spec.device == DeviceSpec::Auto;
                let slice_steps = if software { SLICE_STEPS } else { SLICE_STEPS_GPU };
                let evaluator = Box::new(gpu);
                Ok(Self { evaluator, kind: "gpu", precision, reference: None, auto, slice_steps, warnings })
            };
            match &spec.device {
                DeviceSpec::Gpu => return open(&gpu::Selector::Best),
                DeviceSpec::GpuIndex(index) => return open(&gpu::Selector::Index(*index)),
                DeviceSpec::GpuName(name) => return open(&gpu::Selector::Name(name.clone())),
                DeviceSpec::Auto if is_large(spec, problem) => {
                    // A real adapter only; one that fails is said, and the CPU takes over.
                    if let Some(real) = gpu::list().into_iter().find(|a| a.kind != "software") {
                        return Ok(open(&gpu::Selector::Index(real.index))
                            .unwrap_or_else(|error| cpu(Some(taken_over(&error)))));
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
        Ok(cpu(None))
    }

    /// A GPU only where one is named: for what has no population.
    pub(super) fn asked_for(spec: &IdentifySpec, problem: &Problem) -> Result<Self> {
        if spec.device == DeviceSpec::Auto {
            return Self::new(&IdentifySpec { device: DeviceSpec::Cpu, ..spec.clone() }, problem);
        }
        Self::new(spec, problem)
    }

    pub(super) fn kind(&self) -> &'static str {
        self.kind
    }

    pub(super) fn precision(&self) -> &'static str {
        self.precision
    }

    /// Candidate-steps that may pass before the observer is asked again.
    pub(super) fn slice_steps(&self) -> usize {
        self.slice_steps
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
        let batch = Batch { groups: &groups };
        if let Err(error) = self.evaluator.evaluate(&batch, costs) {
            if !self.auto {
                return Err(error);
            }
            // auto carries on with the CPU; nothing that was found is lost.
            self.warnings.push(taken_over(&error));
            self.evaluator = Box::new(Simd::default());
            (self.kind, self.precision, self.auto) = ("cpu", "f64", false);
            self.evaluator.evaluate(&batch, costs)?;
        }
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

    /// Replaces the lowest costs by those of the oracle until the lowest of all is one of them.
    fn check_leaders(&mut self, problem: &Problem, population: Candidates<'_>, costs: &mut [f64]) {
        let mut order: Vec<usize> = (0..costs.len()).collect();
        order.sort_by(|a, b| costs[*a].total_cmp(&costs[*b]));
        let mut lowest = f64::INFINITY;
        for (place, row) in order.into_iter().enumerate() {
            if place >= LEADERS && costs[row] >= lowest {
                break;
            }
            costs[row] = Scalar::cost(problem, population.row(row));
            lowest = lowest.min(costs[row]);
            if costs[row] < self.reference.as_ref().map_or(f64::INFINITY, |(cost, _)| *cost) {
                self.reference = Some((costs[row], population.row(row).to_vec()));
            }
        }
    }

    /// The device's cost of a candidate less the oracle's; `None` on the CPU, and where the device fails at the end.
    /// In f32 the deviations are taken from elsewhere in the box, not from the candidate itself, where they are zero.
    pub(super) fn cost_difference(&mut self, problem: &Arc<Problem>, values: &[f64]) -> Option<f64> {
        if self.kind == "cpu" {
            return None;
        }
        let reference: Vec<f64> = values.iter().map(|v| 1.02 * v).collect();
        let candidates = Candidates::new(values, values.len());
        let groups = [Group { problem, candidates, reference: Some(&reference) }];
        let mut cost = [0.0];
        match self.evaluator.evaluate(&Batch { groups: &groups }, &mut cost) {
            Ok(()) => Some(cost[0] - Scalar::cost(problem, values)),
            Err(error) => {
                let message = format!("{error}; the result itself is the oracle's");
                self.warnings.push(Warning { code: "gpu_failed", message });
                None
            }
        }
    }
}

fn taken_over(error: &crate::Error) -> Warning {
    Warning { code: "gpu_failed", message: format!("{error}; the CPU evaluates instead") }
}

/// Whether a search is large enough for a GPU to win.
#[cfg(feature = "gpu")]
fn is_large(spec: &IdentifySpec, problem: &Problem) -> bool {
    let generation = (spec.population as u64).saturating_mul(problem.active() as u64);
    generation >= GPU_GENERATION_STEPS && generation.saturating_mul(spec.generations as u64) >= GPU_SEARCH_STEPS
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::criterion::Criterion;
    use crate::evaluate::Model;
    use crate::motor::Space;
    use crate::record::{Record, Samples};

    /// A device that is lost.
    struct Broken;

    impl Evaluator for Broken {
        fn evaluate(&mut self, _: &Batch<'_>, _: &mut [f64]) -> Result<()> {
            Err(crate::Error::new(crate::ErrorKind::Device, "lost", "Run again."))
        }
    }

    #[test]
    fn auto_carries_on_with_the_cpu_and_a_device_asked_for_does_not() {
        let ramp: Vec<f64> = (0..50).map(f64::from).collect();
        let samples = Samples {
            time_s: ramp.iter().map(|n| 0.001 * n).collect(),
            voltage: ramp.clone(),
            torque: None,
            current: Some(ramp.clone()),
            speed: Some(ramp),
        };
        let record = Record::new(samples).unwrap();
        let problem = Problem::new(&[record], Model::default(), Space::table2(), Criterion::default()).unwrap();
        let problem = Arc::new(problem);
        let values = [0.5, 0.01, 0.05, 1e-4, 1e-4];
        let mut costs = [0.0];
        for auto in [true, false] {
            let evaluator = Box::new(Broken);
            let mut evaluation = Evaluation {
                evaluator,
                kind: "gpu",
                precision: "f32",
                reference: None,
                auto,
                slice_steps: 1,
                warnings: Vec::new(),
            };
            let done = evaluation.evaluate(&problem, &[Candidates::new(&values, 5)], &mut costs);
            assert_eq!(done.is_ok(), auto);
            if auto {
                assert_eq!((evaluation.kind(), evaluation.precision()), ("cpu", "f64"));
                assert_eq!(evaluation.warnings[0].code, "gpu_failed");
                assert!((costs[0] / Scalar::cost(&problem, &values) - 1.0).abs() < 1e-12);
                assert_eq!(evaluation.cost_difference(&problem, &values), None);
            }
        }
    }
}
