//! Runs in the form of IOHprofiler (C. Doerr, H. Wang, F. Ye, S. van Rijn, T. Bäck, arXiv:1810.05281, 2018), which IOHanalyzer and
//! iohinspector read: for each method and problem a JSON file with the runs, and a table of evaluations and lowest values.

use motorfit_core::text::Shortest;
use motorfit_study::suite::{SuiteBlock, SuiteProblem, SuiteResult, SuiteRun};
use serde_json::{Value, json as value};
use std::fmt::Write as _;

/// Returns the files of the runs at the largest budget, as (name, text) pairs. The value of a candidate is its relative gap to the known
/// optimum. The form begins each run with its first evaluation, which generations do not record: it has the gap of a random candidate
/// here, or that of the first generation if it is larger.
#[must_use]
pub fn ioh_files(result: &SuiteResult) -> Vec<(String, String)> {
    let Some(last) = result.last_budget() else {
        return Vec::new();
    };
    let blocks: Vec<&SuiteBlock> = result.blocks.iter().filter(|block| block.budget == last).collect();
    let names = (0..result.spec.entrants.len()).map(|entrant| (entrant, result.name(entrant)));
    let mut files = Vec::new();
    for (entrant, method) in names {
        let stem = |number: usize| format!("f{:02}-{}", number + 1, method.replace([' ', ':', '/'], "_"));
        for block in &blocks {
            let (Some(problem), Some(runs)) = (result.problems.get(block.problem), block.runs.get(entrant)) else {
                continue;
            };
            let stem = stem(block.problem);
            files.push((format!("{stem}.json"), document(result, (block.problem, problem), (&method, &stem, runs))));
            files.push((
                format!("{stem}.dat"),
                runs.iter().fold(String::from("evaluations raw_y\n"), |text, run| text + &lines(problem, run)),
            ));
        }
    }
    files
}

/// Returns the lines of a run.
fn lines(problem: &SuiteProblem, run: &SuiteRun) -> String {
    let first = run.improvements.first().map_or(1.0, |(_, cost)| problem.gap(*cost)).max(1.0);
    let mut text = format!("1 {}\n", Shortest(first));
    for (evaluations, cost) in run.improvements.iter().filter(|(evaluations, _)| *evaluations > 1) {
        let _ = writeln!(text, "{evaluations} {}", Shortest(problem.gap(*cost).max(0.0)));
    }
    text
}

fn document(
    result: &SuiteResult,
    (number, problem): (usize, &SuiteProblem),
    (method, stem, runs): (&str, &str, &[SuiteRun]),
) -> String {
    let run = |(n, run): (u64, &SuiteRun)| {
        let (evaluations, cost) = run.improvements.last().copied().unwrap_or((1, problem.cost(1.0)));
        value!({
            "instance": n, "evals": run.evaluations,
            "best": {"evals": evaluations, "y": problem.gap(cost).max(0.0), "x": Vec::<f64>::new()},
        })
    };
    let document = value!({
        "version": "0.3.18",
        "suite": format!("motorfit-{}-v{}", result.spec.suite.name(), result.version),
        "function_id": number + 1,
        "function_name": problem.name,
        "maximization": false,
        "algorithm": {"name": method, "info": format!("motorfit {}", env!("CARGO_PKG_VERSION"))},
        "attributes": ["evaluations", "raw_y"],
        "scenarios": [{
            "dimension": problem.truth.len(),
            "path": format!("{stem}.dat"),
            "runs": (1..).zip(runs).map(run).collect::<Value>(),
        }],
    });
    crate::json(&document)
}
