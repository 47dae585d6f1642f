//! The GPU evaluator: WGSL integrates the motor for the whole batch in parallel.
//!
//! Step maps are made in f64 on the CPU and uploaded; shaders do indexing, recurrence and accumulation alone; weighted
//! sums per channel come back and the CPU forms the criterion. In f64 the states are computed as they are; in f32 as
//! deviations from a reference, so that rounding is relative to the deviation.

mod device;
mod layout;
mod maps;
mod reference;
mod run;
mod shader;

pub use device::{AdapterFacts, Selector, list};
pub use shader::{LANES, Precision, UNIFORM_BYTES, Variant, assemble};

use super::{Batch, Evaluator, Group, Model, Problem, Scalar};
use crate::candidates::Candidates;
use crate::criterion::Criterion;
use crate::motor::{Discretization, Drive, Parameters, Space, Trajectory, simulate};
use crate::record::{Record, Samples};
use crate::{Error, ErrorKind, Result};
use device::Device;
use layout::Unit;
use run::{Pipelines, Set, Ticket};
use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

/// Bytes of step maps in one submission; larger batches are split and overlap.
const MAPS_BYTES_MAX: u64 = 64 << 20;

/// Evaluates on one adapter.
pub struct Gpu {
    device: Device,
    precision: Precision,
    pipelines: Pipelines,
    sets: [Set; 2],
}

/// Candidates `first..first + count` of a group.
#[derive(Clone, Copy)]
struct Part {
    group: usize,
    first: usize,
    count: usize,
}

/// A part of the batch in flight.
struct Flight {
    parts: Vec<Part>,
    ticket: Ticket,
    set: usize,
}

impl Gpu {
    /// Opens an adapter and checks that it computes rightly. `precision`: `None` takes f64 where the device has it.
    ///
    /// # Errors
    /// `Device` when there is no such adapter, it lacks f64, cannot be opened or computes wrongly.
    pub fn open(selector: &Selector, precision: Option<Precision>) -> Result<Self> {
        let device = Device::open(selector, precision == Some(Precision::F64))?;
        let has_f64 = device.facts.f64;
        if precision == Some(Precision::F64) && !has_f64 {
            return Err(Error::new(
                ErrorKind::Device,
                format!("{} does not compute in f64", device.facts.name),
                "Use --precision f32, or --device cpu.",
            ));
        }
        let precision = precision.unwrap_or(if has_f64 { Precision::F64 } else { Precision::F32 });
        let mut gpu = Self { device, precision, pipelines: Pipelines::default(), sets: Default::default() };
        gpu.check_itself()?;
        Ok(gpu)
    }

    /// What is known of the adapter.
    #[must_use]
    pub fn facts(&self) -> &AdapterFacts {
        &self.device.facts
    }

    /// The numbers that it computes with.
    #[must_use]
    pub fn precision(&self) -> Precision {
        self.precision
    }

    /// Some candidates against the oracle: the compiler of some driver versions is known to be wrong.
    fn check_itself(&mut self) -> Result<()> {
        let (problem, values) = specimen()?;
        let groups = [Group { problem: &problem, candidates: Candidates::new(&values, 5), reference: None }];
        let mut costs = vec![0.0; values.len() / 5];
        self.evaluate(&Batch { groups: &groups }, &mut costs)?;
        self.compare(&problem, &values, &costs)
    }

    /// Costs that this device gave against the oracle's.
    fn compare(&self, problem: &Problem, values: &[f64], costs: &[f64]) -> Result<()> {
        // Ten times what the suite of tests allows.
        let allowed = if self.precision == Precision::F64 { 1e-11 } else { 2e-4 };
        for (row, cost) in values.chunks(5).zip(costs) {
            let oracle = Scalar::cost(problem, row);
            let error = (cost - oracle).abs() / oracle;
            if error.is_nan() || error > allowed {
                let AdapterFacts { name, driver, .. } = &self.device.facts;
                let precision = self.precision.name();
                return Err(Error::new(
                    ErrorKind::Device,
                    format!(
                        "{name} ({driver}) computes wrongly in {precision}: {cost:e} where {oracle:e} is right, off by \
                         {error:.1e}"
                    ),
                    "Update its driver, choose another adapter, or use --device cpu.",
                ));
            }
        }
        Ok(())
    }

