//! Modelica: the equations of the machine with their parameters, in SI units, without a library.

use super::contents::{Exported, not_identifiable};
use motorfit_core::Result;
use motorfit_core::text::Shortest;
use motorfit_core::units::Unit;
use motorfit_model::{Equation, Formula, FormulaKind, Model, ModelState};
use std::fmt::Write as _;

/// Names with a meaning in Modelica.
const RESERVED: [&str; 24] = [
    "algorithm",
    "and",
    "annotation",
    "block",
    "class",
    "connect",
    "constant",
    "der",
    "discrete",
    "each",
    "else",
    "end",
    "equation",
    "flow",
    "for",
    "function",
    "if",
    "import",
    "in",
    "model",
    "not",
    "or",
    "time",
    "type",
];
/// Speed over which Coulomb friction changes its sign.
const CREEP: &str = "creep";

/// Returns the text of the file.
pub(super) fn text(of: &Exported) -> Result<String> {
    let model = &of.model;
    if let Some((lacking, _)) = model.parameters().iter().zip(&of.values).find(|(_, value)| !value.is_finite()) {
        return Err(not_identifiable(&lacking.name));
    }
    let mut text = String::new();
    for line in of.origin() {
        let _ = writeln!(text, "// {line}");
    }
    for effect in left_out(of) {
        let _ = writeln!(text, "// Left out: {effect}.");
    }
    let _ = writeln!(text, "model Machine \"{}\"", quoted(&of.title));
    let described = |symbol: &str| of.parameters.iter().find(|p| p.symbol == symbol).map_or("", |p| p.name.as_str());
    for (parameter, value) in model.parameters().iter().zip(&of.values) {
        let unit = &parameter.unit.unit;
        let (value, unit) = (Shortest(value * unit.factor + unit.offset), si(&parameter.unit.text, unit));
        let about = quoted(described(&parameter.name));
        let _ = writeln!(text, "  parameter Real {}(unit=\"{unit}\") = {value} \"{about}\";", name(&parameter.name));
    }
    for constant in model.constants() {
        let unit = Unit { dimension: constant.dimension, ..Unit::ONE };
        let (value, unit) = (Shortest(constant.value), si("", &unit));
        let _ = writeln!(text, "  constant Real {}(unit=\"{unit}\") = {value};", name(&constant.name));
    }
    if model.reactions() > 0 {
        let about = "Speed, or current, over which friction changes its sign";
        let _ = writeln!(text, "  parameter Real {CREEP} = 1e-4 \"{about}\";");
    }
    for input in model.inputs() {
        let unit = si(&input.unit.text, &input.unit.unit);
        let start = input.default.unwrap_or(0.0) * input.unit.unit.factor + input.unit.unit.offset;
        let _ = writeln!(text, "  input Real {}(unit=\"{unit}\", start={});", name(&input.name), Shortest(start));
    }
    text.push_str(&variables(of));
    text.push_str("equation\n");
    text.push_str(&equations(of));
    text.push_str("end Machine;\n");
    Ok(text)
}

/// Returns the effects that the equations do not hold.
fn left_out(of: &Exported) -> Vec<String> {
    let mut effects = of.not_in_equations.clone();
    for (signal, [delay_s, latency_s]) in of.model.delays_s(&of.values) {
        if delay_s < 0.0 {
            effects.push(format!(
                "the delay of {signal}, {} s: a signal cannot act before it is there",
                Shortest(delay_s)
            ));
        }
        if delay_s > 0.0 && of.model.inputs().iter().any(|input| input.name == signal) {
            effects.push(format!("the delay of {signal}, {} s", Shortest(delay_s)));
        }
        if latency_s != 0.0 {
            effects.push(format!("the latency of {signal}, {} s", Shortest(latency_s)));
        }
    }
    let averaged = of.model.outputs().iter().filter(|output| output.is_averaged());
    let offset = of.model.inputs().iter().filter(|input| input.is_offset);
    effects.extend(offset.map(|input| format!("the offset of {}", input.name)));
    let late = of.model.outputs().iter().filter(|output| output.is_late());
    effects.extend(late.map(|output| format!("the filter and delay of the sensor of {}", output.name)));
    effects.extend(averaged.map(|output| format!("the moving average of {}", output.name)));
    effects
}

/// Returns the declarations of definitions, states and outputs.
fn variables(of: &Exported) -> String {
    let model = &of.model;
    let mut text = String::new();
    let sections = ["signals", "let"];
    for equation in model.equations().iter().filter(|equation| sections.contains(&equation.section)) {
        let _ = writeln!(text, "  Real {};", name(&equation.name));
    }
    let starts = starts(of);
    for (state, start) in model.states().iter().zip(starts) {
        let unit = si(&state.unit.text, &state.unit.unit);
        let is_output = model
            .outputs()
            .iter()
            .any(|output| output.name == state.name && output_name(model, &output.name).is_none());
        let kind = if is_output { "output " } else { "" };
        let start = Shortest(start);
        let _ = writeln!(text, "  {kind}Real {}(unit=\"{unit}\", start={start}, fixed=true);", name(&state.name));
    }
    for output in model.outputs() {
        let Some(own) = output_name(model, &output.name) else { continue };
        let _ = writeln!(text, "  output Real {own}(unit=\"{}\");", si(&output.unit.text, &output.unit.unit));
    }
    text
}

