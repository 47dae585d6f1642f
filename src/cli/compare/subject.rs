//! Machine and settings of `compare`.

use crate::cli::args::CompareArgs;
use crate::cli::prelude::*;
use motorfit::evaluate::{self, Initial};
use motorfit::identify::{IdentifySpec, Method};
use motorfit::model::Model;
use motorfit::settings::Value;
use motorfit::study::compare::{CompareSettings, CompareSpec, ComparisonSubject};

/// Returns the machine that methods are compared on: the DC motor, or the model of the arguments.
pub(super) fn subject(args: &CompareArgs) -> Result<ComparisonSubject> {
    if let Some(path) = &args.model.model {
        return of_model(args, path);
    }
    if args.records.is_empty() {
        return ComparisonSubject::m2();
    }
    let mut given = args.reading.0.clone();
    given.put(Setting::Discretization, Value::Text(args.discretization.name().to_owned()));
    Ok(ComparisonSubject::of_motor(inputs::records(&args.records, &given)?, None))
}

fn of_model(args: &CompareArgs, path: &Path) -> Result<ComparisonSubject> {
    let model = Model::open(path)?;
    if args.records.is_empty() {
        let hint = "Name recordings of the machine, as in motorfit compare log.csv --model pmsm.";
        return Err(Error::usage("--model has no recording, and only the DC motor has a simulated one", hint));
    }
    let mut given = args.reading.0.and(&args.device.0);
    given.put(Setting::Discretization, Value::Text(args.discretization.name().to_owned()));
    given.put(Setting::Bounds, Value::List(args.bounds.clone()));
    given.put(Setting::Fix, Value::List(args.fix.clone()));
    let spec = settings::model_spec(&given)?;
    let records = inputs::records_with(&args.records, &settings::model_reading(&given, &model)?)?;
    ComparisonSubject::of_model(model, records, spec)
}

/// Returns the factors of a comparison.
pub(super) fn requested(args: &CompareArgs) -> CompareSettings {
    CompareSettings {
        methods: args.methods.clone(),
        criteria: args.criteria.clone(),
        population: args.population.clone(),
        generations: args.generations.clone(),
        set: args.set.clone(),
        transforms: args.transform.clone(),
        bounds: args.bounds.clone(),
        fix: args.fix.clone(),
    }
}

/// Returns the settings of a comparison, with the space of the DC motor still to be set.
pub(super) fn spec(args: &CompareArgs, requested: &CompareSettings, device: IdentifySpec) -> Result<CompareSpec> {
    let model = evaluate::Model { discretization: args.discretization, initial: Initial::Auto };
    let base = if args.preset.is_some() { CompareSpec::paper() } else { CompareSpec::default() };
    Ok(CompareSpec {
        settings: if args.preset.is_some() { base.settings } else { requested.settings()? },
        runs: args.runs,
        seed: args.seed,
        model,
        steiglitz_mcbride: requested.methods.contains(&Method::SteiglitzMcBride),
        noise_records: args.noise_records,
        target: args.target,
        device: device.device,
        precision: device.precision,
        evaluator: device.evaluator,
        throughput_profile: device.throughput_profile,
        ..base
    })
}
