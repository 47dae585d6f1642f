//! What an identification has beside its parameters: feedforward characteristics, tests of the residuals, repeatability.

use crate::estimate::Uncertainty;
use crate::identify::{
    Characteristic, Characteristics, Identification, InputTest, Regression, Repeatability, ResidualTest, ResidualTests,
};
use crate::motor::Input;
use crate::text::{engineering, significant};
use serde_json::{Map, Value, json as value};

/// The part `characteristics` of the document.
pub(super) fn characteristics(found: &Identification) -> Value {
    let of = |c: Characteristic, unit: &str| value!({"value": c.value, "unit": unit, "std_error": c.std_error});
    let named = Characteristics::named_of(found);
    let by_error = named.map(|(name, unit, c)| (name.to_owned(), c.map_or(Value::Null, |c| of(c, unit))));
    let by_regression = |r: &Regression| {
        value!({
            "window_s": r.window_s, "window_samples": r.window_samples, "samples": r.samples,
            "kS": of(r.ks, named[0].1), "kV": of(r.kv, named[1].1), "kA": of(r.ka, named[2].1),
        })
    };
    value!({
        "output_error": by_error.into_iter().collect::<Map<String, Value>>(),
        "regression": found.regressions.iter().map(by_regression).collect::<Value>(),
    })
}

/// The characteristics in lines, and one for the widest difference of a regression.
#[must_use]
pub fn characteristics_lines(found: &Identification) -> Vec<(&'static str, String)> {
    let of = |list: &[(&str, &str, Option<Characteristic>)]| {
        let one = |(name, unit, c): &(&str, &str, Option<Characteristic>)| {
            c.map(|c| format!("{} {} {unit}", name.replace('_', " "), with_error(c)))
        };
        list.iter().filter_map(one).collect::<Vec<_>>().join(", ")
    };
    let named = Characteristics::named_of(found);
    let mut lines = match Characteristics::of(found) {
        Some(_) => vec![(name_of(found.input), of(&named[..4])), ("", of(&named[4..]))],
        None => Vec::new(),
    };
    if let Some(r) = found.regressions.last() {
        let values = [("kS", named[0].1, Some(r.ks)), ("kV", named[1].1, Some(r.kv)), ("kA", named[2].1, Some(r.ka))];
        lines.push(("", format!("{} by regression over {}", of(&values), window(r))));
    }
    lines
}

/// What drives the motor, in a word.
pub(super) fn name_of(input: Input) -> &'static str {
    match input {
        Input::Voltage => "voltage",
        Input::Current => "current",
    }
}

pub(super) fn window(regression: &Regression) -> String {
    format!("{}, {} samples", engineering(regression.window_s, "s", 3), regression.window_samples)
}

/// A value to five digits, with its standard error where it has one.
pub(super) fn with_error(c: Characteristic) -> String {
    let error = c.std_error.map_or(String::new(), |e| format!(" \u{b1} {}", significant(e, 2)));
    format!("{}{error}", significant(c.value, 5))
}

/// The part `residuals` of the document: the worst of each channel, then all.
pub(super) fn residuals(found: &Identification, uncertainty: &Uncertainty) -> Value {
    let one = |channel: usize| {
        let white = uncertainty.whiteness[channel].as_ref();
        let voltage = worst(&found.residual_tests, channel).map(|test| voltage(&test));
        white.map(|w| value!({"white": w.is_white, "ljung_box": w.statistic, "lag1": w.lag1, "voltage": voltage}))
    };
    let records: Value = found.residual_tests.iter().map(tests).collect();
    value!({"current": one(0), "speed": one(1), "records": records})
}

/// The test against the voltage that is farthest above its threshold.
fn worst(tests: &[ResidualTests], channel: usize) -> Option<InputTest> {
    let part = |test: &InputTest| test.statistic / test.threshold;
    let all = tests.iter().filter_map(|tests| tests[channel]?.voltage);
    all.max_by(|a, b| part(a).total_cmp(&part(b)))
}

/// The tests of one recording.
pub(super) fn tests(tests: &ResidualTests) -> Value {
    let one = |test: &ResidualTest| {
        let ResidualTest { whiteness: w, voltage: v } = test;
        value!({"white": w.is_white, "ljung_box": w.statistic, "lag1": w.lag1, "voltage": v.as_ref().map(voltage)})
    };
    value!({"current": tests[0].as_ref().map(one), "speed": tests[1].as_ref().map(one)})
}

fn voltage(test: &InputTest) -> Value {
    value!({
        "independent": test.is_independent, "statistic": test.statistic, "threshold": test.threshold,
        "explained_percent": test.explained_percent,
    })
}

/// Whether residuals are white and independent of the voltage, over recordings: both channels, where they are tested.
#[must_use]
pub fn verdicts(tests: &[ResidualTests]) -> [String; 2] {
    let of = |verdict: &dyn Fn(&ResidualTest) -> Option<bool>| {
        let channel = |channel: usize| {
            let told: Vec<bool> = tests.iter().filter_map(|t| verdict(t[channel].as_ref()?)).collect();
            match (told.iter().filter(|good| !**good).count(), told.len()) {
                (_, 0) => "\u{2013}".to_owned(),
                (0, _) => "yes".to_owned(),
                (_, 1) => "no".to_owned(),
                (bad, all) => format!("no in {bad} of {all}"),
            }
        };
        format!("{}, {}", channel(0), channel(1))
    };
    [of(&|test| Some(test.whiteness.is_white)), of(&|test| test.voltage.map(|v| v.is_independent))]
}

/// The part `repeatability` of the document; recordings are numbered from 0, those held out after those fitted.
pub(super) fn repeatability(found: &Repeatability) -> Value {
    let pair = |[current, speed]: [Option<f64>; 2]| value!({"current": current, "speed": speed});
    let groups = found.groups.iter().zip(&found.samples);
    value!({
        "ceiling_percent": pair(found.ceiling_percent),
        "sigma": pair(found.sigma),
        "groups": groups.map(|(records, samples)| value!({"records": records, "samples": samples})).collect::<Value>(),
    })
}

/// The repeatability in words.
#[must_use]
pub fn repeatability_text(found: &Repeatability) -> String {
    let channels = ["current", "speed"].into_iter().zip(found.ceiling_percent);
    let to: Vec<String> = channels.filter_map(|(name, p)| Some(format!("{name} {:.2} %", p?))).collect();
    let count: usize = found.groups.iter().map(Vec::len).sum();
    format!("{count} recordings with the same input repeat to {}: no model is expected to fit better", to.join(", "))
}
