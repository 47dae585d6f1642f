//! `simulate`: a motor at rest, driven and recorded.

use super::args::SimulateArgs;
use super::inspect;
use super::prelude::*;
use motorfit::experiment::{Excitation, noise_of, simulated, with_noise};
use motorfit::motor::Discretization;
use motorfit::record::{parse_columns, read_inputs, write_csv};
use motorfit::report::SignalFacts;

pub(super) fn run(args: &SimulateArgs, style: &Style) -> Result<Outcome> {
    let motor = values::motor(&args.parameters)?;
    let band = inspect::band(args.band.settling_band)?;
    let noise = args.noise.as_deref().map(values::noise).transpose()?;
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
        let unit = facts.quantity.unit();
        let settled = response.settling_time_s.map_or_else(
            || "does not settle".to_owned(),
            |t| format!("settled ({} %) from {} s on", args.band.settling_band, significant(t, 5)),
        );
        let [peak, steady] = [response.peak, response.steady_state].map(|value| significant(value, 7));
        let (signal, at) = (facts.quantity, significant(response.peak_time_s, 5));
        style.note(&format!(
            "{signal} without noise: peak {peak} {unit} at {at} s, steady state {steady} {unit}, {settled}"
        ));
    }
    Ok(Outcome::Done)
}

fn excitation(args: &SimulateArgs) -> Result<Excitation> {
    let Some(step) = args.input.strip_prefix("step:") else {
        let columns = parse_columns(args.columns.0.text(Setting::Columns).unwrap_or_default())?;
        let samples = read_inputs(Path::new(&args.input), &columns)?;
        return Ok(Excitation { time_s: samples.time_s, voltage: samples.voltage, torque: samples.torque });
    };
    let Some((volts, at)) = step.split_once('@') else {
        let message = format!("--input: \"{}\" is not step:VOLTS@SECONDS", excerpt(&args.input));
        return Err(Error::usage(message, "Write --input step:10.5@1."));
    };
    let (volts, at) = (values::number(volts, Setting::Input)?, values::number(at, Setting::Input)?);
    if at > args.duration {
        let message = format!("the step at {at} s is after the end at {} s", args.duration);
        return Err(Error::usage(message, "Lengthen --duration or step earlier."));
    }
    Excitation::step(volts, at, args.duration, args.period)
}
