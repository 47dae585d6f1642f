//! The JSON document of a comparison.

use super::paper::paper_tables;
use super::tables::{setting_name, tables};
use crate::identify::bounds;
use crate::record::Severity;
use crate::report::document::{by_symbol, warnings};
use crate::report::spelling::command_line;
use crate::study::compare::{Block, Comparison, InvarianceTest, MethodResult, Outcome, PairwiseTest, Reached, reached};
use serde_json::{Map, Value, json as value};

/// Returns the JSON document of a comparison; with `paper` it includes the paper's tables.
#[must_use]
pub fn compare_document(comparison: &Comparison, paper: bool) -> Value {
    let Comparison { subject, spec, device, .. } = comparison;
    let fixed = spec.space.fixed().iter().map(|(p, _, value)| (p.symbol().to_owned(), Value::from(*value)));
    value!({
        "motorfit": env!("CARGO_PKG_VERSION"),
        "records": subject.records,
        "truth": subject.truth,
        "paper": paper.then(|| paper_tables(comparison)),
        "discretization": spec.model.discretization.name(),
        "fixed": fixed.collect::<Map<String, Value>>(),
        "target": spec.target,
        "noise_db": spec.noise_db,
        "runs": spec.runs,
        "seed": spec.seed,
        "bounds": bounds(&spec.space),
        "device": {"kind": device.0, "name": device.1, "precision": device.2},
        "blocks": comparison.blocks.iter().map(|block| self::block(comparison, block)).collect::<Value>(),
        "invariance": comparison.invariance.iter().filter_map(|test| invariance(comparison, test)).collect::<Value>(),
        "steiglitz_mcbride": comparison.steiglitz.as_ref().map(|sm| value!({
            "parameters": sm.estimate.as_ref().ok(),
            "failure": sm.estimate.as_ref().err(),
            "noise_records": sm.records,
            "noise_sigma": {"current": sm.sigma[0], "speed": sm.sigma[1]},
            "served": sm.spread.len(),
            "standard_deviations": by_symbol(sm.estimates().deviations()),
            "mean_relative_errors_percent": comparison.expected().map(|p| by_symbol(sm.estimates().errors(&p).map(|e| e[1]))),
            "seconds": sm.seconds,
        })),
        "refined": comparison.reference.as_ref().ok().map(|found| found.parameters),
        "refined_failure": comparison.reference.as_ref().err().map(|e| e.spelled(command_line)),
        "warnings": warnings(&comparison.warnings, Severity::Report),
        "remarks": warnings(&comparison.warnings, Severity::Mention),
        "stop": if comparison.interrupted { "interrupted" } else { "budget_spent" },
        "evaluations": comparison.evaluations,
        "seconds": comparison.batch_seconds,
    })
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
    let run = |(n, run): (usize, &Outcome)| {
        value!({
            "run": n, "cost": run.cost, "parameters": run.parameters,
            "evaluations": run.evaluations, "history": run.history,
        })
    };
    value!({
        "method": result.method.name(),
        "settings": format!("{:?}", result.method),
        "cost": result.summary(comparison.spec.seed),
        "best_relative_errors_percent": errors.map(|e| by_symbol(e.map(|pair| pair[0]))),
        "mean_relative_errors_percent": errors.map(|e| by_symbol(e.map(|pair| pair[1]))),
        "standard_deviations": by_symbol(found.deviations()),
        "seconds_one_run": result.seconds,
        "runs": result.runs.iter().enumerate().map(run).collect::<Value>(),
    })
}
