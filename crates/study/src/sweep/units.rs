//! Units: runs on one dataset, in the order in which they are executed.

use super::dataset::Dataset;
use super::run::Running;
use super::runs::{Job, Levels, NOISE};
use motorfit_core::numeric::index;

/// Runs on one dataset.
pub(super) struct Unit {
    pub dataset: Dataset,
    pub ids: Vec<u64>,
}

/// Largest number of runs of a piece, which bounds the memory of its results and recordings.
pub(super) const RUNS: usize = 4096;

/// Iterator over the unfinished units of a sweep for some of its methods.
pub(super) struct Units {
    /// Level indices of all factors except the seed, for the selected methods.
    combinations: Vec<Levels>,
    /// Indices of the motor, the noise level and the seed of the next unit.
    next: [u64; 3],
    /// Largest number of runs of a unit whose seeds share the same recordings.
    most: usize,
}

impl Units {
    /// Creates an iterator over the combinations of levels that `takes` accepts.
    pub(super) fn new(running: &Running<'_>, most: usize, takes: impl Fn(&Job) -> bool) -> Self {
        let runs = &running.sweep.runs;
        let of = |places: &Levels| takes(&runs.job(runs.id(0, places, 0)));
        Self { combinations: runs.combinations().into_iter().filter(of).collect(), next: [0; 3], most }
    }

    /// Returns the next unit with unfinished runs.
    pub(super) fn next(&mut self, running: &Running<'_>) -> Option<Unit> {
        if self.combinations.is_empty() {
            return None;
        }
        let (runs, study) = (&running.sweep.runs, running.sweep.study());
        loop {
            let [number, noise, seed] = self.next;
            let motor = usize::try_from(number).ok().filter(|motor| *motor < running.sweep.manifest.motors.len())?;
            if noise == 0 && seed == 0 && !running.may_be_due(motor) {
                self.next[0] += 1;
                continue;
            }
            let place = index(noise);
            // Without added noise all seeds share the same recordings.
            let is_noisy = study.noise[place].noise.is_some();
            let slice = if is_noisy { 1 } else { (self.most / self.combinations.len()).max(1) as u64 };
            let end = (seed + slice).min(study.seeds.count());
            self.next = match (end == study.seeds.count(), place + 1 == study.noise.len()) {
                (false, _) => [number, noise, end],
                (true, false) => [number, noise + 1, 0],
                (true, true) => [number + 1, 0, 0],
            };
            let own = self.combinations.iter().filter(|places| places[NOISE] == noise);
            let ids = own.flat_map(|places| (seed..end).map(move |seed| runs.id(motor, places, seed)));
            let ids: Vec<u64> = ids.filter(|id| running.is_due(*id)).collect();
            if !ids.is_empty() {
                return Some(Unit { dataset: Dataset { motor, noise: place, seed: study.seeds.at(seed) }, ids });
            }
        }
    }
}
