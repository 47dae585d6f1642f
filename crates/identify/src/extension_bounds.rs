//! Bounds of the parameters of extensions, scaled by the recorded signals and an initial estimate of the motor.

use super::normalized::is_measured;
use super::spec::IdentifySpec;
use motorfit_core::Result;
use motorfit_core::numeric::{count, peak};
use motorfit_motor::{Axis, DefaultBounds, Extension, Parameter, Scope, Space};
use motorfit_record::{Record, is_driven_by_current};

/// Returns the parameters of an extension, without those of sensors of channels that were not measured.
fn shown(extension: Extension, records: &[Record]) -> impl Iterator<Item = Parameter> {
    let measured = [0, 1].map(|channel| is_measured(records, channel));
    extension.parameters().iter().copied().filter(move |p| p.channel().is_none_or(|channel| measured[channel]))
}

/// Returns `space` with the parameters of `extensions` that it lacks. Their bounds follow from the recordings and `motor`, an
/// initial estimate of R, L, K, B and J. The start latency has one value per recording.
///
/// # Errors
/// Returns `Usage` if a lower bound exceeds the upper one.
pub(super) fn extended_space(
    records: &[Record],
    spec: &IdentifySpec,
    space: &Space,
    (extensions, motor): (&[Extension], &[f64; 5]),
) -> Result<Space> {
    let mut free = space.free().to_vec();
    let has = |p: Parameter| {
        space.free().iter().any(|axis| axis.parameter == p) || space.fixed().iter().any(|(of, _, _)| *of == p)
    };
    for parameter in extensions.iter().flat_map(|extension| shown(*extension, records)).filter(|p| !has(*p)) {
        let (min, max) = bounds(parameter, records, motor);
        free.push(Axis { parameter, scope: Scope::Shared, min, max });
    }
    let space = Space::new(free, space.fixed().to_vec())?;
    let mut own = spec.per_recording.clone();
    own.push(Parameter::Latency);
    if records.len() > 1 { space.per_recording(&own, records.len()) } else { Ok(space) }
}

/// Returns the bounds of an extension's parameter, wide enough for all values that the recordings can show.
fn bounds(parameter: Parameter, records: &[Record], &[r, _, k, b, j]: &[f64; 5]) -> (f64, f64) {
    let largest = |of: &dyn Fn(&Record) -> f64| records.iter().map(of).fold(0.0, f64::max);
    let input = || largest(&|record| peak(record.input())).max(f64::MIN_POSITIVE);
    let by_current = is_driven_by_current(records);
    match parameter.default_bounds() {
        DefaultBounds::Fixed(min, max) => (min, max),
        DefaultBounds::OfTorque(min, max) => {
            let stall_torque = if by_current { k * input() } else { k * input() / r };
            (min * stall_torque, max * stall_torque)
        }
        DefaultBounds::OfInput(min, max) => (min * input(), max * input()),
        DefaultBounds::Late(early, periods, constants) => {
            let (period_s, duration_s) = (largest(&Record::period_s), largest(&Record::duration_s));
            let time_constant_s = if by_current { j / b } else { r * j / (k * k + r * b) };
            let longest = (periods * period_s).max(constants * time_constant_s);
            (early * period_s, longest.min(0.25 * duration_s).max(period_s))
        }
        DefaultBounds::Samples => {
            let shortest = records.iter().map(Record::len).min().unwrap_or(1);
            (1.0, (0.25 * count(shortest)).clamp(2.0, 300.0))
        }
    }
}
