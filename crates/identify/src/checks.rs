//! Checks of identifiability: before the fit on the recordings and the spec, after it on the information matrix.

use super::method::Method;
use super::missing_channel::missing_channel;
use super::repeated::check_repeated;
use super::spec::IdentifySpec;
use crate::analysis::is_poor;
use motorfit_core::setting::text;
use motorfit_core::text::engineering;
use motorfit_core::{Error, Result};
use motorfit_estimate::{Refined, describe_direction};
use motorfit_evaluate::Problem;
use motorfit_motor::{Axis, Parameter, Space};
use motorfit_record::warning::Warning;
use motorfit_record::{Record, diagnose, driver};

/// Checks before the fit that the spec is consistent and that the recordings carry information on the free parameters.
///
/// # Errors
/// Returns `Usage` for an invalid spec, `Data` for a recording that is given twice, and `NotIdentified` if nothing drives the
/// motor, there are no more measured values than free parameters, no sample has weight, or a required channel is missing.
pub(super) fn before(records: &[Record], spec: &IdentifySpec, problem: &Problem) -> Result<()> {
    if spec.method == Method::SteiglitzMcBride && !spec.space.fixed().is_empty() {
        let message = "Steiglitz–McBride estimates all five parameters and cannot fix any of them";
        return Err(Error::usage(message, text!("Leave " [Fix] " out, or use " [Method = "auto"] ".")));
    }
    spec.search(problem.space()).check()?;
    check_repeated(records)?;
    check_dead_time(records, problem.space())?;
    let values: usize = records
        .iter()
        .zip(problem.signals())
        .map(|(r, s)| (s.len() - problem.first_active(s)) * r.measured().iter().flatten().count())
        .sum();
    let free = problem.space().free().len();
    if values == 0 || !problem.signals().iter().any(|s| s.is_driven()) {
        let input = driver(records);
        let message =
            format!("nothing drives the motor: {input} and load torque are zero throughout and it starts at rest");
        return Err(Error::not_identified(message, format!("Record while the {input} changes.")));
    }
    if values <= free {
        let message = format!("only {values} measured values under {} for {free} free parameters", driver(records));
        let hint = text!("Record longer or faster, or fix parameters with " [Fix] ".");
        return Err(Error::not_identified(message, hint));
    }
    if !problem.has_weight() {
        let message = text!("no sample has weight: " [TimeOrigin] " is at or after the end of the recording");
        let hint = text!("Give " [TimeOrigin] " in seconds from the start of the recording.");
        return Err(Error::not_identified(message, hint));
    }
    if spec.is_polished()
        && let Some((what, remedy)) = missing_channel(records, spec)
    {
        return Err(Error::not_identified(what, text!({remedy} ".")));
    }
    Ok(())
}

/// Checks that the dead time is at least minus one sampling period, the most by which a logger can record a voltage late.
fn check_dead_time(records: &[Record], space: &Space) -> Result<()> {
    let longest = records.iter().map(Record::period_s).fold(0.0, f64::max);
    let free = space.free().iter().map(|axis| (axis.parameter, axis.min));
    let fixed = space.fixed().iter().map(|(parameter, _, value)| (*parameter, *value));
    let is_earlier =
        |(parameter, value): &(Parameter, f64)| *parameter == Parameter::DeadTime && *value < -longest * (1.0 + 1e-9);
    let Some((_, value)) = free.chain(fixed).find(is_earlier) else { return Ok(()) };
    let message = format!("td is {value} s, less than minus one sampling period of {}", engineering(longest, "s", 4));
    Err(Error::usage(message, format!("Give a value of {} s or more.", -longest)))
}

