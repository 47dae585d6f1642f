//! Tables of a comparison: costs, ranking, parameters, errors, responses, time.

use crate::identify::Method;
use crate::motor::{Parameter, Parameters, Response, response, simulate};
use crate::numeric::{mean, quantile, sorted};
use crate::report::Table;
use crate::report::spelling::command_line;
use crate::study::compare::{Block, Comparison, FEW, MethodResult, Setting, reached};
use crate::text::significant;

/// The heading of a block: criterion, scale and budget.
#[must_use]
pub fn setting_name(setting: &Setting) -> String {
    let criterion = setting.criterion.norm.name();
    let scale = setting.criterion.scale.name();
    let own: String = setting.methods.iter().filter_map(changed).map(|own| format!("; {own}")).collect();
    format!("{criterion}, scale {scale}, {} agents × {} generations{own}", setting.population, setting.generations)
}

/// Settings of a method that are not its usual ones.
fn changed(method: &Method) -> Option<String> {
    let changed = method.search()?.changed();
    let differing: Vec<String> = changed.into_iter().map(|(name, value)| format!("{name}: {value}")).collect();
    (!differing.is_empty()).then(|| format!("{} {}", method.name(), differing.join(", ")))
}

/// A number for a cell, a dash where there is none.
pub(in crate::report) fn cell(value: f64, digits: usize) -> String {
    if value.is_nan() {
        "\u{2013}".to_owned()
    } else if value.is_infinite() {
        "diverged".to_owned()
    } else {
        significant(value, digits)
    }
}

/// Four decimals, zero without a sign.
pub(super) fn fixed(value: f64) -> String {
    let text = format!("{value:.4}");
    if text == "-0.0000" { "0.0000".to_owned() } else { text }
}

/// Percent with two decimals, or fewer where they mean nothing.
pub(super) fn percent(value: f64) -> String {
    if value.is_nan() {
        "\u{2013}".to_owned()
    } else if value < 100.0 {
        format!("{value:.2}")
    } else {
        format!("{value:.0}")
    }
}

/// All tables of a block.
#[must_use]
pub fn tables(comparison: &Comparison, block: &Block) -> Vec<Table> {
    let mut tables = vec![costs(comparison, block)];
    if !block.has_results() {
        return tables;
    }
    if block.results.len() > 1 {
        tables.push(ranking(block));
    }
    tables.push(parameters(comparison, block));
    if comparison.expected().is_some() {
        tables.push(errors(comparison, block));
    }
    tables.push(deviations(comparison, block));
    tables.push(targets(comparison, block));
    tables.extend(responses(comparison, block));
    tables
}

/// Costs of all runs.
fn costs(comparison: &Comparison, block: &Block) -> Table {
    let title = format!("Cost ({})", setting_name(&block.setting));
    let mut table =
        Table::new("cost", title, &["method", "best", "median", "95 % interval", "worst", "average", "a run"]);
    for result in &block.results {
        let s = result.summary(comparison.spec.seed);
        let interval = if s.interval[0].is_nan() {
            "\u{2013}".to_owned()
        } else {
            format!("{}\u{2026}{}", cell(s.interval[0], 3), cell(s.interval[1], 3))
        };
        let seconds = result.seconds.map_or("\u{2013}".to_owned(), |s| crate::text::engineering(s, "s", 3));
        let name = result.method.name().to_owned();
        table.row(vec![
            name,
            cell(s.best, 3),
            cell(s.median, 3),
            interval,
            cell(s.worst, 3),
            cell(s.average, 3),
            seconds,
        ]);
        if s.failed > 0 {
            table.note(format!(
                "{}: {} runs found no candidate that does not diverge.",
                result.method.name(),
                s.failed
            ));
        }
    }
    let single = |name: &str, cost: f64, seconds: String| {
        let dash = || "\u{2013}".to_owned();
        vec![name.to_owned(), cell(cost, 3), dash(), dash(), dash(), dash(), seconds]
    };
    if let (Some(cost), Some(sm)) = (block.steiglitz_cost, &comparison.steiglitz) {
        table.row(single("sm", cost, crate::text::engineering(sm.seconds, "s", 3)));
    }
    if let Some(cost) = block.reference_cost {
        table.row(single("refined", cost, "\u{2013}".to_owned()));
    }
    let runs = block.results.iter().map(|c| c.runs.len()).max().unwrap_or(0);
    if runs == 0 {
        table.note("Interrupted before it was run.");
        return table;
    }
    if comparison.interrupted {
        table.note("Interrupted: these are the best so far, not of the whole budget.");
    }
    if comparison.subject.records.len() > 1 && block.steiglitz_cost.is_some() {
        table.note("sm: from the first recording alone; its cost is over all.");
    }
    table.note(format!(
        "{runs} runs each, seed {}; the interval is that of the median (bootstrap). A run's time is that of one run alone.",
        comparison.spec.seed
    ));
    table
}

