//! The JSON document of a comparison.

use super::paper::paper_tables;
use super::tables::{setting_name, tables};
use crate::motor::Parameter;
use crate::record::Severity;
use crate::report::Table;
use crate::report::document::warnings;
use crate::report::spelling::command_line;
use crate::study::compare::{Block, Comparison, MethodResult, Outcome, reached};
use serde_json::{Map, Value, json as value};

/// The JSON document of a comparison.
pub struct CompareDocument;

impl CompareDocument {
    /// Everything that was found; with `paper` its tables beside ours.
    #[must_use]
    pub fn of(comparison: &Comparison, paper: bool) -> Value {
        let Comparison { subject, spec, device, .. } = comparison;
        let bounds = spec.space.free().iter().map(|a| (a.parameter.symbol().to_owned(), value!([a.min, a.max])));
        value!({
            "motorfit": env!("CARGO_PKG_VERSION"),
            "records": subject.records,
            "truth": subject.truth,
            "paper": paper.then(|| paper_tables(comparison).iter().map(shown).collect::<Value>()),
            "discretization": spec.model.discretization.name(),
            "fixed": fixed(comparison),
            "target": spec.target,
            "noise_db": spec.noise_db,
            "runs": spec.runs,
            "seed": spec.seed,
            "bounds": bounds.collect::<Map<String, Value>>(),
            "device": {"kind": device.0, "name": device.1, "precision": device.2},
            "blocks": comparison.blocks.iter().map(|block| self::block(comparison, block)).collect::<Value>(),
            "steiglitz_mcbride": comparison.steiglitz.as_ref().map(|sm| value!({
                "parameters": sm.estimate.as_ref().ok(),
                "failure": sm.estimate.as_ref().err(),
                "noise_records": sm.records,
                "noise_sigma": {"current": sm.sigma[0], "speed": sm.sigma[1]},
                "served": sm.spread.len(),
                "standard_deviations": by_symbol(sm.deviations()),
                "mean_relative_errors_percent": comparison.expected().map(|p| by_symbol(sm.errors(&p))),
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
}

/// A table as it is shown.
fn shown(table: &Table) -> Value {
    value!({"id": table.id, "title": table.title, "heads": table.heads, "rows": table.rows, "notes": table.notes})
}

/// Values that are held.
fn fixed(comparison: &Comparison) -> Value {
    let held = comparison.spec.space.fixed().iter().map(|(p, _, value)| (p.symbol().to_owned(), Value::from(*value)));
    Value::Object(held.collect())
}

fn by_symbol(values: [f64; 5]) -> Value {
    let pairs = Parameter::ALL.iter().zip(values);
    Value::Object(pairs.map(|(p, v)| (p.symbol().to_owned(), Value::from(v))).collect())
}

fn block(comparison: &Comparison, block: &Block) -> Value {
    let ranking = block.ranking();
    let name = |n: usize| block.results[n].method.name();
    let pair = |p: &crate::study::compare::PairwiseTest| {
        value!({
            "first": name(p.methods[0]), "second": name(p.methods[1]), "superiority": p.superiority,
            "p": p.p_value, "p_holm": p.p_holm,
        })
    };
    let (targets, reached) = reached(block, comparison.spec.target);
    let reached = block.results.iter().zip(reached).map(|(result, r)| {
        let curve = value!({"evaluations": r.evaluations, "seconds": r.seconds, "share": r.share});
        (result.method.name().to_owned(), curve)
    });
    value!({
        "setting": setting_name(&block.setting),
        "criterion": block.setting.criterion.norm.name(),
        "scale": block.setting.criterion.scale.name(),
        "population": block.setting.population,
        "generations": block.setting.generations,
        "methods": block.results.iter().map(|c| result(comparison, c)).collect::<Value>(),
        "ranking": ranking.order.iter().map(|n| name(*n)).collect::<Value>(),
        "pairs": ranking.pairs.iter().map(pair).collect::<Value>(),
        "tables": tables(comparison, block).iter().map(shown).collect::<Value>(),
        "targets": targets,
        "reached": reached.collect::<Map<String, Value>>(),
        "steiglitz_mcbride_cost": block.steiglitz_cost,
        "refined_cost": block.reference_cost,
    })
}

fn result(comparison: &Comparison, result: &MethodResult) -> Value {
    let s = result.summary(comparison.spec.seed);
    let errors = comparison.expected().map(|expected| result.errors(&expected));
    let run = |(n, run): (usize, &Outcome)| {
        value!({
            "run": n, "cost": run.cost, "parameters": run.parameters,
            "evaluations": run.evaluations, "history": run.history,
        })
    };
    value!({
        "method": result.method.name(),
        "settings": format!("{:?}", result.method),
        "cost": {
            "best": s.best, "median": s.median, "median_ci95": s.interval, "worst": s.worst, "average": s.average,
            "failed": s.failed,
        },
        "best_relative_errors_percent": errors.map(|e| by_symbol(e.map(|pair| pair[0]))),
        "mean_relative_errors_percent": errors.map(|e| by_symbol(e.map(|pair| pair[1]))),
        "standard_deviations": by_symbol(result.deviations()),
        "seconds_one_run": result.seconds,
        "runs": result.runs.iter().enumerate().map(run).collect::<Value>(),
    })
}
