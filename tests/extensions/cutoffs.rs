//! Proves: with cutoffs an evaluator returns the same cost to the last bit where it is not above its cutoff, and otherwise one above
//! it, at every SIMD level, for all criteria, joint fits and extensions; searches find the same as without, to the last bit.

use super::contract::{candidates, sets, space};
use super::support::suite::mixed_records;
use super::support::{NORMS, batch, costs, criterion, m2_record, near, uniform};
use motorfit::candidates::Candidates;
use motorfit::criterion::{Norm, Scale};
use motorfit::device::BatchSearchEvaluator;
use motorfit::evaluate::{Batch, Evaluator, Group, Level, Model, Problem, Simd};
use motorfit::motor::{Parameter, Space};
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

/// Checks costs with cutoffs against those without and returns how many were not computed to the end.
fn check(problem: &Arc<Problem>, values: &[f64], level: Level) -> usize {
    let mut simd = Simd::at(level);
    let whole = costs(&mut simd, problem, values);
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
        let ours = batch(&mut simd, &[Group { problem, candidates, reference: None }]).unwrap();
        for (n, ((ours, whole), cutoff)) in ours.iter().zip(&whole).zip(&cutoffs).enumerate() {
            let same = ours.to_bits() == whole.to_bits();
            let is_fine = same || whole > cutoff && ours > cutoff && ours <= whole;
            assert!(is_fine, "{}, candidate {n}: {ours:e} in place of {whole:e}, cutoff {cutoff:e}", level.name());
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
struct Whole(Simd);

impl Evaluator for Whole {
    fn evaluate(&mut self, batch: &Batch<'_>, costs: &mut [f64]) -> motorfit::Result<()> {
        let mut groups = batch.groups.to_vec();
        for group in &mut groups {
            group.candidates = Candidates::new(group.candidates.values(), group.candidates.width());
        }
        self.0.evaluate(&Batch { groups: &groups }, costs)
    }
}

/// Returns the history and the best candidate of each run.
fn searched(search: ConfiguredSearch, problem: &Arc<Problem>, on: Box<dyn Evaluator>) -> Vec<(Vec<f64>, Vec<f64>)> {
    let setup =
        |run: u64| SearchSettings { bounds: problem.space().bounds(), population: 37, generations: 40, seed: 3, run };
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
    for search in SEARCHES {
        for (norm, records, space) in NORMS.into_iter().flat_map(|norm| {
            [(norm, &even, Space::table2()), (norm, &all, Space::table2()), (norm, &all, friction.clone())]
        }) {
            let problem = problem(records, norm, space);
            let [cut, whole]: [Box<dyn Evaluator>; 2] = [Box::new(Simd::default()), Box::new(Whole(Simd::default()))];
            let [cut, whole] = [cut, whole].map(|on| searched(search.into(), &problem, on));
            assert_eq!(cut, whole, "{} with {norm:?}", search.name);
        }
    }
}