fn ranking(block: &Block) -> Table {
    let ranking = block.ranking();
    let name = |n: usize| block.results[n].method.name();
    let runs = block.results.iter().map(|c| c.runs.len()).max().unwrap_or(0);
    let order: Vec<&str> = ranking.order.iter().map(|n| name(*n)).collect();
    let title = format!("Ranking by median cost: {}", order.join(", "));
    let mut table = Table::new("ranking", title, &["pair", "first is lower in", "p", "p corrected", "at 5 %"]);
    for pair in &ranking.pairs {
        let [a, b] = pair.methods;
        let verdict = if runs < FEW {
            "too few runs"
        } else if pair.p_holm < 0.05 {
            "differ"
        } else {
            "no difference shown"
        };
        table.row(vec![
            format!("{} before {}", name(a), name(b)),
            format!("{:.0} % of pairs", 100.0 * pair.superiority),
            cell(pair.p_value, 2),
            cell(pair.p_holm, 2),
            verdict.to_owned(),
        ]);
    }
    table.note(
        "Wilcoxon's signed-rank test, two-sided, of the logarithms of final costs of runs with the same number (they start from \
         the same population), corrected by Holm's method for all pairs of this block; the budget is equal in evaluations.",
    );
    table
}

/// The parameters of the best run of each method.
fn parameters(comparison: &Comparison, block: &Block) -> Table {
    let mut table = Table::new(
        "parameters",
        "Parameters of the best run",
        &["method", "R [ohm]", "L [H]", "K [V s/rad]", "B [N m s/rad]", "J [kg m²]"],
    );
    let mut row = |name: &str, p: Parameters| {
        let values = Parameter::ALL.iter().map(|q| significant(p.get(*q), 6));
        table.row(std::iter::once(name.to_owned()).chain(values).collect());
    };
    if let Some(truth) = comparison.subject.truth {
        row("true", truth);
    }
    for result in &block.results {
        if let Some(p) = result.best().and_then(|run| run.parameters) {
            row(result.method.name(), p);
        }
    }
    if let Some(Ok(p)) = comparison.steiglitz.as_ref().map(|sm| sm.estimate.as_ref()) {
        row("sm", *p);
    }
    if let Ok(found) = &comparison.reference {
        row("refined", found.parameters);
    }
    if let Some(Err(reason)) = comparison.steiglitz.as_ref().map(|sm| sm.estimate.as_ref()) {
        table.note(format!("Steiglitz\u{2013}McBride cannot serve: {reason}."));
    }
    match &comparison.reference {
        Ok(_) => table.note("refined: Levenberg\u{2013}Marquardt with noise weights, what every search could end at."),
        Err(reason) => table.note(format!("There is no refined estimate: {}", reason.spelled(command_line))),
    }
    table
}

