//! Tables of an identification: parameters, fit, feedforward characteristics, model selection.

use super::estimate_rows::{EstimateRow, estimate_rows};
use super::identified::{verdicts, window, with_error};
use super::requested::Requested;
use super::shown::Shown;
use super::table::{Table, dash};
use motorfit_core::text::{decimals, engineering, significant};
use motorfit_identify::analysis::{Characteristic, Characteristics, TransferFunctions};
use motorfit_identify::{Identification, Machine};
use motorfit_motor::Input;

/// Returns the table of parameters, and of identified combinations of others, with their uncertainty.
pub(super) fn parameters_table<M: Machine>(found: &Identification<M>) -> Table {
    let heads = ["parameter", "value", "unit", "standard error", "95 % interval", "remark"];
    let mut table = Table::new("parameters", "Parameters", &heads);
    let interval = |[low, high]: [f64; 2]| format!("{} … {}", significant(low, 6), significant(high, 6));
    for EstimateRow { estimate: e, remark } in estimate_rows(found) {
        let of = e.recording.map_or_else(String::new, |n| format!(" of recording {}", n + 1));
        let description = Some(&e.description).filter(|text| !text.is_empty());
        let description = description.map_or_else(String::new, |text| format!(", {text}"));
        table.row(vec![
            format!("{}{description}{of}", e.name),
            e.value.map_or_else(dash, |value| significant(value, 6)),
            e.unit,
            e.std_error.map_or_else(dash, |error| significant(error, 2)),
            e.ci95.map_or_else(dash, interval),
            remark,
        ]);
    }
    table
}

/// Returns the table of the fit of each output.
pub(super) fn fit_table<M: Shown>(found: &Identification<M>, requested: &Requested) -> Table {
    let held_out = M::held_out_percent(found);
    let mut heads = vec!["output", "fit [%]", "residual σ", "residuals white", "independent of the input"];
    heads.extend(held_out.map(|_| "held out [%]"));
    let mut table = Table::new("fit", "Fit", &heads);
    let [white, independent] = verdicts(&found.residual_tests, found.outputs.len());
    for (n, output) in found.outputs.iter().enumerate() {
        let fit = |fits: &[Option<f64>]| fits.get(n).copied().flatten().map(|fit| decimals(fit, 3));
        let Some(own) = fit(&found.fit_percent) else { continue };
        let sigma = found.residual_sigma.get(n).copied().flatten();
        let sigma = sigma.map_or_else(dash, |s| format!("{} {}", significant(s, 3), output.unit));
        let mut cells = vec![output.name.clone(), own, sigma, white[n].clone(), independent[n].clone()];
        cells.extend(held_out.map(|fits| fit(fits).unwrap_or_else(dash)));
        table.row(cells);
    }
    let (criterion, scale) = (requested.criterion.norm.name(), requested.criterion.scale.name());
    table.note(format!("Cost {} ({criterion}, scale {scale}).", significant(found.cost, 4)));
    if let Some(note) = M::note(found) {
        table.note(note);
    }
    table
}

/// Returns the table of the feedforward characteristics.
pub(super) fn characteristics_table(found: &Identification) -> Table {
    let mut heads = vec!["characteristic".to_owned(), "unit".to_owned(), "output error".to_owned()];
    heads.extend(found.regressions.iter().map(|r| format!("regression on differences over {}", window(r))));
    let mut table = Table::new("characteristics", "Feedforward characteristics (\u{b1} standard error)", &heads);
    let cell = |c: Option<Characteristic>| c.map_or_else(dash, with_error);
    for (n, (name, unit, by_error)) in Characteristics::named_of(found).into_iter().enumerate() {
        let by_regression =
            found.regressions.iter().map(|r| cell([r.ks, r.kv, r.ka].get(n).map(|c| c.without_error())));
        table.named_row(&name.replace('_', " "), [unit.to_owned(), cell(by_error)].into_iter().chain(by_regression));
    }
    let beside = match found.regressions.is_empty() {
        true => "A regression on differences of the measured speed does not identify them here.",
        false => {
            "The regression uses differences of the measured speed, which attenuate fast dynamics; noise and inductance bias \
             it by many of its standard errors, which are not shown."
        }
    };
    let symbol = if found.input == Input::Current { "i" } else { "v" };
    table.note(format!(
        "{symbol} = kS sgn(\u{3c9}) + kG + kV \u{3c9} + kA d\u{3c9}/dt. The output-error values follow from the parameters. {beside}"
    ));
    table
}