/// Checks after the fit that every free parameter is identifiable; without a refinement a warning replaces the error. `open` are the
/// parameters that a missing channel would identify: of these the inductance is not asked for.
///
/// # Errors
/// Returns `NotIdentified` if a refined fit leaves a free parameter unidentified.
pub(super) fn after(
    records: &[Record],
    spec: &IdentifySpec,
    space: &Space,
    refined: &Refined,
    open: &[Parameter],
) -> Result<Option<Warning>> {
    if open.contains(&Parameter::L) && is_inductance(spec, space, refined) {
        return Ok(None);
    }
    let Some(what) = unknown(spec, space, refined) else { return Ok(None) };
    let constant = |r: &Record| r.input().windows(2).all(|v| v[0].to_bits() == v[1].to_bits());
    let input = driver(records);
    let (first, capital, what_else) = if records.iter().all(constant) {
        ("the", "The", format!(" {input} is constant: record it changing, or a step from rest"))
    } else {
        ("record", "Record", format!(" faster or longer, under a {input} that changes more"))
    };
    let rest = text!("{what_else}, or fix parameters with "[Fix]);
    if spec.is_polished() {
        reversed_sign(records)?;
        return Err(Error::not_identified(what, text!("{capital}" {rest} ".")));
    }
    Ok(Some(Warning::new("not_identifiable", text!("{what}; {first}" {rest}))))
}

/// Returns true if the inductance alone is not identified.
fn is_inductance(spec: &IdentifySpec, space: &Space, refined: &Refined) -> bool {
    let directions = &refined.uncertainty.unidentifiable;
    let is_own = |direction: &Vec<f64>| {
        let axes = space.free().iter().zip(direction).filter(|(_, part)| part.abs() > 0.1);
        axes.into_iter().all(|(axis, _)| axis.parameter == Parameter::L)
    };
    match directions.is_empty() {
        true => running(spec, space, refined).is_some_and(|(parameter, _)| parameter == Parameter::L),
        false => directions.iter().all(is_own),
    }
}

/// Returns the first motor parameter that ends at an automatic bound, and the side of that bound.
pub(super) fn running(spec: &IdentifySpec, space: &Space, refined: &Refined) -> Option<(Parameter, &'static str)> {
    let runs = |(axis, side): (&Axis, &Option<&'static str>)| {
        let side = side.filter(|_| spec.auto_bounds.contains(&axis.parameter))?;
        (!axis.parameter.is_extension()).then_some((axis.parameter, side))
    };
    space.free().iter().zip(&refined.at_bound).find_map(runs)
}

/// Describes what is not identifiable: directions without information, or a parameter that ends at an automatic bound.
fn unknown(spec: &IdentifySpec, space: &Space, refined: &Refined) -> Option<String> {
    let axes = space.free();
    let directions = &refined.uncertainty.unidentifiable;
    if let [direction] = &directions[..] {
        return Some(format!("the recordings do not identify {}", describe_direction(direction, axes)));
    }
    if !directions.is_empty() {
        let part = |n: usize| directions.iter().any(|direction| direction[n].abs() > 0.1);
        let symbols: Vec<&str> = (0..axes.len()).filter(|n| part(*n)).map(|n| axes[n].parameter.symbol()).collect();
        let (rank, count, unknown) = (refined.uncertainty.rank, axes.len(), symbols.join(", "));
        let combinations = if rank == 1 { "combination" } else { "combinations" };
        return Some(format!(
            "the recordings identify {rank} {combinations} of the {count} free parameters; not identifiable: {unknown}"
        ));
    }
    let (parameter, side) = running(spec, space, refined)?;
    let where_to = if side == "min" { "zero" } else { "ever larger values" };
    Some(format!("the recordings do not identify {}: the best fit takes it to {where_to}", parameter.symbol()))
}

/// Checks that a refined model fits at least one channel better than its mean.
///
/// # Errors
/// Returns `NotIdentified` if it does not, or if the fit is poor and a channel has a reversed sign.
pub(super) fn fit(records: &[Record], spec: &IdentifySpec, fit_percent: &[Option<f64>]) -> Result<()> {
    if !spec.is_polished() {
        return Ok(());
    }
    if is_poor(fit_percent) {
        reversed_sign(records)?;
    }
    if fit_percent.iter().flatten().all(|percent| *percent <= 0.0) {
        let message = "the model does not fit the recordings: no channel is fitted better than by its mean";
        return Err(Error::not_identified(message, "Check columns, units and signs."));
    }
    Ok(())
}

/// Returns an error if the diagnosis of the recordings finds a channel with a reversed sign.
fn reversed_sign(records: &[Record]) -> Result<()> {
    let mut found = records.iter().flat_map(diagnose);
    match found.find(|finding| finding.code == "sign_reversed") {
        Some(finding) => Err(Error::not_identified(finding.message, finding.remedy)),
        None => Ok(()),
    }
}
