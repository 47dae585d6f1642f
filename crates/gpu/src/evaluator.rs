//! The GPU evaluator: divides batches into submissions, keeps several in flight, and computes costs from their sums.

use super::check::Specimen;
use super::clock::Kernel;
use super::constants::is_served;
use super::device::{AdapterFacts, Device, Selector, caught, error};
use super::features::ShaderFeatures;
use super::layout::BUDGET;
use super::model::ModelsOnDevice;
use super::parts::{Part, split};
use super::pipelines::Pipelines;
use super::set::Set;
use super::sums::{add, finish_costs};
use super::variant::{Precision, Variant};
use motorfit_core::{Error, ErrorKind, Result};
use motorfit_evaluate::{Batch, Evaluator, Group, Pending, Simd};
use std::collections::{HashSet, VecDeque};

/// Number of submissions of one batch in flight.
const FLIGHTS: usize = 2;
/// Number of sets of buffers.
const SETS: usize = 4;

/// The GPU evaluator on one adapter, for problems of the DC motor and of users' models.
pub struct Gpu {
    pub(crate) device: Device,
    pub(crate) precision: Precision,
    budget: usize,
    pipelines: Pipelines,
    /// Shaders that passed the comparison with the scalar evaluator.
    checked: HashSet<Variant>,
    sets: Vec<Set>,
    /// Index of the set that was reused last.
    next: usize,
    /// Number of device failures, after each of which all sets were dropped.
    losses: usize,
    /// Computing time of the device in a timed evaluation.
    kernel: Kernel,
    /// Problems of users' models that are on the device.
    pub(crate) models: ModelsOnDevice,
}

/// A submission in flight, with its parts of the batch.
struct Flight {
    parts: Vec<Part>,
    set: usize,
}

/// A batch that has begun.
struct Begun {
    flights: VecDeque<Flight>,
    waiting: VecDeque<Vec<Part>>,
    /// Number of device failures before it. After another failure its sets are gone.
    losses: usize,
}

impl Gpu {
    /// Opens an adapter and compares it with the scalar evaluator. A `precision` of `None` uses f64 if the device has it.
    ///
    /// # Errors
    /// Returns a device error if there is no matching adapter, or it lacks the requested f64, cannot be opened or computes
    /// wrong costs.
    pub fn open(selector: &Selector, precision: Option<Precision>) -> Result<Self> {
        let mut gpu = Self::unchecked(selector, precision)?;
        let (precision, uniform, fetch) = (gpu.precision, gpu.device.uniform, gpu.device.fetch);
        let usual = Variant { precision, absolute: false, weighted: false, uniform, fetch, features: None };
        gpu.guard(|gpu| gpu.check_shader(usual))?;
        Ok(gpu)
    }

    /// Opens an adapter without the check of the motor's shader, for models, whose shaders are compared with their graph.
    #[doc(hidden)]
    pub fn unchecked(selector: &Selector, precision: Option<Precision>) -> Result<Self> {
        let device = Device::open(selector, precision == Some(Precision::F64))?;
        let precision = precision.unwrap_or(if device.facts.f64 { Precision::F64 } else { Precision::F32 });
        let budget = usize::try_from(device.facts.binding_bytes_max).unwrap_or(usize::MAX).min(BUDGET);
        Ok(Self {
            device,
            precision,
            budget,
            pipelines: Pipelines::default(),
            checked: HashSet::new(),
            sets: Vec::new(),
            next: 0,
            losses: 0,
            kernel: Kernel::default(),
            models: ModelsOnDevice::default(),
        })
    }

    /// Returns the properties of the adapter.
    #[must_use]
    pub fn facts(&self) -> &AdapterFacts {
        &self.device.facts
    }

    /// Returns the precision of the evaluation.
    #[must_use]
    pub fn precision(&self) -> Precision {
        self.precision
    }

    /// Returns the name of the adapter and its graphics interface.
    #[must_use]
    pub fn name(&self) -> String {
        format!("{} ({})", self.device.facts.name, self.device.facts.backend)
    }

    /// Compares a shader with the scalar evaluator before its first use.
    fn check_shader(&mut self, variant: Variant) -> Result<()> {
        if self.checked.contains(&variant) {
            return Ok(());
        }
        let specimen = Specimen::new(variant)?;
        let problem = &specimen.problem;
        let groups = [Group { problem, candidates: specimen.candidates(), reference: None }];
        let mut set = Set::default();
        set.submit(&self.device, &mut self.pipelines, &groups, variant)?;
        let mut costs = vec![0.0; groups[0].candidates.count()];
        set.collect(&self.device, &mut |unit, sums| add(unit, problem, sums, &mut costs))?;
        costs.iter_mut().for_each(|cost| *cost = problem.cost(*cost));
        specimen.compare(&self.device.facts, variant.precision, &costs)?;
        self.checked.insert(variant);
        Ok(())
    }

    /// Runs `work`, also if it panics. After a device error everything in flight is dropped.
    pub(crate) fn guard<T>(&mut self, work: impl FnOnce(&mut Self) -> Result<T>) -> Result<T> {
        let facts = self.device.facts.clone();
        let done = caught(&facts, || work(self));
        if done.as_ref().is_err_and(|e| e.kind() == ErrorKind::Device) {
            self.sets.clear();
            self.models.clear();
            self.losses += 1;
        }
        done
    }

