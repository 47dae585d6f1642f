//! `evaluate` with a user's model.

use crate::cli::args::EvaluateArgs;
use crate::cli::candidates::{Sampled, Source};
use crate::cli::evaluation::{Costs, evaluate, sample};
use crate::cli::prelude::*;
use crate::cli::slice;
use motorfit::device::DeviceUsed;
use motorfit::evaluate::model::{ModelAxis, ModelRecording};
use motorfit::identify::model::ModelCosts;
use motorfit::model::Model;
use motorfit::optimize::Sample;
use motorfit::record::Record;
use motorfit::report::{EvaluateDocument, model_costs_document};
use motorfit::study::model_cost_map;
use motorfit::warning::Warning;
use serde_json::Value;

pub(in crate::cli) fn run(args: &EvaluateArgs, path: &Path, style: &Style) -> Result<Outcome> {
    if args.profile {
        let hint = "Leave --profile out, or identify the model: its result has the standard errors.";
        return Err(Error::usage("--profile serves the DC motor only, not a model", hint));
    }
    let model = Model::open(path)?;
    let given = args.problem.0.and(&args.device.0);
    let spec = settings::model_spec(&given)?;
    let reading = settings::model_reading(&args.recordings.reading.0.and(&args.problem.0), &model)?;
    let sampled = if args.slice.is_some() { None } else { sample(args)? };
    let records = inputs::records_with(&args.recordings.records, &reading)?;
    let recordings = records.iter().map(|record| ModelRecording::new(&model, record)).collect::<Result<Vec<_>>>()?;
    with_threads(given.count(Setting::Threads), || {
        if let Some(slice) = &args.slice {
            let map = model_cost_map((&model, &recordings), &spec, slice::names(slice)?, slice::side(args)?)?;
            return slice::shown(args, &map, &spec.criterion, style);
        }
        let costs = ModelCosts::new(&model, recordings, &spec)?;
        let axes = costs.problem().space().free.clone();
        let unit = vec![(0.0, 1.0); axes.len()];
        let sampled = sampled.map(|(sampling, number)| Sample::new(sampling, number, unit, args.seed)).transpose()?;
        let source = sampled.map(|sample| Box::new(OfAxes { fractions: Sampled(sample, 0), axes }) as Box<dyn Source>);
        evaluate(args, &records, Box::new(costs), source, style)
    })
}

/// A sample that is even in the logarithms of parameters whose axis is logarithmic.
struct OfAxes {
    fractions: Sampled,
    axes: Vec<ModelAxis>,
}

impl Source for OfAxes {
    fn count(&self) -> Option<u64> {
        self.fractions.count()
    }

    fn next(&mut self, most: usize, width: usize, values: &mut Vec<f64>) -> Result<()> {
        let from = values.len();
        self.fractions.next(most, width, values)?;
        for (value, axis) in values[from..].iter_mut().zip(self.axes.iter().cycle()) {
            *value = axis.at(*value);
        }
        Ok(())
    }
}

impl Costs for ModelCosts {
    fn names(&self) -> Vec<String> {
        Self::names(self)
    }

    fn steps(&self) -> usize {
        Self::steps(self)
    }

    /// The costs are computed when they are asked for.
    fn begin(&mut self, _: &[f64]) -> Result<()> {
        Ok(())
    }

    fn finish(&mut self, values: &[f64], costs: &mut [f64]) -> Result<()> {
        self.evaluate(values, costs)
    }

    fn device(&self) -> DeviceUsed {
        Self::device(self)
    }

    fn warnings(&self) -> &[Warning] {
        Self::warnings(self)
    }

    fn document(&self, document: &EvaluateDocument, records: &[Record], best: &[(f64, &[f64])]) -> Value {
        model_costs_document(document, records, self, best)
    }
}