/// Returns the initial values of the states in SI units.
fn starts(of: &Exported) -> Vec<f64> {
    let mut open = of.initial.iter();
    let given = of.model.initial_values(&of.values);
    let one = |(state, given): (&ModelState, Option<f64>)| {
        let unit = &state.unit.unit;
        let own = given.unwrap_or_else(|| open.next().copied().unwrap_or(0.0) * unit.factor);
        own + unit.offset
    };
    of.model.states().iter().zip(given).map(one).collect()
}

fn equations(of: &Exported) -> String {
    let mut text = String::new();
    for equation in of.model.equations() {
        let Some(formula) = equation.formula() else { continue };
        let right = written(&formula, 0);
        let left = name(&equation.name);
        let line = match equation.section {
            "states" => format!("der({left}) = {right}"),
            // An output that is the state of its name is declared with the state.
            "outputs" => match output_name(&of.model, &equation.name) {
                None => continue,
                Some(own) => format!("{own} = {right}"),
            },
            "signals" => format!("{left} = {}", delayed(of, &equation.name, right)),
            _ => format!("{left} = {right}"),
        };
        let _ = writeln!(text, "  {line};");
    }
    text
}

/// Returns a signal with its delay.
fn delayed(of: &Exported, signal: &str, value: String) -> String {
    match of.model.delays_s(&of.values).into_iter().find(|(name, [delay_s, _])| name == signal && *delay_s > 0.0) {
        Some((_, [delay_s, _])) => format!("delay({value}, {})", Shortest(delay_s)),
        None => value,
    }
}

/// Returns the name of an output; `None` if it is the state of its name.
fn output_name(model: &Model, output: &str) -> Option<String> {
    let value = model.equations().iter().find(|equation| equation.section == "outputs" && equation.name == output);
    let formula = value.and_then(Equation::formula);
    let is_state = |name: &str| model.states().iter().any(|state| state.name == name);
    match formula.as_ref().map(Formula::kind) {
        Some(FormulaKind::Name(of)) if of == output && is_state(of) => None,
        _ => Some(format!("y_{output}")),
    }
}

/// Returns a name that Modelica accepts.
fn name(name: &str) -> String {
    if RESERVED.contains(&name) || name.starts_with('_') || name == CREEP {
        format!("'{name}'")
    } else {
        name.to_owned()
    }
}

fn quoted(text: &str) -> String {
    text.replace('\\', "/").replace('"', "'")
}

/// Returns a unit in the notation of Modelica, without a factor.
fn si(text: &str, unit: &Unit) -> String {
    let is_plain = unit.factor.to_bits() == 1_f64.to_bits() && unit.offset == 0.0 && !text.is_empty();
    let text = if is_plain { text.to_owned() } else { unit.dimension.to_string() };
    text.replace('*', ".").replace('^', "").replace("ohm", "Ohm").replace(' ', "")
}

/// Returns a formula, in brackets if it binds less than `least`.
fn written(formula: &Formula, least: u8) -> String {
    let (own, text) = match formula.kind() {
        FormulaKind::Number(value) => (9, Shortest(value).to_string()),
        FormulaKind::Name("pi") => (9, "3.141592653589793".to_owned()),
        FormulaKind::Name(of) => (9, name(of)),
        // Modelica has signs at the beginning of a sum only.
        FormulaKind::Negative(inner) => (0, format!("-{}", written(&inner, 6))),
        FormulaKind::Not(inner) => (3, format!("not {}", written(&inner, 9))),
        FormulaKind::Fraction(above, below) => (5, format!("{}/{}", written(&above, 5), written(&below, 6))),
        FormulaKind::Power(base, exponent) => (8, format!("{}^{}", written(&base, 9), written(&exponent, 9))),
        FormulaKind::Binary(sign, precedence, left, right) => {
            let sign = match sign {
                "&&" => " and ".to_owned(),
                "||" => " or ".to_owned(),
                "*" => "*".to_owned(),
                sign => format!(" {sign} "),
            };
            (precedence, format!("{}{sign}{}", written(&left, precedence), written(&right, precedence + 1)))
        }
        FormulaKind::Call(function, arguments) => call(function, &arguments),
    };
    if own < least { format!("({text})") } else { text }
}

/// Returns a call of a function, with its precedence.
fn call(function: &str, arguments: &[Formula]) -> (u8, String) {
    let whole: Vec<String> = arguments.iter().map(|argument| written(argument, 0)).collect();
    let tight: Vec<String> = arguments.iter().map(|argument| written(argument, 9)).collect();
    match (function, &whole[..]) {
        ("select", [condition, then, otherwise]) => (0, format!("if {condition} then {then} else {otherwise}")),
        ("clamp", [value, low, high]) => (9, format!("max({low}, min({value}, {high}))")),
        ("deadzone", [value, gap]) => (4, format!("{} - max(-{}, min({value}, {gap}))", tight[0], tight[1])),
        // Without its samples: continuous.
        ("hold", [law, _]) => (5, format!("({law})")),
        ("stick", [speed, _]) => (5, format!("{}*tanh(({speed})/{CREEP})", tight[1])),
        ("pow", [_, _]) => (8, format!("{}^{}", tight[0], tight[1])),
        _ => (9, format!("{function}({})", whole.join(", "))),
    }
}
