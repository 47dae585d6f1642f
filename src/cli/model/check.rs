//! The command `model check`: what was understood of a model.

use super::args::CheckArgs;
use crate::cli::prelude::*;
use motorfit::model::{InitialState, Model};
use motorfit::report::{model_check_document, model_check_page};
use motorfit::text::Shortest;

pub(super) fn run(args: &CheckArgs, style: &Style) -> Result<Outcome> {
    let model = Model::open(&args.model)?;
    let out = args.out.as_deref().map(Out::take).transpose()?;
    let document = json(&model_check_document(&model));
    if let Some(precision) = args.wgsl {
        data(&model.wgsl(precision)?)?;
    } else if args.json {
        data(&document)?;
    } else {
        show(&text(&model))?;
    }
    if let Some(out) = out {
        let page = model_check_page(&model, &[method(&model)]).html(!args.page.no_script);
        out.write(&[("report.html".to_owned(), page), ("result.json".to_owned(), document)], style)?;
    }
    Ok(Outcome::Done)
}

/// Returns a sentence on the integration method.
fn method(model: &Model) -> String {
    match (model.is_affine(), model.reactions()) {
        (true, 0) => "The equations are affine in states and inputs: on an even clock steps are exact.".to_owned(),
        (true, n) => format!(
            "The equations are affine in states and inputs, with {}: on an even clock steps between reactions are exact.",
            motorfit::text::counted(n, "set-valued reaction")
        ),
        _ => "The equations are not affine: Runge–Kutta of order 4, or its exponential form where the sampling period is long for \
              the fastest pole."
            .to_owned(),
    }
}

fn text(model: &Model) -> String {
    let mut text = format!("{STRONG}{}{STRONG:#}\n", printable(model.name()));
    let mut line = |name: &str, value: String| {
        let _ = writeln!(text, "  {name:<11}{}", printable(&value));
    };
    let unit = |unit: &str| if unit == "1" { String::new() } else { format!(" [{unit}]") };
    for (n, input) in model.inputs().iter().enumerate() {
        let column = input.column.as_ref().filter(|column| **column != input.name);
        let column = column.map_or(String::new(), |column| format!(", column {column}"));
        let default = input.default.map_or(String::new(), |value| format!(", {} without it", significant(value, 6)));
        line(if n == 0 { "inputs" } else { "" }, format!("{}{}{column}{default}", input.name, unit(&input.unit.text)));
    }
    for (n, state) in model.states().iter().enumerate() {
        let initial = match state.initial {
            InitialState::Given(_) => "initial value given",
            InitialState::Measured(_) => "initial value measured",
            InitialState::Free => "initial value estimated",
        };
        line(if n == 0 { "states" } else { "" }, format!("{}{}, {initial}", state.name, unit(&state.unit.text)));
    }
    for (n, output) in model.outputs().iter().enumerate() {
        let column = output.column.as_ref().filter(|column| **column != output.name);
        let column = column.map_or(String::new(), |column| format!(", column {column}"));
        let sensor = match (output.is_late(), output.is_averaged()) {
            (true, _) => ", its sensor late",
            (false, true) => ", averaged by its sensor",
            _ => "",
        };
        line(
            if n == 0 { "outputs" } else { "" },
            format!("{}{}{column}{sensor}", output.name, unit(&output.unit.text)),
        );
    }
    for (n, of) in model.parameters().iter().enumerate() {
        let scale = if of.is_logarithmic { ", logarithmic" } else { "" };
        let about = if of.description.is_empty() { String::new() } else { format!("  {}", of.description) };
        let neutral = of.neutral.map_or(String::new(), |value| format!(", neutral {}", Shortest(value)));
        let range = format!("{} … {}{scale}{neutral}", Shortest(of.min), Shortest(of.max));
        line(if n == 0 { "parameters" } else { "" }, format!("{:<6}{range}{}{about}", of.name, unit(&of.unit.text)));
    }
    for (n, term) in model.terms().iter().enumerate() {
        let of: Vec<&str> = term.parameters.iter().map(|n| model.parameters()[*n].name.as_str()).collect();
        line(if n == 0 { "terms" } else { "" }, format!("{}: {}", term.name, of.join(", ")));
    }
    line("equations", format!("{} operations for the right-hand sides and outputs", model.operations()));
    line("method", method(model));
    text
}
