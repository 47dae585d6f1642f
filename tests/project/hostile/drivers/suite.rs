//! Calls of suites: their problems, runs, measures and reports.

use crate::hostile::arguments::{COUNTS, FEW, NUMBERS, texts};
use crate::hostile::calls::{Calls, ask, drive};
use motorfit::experiment::Shape;
use motorfit::identify::Method;
use motorfit::named::Named;
use motorfit::optimize::{Coordinates, DifferentialEvolutionOptions, MultistartOptions};
use motorfit::report::Reproduced;
use motorfit::report::suite::{ioh_files, suite_csv, suite_document, suite_page, suite_tables};
use motorfit::study::compare::CompareSettings;
use motorfit::study::suite::{Entrant, Suite, SuiteResult, SuiteRun, SuiteSpec, run_suite};
use std::ops::ControlFlow;

fn entrant(method: impl Into<Method>) -> Entrant {
    Entrant { method: method.into(), coordinates: Coordinates::Log, population: Some(10) }
}

fn quick() -> SuiteSpec {
    let entrants = vec![entrant(DifferentialEvolutionOptions::default()), entrant(MultistartOptions::default())];
    SuiteSpec { entrants, budgets: vec![30, 60], runs: 2, ..SuiteSpec::default() }
}

/// Returns the result of a quick suite, and inconsistent copies of it.
fn results() -> Vec<SuiteResult> {
    let found = run_suite(&quick(), &mut |_| ControlFlow::Continue(())).unwrap();
    let mut all = vec![found.clone()];
    let mut with = |change: &dyn Fn(&mut SuiteResult)| {
        let mut other = found.clone();
        change(&mut other);
        all.push(other);
    };
    with(&|r| r.blocks.clear());
    with(&|r| r.problems.clear());
    with(&|r| r.spec.entrants.clear());
    with(&|r| r.spec.budgets.clear());
    with(&|r| r.blocks[0].runs.clear());
    with(&|r| r.blocks[0].runs[0].clear());
    with(&|r| r.blocks[0].runs[1][0].improvements.clear());
    with(&|r| (r.blocks[0].budget, r.blocks[1].problem) = (usize::MAX, usize::MAX));
    for value in FEW {
        with(&|r| r.problems.iter_mut().for_each(|p| (p.optimum_cost, p.random_cost) = (value, value)));
        with(&|r| {
            let runs = r.blocks.iter_mut().flat_map(|b| b.runs.iter_mut().flatten());
            runs.for_each(|run| (run.improvements, run.evaluations) = (vec![(u64::MAX, value)], u64::MAX));
        });
    }
    all
}

pub fn suites(calls: &mut Calls) {
    for result in results() {
        let shown = format!("{:?}", result.blocks);
        for index in [0, 1, 2, usize::MAX] {
            drive!(calls, shown;
                "study::suite::SuiteResult::name" => result.name(index),
                "study::suite::SuiteResult::measure" => FEW.map(|gap| result.measure(index, 0, gap)),
                "study::suite::SuiteResult::measures" => FEW.map(|gap| result.measures(0, index, gap).len()),
                "study::suite::SuiteResult::reached" => result.reached(index),
                "study::suite::SuiteResult::performance_profile" => FEW.map(|gap| result.performance_profile(index, gap)),
                "study::suite::SuiteResult::data_profile" => FEW.map(|gap| result.data_profile(index, gap)),
                "study::suite::SuiteResult::median_gaps" => result.median_gaps(index),
                "study::suite::SuiteResult::ranks" => result.ranks(index),
            );
        }
        let how = Reproduced { command: String::new(), options: Vec::new() };
        drive!(calls, shown;
            "study::suite::SuiteResult::last_budget" => result.last_budget(),
            "report::suite::suite_tables" => suite_tables(&result),
            "report::suite::suite_csv" => suite_csv(&result),
            "report::suite::suite_document" => suite_document(&result),
            "report::suite::suite_page" => suite_page(&result, &how).html(true),
            "report::suite::ioh_files" => ioh_files(&result),
        );
        for problem in &result.problems {
            drive!(calls, shown;
                "study::suite::SuiteProblem::gap" => NUMBERS.map(|cost| problem.gap(cost)),
                "study::suite::SuiteProblem::cost" => NUMBERS.map(|gap| problem.cost(gap)),
            );
        }
    }
}

