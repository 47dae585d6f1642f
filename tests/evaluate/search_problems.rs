//! Proves: a problem of either machine, the DC motor or a user's model, gives searches as many names, axes and bounds as a candidate has
//! values; evaluators compute the costs of the problem itself, alone, in groups beside another problem, and for candidates that are
//! no numbers; the motor as a model has the names and, within rounding, the costs of the built-in motor; an evaluator that mixes up
//! groups or candidates fails.
//! Does not prove: that costs are right (contract.rs, models.rs).
#![allow(clippy::unwrap_used, reason = "a test may stop")]

use crate::support::{m2_record, problem};
use motorfit::Result;
use motorfit::candidates::Candidates;
use motorfit::criterion::{Criterion, Norm};
use motorfit::evaluate::model::{ModelProblem, ModelRecording, ModelSettings, ModelSpace};
use motorfit::evaluate::{Batch, CandidateValue, Evaluator, Group, Model, PoleTables, Problem, SearchProblem, Simd};
use motorfit::model::BuiltIn;
use std::sync::Arc;

/// Returns candidates spread over the axes of a problem, one of which is no number.
fn candidates(problem: &dyn SearchProblem, number: u32) -> Vec<f64> {
    let one = |n: u32| {
        let fraction =
            move |axis: u32| if n == 3 { f64::NAN } else { f64::from((n * 7919 + axis * 131) % 997) / 997.0 };
        problem.axes().into_iter().zip(0..).map(move |(axis, place)| match fraction(place) {
            fraction if fraction.is_nan() => fraction,
            fraction => axis.at(fraction),
        })
    };
    (0..number).flat_map(one).collect()
}

/// Compares an evaluator with the costs of the problems themselves; `others` is another problem of the same machine.
fn check<P: SearchProblem>(
    evaluator: &mut dyn Evaluator<P>,
    problem: &Arc<P>,
    others: &Arc<P>,
    tolerance: f64,
) -> std::result::Result<(), String> {
    let width = problem.width();
    let counts = [problem.names().len(), problem.axes().len(), problem.bounds().len()];
    if counts != [width; 3] {
        return Err(format!("{counts:?} for {width} values"));
    }
    // More than two blocks of a model's 64 candidates, in groups of unequal size.
    let values = candidates(problem.as_ref(), 150);
    let all = Candidates::new(&values, width);
    let group = |problem, from, to| Group { problem, candidates: all.rows(from, to), reference: None };
    let groups = [group(problem, 0, 47), group(others, 0, 5), group(problem, 47, 47), group(problem, 47, 150)];
    let mut together = vec![0.0; 155];
    evaluator.evaluate(&Batch { groups: &groups }, &mut together).map_err(|error| error.to_string())?;
    let expected = |n: usize| match n {
        0..47 => problem.cost_of(all.row(n)),
        47..52 => others.cost_of(all.row(n - 47)),
        _ => problem.cost_of(all.row(n - 5)),
    };
    for (n, cost) in together.iter().enumerate() {
        let expected = expected(n);
        let is_same = cost.to_bits() == expected.to_bits() || (cost / expected - 1.0).abs() <= tolerance;
        if !is_same {
            return Err(format!("candidate {n}: {cost}, expected {expected}"));
        }
    }
    Ok(())
}

/// Returns the problems of the built-in motor in two criteria.
fn motors() -> [Arc<Problem>; 2] {
    [Norm::Nrmse, Norm::Iae]
        .map(|norm| problem(&[m2_record()], Model::default(), Criterion { norm, ..Criterion::default() }))
}

/// Returns the same problems of the motor as a model.
fn models() -> [Arc<ModelProblem>; 2] {
    let (record, model) = (m2_record(), BuiltIn::DcMotor.model().unwrap());
    let samples = record.samples().clone();
    let inputs = vec![samples.voltage, vec![0.0; samples.time_s.len()]];
    let recording = ModelRecording {
        step_s: vec![1e-3],
        inputs,
        measured: vec![samples.current, samples.speed],
        counting: Vec::new(),
        effective_sample_ratio: 1.0,
        name: None,
        assumed: None,
        time_s: samples.time_s,
    };
    [Norm::Nrmse, Norm::Iae].map(|norm| {
        let settings =
            ModelSettings { criterion: Criterion { norm, ..Criterion::default() }, ..ModelSettings::default() };
        let space = ModelSpace::new(&model, 1);
        Arc::new(ModelProblem::new(&model, space, vec![recording.clone()], settings).unwrap())
    })
}

#[test]
fn evaluators_compute_the_costs_of_the_problem() {
    let ([motor, other], [model, other_model]) = (motors(), models());
    // The tolerances are those of the contracts; blocks of a model do not depend on their candidates, to the last bit.
    check(&mut Simd::default(), &motor, &other, 1e-12).unwrap();
    check(&mut Simd::alone(), &other, &motor, 1e-12).unwrap();
    check(&mut PoleTables::default(), &motor, &other, 1e-8).unwrap();
    check(&mut Simd::default(), &model, &other_model, 0.0).unwrap();
    check(&mut Simd::alone(), &other_model, &model, 0.0).unwrap();
}

#[test]
fn the_motor_as_a_model_is_the_same_problem() {
    for (motor, model) in motors().into_iter().zip(models()) {
        assert_eq!((motor.names(), motor.width()), (model.names(), model.width()));
        assert_eq!(SearchProblem::criterion(motor.as_ref()), SearchProblem::criterion(model.as_ref()));
        assert!(motor.user_model().is_none() && model.user_model().is_some());
        for row in candidates(model.as_ref(), 40).chunks(5) {
            let [own, other] = [motor.cost_of(row), model.cost_of(row)];
            // Exponentials and step maps round differently, by 1e-13 of a trajectory of 3001 steps each.
            assert!(own.to_bits() == other.to_bits() || (own / other - 1.0).abs() < 1e-9, "{row:?}: {own} and {other}");
        }
        let values: Vec<f64> = motor.axes().iter().map(|axis| axis.at(0.5)).collect();
        let named = values.iter().copied().map(CandidateValue::Shared);
        let named: Vec<_> = motor.names().into_iter().zip(named).collect();
        assert!(motor.values_of(&values) == named && model.values_of(&values) == named);
    }
}

/// An evaluator whose costs are changed by a function.
struct Corrupted(fn(&mut [f64]));

impl Evaluator<ModelProblem> for Corrupted {
    fn evaluate(&mut self, batch: &Batch<'_, ModelProblem>, costs: &mut [f64]) -> Result<()> {
        Simd::default().evaluate(batch, costs)?;
        (self.0)(costs);
        Ok(())
    }
}

#[test]
fn a_corrupted_evaluator_fails() {
    let [model, other] = models();
    check(&mut Corrupted(|_| ()), &model, &other, 0.0).unwrap();
    let wrong: [fn(&mut [f64]); 4] = [
        |costs| costs.swap(46, 52),
        |costs| costs.rotate_left(1),
        |costs| costs[154] *= 1.0 + 1e-15,
        |costs| costs[3] = f64::NAN,
    ];
    for (n, corruption) in wrong.into_iter().enumerate() {
        assert!(check(&mut Corrupted(corruption), &model, &other, 0.0).is_err(), "corruption {n} went unnoticed");
    }
}
