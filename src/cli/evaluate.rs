//! The command `evaluate`: costs of candidates from a file or a sample.

use super::args::EvaluateArgs;
use super::candidates::{Sampled, Source};
use super::evaluation::{BATCH_MAX, evaluate, sample};
use super::prelude::*;
use motorfit::identify::BatchCosts;
use motorfit::optimize::{Sample, Sampling};

pub(super) fn run(args: &EvaluateArgs, style: &Style) -> Result<Outcome> {
    if let Some(model) = &args.model.model {
        return super::model::evaluate::run(args, model, style);
    }
    if let Some(slice) = &args.slice {
        return super::slice::run(args, slice, style);
    }
    if args.profile {
        return super::profile::run(args, style);
    }
    let mut spec = inputs::spec(&args.problem, &args.device, style)?;
    let sampled = sample(args)?;
    let records = inputs::records(&args.recordings.records, &args.recordings.reading.0.and(&args.problem.0))?;
    // The choice of a device depends on the numbers of candidates per batch and in total. For a file the total is a guess.
    let axes = u32::try_from(spec.space.free().len()).unwrap_or(u32::MAX);
    let expected = match sampled {
        None => 1 << 20,
        Some((Sampling::Grid, number)) => number.saturating_pow(axes),
        Some((_, number)) => number,
    };
    let expected = usize::try_from(expected).unwrap_or(usize::MAX);
    spec.population = expected.min(BATCH_MAX);
    spec.generations = expected.div_ceil(spec.population);
    // Costs of given candidates do not depend on their number.
    let spec = if sampled.is_none() { spec.by_kernel() } else { spec };
    with_threads(spec.threads, || {
        let costs = BatchCosts::new(&records, &spec)?;
        let bounds = || costs.problem().space().bounds();
        let sampled =
            sampled.map(|(sampling, number)| Sample::new(sampling, number, bounds(), args.seed)).transpose()?;
        let source = sampled.map(|sample| Box::new(Sampled(sample, 0)) as Box<dyn Source>);
        evaluate(args, &records, Box::new(costs), source, style)
    })
}
