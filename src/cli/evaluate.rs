//! The command `evaluate`: costs of candidates from a file or a sample, for the DC motor or a user's model.

use super::args::EvaluateArgs;
use super::evaluation::{BATCH_MAX, evaluate, sample};
use super::model::inputs::ModelInputs;
use super::prelude::*;
use motorfit::identify::BatchCosts;
use motorfit::optimize::Sampling;

pub(super) fn run(args: &EvaluateArgs, style: &Style) -> Result<Outcome> {
    let model = args.model.model.as_deref();
    if args.profile {
        return super::profile::run(args, style);
    }
    if let Some(slice) = &args.slice {
        return super::slice::run(args, slice, style);
    }
    let sampled = sample(args)?;
    if let Some(path) = model {
        let ModelInputs { model, spec, records, recordings, threads } = ModelInputs::new(args, path)?;
        return with_threads(threads, || {
            evaluate(args, &records, BatchCosts::of_model(&model, recordings, &spec)?, sampled, style)
        });
    }
    let mut spec = inputs::spec(&args.problem, &args.device, style)?;
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
    with_threads(spec.threads, || evaluate(args, &records, BatchCosts::new(&records, &spec)?, sampled, style))
}
