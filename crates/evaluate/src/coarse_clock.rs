//! Rounding of irregular sample times, for evaluations that only compare starts of refinements. On an irregular clock nearly
//! every step has a different length, and computing the step maps for each length takes longer than the simulation itself.

use super::problem::Problem;
use super::signals::Signals;
use motorfit_core::numeric::{count, whole};
use motorfit_motor::Discretization;
use std::sync::{Arc, OnceLock};

/// Number of grid intervals per period to which times are rounded. A sample moves by at most 1/16 of a period, unless steps are
/// shorter than an interval; this moves a basin of the cost by far less than its width.
const PARTS: f64 = 8.0;
/// Smallest number of distinct steps at which times are rounded.
const STEPS_MIN: usize = 32;

impl Problem {
    /// Returns the problem with the sample times of irregular recordings rounded to a grid, so that few distinct steps remain.
    /// Recordings with few steps are shared unchanged.
    #[must_use]
    #[doc(hidden)]
    pub fn at_coarse_steps(&self) -> Self {
        let method = self.model().discretization;
        self.with_signals(|signals| signals.at_coarse_steps(method).map_or_else(|| signals.clone(), Arc::new))
    }
}

impl Signals {
    /// Returns the index of the step that follows a sample.
    #[doc(hidden)]
    pub fn step_of(&self, n: usize) -> u16 {
        self.step_index.get(n).copied().unwrap_or(0)
    }

    /// Returns true if there are enough distinct steps for rounding.
    #[doc(hidden)]
    pub fn has_many_steps(&self) -> bool {
        self.step_s.len() >= STEPS_MIN
    }

    /// Returns a copy with rounded times, or `None` if there are few distinct steps.
    fn at_coarse_steps(&self, method: Discretization) -> Option<Self> {
        if !self.has_many_steps() {
            return None;
        }
        let unit_s = self.period_s / PARTS;
        // Rounding times instead of steps keeps errors from accumulating. Every step keeps at least one grid interval.
        let (mut time, mut rounded) = (0.0, 0);
        let steps: Vec<usize> = (0..self.len())
            .map(|n| {
                time += self.step_s[usize::from(self.step_of(n))];
                let before = rounded;
                rounded = whole((time / unit_s).round()).max(before + 1);
                rounded - before
            })
            .collect();
        let mut distinct = steps.clone();
        distinct.sort_unstable();
        distinct.dedup();
        let place = |step: &usize| u16::try_from(distinct.partition_point(|known| known < step));
        let step_index = steps.iter().map(place).collect::<Result<Vec<u16>, _>>().ok()?;
        let step_s = distinct.iter().map(|n| count(*n) * unit_s).collect();
        let mut copy = self.clone();
        (copy.step_s, copy.step_index, copy.split) = (step_s, step_index, None);
        copy.times = OnceLock::new();
        copy.set_runs(method);
        Some(copy)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Model;
    use crate::criterion::Criterion;
    use motorfit_motor::Space;
    use motorfit_record::{Record, Samples};

    fn problem(off: impl Fn(u32) -> f64) -> Problem {
        let time_s: Vec<f64> = (0..400).map(|n| 0.01 * (f64::from(n) + off(n))).collect();
        let voltage = time_s.iter().map(|t| t.sin()).collect();
        let speed = Some(time_s.iter().map(|t| t.cos()).collect());
        let record = Record::new(Samples { time_s, voltage, speed, ..Samples::default() }).unwrap();
        Problem::new(&[record], Model::default(), Space::table2(), Criterion::default()).unwrap()
    }

    #[test]
    fn rounded_times_stay_near_and_have_few_steps() {
        let jittered = problem(|n| 0.3 * (1.7 * f64::from(n)).sin());
        let coarse = jittered.at_coarse_steps();
        let [fine, coarse] = [&jittered, &coarse].map(|problem| &problem.signals()[0]);
        assert!(fine.step_s.len() > 200 && coarse.step_s.len() < 16, "{}", coarse.step_s.len());
        let mut apart = 0.0;
        for n in 0..399 {
            let step = |signals: &Signals| signals.step_s[usize::from(signals.step_of(n))];
            apart += step(coarse) - step(fine);
            assert!(apart.abs() <= 0.5 / PARTS * fine.period_s * (1.0 + 1e-9), "{n}: {apart}");
        }
        let covered: usize = coarse.runs.iter().map(|run| run.end - run.start).sum();
        assert!(covered == 400 && coarse.segments.iter().all(|s| s.run.step == coarse.step_of(s.run.start)));
    }

    #[test]
    fn clocks_with_few_steps_are_shared_as_they_are() {
        for problem in [problem(|_| 0.0), problem(|n| 0.1 * f64::from(n % 3))] {
            assert!(Arc::ptr_eq(&problem.at_coarse_steps().signals()[0], &problem.signals()[0]));
        }
    }
}
