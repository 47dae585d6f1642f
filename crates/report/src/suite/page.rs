//! Page of a suite.

use super::tables::{compact, suite_tables};
use crate::chart::{AxisScale, Chart, Form, Panel, Series};
use crate::page::{Page, Part, Section};
use crate::pages::{Reproduced, reproduce, section};
use crate::spelling::command_line;
use motorfit_core::numeric::count_u64;
use motorfit_study::suite::{GAP, SuiteResult};

/// Returns the page of a suite.
#[must_use]
pub fn suite_page(result: &SuiteResult, how: &Reproduced) -> Page {
    let mut sure: Vec<Part> = result.warnings.iter().map(|w| Part::Warning(w.spelled(command_line))).collect();
    if result.interrupted {
        sure.push(Part::Warning("This suite was interrupted: the results are incomplete.".to_owned()));
    }
    let mut sections = Vec::new();
    if !sure.is_empty() {
        sections.push(section("Warnings", sure));
    }
    let mut tables = suite_tables(result).into_iter().map(Part::Table).collect::<Vec<_>>();
    let by_problem = tables.pop();
    sections.push(section("Results by budget", tables));
    sections.push(profiles(result));
    sections.push(section("Results by problem", by_problem.into_iter().collect()));
    sections.push(reproduce(&[], how, Some(result.device.to_string())));
    let title = format!("Searches on the suite {}, version {}", result.spec.suite.name(), result.version);
    Page { title, answer: answer(result), sections, ..Page::default() }
}

/// Names the first and those that do not differ from it significantly, for each budget.
fn answer(result: &SuiteResult) -> String {
    let one = |(n, budget): (usize, &u64)| {
        let ranks = result.ranks(n)?;
        let equals = (0..ranks.p_holm.len()).filter(|entrant| ranks.p_holm[*entrant] >= 0.05);
        let equals: Vec<String> = equals.map(|entrant| result.name(entrant)).collect();
        let also =
            if equals.is_empty() { String::new() } else { format!(", not significantly before {}", equals.join(", ")) };
        Some(format!("{} evaluations: {}{also}.", compact(count_u64(*budget)), result.name(ranks.first)))
    };
    let all: Vec<String> = result.spec.budgets.iter().enumerate().filter_map(one).collect();
    if all.is_empty() {
        "No problem is complete.".to_owned()
    } else {
        format!("First in rank with {}", all.join(" With "))
    }
}

/// Returns the section of the distributions at the largest budget.
fn profiles(result: &SuiteResult) -> Section {
    let last = result.last_budget();
    let Some(last) = last else { return section("Profiles", Vec::new()) };
    let panel = |label: &str, axis: &str, profiles: Vec<Vec<(f64, f64)>>| {
        let end = profiles.iter().filter_map(|points| Some(points.last()?.0)).fold(0.0, f64::max);
        let of = |(n, mut points): (usize, Vec<(f64, f64)>)| {
            // A distribution keeps its last fraction.
            points.extend(points.last().map(|(_, fraction)| (end, *fraction)));
            Series::new(&result.name(n), n + 1, Form::Steps, points)
        };
        let series = profiles.into_iter().enumerate().map(of).collect();
        let scales = [AxisScale::Log, AxisScale::Linear];
        Panel { axis: Some(axis.to_owned()), scales, ..Panel::new(label, series) }
    };
    let panels = vec![
        panel("targets reached, fraction [1]", "evaluations / parameters [1]", result.reached(last)),
        panel(
            "data profile: problems solved, fraction [1]",
            "evaluations / (parameters + 1) [1]",
            result.data_profile(last, GAP),
        ),
        panel(
            "performance profile: problems solved, fraction [1]",
            "ratio to the shortest time [1]",
            result.performance_profile(last, GAP),
        ),
    ];
    let budget = compact(count_u64(result.spec.budgets[last]));
    section(
        "Profiles",
        vec![Part::Chart(Chart {
            id: "profiles".to_owned(),
            panels,
            is_grid: true,
            alternative: "for each method".to_owned(),
            caption: format!(
                "Runs of {budget} evaluations. Targets: 41 gaps from 1 to 1e-8, of all problems and runs. Data profile: problems whose expected \
                 running time to a gap of {GAP:e} is within so many simplex gradients. Performance profile: problems on which it is \
                 within a factor of the shortest one."
            ),
            ..Chart::default()
        })],
    )
}
