//! JSON document of a suite.

use crate::document::warnings;
use motorfit_record::Severity;
use motorfit_study::suite::{Entrant, GAP, SuiteBlock, SuiteProblem, SuiteResult, SuiteRun};
use serde_json::{Value, json as value};

/// Returns the JSON document of a suite.
#[must_use]
pub fn suite_document(result: &SuiteResult) -> Value {
    let budgets = result.spec.budgets.iter().enumerate().map(|(n, evaluations)| budget(result, n, *evaluations));
    value!({
        "motorfit": env!("CARGO_PKG_VERSION"),
        "suite": result.spec.suite.name(),
        "version": result.version,
        "runs": result.spec.runs,
        "seed": result.spec.seed,
        "gap": GAP,
        "device": result.device,
        "methods": (0..result.spec.entrants.len()).map(|n| entrant(result, n)).collect::<Value>(),
        "problems": result.problems.iter().map(problem).collect::<Value>(),
        "budgets": budgets.collect::<Value>(),
        "warnings": warnings(&result.warnings, Severity::Report),
        "stop": if result.interrupted { "interrupted" } else { "budget_spent" },
        "evaluations": result.evaluations,
        "seconds": result.seconds,
    })
}

fn entrant(result: &SuiteResult, n: usize) -> Value {
    let Entrant { method, coordinates, population } = &result.spec.entrants[n];
    value!({
        "name": result.name(n), "method": method.name(), "settings": format!("{method:?}"),
        "transform": coordinates.to_string(), "population": population,
    })
}

fn problem(problem: &SuiteProblem) -> Value {
    let axes = problem.problem.space().free().iter().zip(problem.truth.iter().zip(&problem.optimum));
    let axis = |(axis, (truth, optimum)): (&motorfit_motor::Axis, (&f64, &f64))| {
        let values = value!({"true": truth, "optimum": optimum, "min": axis.min, "max": axis.max});
        (axis.parameter.symbol().to_owned(), values)
    };
    value!({
        "name": problem.name,
        "optimum_cost": problem.optimum_cost,
        "random_cost": problem.random_cost,
        "parameters": axes.map(axis).collect::<serde_json::Map<String, Value>>(),
    })
}

fn budget(result: &SuiteResult, n: usize, evaluations: u64) -> Value {
    let of = |entrant: usize| {
        let by_problem =
            result.measures(n, entrant, GAP).into_iter().map(|(name, measure)| (name.to_owned(), value!(measure)));
        value!({
            "method": result.name(entrant),
            "population_generations": result.spec.entrants[entrant].shape(evaluations),
            "all": result.measure(n, entrant, GAP),
            "problems": by_problem.collect::<serde_json::Map<String, Value>>(),
        })
    };
    let gaps = |block: &SuiteBlock| {
        let problem = result.problems.get(block.problem)?;
        let gap = |run: &SuiteRun| problem.gap(run.cost());
        let runs = block.runs.iter().map(|runs| runs.iter().map(gap).collect::<Value>());
        Some((problem.name.clone(), runs.collect::<Value>()))
    };
    let blocks = result.blocks.iter().filter(|block| block.budget == n);
    value!({
        "evaluations": evaluations,
        "methods": (0..result.spec.entrants.len()).map(of).collect::<Value>(),
        "ranks": result.ranks(n),
        "gaps": blocks.filter_map(gaps).collect::<serde_json::Map<String, Value>>(),
    })
}
