//! `simulate` with a user's model.

use crate::cli::args::SimulateArgs;
use crate::cli::prelude::*;
use motorfit::criterion::Noise;
use motorfit::evaluate::model::{ModelProblem, ModelRecording, ModelSettings, ModelSpace, signal_requests};
use motorfit::experiment::white_noise;
use motorfit::model::Model;
use motorfit::numeric::{count, rms, whole};
use motorfit::record::{ReadOptions, parse_signal_columns, read_signal_inputs};
use motorfit::report::columns_csv;

pub(in crate::cli) fn run(args: &SimulateArgs, path: &Path, style: &Style) -> Result<Outcome> {
    let model = Model::open(path)?;
    let values = values(&model, &args.parameters)?;
    let recording = recording(&model, args)?;
    let space = ModelSpace::all_fixed(&values);
    let problem = ModelProblem::new(&model, space, vec![recording], ModelSettings::default())?;
    let open = vec![0.0; problem.open_initial(0).len()];
    let mut outputs = problem.simulate(&[], 0, &open).outputs;
    if outputs.iter().flatten().any(|value| !value.is_finite()) {
        let hint = "Check the parameters and their units.";
        return Err(Error::not_identified("the simulated machine grows without limit", hint));
    }
    let noise = args.noise.as_deref().map(parse::noise).transpose()?;
    for (n, signal) in outputs.iter_mut().enumerate() {
        let sigma = match noise {
            None => 0.0,
            Some(Noise::Decibels(decibels)) => rms(signal) * 10_f64.powf(-decibels / 20.0),
            Some(_) => {
                return Err(Error::usage(
                    "--noise of a model",
                    "Give decibels below the rms value of each output, as 40dB.",
                ));
            }
        };
        let noise = white_noise(signal.len(), sigma, args.seed, n as u64);
        signal.iter_mut().zip(noise).for_each(|(value, noise)| *value += noise);
    }
    let recording = problem.recording(0);
    let mut heads = vec!["time_s".to_owned()];
    let named = |name: &str, column: &Option<String>, unit: &str| {
        let name = column.as_deref().unwrap_or(name);
        if unit == "1" { name.to_owned() } else { format!("{name} [{unit}]") }
    };
    heads.extend(model.inputs().iter().map(|input| named(&input.name, &input.column, &input.unit.text)));
    heads.extend(model.outputs().iter().map(|output| named(&output.name, &output.column, &output.unit.text)));
    let columns: Vec<Vec<f64>> =
        std::iter::once(recording.time_s.clone()).chain(recording.inputs.iter().cloned()).chain(outputs).collect();
    let text = columns_csv(&heads, &columns);
    out::write_file(&args.out, &text)?;
    if args.out != Path::new("-") {
        style.note(&format!("wrote {}: {} samples", args.out.display(), recording.len()));
    }
    Ok(Outcome::Done)
}

/// Parses values of parameters; those that are missing take the values of the model.
fn values(model: &Model, text: &str) -> Result<Vec<f64>> {
    let mut values: Vec<Option<f64>> = model.parameters().iter().map(|parameter| parameter.value).collect();
    for item in text.split(',').filter(|item| !item.trim().is_empty()) {
        let (name, value) = parse::pair(item, Setting::Parameters, "R=0.9,L=0.01")?;
        let at = model.parameters().iter().position(|parameter| parameter.name == name);
        let Some(at) = at else {
            let names: Vec<&str> = model.parameters().iter().map(|parameter| parameter.name.as_str()).collect();
            return Err(Error::usage(
                format!("--parameters: \"{}\" is not a parameter", excerpt(name)),
                format!("The parameters are {}.", names.join(", ")),
            ));
        };
        values[at] = Some(parse::number(value, Setting::Parameters)?);
    }
    let missing: Vec<&str> = model
        .parameters()
        .iter()
        .zip(&values)
        .filter(|(_, value)| value.is_none())
        .map(|(p, _)| p.name.as_str())
        .collect();
    if !missing.is_empty() {
        return Err(Error::usage(
            format!("--parameters lacks {}", missing.join(", ")),
            "Give a value for each of them, in the units of the model.",
        ));
    }
    Ok(values.into_iter().flatten().collect())
}

/// Returns the inputs of a simulation.
fn recording(model: &Model, args: &SimulateArgs) -> Result<ModelRecording> {
    let is_file = Path::new(&args.input).exists();
    let (time_s, inputs) = if is_file || !args.input.contains("step:") {
        let signals = signal_requests(model);
        let names: Vec<&str> = signals.iter().map(|signal| signal.name.as_str()).collect();
        let columns = parse_signal_columns(args.columns.0.text(Setting::Columns).unwrap_or_default(), &names)?;
        let inputs: Vec<_> = signals.into_iter().filter(|signal| signal.is_input).collect();
        let options = ReadOptions { columns, signals: inputs, ..ReadOptions::default() };
        let samples = read_signal_inputs(Path::new(&args.input), &options)?;
        let of = |(n, input): (usize, &motorfit::model::ModelInput)| {
            let own = samples.named.iter().find(|signal| signal.number == n).map(|signal| signal.values.clone());
            own.unwrap_or_else(|| vec![input.default.unwrap_or(0.0); samples.time_s.len()])
        };
        let inputs = model.inputs().iter().enumerate().map(of).collect();
        (samples.time_s, inputs)
    } else {
        steps(model, args)?
    };
    ModelRecording::to_simulate(model, time_s, inputs)
}

/// Returns the time and the inputs of steps, `NAME=step:VALUE@SECONDS,…`, or `step:VALUE@SECONDS` for the first input.
fn steps(model: &Model, args: &SimulateArgs) -> Result<(Vec<f64>, Vec<Vec<f64>>)> {
    if !(args.period > 0.0 && args.duration / args.period >= 2.0 && args.duration / args.period <= 1e7) {
        return Err(Error::usage(
            format!("--duration {} with --period {}", args.duration, args.period),
            "Simulate 3 to 10 million samples.",
        ));
    }
    let samples = whole((args.duration / args.period).round()) + 1;
    let time_s: Vec<f64> = (0..samples).map(|n| count(n) * args.period).collect();
    let mut inputs: Vec<Vec<f64>> =
        model.inputs().iter().map(|input| vec![input.default.unwrap_or(0.0); samples]).collect();
    for item in args.input.split(',') {
        let (name, step) = match item.split_once('=') {
            Some((name, step)) => (Some(name.trim()), step.trim()),
            None => (None, item.trim()),
        };
        let at = match name {
            None => Some(0).filter(|_| !inputs.is_empty()),
            Some(name) => model.inputs().iter().position(|input| input.name == name),
        };
        let parts = step.strip_prefix("step:").and_then(|step| step.split_once('@'));
        let (Some(at), Some((value, from))) = (at, parts) else {
            let names: Vec<&str> = model.inputs().iter().map(|input| input.name.as_str()).collect();
            let hint = format!(
                "Write NAME=step:VALUE@SECONDS,… for the inputs {}, or give a CSV file with them.",
                names.join(", ")
            );
            return Err(Error::usage(format!("--input: \"{}\" is not a step of an input", excerpt(item)), hint));
        };
        let (value, from) = (parse::number(value, Setting::Input)?, parse::number(from, Setting::Input)?);
        for (value_at, time) in inputs[at].iter_mut().zip(&time_s) {
            if *time >= from {
                *value_at = value;
            }
        }
    }
    Ok((time_s, inputs))
}
