//! Parsers for structured values of settings: parameters, bounds, noise. `of` is the setting that errors name.

use motorfit_core::setting::{Setting, text};
use motorfit_core::text::excerpt;
use motorfit_core::{Error, Result};
use motorfit_evaluate::criterion::Noise;
use motorfit_motor::{Extended, Parameter, Parameters};

/// Splits `KEY=VALUE` into key and value, without surrounding spaces.
///
/// # Errors
/// Returns a usage error with the `example` if there is no `=`.
pub fn pair<'a>(item: &'a str, of: Setting, example: &str) -> Result<(&'a str, &'a str)> {
    item.split_once('=').map(|(key, value)| (key.trim(), value.trim())).ok_or_else(|| {
        let message = text!({ of }(": \"{}\" is not KEY=VALUE", excerpt(item)));
        Error::usage(message, text!("Write " {of.to(example)} "."))
    })
}

/// Parses a finite number.
///
/// # Errors
/// Returns a usage error if the text is not a finite number.
pub fn number(text: &str, of: Setting) -> Result<f64> {
    motorfit_record::parse_number(text, false)
        .map_err(|found| Error::usage(text!({of} ": {found}"), "Use a decimal point and SI units."))
}

/// Parses values of parameters, `R=0.92`, `L=…`, each parameter at most once.
///
/// # Errors
/// Returns a usage error for an unknown or repeated parameter, and for a value outside the parameter's domain.
pub fn parameters(items: &[String], of: Setting) -> Result<Vec<(Parameter, f64)>> {
    let mut list: Vec<(Parameter, f64)> = Vec::new();
    for item in items.iter().filter(|item| !item.trim().is_empty()) {
        let (symbol, value) = pair(item, of, "R=0.92,L=0.0078")?;
        let parameter: Parameter = symbol.parse()?;
        let value = number(value, of)?;
        if !parameter.admits(value) {
            let message = text!({ of }(": {symbol} is {value}, expected a {} value", parameter.domain()));
            return Err(Error::usage(message, format!("Give it in {}.", parameter.unit())));
        }
        if list.iter().any(|(p, _)| *p == parameter) {
            return Err(Error::usage(text!({of} " gives {symbol} twice"), "Give each parameter once."));
        }
        list.push((parameter, value));
    }
    Ok(list)
}

/// Parses a motor: all five parameters or `m2`, optionally followed by parameters that replace those of `m2` or extend it.
///
/// # Errors
/// Returns a usage error if one of the five is missing, and propagates the errors of [`parameters`].
pub fn motor(text: &str) -> Result<Extended> {
    let is_m2 = |item: &str| item.trim().eq_ignore_ascii_case("m2");
    let named: Vec<String> = text.split(',').filter(|item| !is_m2(item)).map(str::to_owned).collect();
    let list = parameters(&named, Setting::Parameters)?;
    let is_given = |parameter: &Parameter| list.iter().any(|(given, _)| given == parameter);
    if let Some(lacking) = Parameter::ALL.into_iter().find(|p| !text.split(',').any(is_m2) && !is_given(p)) {
        let message = text!([Parameters](" lacks {}, the {}", lacking.symbol(), lacking.name()));
        let remedy =
            "Give m2, the motor of the paper, or all five: R=0.921042,L=0.007759,K=0.073472,B=0.000678,J=0.000136.";
        return Err(Error::usage(message, remedy));
    }
    Ok(list.iter().fold(Extended::from(&Parameters::M2), |motor, (parameter, value)| motor.with(*parameter, *value)))
}

/// Returns the parameters whose bounds follow the estimate: those without given bounds, or none if `table2` is among the items.
///
/// # Errors
/// Returns a usage error if bounds cannot be parsed, see [`bounds`].
pub fn auto_bounds(items: &[String]) -> Result<Vec<Parameter>> {
    if items.iter().any(|item| item.trim() == "table2") {
        return Ok(Vec::new());
    }
    let given = bounds(items)?;
    Ok(Parameter::ALL.into_iter().filter(|p| !given.iter().any(|(of, _, _)| of == p)).collect())
}

