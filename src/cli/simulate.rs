//! The command `simulate`: simulates a motor that starts at rest and writes a recording.

use super::args::SimulateArgs;
use super::inspect;
use super::out::WritePart;
use super::output::is_read;
use super::prelude::*;
use motorfit::criterion::Noise;
use motorfit::experiment::{Excitation, StepExperiment, noise_of, simulated, with_noise};
use motorfit::motor::{Discretization, StepResponse};
use motorfit::record::{Quantity, parse_columns, read_inputs, write_csv};
use motorfit::report::SignalFacts;
use std::ops::ControlFlow;

pub(super) fn run(args: &SimulateArgs, style: &Style) -> Result<Outcome> {
    if let Some(model) = &args.model {
        return super::model::simulate::run(args, model, style);
    }
    let motor = parse::motor(&args.parameters)?;
    let band = inspect::band(args.band.settling_band)?;
    let noise = args.noise.as_deref().map(parse::noise).transpose()?;
    if let Some(step) = &args.input.strip_prefix("step:") {
        let (volts, at) = step_of(args, step)?;
        let step = StepExperiment::new(motor, volts, at, [args.duration, args.period])?;
        if let Some(step) = step.filter(|_| noise != Some(Noise::Estimated)) {
            return streamed(args, &step, (noise, band), style);
        }
    }
    let clean = simulated(motor, &excitation(args)?, Discretization::Zoh)?;
    let sigma = noise.map_or([0.0; 2], |noise| noise_of(&clean, noise));
    let record = with_noise(&clean, sigma, args.seed)?;
    let text = write_csv(&record);
    if args.out == Path::new("-") {
        data(&text)?;
    } else {
        out::write_file(&args.out, &text)?;
        style.note(&format!("wrote {}: {} samples", args.out.display(), record.len()));
    }
    for facts in SignalFacts::of(&clean, band) {
        let Some(response) = facts.response else { continue };
        describe(args, facts.quantity, &response, style);
    }
    Ok(Outcome::Done)
}

/// Simulates a voltage step in segments, with memory independent of its length.
fn streamed(
    args: &SimulateArgs,
    step: &StepExperiment,
    (noise, band): (Option<Noise>, f64),
    style: &Style,
) -> Result<Outcome> {
    let Some(figures) = step.figures(&mut signals::interrupted)? else { return Ok(interrupted(style)) };
    let sigma = noise.and_then(|noise| figures.sigma(noise)).unwrap_or_default();
    let mut fill = |write: &mut WritePart<'_>| {
        let mut part = |text: &str| {
            write(text)?;
            Ok(if is_read() { signals::interrupted() } else { ControlFlow::Break(()) })
        };
        step.write(&figures, (sigma, args.seed), band, &mut part)
    };
    let is_stdout = args.out == Path::new("-");
    let responses = if is_stdout { fill(&mut |text| data(text))? } else { out::write_parts(&args.out, &mut fill)? };
    let Some(responses) = responses else {
        // A reader that closes the pipe early is no error.
        return Ok(if is_read() { interrupted(style) } else { Outcome::Done });
    };
    if !is_stdout {
        style.note(&format!("wrote {}: {} samples", args.out.display(), step.samples()));
    }
    for (quantity, response) in [Quantity::Current, Quantity::Speed].into_iter().zip(&responses) {
        describe(args, quantity, response, style);
    }
    Ok(Outcome::Done)
}

fn interrupted(style: &Style) -> Outcome {
    style.note(signals::NO_RESULT);
    Outcome::Interrupted
}

fn describe(args: &SimulateArgs, quantity: Quantity, response: &StepResponse, style: &Style) {
    let unit = quantity.unit();
    let settled = response.settling_time_s.map_or_else(
        || "does not settle".to_owned(),
        |t| format!("settled ({} %) from {} s on", args.band.settling_band, significant(t, 5)),
    );
    let [peak, steady] = [response.peak, response.steady_state].map(|value| significant(value, 7));
    let at = significant(response.peak_time_s, 5);
    style.note(&format!(
        "{quantity} without noise: peak {peak} {unit} at {at} s, steady state {steady} {unit}, {settled}"
    ));
}

fn excitation(args: &SimulateArgs) -> Result<Excitation> {
    let Some(step) = args.input.strip_prefix("step:") else {
        if args.input.contains('@') && !Path::new(&args.input).exists() {
            return Err(neither(&args.input));
        }
        let columns = parse_columns(args.columns.0.text(Setting::Columns).unwrap_or_default())?;
        let samples = read_inputs(Path::new(&args.input), &columns)?;
        return Ok(Excitation { time_s: samples.time_s, voltage: samples.voltage, torque: samples.torque });
    };
    let (volts, at) = step_of(args, step)?;
    Excitation::step(volts, at, args.duration, args.period)
}

fn neither(input: &str) -> Error {
    let message = format!("--input: \"{}\" is neither step:VOLTS@SECONDS nor a file", excerpt(input));
    Error::usage(message, "Write --input step:10.5@1, or the path of a CSV file with time and voltage.")
}

/// Returns the voltage of a step and its time \[s\].
fn step_of(args: &SimulateArgs, step: &str) -> Result<(f64, f64)> {
    let Some((volts, at)) = step.split_once('@') else { return Err(neither(&args.input)) };
    let (volts, at) = (parse::number(volts, Setting::Input)?, parse::number(at, Setting::Input)?);
    if at > args.duration {
        let message = format!("the step at {at} s is after the end at {} s", args.duration);
        return Err(Error::usage(message, "Lengthen --duration or step earlier."));
    }
    Ok((volts, at))
}
