//! Proves: with cutoffs an evaluator returns the same cost to the last bit where it is not above its cutoff, and otherwise one above
//! it, at every SIMD level and on the best adapter, for all criteria, joint fits and extensions; searches find the same as without, to
//! the last bit.

use super::contract::{candidates, sets, space};
use crate::support::rates::cases;
use crate::support::suite::mixed_records;
use crate::support::{NORMS, batch, costs, criterion, m2_record, near, uniform};
use motorfit::Result;
use motorfit::candidates::Candidates;
use motorfit::criterion::{Norm, Scale};
use motorfit::device::BatchSearchEvaluator;
use motorfit::evaluate::{Batch, Evaluator, Group, Level, Model, Pending, Problem, Simd};
use motorfit::experiment::{Excitation, simulated};
use motorfit::motor::{Discretization, Parameter, Parameters, Space};
use motorfit::optimize::{Budget, ConfiguredSearch, Run, SEARCHES, SearchSettings, minimize};
use motorfit::record::Record;
use std::ops::ControlFlow;
use std::sync::Arc;

fn problem(records: &[Record], norm: Norm, space: Space) -> Arc<Problem> {
    Arc::new(Problem::new(records, Model::default(), space, criterion(norm, Scale::Std)).unwrap())
}

/// Returns recordings on even clocks only, which have a kernel of their own: a step, a binary voltage with torque, a ramp.
fn even_records() -> Vec<Record> {
    let records = [vec![m2_record()], mixed_records()].concat();
    records.into_iter().filter(|record| record.steps().step_index.is_empty()).collect()
}

/// Checks costs with cutoffs against those without at a SIMD level.
fn check(problem: &Arc<Problem>, values: &[f64], level: Level) -> usize {
    check_on(&mut Simd::at(level), problem, values)
}

/// Checks costs with cutoffs against those without and returns how many were not computed to the end.
fn check_on(evaluator: &mut dyn Evaluator, problem: &Arc<Problem>, values: &[f64]) -> usize {
    let whole = costs(evaluator, problem, values);
    let mut sorted = whole.clone();
    sorted.sort_by(f64::total_cmp);
    let mut abandoned = 0;
    let all = |cutoff: f64| vec![cutoff; whole.len()];
    for cutoffs in [
        all(f64::INFINITY),
        all(0.0),
        all(0.5 * sorted[0]),
        all(sorted[2]),
        all(sorted[whole.len() / 2]),
        whole.clone(),
        whole.iter().map(|cost| cost.next_down()).collect(),
        whole.iter().rev().copied().collect(),
    ] {
        let candidates = Candidates::new(values, problem.space().free().len()).with_cutoffs(&cutoffs);
        let ours = batch(evaluator, &[Group { problem, candidates, reference: None }]).unwrap();
        for (n, ((ours, whole), cutoff)) in ours.iter().zip(&whole).zip(&cutoffs).enumerate() {
            let same = ours.to_bits() == whole.to_bits();
            let is_fine = same || whole > cutoff && ours > cutoff && ours <= whole;
            assert!(is_fine, "{}, candidate {n}: {ours:e} in place of {whole:e}, cutoff {cutoff:e}", evaluator.name());
            abandoned += usize::from(!same);
        }
    }
    abandoned
}

#[test]
fn a_cost_is_exact_unless_it_is_above_its_cutoff() {
    for level in Level::available() {
        for norm in NORMS {
            let far = check(&problem(&[m2_record()], norm, Space::table2()), &uniform(61, 5), level);
            // Of three of the eight sets of cutoffs every candidate is above its own.
            assert!(far > 61, "{}, {norm:?}: only {far} were abandoned", level.name());
            check(&problem(&[m2_record()], norm, Space::table2()), &near(29, 1e-3, 2), level);
            let joint = check(&problem(&mixed_records(), norm, Space::table2()), &near(29, 0.3, 5), level);
            assert!(joint > 29, "{}, {norm:?}, joint: only {joint} were abandoned", level.name());
            // Enough blocks for candidates to move, over several recordings, with one that has no cost.
            let mut many = [near(150, 0.3, 5), uniform(100, 6)].concat();
            many[5 * 70] = f64::NAN;
            let even = check(&problem(&even_records(), norm, Space::table2()), &many, level);
            assert!(even > 250, "{}, {norm:?}, even clocks: only {even} were abandoned", level.name());
        }
    }
}

#[test]
fn so_is_a_cost_with_extensions() {
    let records = [vec![m2_record()], mixed_records()].concat();
    for (n, extensions) in sets().into_iter().enumerate() {
        let space = space(&extensions, records.len());
        let values = candidates(&space, 29, n);
        let problem = problem(&records, NORMS[n % NORMS.len()], space);
        for level in Level::available() {
            let abandoned = check(&problem, &values, level);
            assert!(abandoned > 29, "{}, {extensions:?}: only {abandoned} were abandoned", level.name());
        }
    }
}

/// An evaluator that does not see cutoffs.
struct Whole<E>(E);

/// Returns the groups of a batch without their cutoffs.
fn whole<'a>(batch: &Batch<'a>) -> Vec<Group<'a>> {
    let whole = |candidates: Candidates<'a>| Candidates::new(candidates.values(), candidates.width());
    batch.groups.iter().map(|group| Group { candidates: whole(group.candidates), ..*group }).collect()
}

impl<E: Evaluator> Evaluator for Whole<E> {
    fn evaluate(&mut self, batch: &Batch<'_>, costs: &mut [f64]) -> Result<()> {
        self.0.evaluate(&Batch { groups: &whole(batch) }, costs)
    }

