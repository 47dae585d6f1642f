//! The JSON document of a comparison.

use super::cells::setting_name;
use super::paper::paper_tables;
use super::tables::tables;
use crate::document::{joined, warnings};
use crate::spelling::command_line;
use motorfit_identify::model::integration;
use motorfit_record::Severity;
use motorfit_study::compare::{
    Block, ComparedModel, Comparison, InvarianceTest, MethodResult, Outcome, PairwiseTest, Reached, reached,
};
use serde_json::{Map, Value, json as value};

/// Returns values of the parameters by their names.
fn named<T: Into<Value>>(comparison: &Comparison, values: impl IntoIterator<Item = T>) -> Value {
    let names = comparison.parameters.iter().map(|parameter| parameter.name.clone());
    names.zip(values.into_iter().map(Into::into)).collect::<Map<String, Value>>().into()
}

/// Returns the entries that the document of a model has beside those of a DC motor: the model, the units of its parameters and the
/// integration.
fn of_model(comparison: &Comparison, of: &ComparedModel) -> Value {
    let problem = comparison.blocks.first().and_then(|block| of.problem(block.setting.criterion).ok());
    value!({
        "model": {"name": of.model.name(), "sha256": of.model.digest()},
        "units": named(comparison, comparison.parameters.iter().map(|parameter| parameter.unit.clone())),
        "integration": problem.map(|problem| integration(problem.method())),
    })
}

/// Returns the JSON document of a comparison; with `paper` it includes the paper's tables.
#[must_use]
pub fn compare_document(comparison: &Comparison, paper: bool) -> Value {
    let Comparison { subject, spec, device, .. } = comparison;
    let fixed = comparison.parameters.iter().filter_map(|p| Some((p.name.clone(), Value::from(p.fixed()?))));
    let bounds = comparison.parameters.iter().filter_map(|p| Some((p.name.clone(), value!(p.bounds()?))));
    let is_of_motor = subject.model().is_none();
    let discretization = match subject.model() {
        None => spec.model.discretization.name(),
        Some(of) => {
            if of.spec.is_first_order_hold {
                "foh"
            } else {
                "zoh"
            }
        }
    };
    let expected = comparison.expected();
    let document = value!({
        "motorfit": env!("CARGO_PKG_VERSION"),
        "records": subject.records,
        "truth": subject.truth(),
        "paper": paper.then(|| paper_tables(comparison)),
        "discretization": discretization,
        "fixed": fixed.collect::<Map<String, Value>>(),
        "target": spec.target,
        "noise_db": is_of_motor.then_some(spec.noise_db),
        "runs": spec.runs,
        "seed": spec.seed,
        "bounds": bounds.collect::<Map<String, Value>>(),
        "device": device,
        "blocks": comparison.blocks.iter().map(|block| self::block(comparison, block)).collect::<Value>(),
        "invariance": comparison.invariance.iter().filter_map(|test| invariance(comparison, test)).collect::<Value>(),
        "steiglitz_mcbride": comparison.steiglitz.as_ref().map(|sm| value!({
            "parameters": sm.estimate.as_ref().ok(),
            "failure": sm.estimate.as_ref().err(),
            "noise_records": sm.records,
            "noise_sigma": {"current": sm.sigma[0], "speed": sm.sigma[1]},
            "served": sm.spread.len(),
            "standard_deviations": named(comparison, sm.estimates().deviations(&comparison.parameters)),
            "mean_relative_errors_percent": expected.as_ref()
                .map(|values| named(comparison, sm.estimates().errors(values).iter().map(|e| e[1]))),
            "seconds": sm.seconds,
        })),
        "refined": comparison.reference.as_ref().ok().map(|found| named(comparison, found.values(&comparison.parameters))),
        "refined_trust": comparison.reference.as_ref().ok().map(|found| value!({
            "level": found.trust().level.name(),
            "reasons": found.trust().reasons.iter().map(|reason| reason.code).collect::<Vec<_>>(),
        })),
        "refined_failure": comparison.reference.as_ref().err().map(|e| e.spelled(command_line)),
        "warnings": warnings(&comparison.warnings, Severity::Report),
        "remarks": warnings(&comparison.warnings, Severity::Mention),
        "stop": if comparison.interrupted { "interrupted" } else { "budget_spent" },
        "evaluations": comparison.evaluations,
        "seconds": comparison.batch_seconds,
    });
    match subject.model() {
        None => document,
        Some(of) => joined(document, of_model(comparison, of)),
    }
}

fn invariance(comparison: &Comparison, test: &InvarianceTest) -> Option<Value> {
    let (result, [base, other]) = test.of(comparison)?;
    Some(value!({
        "setting": setting_name(&base.setting),
        "blocks": test.blocks,
        "method": result.method.name(),
        "transform": other.setting.coordinates.to_string(),
        "median_excess": test.excess,
        "ratio": test.ratio,
        "ratio_ci95": test.ratio_interval,
        "higher": test.higher,
        "higher_ci95": test.higher_interval,
        "p": test.p_value,
        "p_holm": test.p_holm,
        "verdict": test.verdict.name(),
    }))
}

fn block(comparison: &Comparison, block: &Block) -> Value {
    let ranking = block.ranking();
    let name = |n: usize| block.results[n].method.name();
    let pair = |p: &PairwiseTest| {
        value!({
            "first": name(p.methods[0]), "second": name(p.methods[1]), "superiority": p.superiority,
            "p": p.p_value, "p_holm": p.p_holm,
        })
    };
    let (targets, reached) = reached(block, comparison.spec.target);
    let curve = |(result, reached): (&MethodResult, Reached)| (result.method.name().to_owned(), value!(reached));
    let reached = block.results.iter().zip(reached).map(curve);
    value!({
        "setting": setting_name(&block.setting),
        "criterion": block.setting.criterion.norm.name(),
        "scale": block.setting.criterion.scale.name(),
        "population": block.setting.population,
        "generations": block.setting.generations,
        "transform": block.setting.coordinates.to_string(),
        "methods": block.results.iter().map(|c| result(comparison, c)).collect::<Value>(),
        "ranking": ranking.order.iter().map(|n| name(*n)).collect::<Value>(),
        "pairs": ranking.pairs.iter().map(pair).collect::<Value>(),
        "tables": tables(comparison, block),
        "targets": targets,
        "reached": reached.collect::<Map<String, Value>>(),
        "steiglitz_mcbride_cost": block.steiglitz_cost,
        "refined_cost": block.reference_cost,
    })
}

fn result(comparison: &Comparison, result: &MethodResult) -> Value {
    let found = result.estimates();
    let errors = comparison.expected().map(|expected| found.errors(&expected));
    let error = |which: usize| errors.as_ref().map(|all| named(comparison, all.iter().map(|pair| pair[which])));
    let run = |(n, run): (usize, &Outcome)| {
        value!({
            "run": n, "cost": run.cost,
            "parameters": run.parameters.as_ref().map(|values| named(comparison, values.iter().copied())),
            "evaluations": run.evaluations, "history": run.history,
        })
    };
    value!({
        "method": result.method.name(),
        "settings": format!("{:?}", result.method),
        "cost": result.summary(comparison.spec.seed),
        "best_relative_errors_percent": error(0),
        "mean_relative_errors_percent": error(1),
        "standard_deviations": named(comparison, found.deviations(&comparison.parameters)),
        "seconds_one_run": result.seconds,
        "runs": result.runs.iter().enumerate().map(run).collect::<Value>(),
    })
}