    /// The shader that a group needs, but for where its samples lie.
    fn variant(&self, group: &Group<'_>) -> Variant {
        Variant {
            precision: self.precision,
            absolute: group.problem.criterion().is_absolute(),
            weighted: group.problem.signals().iter().any(|s| !s.weight.is_empty()),
            uniform: self.device.has_uniform(UNIFORM_BYTES),
        }
    }

    /// Parts of one shader each and of bounded size: maps within the budget, samples within another of the same size
    /// (a recording that alone is larger still goes in one part).
    fn split(&self, batch: &Batch<'_>) -> Vec<Vec<Part>> {
        let budget = usize::try_from(MAPS_BYTES_MAX.min(self.device.facts.binding_bytes_max)).unwrap_or(usize::MAX);
        let entry = self.precision.fields() * self.precision.bytes();
        let mut pieces: Vec<Vec<Part>> = Vec::new();
        let (mut maps_room, mut samples_room, mut shader) = (0, 0, None);
        for (group, of) in batch.groups.iter().enumerate() {
            let variant = self.variant(of);
            let signals = of.problem.signals();
            let each = entry * signals.iter().map(|s| s.step_s.len()).sum::<usize>();
            let samples: usize =
                signals.iter().map(|s| s.active() * self.precision.sample() * self.precision.bytes()).sum();
            let (mut first, count) = (0, of.candidates.count());
            while first < count {
                if shader != Some(variant) || maps_room < each * shader::LANES || samples_room < samples {
                    pieces.push(Vec::new());
                    (maps_room, samples_room, shader) = (budget, budget.max(samples), Some(variant));
                }
                let fits = (maps_room / each).max(shader::LANES).min(count - first);
                // Blocks are whole.
                maps_room = maps_room.saturating_sub(fits.next_multiple_of(shader::LANES) * each);
                samples_room -= samples;
                if let Some(piece) = pieces.last_mut() {
                    piece.push(Part { group, first, count: fits });
                }
                first += fits;
            }
        }
        pieces
    }

    fn launch(&mut self, batch: &Batch<'_>, parts: Vec<Part>, set: usize) -> Result<Flight> {
        let groups: Vec<Group<'_>> = parts.iter().map(|part| part.of(batch)).collect();
        let variant = self.variant(&groups[0]);
        let ticket = self.sets[set].submit(&self.device, &mut self.pipelines, &groups, variant)?;
        Ok(Flight { parts, ticket, set })
    }

    /// Waits for a part and adds its sums to the totals of its candidates.
    fn land(&self, batch: &Batch<'_>, flight: Flight, offsets: &[usize], totals: &mut [f64]) -> Result<()> {
        let Flight { parts, ticket, set } = flight;
        let units = self.sets[set].scene.as_ref().map_or(&[][..], |scene| &scene.units);
        self.sets[set].collect(&self.device, ticket, &mut |sums| {
            for Unit { place, first, .. } in units {
                let part = parts[place.group];
                let signals = &batch.groups[part.group].problem.signals()[place.recording];
                let from = offsets[part.group] + part.first;
                for (n, total) in totals[from..from + part.count].iter_mut().enumerate() {
                    let at = 2 * shader::LANES * (first + n / shader::LANES) + n % shader::LANES;
                    *total += Problem::scaled(signals, [sums[at], sums[at + shader::LANES]]);
                }
            }
        })
    }
}

/// A short experiment with a motor like the paper's, and candidates around it.
fn specimen() -> Result<(Arc<Problem>, Vec<f64>)> {
    let voltage: Vec<f64> = (0..400_u32).map(|n| if n < 20 { 0.0 } else { 10.0 - f64::from(n / 100) }).collect();
    let drive = Drive { step_s: &[0.001], step_index: &[], voltage: &voltage, torque: &[] };
    let truth = Parameters::M2.to_array();
    let Trajectory { current, speed } = simulate(&Parameters::M2, &drive, [0.0; 2], Discretization::Zoh);
    let time_s = (0..400_u32).map(|n| f64::from(n) * 0.001).collect();
    let record = Record::new(Samples { time_s, voltage, torque: None, current: Some(current), speed: Some(speed) })?;
    let problem = Problem::new(&[record], Model::default(), Space::table2(), Criterion::default())?;
    let factor = |n: u32, axis: u32| 1.0 + 0.3 * f64::from(n * 7 + axis * 5 + 1).sin();
    let candidates = (0..37).flat_map(|n| (0..5).map(move |axis| (n, axis)));
    Ok((Arc::new(problem), candidates.map(|(n, axis)| truth[axis as usize] * factor(n, axis)).collect()))
}