    /// Returns the shader variant for a group. Its samples are in a uniform buffer if they fit.
    fn variant(&self, group: &Group<'_>) -> Variant {
        let features = ShaderFeatures::of(group.problem.features());
        Variant {
            precision: if features.is_some() { self.precision.plain() } else { self.precision },
            absolute: group.problem.criterion().is_absolute(),
            weighted: group.problem.signals().iter().any(|s| !s.weight.is_empty()),
            uniform: self.device.uniform,
            fetch: self.device.fetch,
            features,
        }
    }

    /// Returns true if the device can evaluate a group. The CPU evaluates the others.
    fn serves(&self, group: &Group<'_>) -> bool {
        is_served(group.problem, self.precision.bytes(), self.budget)
    }

    /// Returns an idle set: preferably one with the data of these groups, else a new one, else the next in turn.
    fn idle_set(&mut self, groups: &[Group<'_>], variant: Variant) -> Result<usize> {
        let serves = |set: &Set| set.batch.as_ref().is_some_and(|batch| batch.serves(groups, variant));
        if let Some(found) = self.sets.iter().position(|set| set.flight.is_none() && serves(set)) {
            return Ok(found);
        }
        if self.sets.len() < SETS {
            self.sets.push(Set::default());
            return Ok(self.sets.len() - 1);
        }
        for _ in 0..SETS {
            self.next = (self.next + 1) % SETS;
            if self.sets[self.next].flight.is_none() {
                return Ok(self.next);
            }
        }
        Err(Error::usage("too many batches are pending", "Finish one before beginning the next."))
    }

    /// Submits waiting parts until [`FLIGHTS`] are in flight.
    fn launch(&mut self, batch: &Batch<'_>, pending: &mut Begun) -> Result<()> {
        while pending.flights.len() < FLIGHTS
            && let Some(parts) = pending.waiting.front()
        {
            let groups: Vec<Group<'_>> = parts.iter().map(|part| part.of(batch)).collect();
            let variant = self.variant(&groups[0]);
            let set = match self.idle_set(&groups, variant) {
                // A submission in flight will release a set.
                Err(_) if !pending.flights.is_empty() => return Ok(()),
                found => found?,
            };
            self.sets[set].submit(&self.device, &mut self.pipelines, &groups, variant)?;
            let used = self.sets[set].batch.as_ref().map_or(variant, |batch| batch.variant);
            if let Some(parts) = pending.waiting.pop_front() {
                pending.flights.push_back(Flight { parts, set });
            }
            self.check_shader(used)?;
        }
        Ok(())
    }

    /// Waits for all submissions of a batch and adds their sums to the totals of the candidates.
    fn collect_all(&mut self, batch: &Batch<'_>, mut pending: Begun, totals: &mut [f64]) -> Result<()> {
        loop {
            self.launch(batch, &mut pending)?;
            let Some(Flight { parts, set }) = pending.flights.pop_front() else { return Ok(()) };
            let Some(set) = self.sets.get_mut(set).filter(|_| pending.losses == self.losses) else {
                return Err(error("the device failed while this batch was pending", "Run again."));
            };
            let stamps = set.collect(&self.device, &mut |unit, sums| {
                let Part { group, count, at, .. } = parts[unit.group];
                add(unit, batch.groups[group].problem, sums, &mut totals[at..at + count]);
            })?;
            if let Some(stamps) = stamps {
                self.kernel.add(stamps);
            }
        }
    }
}

impl Evaluator for Gpu {
    fn evaluate(&mut self, batch: &Batch<'_>, costs: &mut [f64]) -> Result<()> {
        batch.check(costs)?;
        let pending = self.begin(batch)?;
        self.finish(batch, pending, costs)
    }

    fn begin(&mut self, batch: &Batch<'_>) -> Result<Pending> {
        batch.check_candidates()?;
        self.guard(|gpu| {
            let shader = |group: &Group<'_>| gpu.serves(group).then(|| gpu.variant(group));
            let waiting = split(batch, gpu.budget, shader).into();
            let mut begun = Begun { flights: VecDeque::new(), waiting, losses: gpu.losses };
            gpu.launch(batch, &mut begun)?;
            Ok(Pending::of(begun))
        })
    }

    fn finish(&mut self, batch: &Batch<'_>, pending: Pending, costs: &mut [f64]) -> Result<()> {
        batch.check(costs)?;
        let Some(begun) = pending.take::<Begun>() else {
            return Err(Error::usage(
                "this batch was begun by another evaluator",
                "Finish it on the evaluator that began it.",
            ));
        };
        costs.fill(0.0);
        self.guard(|gpu| gpu.collect_all(batch, begun, costs))?;
        let mut rest = costs;
        for group in batch.groups {
            let (own, others) = rest.split_at_mut(group.candidates.count());
            if self.serves(group) {
                finish_costs(group, own)?;
            } else {
                Simd::default().evaluate(&Batch { groups: &[*group] }, own)?;
            }
            rest = others;
        }
        Ok(())
    }

    fn overlaps(&self) -> bool {
        true
    }

    fn is_exact(&self) -> bool {
        self.precision == Precision::F64
    }

    fn evaluate_timed(&mut self, batch: &Batch<'_>, costs: &mut [f64]) -> Result<Option<f64>> {
        (self.device.timed, self.kernel) = (true, Kernel::default());
        let done = self.evaluate(batch, costs);
        self.device.timed = false;
        done?;
        Ok(self.kernel.seconds(self.device.queue.get_timestamp_period()))
    }

    fn name(&self) -> String {
        Self::name(self)
    }
}

#[cfg(test)]
mod tests;