/// Returns the transfer functions of the linear motor and its poles; `None` if a parameter is not identifiable or the current is
/// the input.
pub(super) fn transfer_functions(found: &Identification) -> Option<Vec<(String, String)>> {
    let of = TransferFunctions::of(&found.parameters)?;
    if found.input == Input::Current || !found.unidentified.is_empty() {
        return None;
    }
    let number = |v: f64| significant(v, 5);
    let [first, second] = of.denominator.map(number);
    let denominator = format!("(1 + {first} s + {second} s\u{b2})");
    let poles = match of.poles {
        [[real, imaginary], _] if imaginary > 0.0 => {
            format!("{} \u{b1} {}j rad/s", number(real), number(imaginary)).replace('-', "\u{2212}")
        }
        [[slow, _], [fast, _]] => {
            let times = [slow, fast].map(|pole| engineering(-1.0 / pole, "s", 4));
            let poles = format!("{} and {} rad/s", number(slow), number(fast)).replace('-', "\u{2212}");
            format!("{poles}, time constants {} and {}", times[0], times[1])
        }
    };
    let named = |name: &str, text: String| (name.to_owned(), text);
    Some(vec![
        named("speed / voltage", format!("{} / {denominator} rad/s/V", number(of.speed_gain))),
        named(
            "current / voltage",
            format!("{} (1 + {} s) / {denominator} A/V", number(of.current_gain), number(of.current_zero)),
        ),
        named("poles", poles),
    ])
}

/// Explanation of a table of a selection.
const SELECTION_NOTE: &str = "free: number of free parameters. ΔBIC: Bayesian information criterion at the effective sample size of the residuals, \
     less that of the model selected before. A larger model is selected if it lowers the criterion by more than 6, for the \
     residuals or for their innovations, and the residuals of an output by more than 1 %.";

/// Returns the table of the models that the selection fitted, in their order; `None` if the extensions or terms were given.
#[must_use]
pub fn selection_table<M: Shown>(found: &Identification<M>) -> Option<Table> {
    let selection = found.selection.as_ref()?;
    let mut heads = vec![format!("{}s", M::TERM), "free".to_owned()];
    heads.extend(found.outputs.iter().map(|output| format!("{} [%]", output.name)));
    heads.extend(["ΔBIC".to_owned(), String::new()]);
    let mut table = Table::new("selection", "Model selection", &heads.iter().map(String::as_str).collect::<Vec<_>>());
    for step in selection {
        let fits = step.fit_percent.iter().map(|fit| fit.map_or_else(dash, |fit| decimals(fit, 2)));
        let gain = step.gain.map_or_else(String::new, |gain| significant(gain, 3));
        let taken = if step.taken { "selected" } else { "" };
        let name = if step.with.is_empty() { "none".to_owned() } else { step.with.join(", ") };
        table.row([name, step.free.to_string()].into_iter().chain(fits).chain([gain, taken.to_owned()]));
    }
    let exchanged = format!("If {}s are selected, the last rows exchange one of them for a similar one.", M::TERM);
    table.note(format!("{SELECTION_NOTE} {exchanged}"));
    Some(table)
}

/// Describes the selection in a line: the selected model, and the number of models that were fitted.
#[must_use]
pub fn selection_text<M: Shown>(found: &Identification<M>) -> Option<String> {
    let tried = found.selection.as_ref()?.len();
    Some(format!("{}; {tried} models were compared (listed by -v)", selected(found)))
}

/// Describes the selected model: its extensions or terms, the intersample behaviour of the voltage, and the excluded samples.
pub(super) fn selected<M: Shown>(found: &Identification<M>) -> String {
    let what = if found.with.is_empty() { format!("no {}", M::TERM) } else { found.with.join(", ") };
    let samples: usize = found.left_out.iter().map(|of| of.samples).sum();
    let left_out = match samples {
        0 => String::new(),
        _ => format!("; {samples} samples excluded, where the voltage is undersampled"),
    };
    format!("{what}{}{left_out}", M::hold(found))
}
