//! `simulate`: a motor at rest, driven and recorded.

use super::args::SimulateArgs;
use super::output::{Style, data};
use super::{Outcome, inspect, values};
use motorfit::criterion::Noise;
use motorfit::experiment::{Excitation, noise_of, simulated, with_noise};
use motorfit::motor::Discretization;
use motorfit::record::{parse_columns, read_inputs, write_csv};
use motorfit::report::SignalFacts;
use motorfit::text::{excerpt, significant};
use motorfit::{Error, Result};
use std::io::Write as _;
use std::path::Path;

pub(super) fn run(args: &SimulateArgs, style: &Style) -> Result<Outcome> {
    let parameters = values::motor(&args.parameters)?;
    let band = inspect::band(args.band.settling_band)?;
    let noise = args.noise.as_deref().map(values::noise).transpose()?;
    let clean = simulated(&parameters, &excitation(args)?, Discretization::Zoh)?;
    let sigma = match noise {
        None => [0.0; 2],
        // What is not given is not there.
        Some(Noise::Sigma(sigma)) => sigma.map(|s| s.unwrap_or(0.0)),
        Some(noise) => noise_of(&clean, noise),
    };
    let record = with_noise(&clean, sigma, args.seed)?;
    let text = write_csv(&record);
    if args.out == Path::new("-") {
        data(&text)?;
    } else {
        write(&args.out, &text)?;
        style.note(&format!("wrote {}: {} samples", args.out.display(), record.len()));
    }
    for facts in SignalFacts::of(&clean, band) {
        let Some(response) = facts.response else { continue };
        let unit = facts.quantity.unit();
        let settled = response.settling_time_s.map_or_else(
            || "does not settle".to_owned(),
            |t| format!("settled ({} %) from {} s on", args.band.settling_band, significant(t, 5)),
        );
        style.note(&format!(
            "{} without noise: peak {} {unit} at {} s, steady state {} {unit}, {settled}",
            facts.quantity,
            significant(response.peak, 7),
            significant(response.peak_time_s, 5),
            significant(response.steady_state, 7),
        ));
    }
    Ok(Outcome::Done)
}

fn excitation(args: &SimulateArgs) -> Result<Excitation> {
    let Some(step) = args.input.strip_prefix("step:") else {
        let columns = parse_columns(args.columns.columns.as_deref().unwrap_or_default())?;
        let samples = read_inputs(Path::new(&args.input), &columns)?;
        return Ok(Excitation { time_s: samples.time_s, voltage: samples.voltage, torque: samples.torque });
    };
    let Some((volts, at)) = step.split_once('@') else {
        let message = format!("--input: \"{}\" is not step:VOLTS@SECONDS", excerpt(&args.input));
        return Err(Error::usage(message, "Write --input step:10.5@1."));
    };
    let (volts, at) = (values::number(volts, "--input")?, values::number(at, "--input")?);
    if at > args.duration {
        let message = format!("the step at {at} s is after the end at {} s", args.duration);
        return Err(Error::usage(message, "Lengthen --duration or step earlier."));
    }
    Excitation::step(volts, at, args.duration, args.period)
}

/// Beside, synced, renamed: the file is whole or not there.
fn write(path: &Path, text: &str) -> Result<()> {
    let failed = |error: std::io::Error| {
        Error::data(format!("cannot be written: {error}"), "Choose a folder that exists and may be written to.")
            .in_file(path)
    };
    if path.is_dir() {
        return Err(Error::data("is a folder, expected a file to write", "Name a file in it.").in_file(path));
    }
    // A link is written through, a device or pipe written to, a protected file left alone.
    let resolved = path.canonicalize();
    let path = resolved.as_deref().unwrap_or(path);
    match path.metadata() {
        Ok(metadata) if !metadata.is_file() => return std::fs::write(path, text).map_err(failed),
        Ok(metadata) if metadata.permissions().readonly() => {
            return Err(
                Error::data("is protected against writing", "Choose another file, or allow writing it.").in_file(path)
            );
        }
        _ => {}
    }
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut beside = tempfile::Builder::new();
    #[cfg(unix)]
    {
        // Those of an ordinary new file; the system takes its mask off.
        use std::os::unix::fs::PermissionsExt as _;
        beside.permissions(std::fs::Permissions::from_mode(0o666));
    }
    let mut file = beside.tempfile_in(folder).map_err(failed)?;
    file.write_all(text.as_bytes()).and_then(|()| file.as_file().sync_all()).map_err(failed)?;
    file.persist(path).map_err(|error| failed(error.error))?;
    Ok(())
}
