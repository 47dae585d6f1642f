//! `inspect` with a user's model.

use crate::cli::args::InspectArgs;
use crate::cli::inspect::table;
use crate::cli::prelude::*;
use motorfit::evaluate::model::ModelRecording;
use motorfit::identify::model::{ModelIdentification, ModelSpec, identify_model};
use motorfit::model::Model;
use motorfit::record::Record;
use motorfit::report::{ModelSignalFacts, command_line, model_inspect_document};

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
        let found = identify_model(&model, &[recording], &spec, &mut |_| signals::interrupted());
        if args.json {
            documents.push(model_inspect_document(record, &facts, &found));
        } else {
            show(&text(record, &facts, &found))?;
        }
    }
    if args.json {
        let model = serde_json::json!({"name": model.name(), "sha256": model.digest()});
        let version = env!("CARGO_PKG_VERSION");
        data(&json(&serde_json::json!({"motorfit": version, "model": model, "records": documents})))?;
    }
    Ok(if signals::is_interrupted() { Outcome::Interrupted } else { Outcome::Done })
}

fn text(record: &Record, facts: &[ModelSignalFacts], found: &Result<ModelIdentification>) -> String {
    let mut text = format!("{}\n", inputs::understood(record));
    if !record.source().ignored.is_empty() {
        let _ = writeln!(text, "  not used: {}", printable(&record.source().ignored.join(", ")));
    }
    text.push_str(&table(facts.iter().map(|f| (f.name.clone(), f.unit.clone(), f.statistics))));
    if let Ok(found) = found {
        let _ = writeln!(text, "  {STRONG}steps{STRONG:#}: {}", found.method.described());
    }
    let line = match found {
        Err(error) => format!("nothing: {}. {}", error.spelled(command_line), error.hint().spelled(command_line)),
        Ok(found) => {
            let one = |e: &motorfit::identify::model::ModelEstimate| {
                let percent = 100.0 * (e.std_error? / e.value?).abs();
                Some(format!("{} ± {} %", e.label(), significant(percent, 2)))
            };
            let errors: Vec<String> = found.estimates.iter().filter_map(one).collect();
            format!("{} (standard errors)", errors.join(", "))
        }
    };
    let _ = writeln!(text, "  {STRONG}identifies{STRONG:#}: {}", printable(&line));
    let reasons = found.iter().flat_map(|found| &found.trust.reasons);
    for reason in reasons.filter(|reason| reason.code == "outliers") {
        let _ = writeln!(text, "  {STRONG}suspect{STRONG:#}: {}", printable(&reason.message.spelled(command_line)));
    }
    for combination in found.iter().flat_map(|found| &found.combinations) {
        let _ = writeln!(text, "  {STRONG}does not identify{STRONG:#} all of them: {}", printable(combination));
    }
    text
}