impl Part {
    fn of<'a>(&self, batch: &Batch<'a>) -> Group<'a> {
        let group = batch.groups[self.group];
        let width = group.candidates.width();
        let values = &group.candidates.values()[self.first * width..(self.first + self.count) * width];
        Group { candidates: Candidates::new(values, width), ..group }
    }
}

impl Gpu {
    /// Costs before the criterion's last step, part after part.
    fn totals(&mut self, batch: &Batch<'_>, offsets: &[usize], totals: &mut [f64]) -> Result<()> {
        // While one part is computed, the next is packed.
        let mut flights: VecDeque<Flight> = VecDeque::new();
        for (n, parts) in self.split(batch).into_iter().enumerate() {
            if flights.len() == self.sets.len()
                && let Some(flight) = flights.pop_front()
            {
                self.land(batch, flight, offsets, totals)?;
            }
            flights.push_back(self.launch(batch, parts, n % 2)?);
        }
        flights.into_iter().try_for_each(|flight| self.land(batch, flight, offsets, totals))
    }
}

impl Evaluator for Gpu {
    fn evaluate(&mut self, batch: &Batch<'_>, costs: &mut [f64]) -> Result<()> {
        batch.check(costs)?;
        costs.fill(0.0);
        let offsets: Vec<usize> = (batch.groups.iter())
            .scan(0, |at, group| {
                let from = *at;
                *at += group.candidates.count();
                Some(from)
            })
            .collect();
        // wgpu panics where a driver reports a loss while it is waited for.
        let done = catch_unwind(AssertUnwindSafe(|| self.totals(batch, &offsets, costs))).unwrap_or_else(|_| {
            let message = format!("{} was lost while it computed", self.device.facts.name);
            Err(Error::new(
                ErrorKind::Device,
                message,
                "Run again; if it stays, update the driver or use --device cpu.",
            ))
        });
        if done.is_err() {
            // What was in flight is not to be trusted again.
            self.sets = Default::default();
        }
        done?;
        for (group, from) in batch.groups.iter().zip(offsets) {
            for (row, cost) in costs[from..from + group.candidates.count()].iter_mut().enumerate() {
                let is_nan = group.candidates.row(row).iter().any(|v| v.is_nan());
                *cost = if is_nan { f64::INFINITY } else { group.problem.cost(*cost) };
            }
        }
        Ok(())
    }

    fn name(&self) -> String {
        format!("{} ({})", self.device.facts.name, self.device.facts.backend)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lost_device_and_a_wrong_one_are_errors() {
        let Ok(mut gpu) = Gpu::open(&Selector::Best, None) else {
            assert!(std::env::var_os("MOTORFIT_NO_SKIP").is_none(), "no adapter");
            return;
        };
        let (problem, values) = specimen().unwrap();
        let groups = [Group { problem: &problem, candidates: Candidates::new(&values, 5), reference: None }];
        let mut costs = vec![0.0; 37];
        gpu.evaluate(&Batch { groups: &groups }, &mut costs).unwrap();
        // A device that computes wrongly: here one whose results are compared with another motor's.
        let wrong = gpu.compare(&problem, &values, &costs.iter().map(|c| c * 1.001).collect::<Vec<_>>()).unwrap_err();
        assert_eq!(wrong.kind(), ErrorKind::Device);
        assert!(wrong.to_string().contains("computes wrongly"), "{wrong}");
        gpu.device.device.destroy();
        let lost = gpu.evaluate(&Batch { groups: &groups }, &mut costs).unwrap_err();
        assert_eq!(lost.kind(), ErrorKind::Device);
        assert!(!lost.remedy().is_empty(), "{lost}");
        let again = gpu.evaluate(&Batch { groups: &groups }, &mut costs).unwrap_err();
        assert_eq!(again.kind(), ErrorKind::Device, "and stays one");
    }
}
