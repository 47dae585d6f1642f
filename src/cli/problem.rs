//! What `identify` and `evaluate` share: criterion, model, space and device, from their flags.

use super::args::{DeviceArgs, ProblemArgs};
use super::cache;
use super::output::Style;
use motorfit::criterion::{Criterion, Scale};
use motorfit::evaluate::Model;
use motorfit::identify::{DeviceSpec, IdentifySpec, With, values};
use motorfit::motor::Space;
use motorfit::setting::Setting;
use motorfit::{Error, Result};

/// More threads than any machine has cores help nobody.
const THREADS_MAX: usize = 1024;

/// The part of a spec that says what candidates are evaluated on, and by what.
pub(super) fn spec(args: &ProblemArgs, device: &DeviceArgs, style: &Style) -> Result<IdentifySpec> {
    let noise = args.noise.as_deref().map(values::noise).transpose()?.unwrap_or_default();
    let (norm, scale) = (args.criterion, args.scale);
    let chosen = self::device(device, style)?;
    if args.time_origin.is_some_and(|t| !t.is_finite()) {
        return Err(Error::usage("--time-origin is not finite", "Give seconds from the start of the recording."));
    }
    if args.noise.is_some() && scale != Scale::Noise {
        return Err(Error::usage(
            "--noise has no effect without --scale noise",
            "Add --scale noise or leave --noise out.",
        ));
    }
    if args.time_origin.is_some() && !norm.is_time_weighted() {
        let message = "--time-origin has no effect without --criterion itse or itae";
        return Err(Error::usage(message, "Choose one of them or leave --time-origin out."));
    }
    // What is held may be all of the motor where extensions are asked for.
    let space = if args.with.is_empty() { Space::table2_with } else { Space::table2_to_extend };
    Ok(IdentifySpec {
        criterion: Criterion { norm, scale, time_origin_s: args.time_origin, noise },
        model: Model { discretization: args.discretization.unwrap_or_default(), initial: args.initial },
        space: space(&values::bounds(&args.bounds)?, &values::parameters(&args.fix, Setting::Fix)?)?,
        auto_bounds: values::auto_bounds(&args.bounds)?,
        with: With::parse(&args.with)?,
        per_recording: values::named(&args.per_recording, Setting::PerRecording)?,
        ..chosen
    })
}

pub(super) fn check_threads(threads: Option<usize>) -> Result<()> {
    match threads.filter(|threads| !(1..=THREADS_MAX).contains(threads)) {
        None => Ok(()),
        Some(threads) => {
            let remedy = format!("Give 1 to {THREADS_MAX}, or leave it out for all.");
            Err(Error::usage(format!("--threads is {threads}"), remedy))
        }
    }
}

/// The part of a spec that says what evaluates.
pub(super) fn device(args: &DeviceArgs, style: &Style) -> Result<IdentifySpec> {
    check_threads(args.threads)?;
    let device: DeviceSpec = args.device.parse()?;
    Ok(IdentifySpec {
        paces: if device == DeviceSpec::Auto { cache::paces(style) } else { None },
        device,
        precision: args.precision,
        threads: args.threads,
        ..IdentifySpec::default()
    })
}
