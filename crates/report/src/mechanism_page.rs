//! Page of a mechanism of a robot.

use super::identify_page::identify_page;
use super::mechanism::{FeedbackDesign, mechanism_code, mechanism_lines, mechanism_selection};
use super::page::{Card, Page, Part, Section};
use super::pages::{Reproduced, section};
use super::recorded::Recorded;
use super::table::{Table, dash};
use motorfit_core::text::{Shortest, engineering, significant};
use motorfit_identify::mechanism::{Feedback, MechanismFit};
use motorfit_record::Record;

/// Returns the page of an identification of a mechanism.
#[must_use]
pub fn mechanism_page(records: &[Record], fit: &MechanismFit, design: &FeedbackDesign<'_>, how: &Reproduced) -> Page {
    let recorded: Vec<Recorded> =
        fit.recordings.iter().map(|recording| Recorded::of_model(&fit.model, recording, false)).collect();
    let page = identify_page((&fit.fitted(records), &recorded), &fit.spec, &fit.found, how);
    let cards = mechanism_lines(fit).into_iter().map(|line| Card {
        symbol: line.name.to_owned(),
        name: line.text.to_owned(),
        value: match (line.value, line.std_error) {
            (Some(value), Some(error)) => format!("{} ± {}", significant(value, 5), significant(error, 2)),
            (Some(value), None) => significant(value, 5),
            _ => dash(),
        },
        unit: line.unit.replace('*', "·"),
        remark: line.at_bound.map_or_else(String::new, |side| format!("at its {side}")),
    });
    let mut sections: Vec<Section> = vec![section("Feedforward and feedback", feedback(fit, design))];
    let warnings = page.sections.iter().position(|section| section.heading == "Warnings").map_or(0, |at| at + 1);
    let (before, after) = page.sections.split_at(warnings);
    let mut all = before.to_vec();
    all.append(&mut sections);
    all.extend(after.iter().cloned());
    Page { cards: cards.collect(), sections: all, ..page }
}

fn feedback(fit: &MechanismFit, design: &FeedbackDesign<'_>) -> Vec<Part> {
    let unit = fit.unit.symbol;
    let mut values =
        Table::new("feedforward", "Characteristics", &["name", "value", "unit", "standard error", "95 % interval"]);
    for line in mechanism_lines(fit) {
        let interval = line.ci95.map_or_else(dash, |ci| ci.map(|end| significant(end, 5)).join(" … "));
        values.row(vec![
            format!("{}, {}", line.name, line.text),
            line.value.map_or_else(dash, |value| significant(value, 6)),
            line.unit,
            line.std_error.map_or_else(dash, |error| significant(error, 2)),
            interval,
        ]);
    }
    values.note(format!("Mechanism: {}.", mechanism_selection(fit)));
    let controller = design.controller;
    let mut gains = Table::new("feedback", "Feedback gains", &["loop", "largest error", "kP", "kD"]);
    let of = |feedback: Option<Feedback>, n: usize| {
        feedback.map_or_else(dash, |Feedback { gains, std_error }| {
            let value = [gains.kp, gains.kd][n];
            let error = std_error[n].filter(|error| *error > 0.0).map(|error| format!(" ± {}", significant(error, 2)));
            significant(value, 5) + &error.unwrap_or_default()
        })
    };
    let [velocity, position] = [design.weights.velocity, design.weights.position].map(Shortest);
    for (name, error, loop_) in [
        ("velocity", format!("{velocity} {unit}/s"), design.velocity),
        ("position", format!("{position} {unit}"), design.position),
    ] {
        gains.row(vec![name.to_owned(), error, of(loop_, 0), of(loop_, 1)]);
    }
    let [period, delay] = [controller.period_s, controller.delay_s].map(|seconds| engineering(seconds, "s", 3));
    gains.note(format!(
        "Linear–quadratic regulators for {}: period {period}, delay of the measurement {delay}, at most {} V. Gains are a start for tuning.",
        controller.name,
        Shortest(design.weights.volts)
    ));
    let mut parts = vec![Part::Table(values), Part::Table(gains)];
    parts.extend(mechanism_code(fit).into_iter().map(Part::Typed));
    parts
}