    fn begin(&mut self, batch: &Batch<'_>) -> Result<Pending> {
        self.0.begin(&Batch { groups: &whole(batch) })
    }

    fn finish(&mut self, batch: &Batch<'_>, pending: Pending, costs: &mut [f64]) -> Result<()> {
        self.0.finish(&Batch { groups: &whole(batch) }, pending, costs)
    }

    fn overlaps(&self) -> bool {
        self.0.overlaps()
    }

    fn is_exact(&self) -> bool {
        self.0.is_exact()
    }
}

/// Returns the history and the best candidate of each run.
fn searched(search: ConfiguredSearch, problem: &Arc<Problem>, on: Box<dyn Evaluator>) -> Vec<(Vec<f64>, Vec<f64>)> {
    let setup = |run: u64| SearchSettings {
        bounds: problem.space().bounds(),
        population: 37,
        generations: 40,
        seed: 3,
        run,
        ..SearchSettings::default()
    };
    let mut runs: Vec<Run> = (0..3).map(|run| Run::new(search.begin(setup(run)).unwrap())).collect();
    let mut evaluate = BatchSearchEvaluator::new(on, vec![problem.clone()]);
    // Slices cut a population in two, with its cutoffs.
    let budget = Budget { generations: 40, slice: 23 };
    minimize(&mut runs, budget, &mut evaluate, &mut |_| ControlFlow::Continue(())).unwrap();
    runs.into_iter().map(|run| (run.history, run.optimizer.best().unwrap().values.to_vec())).collect()
}

#[test]
fn searches_find_the_same_with_and_without_cutoffs() {
    let (even, all) = (even_records(), [vec![m2_record()], mixed_records()].concat());
    assert_eq!((even.len(), all.len()), (3, 4));
    let friction = space(&[Parameter::Coulomb, Parameter::DeadTime], all.len());
    let of = [(&even, Space::table2()), (&all, Space::table2()), (&all, friction)];
    for (n, search) in SEARCHES.into_iter().enumerate() {
        for (m, norm) in NORMS.into_iter().enumerate() {
            for (records, space) in of.iter().skip(cases((n + m) % of.len(), 0)).take(cases(1, of.len())) {
                let problem = problem(records, norm, space.clone());
                let [cut, whole]: [Box<dyn Evaluator>; 2] =
                    [Box::new(Simd::default()), Box::new(Whole(Simd::default()))];
                let [cut, whole] = [cut, whole].map(|on| searched(search.into(), &problem, on));
                assert_eq!(cut, whole, "{} with {norm:?}", search.name);
            }
        }
    }
}

#[cfg(feature = "gpu")]
mod adapter {
    use super::*;
    use crate::support::adapter::open;
    use motorfit::evaluate::gpu::{Gpu, Precision};

    /// Calls `test` with the best adapter in each precision.
    fn each(test: impl Fn(&dyn Fn() -> Option<Gpu>)) {
        for precision in [Precision::F64, Precision::F32] {
            test(&|| open(precision));
        }
    }

    #[test]
    fn a_cost_is_exact_unless_it_is_above_its_cutoff() {
        each(|open| {
            let Some(mut gpu) = open() else { return };
            for norm in NORMS {
                let far = check_on(&mut gpu, &problem(&[m2_record()], norm, Space::table2()), &uniform(61, 5));
                // Of three of the eight sets of cutoffs every candidate is above its own. An adapter compares one recording at a
                // time, so that of a joint fit only cutoffs of 0 are certain to be passed.
                assert!(far > 61, "{norm:?}: only {far} were abandoned");
                let joint = check_on(&mut gpu, &problem(&mixed_records(), norm, Space::table2()), &near(29, 0.3, 5));
                assert!(joint >= 29, "{norm:?}, joint: only {joint} were abandoned");
            }
            // More samples than an invocation may loop over in one round.
            let long = Excitation::step(10.5, 0.0, 130.0, 0.001).unwrap();
            let long = simulated(&Parameters::M2, &long, Discretization::Zoh).unwrap();
            let long = check_on(&mut gpu, &problem(&[long], Norm::Nrmse, Space::table2()), &uniform(61, 5));
            assert!(long > 61, "only {long} were abandoned");
        });
    }

    #[test]
    fn so_is_a_cost_with_extensions() {
        each(|open| {
            let Some(mut gpu) = open() else { return };
            let records = even_records();
            for (n, extensions) in sets().into_iter().enumerate() {
                let space = space(&extensions, records.len());
                let values = candidates(&space, 29, n);
                let abandoned = check_on(&mut gpu, &problem(&records, NORMS[n % NORMS.len()], space), &values);
                assert!(abandoned >= 29, "{extensions:?}: only {abandoned} were abandoned");
            }
        });
    }

    #[test]
    fn searches_find_the_same_with_and_without_cutoffs() {
        each(|open| {
            for (search, norm) in SEARCHES.into_iter().zip(NORMS) {
                let problem = problem(&even_records(), norm, Space::table2());
                let (Some(cut), Some(all)) = (open(), open()) else { return };
                let [cut, all]: [Box<dyn Evaluator>; 2] = [Box::new(cut), Box::new(Whole(all))];
                let [cut, all] = [cut, all].map(|on| searched(search.into(), &problem, on));
                assert_eq!(cut, all, "{} with {norm:?}", search.name);
            }
        });
    }
}
