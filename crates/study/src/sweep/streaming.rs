//! Runs without a population search: recordings stream through all cores, each read, estimated and dropped.

use super::dataset::Kept;
use super::fits::Fits;
use super::planned::Sweep;
use super::run::{Finished, Running, Step};
use super::runs::Job;
use super::search::is_lockstep;
use super::units::{RUNS, Unit, Units};
use motorfit_core::clock::Instant;
use motorfit_identify::Method;
use rayon::prelude::*;

/// Units of a piece per thread, enough that threads are seldom idle at its end.
const MOTORS: usize = 64;
/// Bytes of the recordings of a piece.
const BYTES: u64 = 64 << 20;

/// Candidate-steps of a piece of `auto` if all of its runs had to search: some tenths of a second.
const STEPS: u64 = 1_000_000_000;
/// Work of a step of a model, relative to one of the linear motor.
const MODEL: u64 = 20;

impl Running<'_> {
    /// Runs the methods without a population: Steiglitz–McBride on linear motors, or with `may_search` the others, each
    /// of which may have to search.
    pub(super) fn stream(&mut self, may_search: bool) -> Step {
        let sweep = self.sweep;
        let is_model = |job: &Job| sweep.study().machine(&job.factors).model.is_some();
        let is_extended = |job: &Job| sweep.study().spec(&job.factors).is_extended();
        let searches = |job: &Job| job.factors.method == Method::Auto || is_model(job) || is_extended(job);
        let takes = |job: &Job| !is_lockstep(sweep.study(), job) && searches(job) == may_search;
        let mut units = Units::new(self, if may_search { 1 } else { RUNS }, takes);
        let mut next = units.next(self);
        // The recordings of a motor with many noise realizations are read once.
        let mut kept: Kept = None;
        while next.is_some() {
            let items = self.items(&mut units, &mut next, may_search);
            let (finished, last) = sweep.side_by_side(items, kept.take());
            kept = last;
            self.keep(finished)?;
        }
        Ok(())
    }

    /// Returns the units of the next piece, grouped by motor.
    fn items(&self, units: &mut Units, next: &mut Option<Unit>, may_search: bool) -> Vec<(usize, Vec<Unit>)> {
        let mut items: Vec<(usize, Vec<Unit>)> = Vec::new();
        let threads = rayon::current_num_threads();
        let (mut runs, mut count, mut bytes, mut steps) = (0, 0, 0, 0);
        while let Some(unit) = next.take_if(|unit| {
            let is_same = items.last().is_some_and(|(motor, _)| *motor == unit.dataset.motor);
            let full = runs + unit.ids.len() > RUNS || count >= MOTORS * threads || (bytes > BYTES && !is_same);
            items.is_empty() || (!full && (steps <= STEPS || count < threads))
        }) {
            (runs, count) = (runs + unit.ids.len(), count + 1);
            if may_search {
                let samples = self.samples(unit.dataset.motor);
                let work = |id: &u64| {
                    let f = self.sweep.runs.job(*id).factors;
                    let agents = (f.population as u64).saturating_mul(f.generations as u64);
                    let factor = if self.sweep.study().machine(&f).model.is_some() { MODEL } else { 1 };
                    agents.saturating_mul(samples).saturating_mul(factor)
                };
                steps = unit.ids.iter().map(work).fold(steps, u64::saturating_add);
            }
            match items.last_mut().filter(|(motor, _)| *motor == unit.dataset.motor) {
                Some((_, units)) => units.push(unit),
                None => {
                    let motor = &self.sweep.manifest.motors[unit.dataset.motor];
                    bytes += motor.all_files().map(|file| file.bytes).sum::<u64>();
                    items.push((unit.dataset.motor, vec![unit]));
                }
            }
            *next = units.next(self);
        }
        items
    }
}

impl Sweep {
    /// Runs motors in parallel and returns the finished runs with the recordings of the last motor.
    fn side_by_side(&self, items: Vec<(usize, Vec<Unit>)>, kept: Kept) -> (Vec<Finished>, Kept) {
        let last = items.len() - 1;
        let motor = |(n, (motor, units)): (usize, (usize, Vec<Unit>))| {
            let machine = |id: &u64| self.study().machine(&self.runs.job(*id).factors).number();
            let numbers = units.iter().flat_map(|unit| &unit.ids).map(machine);
            let recordings = self.read_or_kept(motor, numbers, kept.as_ref());
            let unit = |unit: &Unit| {
                let begun = Instant::now();
                let mut fits = Fits::new(self, &recordings, unit.dataset);
                let mut before = 0.0;
                let one = |id: &u64| {
                    let job = self.runs.job(*id);
                    let outcome = fits.outcome(&job);
                    let now = begun.elapsed().as_secs_f64();
                    let seconds = now - std::mem::replace(&mut before, now);
                    (job, outcome, seconds)
                };
                let found: Vec<_> = unit.ids.iter().map(one).collect();
                found.into_iter().map(|(job, outcome, s)| Finished::new(self, &job, &outcome, s)).collect::<Vec<_>>()
            };
            let finished: Vec<Finished> = match &units[..] {
                [one] => unit(one),
                many => many.par_iter().flat_map_iter(unit).collect(),
            };
            (finished, (n == last).then_some((motor, recordings)))
        };
        let done: Vec<_> = items.into_par_iter().enumerate().map(motor).collect();
        let (finished, mut kept): (Vec<Vec<Finished>>, Vec<_>) = done.into_iter().unzip();
        (finished.into_iter().flatten().collect(), kept.pop().flatten())
    }
}
