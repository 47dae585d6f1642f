//! Values of settings that are small languages of their own: parameters, bounds, noise. `of` is the setting that errors name.

use crate::criterion::Noise;
use crate::motor::{Extended, Parameter, Parameters};
use crate::setting::{Setting, text};
use crate::text::excerpt;
use crate::{Error, Result};

/// `KEY=VALUE` in its two parts.
///
/// # Errors
/// `Usage` when it is not.
pub fn pair<'a>(item: &'a str, of: Setting, example: &str) -> Result<(&'a str, &'a str)> {
    item.split_once('=').map(|(key, value)| (key.trim(), value.trim())).ok_or_else(|| {
        let message = text!({ of }(": \"{}\" is not KEY=VALUE", excerpt(item)));
        Error::usage(message, text!("Write " {of.to(example)} "."))
    })
}

/// A finite number.
///
/// # Errors
/// `Usage` when it is not.
pub fn number(text: &str, of: Setting) -> Result<f64> {
    crate::record::parse_number(text, false)
        .map_err(|found| Error::usage(text!({of} ": {found}"), "Use a decimal point and SI units."))
}

/// `R=0.92,L=…`, positive values, each parameter at most once.
///
/// # Errors
/// `Usage` when it is not.
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

/// All five parameters of a motor, or `m2`; with it parameters of extensions.
///
/// # Errors
/// `Usage` when it is not.
pub fn motor(text: &str) -> Result<Extended> {
    let is_m2 = |item: &str| item.trim().eq_ignore_ascii_case("m2");
    let named: Vec<String> = text.split(',').filter(|item| !is_m2(item)).map(str::to_owned).collect();
    let list = parameters(&named, Setting::Parameters)?;
    let is_given = |parameter: &Parameter| list.iter().any(|(given, _)| given == parameter);
    if let Some(lacking) = Parameter::ALL.into_iter().find(|p| !text.split(',').any(is_m2) && !is_given(p)) {
        let message = text!([Parameters](" lacks {}, the {}", lacking.symbol(), lacking.name()));
        let remedy = "Give all five: R=0.921042,L=0.007759,K=0.073472,B=0.000678,J=0.000136.";
        return Err(Error::usage(message, remedy));
    }
    Ok(list.iter().fold(Extended::from(&Parameters::M2), |motor, (parameter, value)| motor.with(*parameter, *value)))
}

/// The parameters without bounds of their own that follow the estimate: all such, or none under `table2`.
///
/// # Errors
/// `Usage` when it is not.
pub fn auto_bounds(items: &[String]) -> Result<Vec<Parameter>> {
    if items.iter().any(|item| item.trim() == "table2") {
        return Ok(Vec::new());
    }
    let given = bounds(items)?;
    Ok(Parameter::ALL.into_iter().filter(|p| !given.iter().any(|(of, _, _)| of == p)).collect())
}

/// `table2`, `auto`, `R=0.1:1`, …: the bounds that differ from Table 2.
///
/// # Errors
/// `Usage` when it is not.
pub fn bounds(items: &[String]) -> Result<Vec<(Parameter, f64, f64)>> {
    let own = |item: &&String| !matches!(item.trim(), "auto" | "table2");
    ranges(&items.iter().filter(own).cloned().collect::<Vec<_>>(), Setting::Bounds)
}

/// `R=0.1:1`, …: ranges of parameters.
///
/// # Errors
/// `Usage` when it is not.
pub fn ranges(items: &[String], of: Setting) -> Result<Vec<(Parameter, f64, f64)>> {
    let mut list = Vec::new();
    for item in items.iter().map(|item| item.trim()).filter(|item| !item.is_empty()) {
        let example = if of == Setting::Bounds { "table2, auto or R=0.1:1,L=0.001:0.1" } else { "R=0.1:1,L=0.001:0.1" };
        let (symbol, range) = pair(item, of, example)?;
        let parameter: Parameter = symbol.parse()?;
        let Some((min, max)) = range.split_once(':') else {
            let message = text!({ of }(": \"{}\" is not MIN:MAX", excerpt(range)));
            return Err(Error::usage(message, text!("Write " {of.to("R=0.1:1,L=0.001:0.1")} ".")));
        };
        if list.iter().any(|(p, _, _)| *p == parameter) {
            return Err(Error::usage(text!({of} " gives {symbol} twice"), "Give each parameter once."));
        }
        list.push((parameter, number(min, of)?, number(max, of)?));
    }
    Ok(list)
}

/// `TL,K`, …: parameters by their symbols.
///
/// # Errors
/// `Usage` when it is not.
pub fn named(items: &[String], of: Setting) -> Result<Vec<Parameter>> {
    let names = items.iter().map(|item| item.trim()).filter(|item| !item.is_empty());
    names.map(|name| name.parse().map_err(|e: Error| Error::usage(text!({of} ": " {e.text()}), e.hint()))).collect()
}

/// `40dB`, or `i=0.05,w=0.5`.
///
/// # Errors
/// `Usage` when it is not.
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
