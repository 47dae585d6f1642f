//! `inspect` with a user's model.

use crate::cli::args::InspectArgs;
use crate::cli::prelude::*;
use motorfit::evaluate::model::{ModelProblem, ModelRecording};
use motorfit::identify::model::{ModelIdentification, ModelSpec, identify_model};
use motorfit::model::Model;
use motorfit::record::Record;
use motorfit::report::{ModelSignalFacts, model_inspect_document};

pub(in crate::cli) fn run(args: &InspectArgs, path: &Path) -> Result<Outcome> {
    let model = Model::open(path)?;
    if args.out.is_some() {
        let hint = "Use identify with --out, whose report has the charts of the model.";
        return Err(Error::usage("--out of inspect draws the signals of the DC motor", hint));
    }
    let reading = settings::model_reading(&args.recordings.reading.0, &model)?;
    let records = inputs::records_with(&args.recordings.records, &reading)?;
    let mut documents = Vec::new();
    for record in &records {
        let recording = ModelRecording::new(&model, record)?;
        let facts = ModelSignalFacts::of(&model, &recording);
        let spec = ModelSpec::default();
        let problem = ModelProblem::new(&model, spec.space(&model, 1)?, vec![recording.clone()], spec.settings())?;
        let found = identify_model(&model, &[recording], &spec, &mut |_| signals::interrupted());
        if args.json {
            documents.push(model_inspect_document(record, &facts, problem.method(), &found));
        } else {
            show(&text(record, &facts, &problem, &found))?;
        }
    }
    if args.json {
        let model = serde_json::json!({"name": model.name(), "sha256": model.digest()});
        let version = env!("CARGO_PKG_VERSION");
        data(&json(&serde_json::json!({"motorfit": version, "model": model, "records": documents})))?;
    }
    Ok(if signals::is_interrupted() { Outcome::Interrupted } else { Outcome::Done })
}

fn text(
    record: &Record,
    facts: &[ModelSignalFacts],
    problem: &ModelProblem,
    found: &Result<ModelIdentification>,
) -> String {
    let mut text = format!("{}\n", inputs::understood(record));
    if !record.source().ignored.is_empty() {
        let _ = writeln!(text, "  not used: {}", printable(&record.source().ignored.join(", ")));
    }
    text.push_str(&table(facts));
    let _ = writeln!(text, "  {STRONG}steps{STRONG:#}: {}", problem.method().described());
    let line = match found {
        Err(error) => format!("nothing: {error}"),
        Ok(found) => {
            let one = |e: &motorfit::identify::model::ModelEstimate| {
                let percent = 100.0 * (e.std_error? / e.value?).abs();
                Some(format!("{} ± {} %", e.name, significant(percent, 2)))
            };
            let errors: Vec<String> = found.estimates.iter().filter_map(one).collect();
            format!("{} (standard errors)", errors.join(", "))
        }
    };
    let _ = writeln!(text, "  {STRONG}identifies{STRONG:#}: {}", printable(&line));
    for combination in found.iter().flat_map(|found| &found.combinations) {
        let _ = writeln!(text, "  {STRONG}does not identify{STRONG:#} all of them: {}", printable(combination));
    }
    text
}

fn table(facts: &[ModelSignalFacts]) -> String {
    let mut table = comfy_table::Table::new();
    table.load_style(comfy_table::presets::NOTHING);
    table.set_header(["signal", "unit", "min", "max", "mean", "rms", "noise σ"]);
    for f in facts {
        let numbers = [f.min, f.max, f.mean, f.rms].map(|value| significant(value, 4));
        let [min, max, mean, rms] = numbers;
        table.add_row([f.name.clone(), f.unit.clone(), min, max, mean, rms, significant(f.noise_sigma, 2)]);
    }
    for column in table.column_iter_mut().skip(2) {
        column.set_cell_alignment(comfy_table::CellAlignment::Right);
    }
    format!("{table}\n")
}
