//! Tables of an identification: parameters, fit, feedforward characteristics, model selection.

use super::identified::{window, with_error};
use super::table::{Table, dash};
use motorfit_core::text::{decimals, engineering, significant};
use motorfit_identify::analysis::{Characteristic, Characteristics, TransferFunctions};
use motorfit_identify::{Identification, IdentifySpec, SelectionStep};
use motorfit_motor::{Discretization, Extension, Input, Scope};

/// Returns the table of parameters with their uncertainty.
pub(super) fn parameters_table(found: &Identification) -> Table {
    let heads = ["parameter", "value", "unit", "standard error", "95 % interval", "remark"];
    let mut table = Table::new("parameters", "Parameters", &heads);
    for e in found.estimates() {
        let p = e.parameter;
        let remark = match (e.value, e.at_bound) {
            (None, _) => "not identifiable".to_owned(),
            _ if e.fixed => "fixed".to_owned(),
            (_, Some("max")) => "at its upper bound".to_owned(),
            (_, Some(_)) => "at its lower bound".to_owned(),
            _ => String::new(),
        };
        let of = if let Scope::Recording(n) = e.scope {
            format!(" of recording {}", u64::from(n) + 1)
        } else {
            String::new()
        };
        table.row(vec![
            format!("{}, {}{of}", p.symbol(), p.name()),
            e.value.map_or_else(dash, |value| significant(value, 6)),
            p.unit().to_owned(),
            e.std_error.map_or_else(dash, |error| significant(error, 2)),
            e.ci95.map_or_else(dash, |[low, high]| format!("{} … {}", significant(low, 6), significant(high, 6))),
            remark,
        ]);
    }
    table
}

/// Returns the table of the fit of each channel.
pub(super) fn fit_table(found: &Identification, spec: &IdentifySpec) -> Table {
    let mut table = Table::new("fit", "Fit", &["channel", "fit [%]", "residual σ", "residuals white"]);
    for (channel, (name, unit)) in [("current", "A"), ("speed", "rad/s")].into_iter().enumerate() {
        let white = found.uncertainty.as_ref().and_then(|u| u.whiteness[channel].as_ref());
        let white = white.map_or_else(dash, |w| if w.is_white { "yes" } else { "no" }.to_owned());
        let Some(fit) = found.fit_percent[channel] else { continue };
        let residual = found.residual_sigma[channel].map_or_else(dash, |s| format!("{} {unit}", significant(s, 3)));
        table.named_row(name, [decimals(fit, 3), residual, white]);
    }
    let (criterion, scale) = (spec.criterion.norm.name(), spec.criterion.scale.name());
    table.note(format!("Cost {} ({criterion}, scale {scale}).", significant(found.cost, 4)));
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
pub(super) const SELECTION_NOTE: &str = "free: number of free parameters. ΔBIC: Bayesian information criterion at the effective sample size of the residuals, \
     less that of the model selected before. A larger model is selected if it lowers the criterion by more than 6, for the \
     residuals or for their innovations, and the residuals of a channel by more than 1 %. If extensions are \
     selected, the last rows exchange one of them for a similar one.";

/// Returns the table of the models that the selection fitted, in their order.
#[must_use]
pub fn selection_table(selection: &[SelectionStep]) -> Table {
    let heads = ["extensions", "free", "current [%]", "speed [%]", "ΔBIC", ""];
    let mut table = Table::new("selection", "Model selection", &heads);
    for step in selection {
        let [current, speed] = step.fit_percent.map(|fit| fit.map_or_else(dash, |fit| decimals(fit, 2)));
        let gain = step.gain.map_or_else(String::new, |gain| significant(gain, 3));
        let taken = if step.taken { "selected" } else { "" };
        let extensions = step.with.iter().map(|e| e.name()).collect::<Vec<_>>();
        let name = if extensions.is_empty() { "none".to_owned() } else { extensions.join(", ") };
        table.row([name, step.free.to_string(), current, speed, gain, taken.to_owned()]);
    }
    table.note(SELECTION_NOTE);
    table
}

/// Describes the selection in a line: the selected model, and the number of models that were fitted.
#[must_use]
pub fn selection_text(found: &Identification) -> Option<String> {
    let tried = found.selection.as_ref()?.len();
    Some(format!("{}; {tried} models were compared (listed by -v)", selected(found)))
}

/// Describes the selected model: its extensions, the intersample behaviour of the voltage, and the excluded samples.
pub(super) fn selected(found: &Identification) -> String {
    let taken: Vec<&str> = found.extensions().into_iter().map(Extension::name).collect();
    let what = if taken.is_empty() { "no extension".to_owned() } else { taken.join(", ") };
    let intersample = match found.model.discretization {
        Discretization::Foh => "; first-order hold of the voltage",
        _ => "",
    };
    let samples: usize = found.left_out.iter().map(|of| of.samples).sum();
    let left_out = match samples {
        0 => String::new(),
        _ => format!("; {samples} samples excluded, where the voltage is undersampled"),
    };
    format!("{what}{intersample}{left_out}")
}