/// Parses bounds, `table2`, `auto` or `R=0.1:1`, …, and returns those that differ from Table 2 as (parameter, min, max).
///
/// # Errors
/// Returns a usage error if an item is neither a name nor `PARAMETER=MIN:MAX`, or repeats a parameter.
pub fn bounds(items: &[String]) -> Result<Vec<(Parameter, f64, f64)>> {
    let own = |item: &&String| !matches!(item.trim(), "auto" | "table2");
    ranges(&items.iter().filter(own).cloned().collect::<Vec<_>>(), Setting::Bounds)
}

/// Parses ranges of parameters, `R=0.1:1`, …, as (parameter, min, max).
///
/// # Errors
/// Returns a usage error if an item is not `PARAMETER=MIN:MAX`, or repeats a parameter.
pub fn ranges(items: &[String], of: Setting) -> Result<Vec<(Parameter, f64, f64)>> {
    let list = named_ranges(items, of)?;
    let of_motor = |(symbol, min, max): &(String, f64, f64)| Ok((symbol.parse()?, *min, *max));
    list.iter().map(of_motor).collect()
}

/// Parses ranges of parameters of any machine, `R=0.1:1`, …, as (symbol, min, max).
///
/// # Errors
/// Returns a usage error if an item is not `PARAMETER=MIN:MAX`, or repeats a parameter.
pub fn named_ranges(items: &[String], of: Setting) -> Result<Vec<(String, f64, f64)>> {
    let mut list: Vec<(String, f64, f64)> = Vec::new();
    for item in items.iter().map(|item| item.trim()).filter(|item| !item.is_empty()) {
        let example = if of == Setting::Bounds { "table2, auto or R=0.1:1,L=0.001:0.1" } else { "R=0.1:1,L=0.001:0.1" };
        let (symbol, range) = pair(item, of, example)?;
        let Some((min, max)) = range.split_once(':') else {
            let message = text!({ of }(": \"{}\" is not MIN:MAX", excerpt(range)));
            return Err(Error::usage(message, text!("Write " {of.to("R=0.1:1,L=0.001:0.1")} ".")));
        };
        if list.iter().any(|(own, _, _)| own == symbol) {
            return Err(Error::usage(text!({of} " gives {symbol} twice"), "Give each parameter once."));
        }
        list.push((symbol.to_owned(), number(min, of)?, number(max, of)?));
    }
    Ok(list)
}

/// Parses parameters by their symbols, `TL`, `K`, ….
///
/// # Errors
/// Returns a usage error for an unknown symbol.
pub fn named(items: &[String], of: Setting) -> Result<Vec<Parameter>> {
    let names = items.iter().map(|item| item.trim()).filter(|item| !item.is_empty());
    names.map(|name| name.parse().map_err(|e: Error| Error::usage(text!({of} ": " {e.text()}), e.hint()))).collect()
}

/// Parses noise: a signal-to-noise ratio, `40dB`, or standard deviations in A and rad/s, `i=0.05,w=0.5`.
///
/// # Errors
/// Returns a usage error if the text has neither form, or a standard deviation is negative.
pub fn noise(text: &str) -> Result<Noise> {
    let hint = || text!("Write " [Noise = "40dB"] ", or " [Noise = "i=0.05,w=0.5"] " in A and rad/s.");
    let bad = |what: String| Error::usage(text!([Noise] ": {what}"), hint());
    let lower = text.trim().to_lowercase();
    if let Some(decibels) = lower.strip_suffix("db") {
        return number(decibels.trim(), Setting::Noise).map(Noise::Decibels);
    }
    let mut sigma = [None; 2];
    for item in lower.split(',') {
        let (key, value) = pair(item, Setting::Noise, "40dB or i=0.05,w=0.5")?;
        let channel = match key {
            "i" => 0,
            "w" => 1,
            _ => return Err(bad(format!("\"{}\" is neither i nor w", excerpt(key)))),
        };
        let value = number(value, Setting::Noise)?;
        if value < 0.0 {
            return Err(bad(format!("{key} is negative")));
        }
        sigma[channel] = Some(value);
    }
    Ok(Noise::Sigma(sigma))
}