pub fn suite_settings(calls: &mut Calls) {
    let usual = quick();
    for spec in [
        SuiteSpec { entrants: Vec::new(), ..usual.clone() },
        SuiteSpec { budgets: Vec::new(), ..usual.clone() },
        SuiteSpec { budgets: vec![0], ..usual.clone() },
        SuiteSpec { budgets: vec![u64::MAX], ..usual.clone() },
        SuiteSpec { budgets: vec![5, 5], ..usual.clone() },
        SuiteSpec { runs: 0, ..usual.clone() },
        SuiteSpec { runs: usize::MAX, ..usual.clone() },
        SuiteSpec { entrants: vec![Entrant { population: Some(0), ..usual.entrants[0].clone() }], ..usual.clone() },
        SuiteSpec {
            entrants: vec![Entrant { population: Some(usize::MAX), ..usual.entrants[0].clone() }],
            ..usual.clone()
        },
        SuiteSpec { entrants: vec![entrant(Method::SteiglitzMcBride)], ..usual.clone() },
        SuiteSpec { entrants: vec![entrant(Method::Auto)], budgets: vec![1, 2], runs: 1, ..usual },
    ] {
        ask!(calls, spec;
            "study::suite::run_suite" => run_suite(&spec, &mut |_| ControlFlow::Continue(())).map(|r| r.blocks.len()),
            "study::suite::run_suite" => run_suite(&spec, &mut |_| ControlFlow::Break(())).map(|r| r.blocks.len()),
        );
    }
    for count in COUNTS {
        for budget in [0, 1, 100, count as u64] {
            let one = Entrant { population: Some(count), ..quick().entrants[0].clone() };
            drive!(calls, (count, budget); "study::suite::Entrant::shape" => one.shape(budget));
        }
    }
    for value in NUMBERS {
        let run = SuiteRun { improvements: vec![(3, value), (5, value)], evaluations: 7 };
        drive!(calls, value;
            "study::suite::SuiteRun::cost" => run.cost(),
            "study::suite::SuiteRun::evaluations_to" => NUMBERS.map(|cost| run.evaluations_to(cost)),
            "experiment::Shape::voltage" => Shape::ALL.map(|shape| [0, 1, 7].map(|n| shape.voltage(value, n, 5 * n))),
        );
    }
    drive!(calls, "suites";
        "study::suite::Suite::definition" => Suite::ALL.map(Suite::definition),
        "study::suite::Suite::name" => Suite::ALL.map(Suite::name),
        "experiment::Shape::name" => Shape::ALL.map(Shape::name),
    );
    ask!(calls, "suites";
        "study::suite::Suite::version" => Suite::Motors.version(),
        "study::suite::Suite::problems" => Suite::Motors.problems().map(|problems| problems.len()),
    );
    for word in texts() {
        ask!(calls, word;
            "study::suite::Suite::named" => <Suite as Named>::named("suite", &word),
            "experiment::Shape::named" => <Shape as Named>::named("shape", &word),
        );
        let settings = CompareSettings {
            methods: vec![DifferentialEvolutionOptions::default().into()],
            criteria: vec![word.clone()],
            population: Vec::new(),
            generations: Vec::new(),
            set: Vec::new(),
            transforms: vec![word.clone()],
            bounds: Vec::new(),
            fix: Vec::new(),
        };
        ask!(calls, word; "study::suite::Entrant::all" => Entrant::all(&settings));
    }
}
