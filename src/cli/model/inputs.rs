//! A user's model with its spec and recordings, as `evaluate` reads them.

use crate::cli::args::EvaluateArgs;
use crate::cli::prelude::*;
use motorfit::evaluate::model::ModelRecording;
use motorfit::identify::model::ModelSpec;
use motorfit::model::Model;
use motorfit::record::Record;

/// A model, its spec, and its recordings as they were read and as the model needs them.
pub(in crate::cli) struct ModelInputs {
    pub model: Model,
    pub spec: ModelSpec,
    pub records: Vec<Record>,
    pub recordings: Vec<ModelRecording>,
    pub threads: Option<usize>,
}

impl ModelInputs {
    pub(in crate::cli) fn new(args: &EvaluateArgs, path: &Path) -> Result<Self> {
        let model = Model::open(path)?;
        let given = args.problem.0.and(&args.device.0);
        let (spec, threads) = (settings::model_spec(&given)?, given.count(Setting::Threads));
        let reading = settings::model_reading(&args.recordings.reading.0.and(&args.problem.0), &model)?;
        let records = inputs::records_with(&args.recordings.records, &reading)?;
        let recordings = records.iter().map(|record| ModelRecording::new(&model, record)).collect::<Result<_>>()?;
        Ok(Self { model, spec, records, recordings, threads })
    }
}
