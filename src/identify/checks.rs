//! What the recordings cannot give: said before the fit where the recordings show it, after it where only the fit does.

use super::search::setup;
use super::spec::IdentifySpec;
use super::warnings::Warning;
use super::{Method, Polish, not_identified, warnings};
use crate::estimate::{Refined, describe};
use crate::evaluate::Problem;
use crate::motor::Space;
use crate::record::Record;
use crate::{Error, Result};

/// Whether the spec, the recordings and the criterion leave anything to be found at all.
pub(super) fn before(records: &[Record], spec: &IdentifySpec, problem: &Problem) -> Result<()> {
    if spec.method == Method::SteiglitzMcBride && !spec.space.fixed().is_empty() {
        return Err(Error::usage(
            "Steiglitz–McBride estimates all five parameters and cannot hold any",
            "Leave --fix out, or use --method auto.",
        ));
    }
    setup(spec, problem.space()).check()?;
    let values: usize =
        records.iter().zip(problem.signals()).map(|(r, s)| s.active() * r.measured().iter().flatten().count()).sum();
    let free = problem.space().free().len();
    if values == 0 || !problem.signals().iter().any(|s| s.is_driven()) {
        return Err(not_identified(
            "nothing drives the motor: voltage and load torque are zero throughout and it starts at rest",
            "Record while the voltage changes.",
        ));
    }
    if values <= free {
        return Err(not_identified(
            format!("{values} measured values under voltage for {free} free parameters"),
            "Record longer or faster, or hold parameters with --fix.",
        ));
    }
    if !problem.has_weight() {
        return Err(not_identified(
            "no sample counts: --time-origin is at or after the end of the recording",
            "Give --time-origin in seconds from the start of the recording.",
        ));
    }
    if spec.polish == Polish::LevenbergMarquardt
        && let Some((what, remedy)) = warnings::missing_channel(records, spec)
    {
        return Err(not_identified(what, remedy));
    }
    Ok(())
}

/// Whether the fit leaves anything that was asked for unknown.
pub(super) fn after(
    records: &[Record],
    spec: &IdentifySpec,
    space: &Space,
    refined: &Refined,
    warnings: &mut Vec<Warning>,
) -> Result<()> {
    let polished = spec.polish == Polish::LevenbergMarquardt;
    let unknown: Vec<String> = refined.uncertainty.unknown.iter().map(|d| describe(d, space.free())).collect();
    if let Some(first) = unknown.first() {
        let what = format!("the recordings cannot tell {first}");
        let remedy = "record a changing voltage from rest, with current and speed, or hold one of them with --fix";
        if polished {
            reversed_sign(records)?;
        }
        if polished {
            return Err(not_identified(what, format!("{}.", remedy.replacen('r', "R", 1))));
        }
        warnings.push(Warning { code: "not_identifiable", message: format!("{what}; {remedy}") });
    }
    Ok(())
}

/// A channel whose sign is reversed, where nothing fits for it.
pub(super) fn reversed_sign(records: &[Record]) -> Result<()> {
    match warnings::sign_reversed(records) {
        Some(warning) => Err(not_identified(warning.message, "Correct the sign and run again.")),
        None => Ok(()),
    }
}