/// Relative errors of the parameters.
fn errors(comparison: &Comparison, block: &Block) -> Table {
    let against = if comparison.subject.truth.is_some() { "the truth" } else { "the refined estimate" };
    let title = format!("Relative errors to {against} [%]: best run / mean over runs");
    let mut table = Table::new("errors", title, &["method", "R", "L", "K", "B", "J", "average"]);
    let Some(expected) = comparison.expected() else { return table };
    let mut row = |name: &str, errors: [[f64; 2]; 5], free: &dyn Fn(Parameter) -> bool| {
        let pair = |[best, mean]: [f64; 2]| format!("{}/{}", percent(best), percent(mean));
        let kept: Vec<[f64; 2]> =
            Parameter::ALL.into_iter().zip(errors).filter(|(p, _)| free(*p)).map(|(_, e)| e).collect();
        let average = [0, 1].map(|n| mean(&kept.iter().map(|e| e[n]).collect::<Vec<f64>>()));
        let cells = Parameter::ALL.into_iter().zip(errors);
        let cells = cells.map(|(p, e)| if free(p) { pair(e) } else { "held".to_owned() }).chain([pair(average)]);
        table.row(std::iter::once(name.to_owned()).chain(cells).collect());
    };
    for result in &block.results {
        row(result.method.name(), result.errors(&expected), &|p| comparison.is_free(p));
    }
    if let Some(sm) = comparison.steiglitz.as_ref().filter(|sm| sm.estimate.is_ok() || !sm.spread.is_empty()) {
        row("sm", sm.all_errors(&expected), &|_| true);
        table.note(steiglitz_note(comparison));
    }
    table
}

/// Where Steiglitz–McBride's spread comes from.
pub(super) fn steiglitz_note(comparison: &Comparison) -> String {
    let Some(sm) = &comparison.steiglitz else { return String::new() };
    if sm.records == 0 {
        return "Steiglitz\u{2013}McBride has no seeds, and no records with new noise can be made of this recording: it has no \
                spread here."
            .to_owned();
    }
    format!(
        "Steiglitz\u{2013}McBride has no seeds: its spread is over {} records with new noise of {} A and {} rad/s{}; it served \
         on {} of them.",
        sm.records,
        significant(sm.sigma[0], 3),
        significant(sm.sigma[1], 3),
        if comparison.subject.truth.is_some() {
            format!(" ({} dB)", comparison.spec.noise_db)
        } else {
            " (that of the residuals)".to_owned()
        },
        sm.spread.len()
    )
}

fn deviations(comparison: &Comparison, block: &Block) -> Table {
    let heads = ["method", "R [ohm]", "L [H]", "K [V s/rad]", "B [N m s/rad]", "J [kg m²]"];
    let mut table = Table::new("deviations", "Standard deviations of the parameters over runs", &heads);
    for result in &block.results {
        let cells = result.deviations().map(|d| cell(d, 3));
        table.row(std::iter::once(result.method.name().to_owned()).chain(cells).collect());
    }
    if let Some(sm) = comparison.steiglitz.as_ref().filter(|sm| !sm.spread.is_empty()) {
        let cells = sm.deviations().map(|d| cell(d, 3));
        table.row(std::iter::once("sm".to_owned()).chain(cells).collect());
        table.note(steiglitz_note(comparison));
    }
    table
}

