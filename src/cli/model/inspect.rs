//! `inspect` with a user's model.

use crate::cli::args::InspectArgs;
use crate::cli::prelude::*;
use crate::cli::signal_table::signal_table;
use motorfit::identify::model::ModelIdentification;
use motorfit::model::Model;
use motorfit::record::Record;
use motorfit::report::{ModelInspection, ModelSignalFacts, command_line, model_inspect_document, model_inspect_page};

pub(in crate::cli) fn run(args: &InspectArgs, path: &Path, style: &Style) -> Result<Outcome> {
    let model = Model::open(path)?;
    let reading = settings::model_reading(&args.recordings.reading.0, &model)?;
    let records = inputs::records_with(&args.recordings.records, &reading)?;
    let out = args.out.as_deref().map(Out::take).transpose()?;
    let inspected = |record| ModelInspection::of(&model, record, &mut |_| signals::interrupted());
    let inspections = records.iter().map(inspected).collect::<Result<Vec<_>>>()?;
    let document = json(&model_inspect_document(&model, &inspections));
    if args.json {
        data(&document)?;
    }
    for one in inspections.iter().filter(|_| !args.json) {
        show(&text(one.record, &one.facts, &one.found))?;
    }
    if let Some(out) = out {
        let how = out::reproduced(vec![("model", format!("{}, sha256 {}", model.name(), model.digest()))]);
        let page = model_inspect_page(&model, &inspections, &how).html(!args.page.no_script);
        out.write(&[("report.html".to_owned(), page), ("result.json".to_owned(), document)], style)?;
    }
    Ok(if signals::is_interrupted() { Outcome::Interrupted } else { Outcome::Done })
}

fn text(record: &Record, facts: &[ModelSignalFacts], found: &Result<ModelIdentification>) -> String {
    let mut text = format!("{}\n", inputs::understood(record));
    if !record.source().ignored.is_empty() {
        let _ = writeln!(text, "  not used: {}", printable(&record.source().ignored.join(", ")));
    }
    text.push_str(&signal_table(facts.iter().map(|f| (f.name.clone(), f.unit.clone(), f.statistics))));
    if let Ok(found) = found {
        let _ = writeln!(text, "  {STRONG}steps{STRONG:#}: {}", found.method.described());
    }
    let line = match found {
        Err(error) => format!("nothing: {}. {}", error.spelled(command_line), error.hint().spelled(command_line)),
        Ok(found) => {
            let one = |e: &motorfit::identify::ParameterEstimate| {
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
