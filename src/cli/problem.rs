//! What `identify` and `evaluate` share: criterion, model, space and device, from their flags.

use super::args::{DeviceArgs, ProblemArgs};
use super::cache;
use super::output::Style;
use motorfit::criterion::Scale;
use motorfit::device::DeviceSpec;
use motorfit::identify::IdentifySpec;
use motorfit::setting::Setting;
use motorfit::settings::{self, Given};
use motorfit::{Error, Result};

/// The part of a spec that says what candidates are evaluated on, and by what.
pub(super) fn spec(problem: &ProblemArgs, device: &DeviceArgs, style: &Style) -> Result<IdentifySpec> {
    checked(settings::problem(&problem.0.and(&device.0))?, &problem.0, style)
}

/// A spec with what was measured of this machine, where no flag is without effect.
pub(super) fn checked(spec: IdentifySpec, given: &Given, style: &Style) -> Result<IdentifySpec> {
    if given.has(Setting::Noise) && spec.criterion.scale != Scale::Noise {
        return Err(Error::usage(
            "--noise has no effect without --scale noise",
            "Add --scale noise or leave --noise out.",
        ));
    }
    if given.has(Setting::TimeOrigin) && !spec.criterion.norm.is_time_weighted() {
        let message = "--time-origin has no effect without --criterion itse or itae";
        return Err(Error::usage(message, "Choose one of them or leave --time-origin out."));
    }
    Ok(measured(spec, style))
}

/// The part of a spec that says what evaluates.
pub(super) fn device(args: &DeviceArgs, style: &Style) -> Result<IdentifySpec> {
    Ok(measured(settings::device(&args.0)?, style))
}

fn measured(spec: IdentifySpec, style: &Style) -> IdentifySpec {
    IdentifySpec { paces: if spec.device == DeviceSpec::Auto { cache::paces(style) } else { None }, ..spec }
}