/// How soon targets are reached.
fn targets(comparison: &Comparison, block: &Block) -> Table {
    let (targets, reached) = reached(block, comparison.spec.target);
    let title = match (targets.first(), targets.last()) {
        (Some(first), Some(last)) if targets.len() > 1 => {
            format!("Reached of {} targets from {} down to {}", targets.len(), cell(*first, 3), cell(*last, 3))
        }
        (Some(only), _) => format!("Reached the cost {}", cell(*only, 3)),
        _ => "Targets".to_owned(),
    };
    let heads = ["method", "25 % after", "50 % after", "75 % after", "at the end", "50 % after [s]"];
    let mut table = Table::new("targets", title, &heads);
    for (result, reached) in block.results.iter().zip(&reached) {
        let place = |share: f64| reached.share.iter().position(|s| *s >= share);
        let at = |share: f64| place(share).map_or("never".to_owned(), |n| format!("{}", reached.evaluations[n]));
        let seconds = place(0.5).and_then(|n| reached.seconds.get(n));
        let seconds = seconds.map_or("\u{2013}".to_owned(), |s| crate::text::engineering(*s, "s", 3));
        let last = percent(100.0 * reached.share.last().copied().unwrap_or(0.0));
        let name = result.method.name().to_owned();
        table.row(vec![name, at(0.25), at(0.5), at(0.75), format!("{last} %"), seconds]);
    }
    table.note("Share of all pairs of a run and a target, after how many evaluations of a run; targets are even in the logarithm.");
    table
}

/// The response of a motor as the first recording drives it.
pub(super) fn current_of(comparison: &Comparison, parameters: &Parameters, band: f64) -> Option<Response> {
    let record = comparison.subject.records.first()?;
    let drive = crate::experiment::drive(record);
    let initial = comparison.initial.first().copied().unwrap_or_default();
    let [current, _] = simulate(parameters, &drive, initial, comparison.spec.model.discretization);
    response(&record.samples().time_s, &current, band)
}

/// Figures of the current: peak, settling, steady state.
fn responses(comparison: &Comparison, block: &Block) -> Option<Table> {
    let record = comparison.subject.records.first()?;
    let time = &record.samples().time_s;
    let measured = record.samples().current.as_ref()?;
    let heads = ["method", "peak [A]", "at [s]", "over [%]", "2 % [s]", "5 % [s]", "steady [A]", "error [A]"];
    let mut table = Table::new("response", "Current of the first recording, best run", &heads);
    let [real, wide] = [0.02, 0.05].map(|band| response(time, measured, band));
    let (real, wide) = (real?, wide?);
    let mut row = |name: &str, [two, five]: [Response; 2]| {
        let time = |t: Option<f64>| t.map_or("never".to_owned(), |t| format!("{t:.3}"));
        table.row(vec![
            name.to_owned(),
            format!("{:.4}", two.peak),
            format!("{:.3}", two.peak_time_s),
            two.overshoot_percent.map_or("\u{2013}".to_owned(), |o| format!("{o:.0}")),
            time(two.settling_time_s),
            time(five.settling_time_s),
            format!("{:.4}", two.steady_state),
            fixed(two.steady_state - real.steady_state),
        ]);
    };
    row("measured", [real, wide]);
    let mut best: Vec<(&str, Parameters)> = block.results.iter().filter_map(named_best).collect();
    best.extend(comparison.steiglitz.as_ref().and_then(|sm| Some(("sm", *sm.estimate.as_ref().ok()?))));
    for (name, p) in best {
        if let (Some(two), Some(five)) = (current_of(comparison, &p, 0.02), current_of(comparison, &p, 0.05)) {
            row(name, [two, five]);
        }
    }
    table.note(
        "over: overshoot. 2 % and 5 %: from when on the current stays within that band around its mean over the last tenth.",
    );
    Some(table)
}

fn named_best(result: &MethodResult) -> Option<(&'static str, Parameters)> {
    Some((result.method.name(), result.best()?.parameters?))
}

/// Quartiles of the lowest cost after each generation.
#[must_use]
pub fn quartiles(result: &MethodResult) -> Vec<[f64; 3]> {
    let generations = result.runs.iter().map(|run| run.history.len()).max().unwrap_or(0);
    let at = |generation: usize| {
        let costs: Vec<f64> = result.runs.iter().filter_map(|run| run.history.get(generation).copied()).collect();
        let sorted = sorted(&costs);
        [0.25, 0.5, 0.75].map(|p| quantile(&sorted, p))
    };
    (0..generations).map(at).collect()
}
