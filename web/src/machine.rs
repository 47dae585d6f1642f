//! The machine of a page: the DC motor, or a model with its answers.

use crate::given::Settings;
use crate::spelling::{as_json, in_page};
use motorfit::evaluate::model::ModelRecording;
use motorfit::identify::Identification;
use motorfit::identify::model::identify_model;
use motorfit::model::{BuiltIn, Model};
use motorfit::named::Named as _;
use motorfit::record::{Reading, Record};
use motorfit::report::{
    ModelInspection, Page, Recorded, Reproduced, Shown, identify_document, identify_page, model_check_document,
    model_check_page, model_inspect_document, model_inspect_page, signals_csv,
};
use motorfit::setting::Text;
use motorfit::settings::{self, Given};
use motorfit::text::{engineering, shell_quoted};
use motorfit::{Error, Result};
use serde_json::{Value, json};
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;

/// A machine by its name: without one, the DC motor.
#[derive(Default)]
pub struct Machine {
    name: String,
    model: Option<Arc<Model>>,
}

impl Machine {
    /// Makes the machine of a name: a built-in model, or a text of a model.
    ///
    /// # Errors
    /// Returns the errors of the text with their lines and columns.
    pub fn new(name: &str, text: &str) -> Result<Self> {
        if name.is_empty() {
            return Ok(Self::default());
        }
        let own = BuiltIn::ALL.iter().find(|own| own.name() == name).map(|own| own.source());
        let model = Model::parse(own.unwrap_or(text)).map_err(|error| error.in_file(Path::new(name)))?;
        Ok(Self { name: name.to_owned(), model: Some(Arc::new(model)) })
    }

    /// Returns true if this is the machine of a name and a text.
    pub fn is(&self, name: &str, text: &str) -> bool {
        let is_built_in = BuiltIn::ALL.iter().any(|own| own.name() == name);
        self.name == name && self.model.as_ref().is_none_or(|model| is_built_in || model.text() == text)
    }

    pub fn model(&self) -> Option<Arc<Model>> {
        self.model.clone()
    }

    /// Returns how recordings are read for it.
    pub fn reading(&self, given: &Given) -> Result<Reading> {
        match &self.model {
            Some(model) => Ok(settings::model_reading(given, model)?),
            None => Ok(settings::reading(given)?),
        }
    }

    /// Returns the flag of the program that names it.
    pub fn flag(&self) -> Option<String> {
        self.model.as_ref().map(|_| format!("--model {}", shell_quoted(&self.name)))
    }

    /// Returns what was understood of it.
    pub fn document(&self) -> Value {
        let Some(model) = &self.model else { return json!({}) };
        let generic = model.generic_terms().into_iter().map(|term| term.name().to_owned());
        let mut document = model_check_document(model);
        document["all_terms"] = model.terms().iter().map(|term| term.name.clone()).chain(generic).collect();
        document
    }

    /// Returns the page of what was understood of it.
    pub fn page(&self, notes: &[String]) -> Result<Page> {
        let none = || Error::usage("there is no model", "Choose one.");
        self.model.as_ref().map(|model| model_check_page(model, notes)).ok_or_else(none)
    }
}

/// Returns a sentence on a recording as it was read.
pub fn read(record: &Record) -> String {
    let source = record.source();
    let name = source.path.as_ref().map_or_else(String::new, |path| format!("{}: ", path.display()));
    format!("{name}{} samples over {}.", record.len(), engineering(record.duration_s(), "s", 3))
}

/// Returns the answer to a question for the identification of any machine.
pub fn answer<M: Shown>(
    (records, recorded): (&[Record], &[Recorded]),
    spec: &M::Spec,
    found: &Identification<M>,
    how: &Reproduced,
) -> Value {
    json!({
        "document": identify_document(records, spec, found),
        "report": identify_page((records, recorded), spec, found, how).html(true),
        "curves": signals_csv((records, recorded), found),
        "next": found.trust.next.as_ref().map(next),
    })
}

/// Returns a next step as a JSON object as a text: a setting with its value, a command, or words.
fn next(step: &Text) -> String {
    let spelled = step.spelled(as_json);
    let is_object = serde_json::from_str::<Value>(&spelled).is_ok_and(|value| value.is_object());
    if is_object { spelled } else { json!({ "words": step.spelled(in_page) }).to_string() }
}

/// Identifies a model.
pub fn identified(model: &Model, records: &[Record], settings: &Settings, how: &Reproduced) -> Result<Value> {
    let spec = settings::model_spec(&settings.given)?;
    let recordings = records.iter().map(|record| ModelRecording::new(model, record)).collect::<Result<Vec<_>>>()?;
    let found = identify_model(model, &recordings, &spec, &mut |_| ControlFlow::Continue(()))?;
    let signals = |recording| Recorded::of_model(&found.model, recording, spec.is_first_order_hold);
    let recorded: Vec<Recorded> = recordings.iter().map(signals).collect();
    Ok(answer((records, &recorded), &spec, &found, how))
}

/// Inspects recordings of a model.
pub fn inspected(model: &Model, records: &[Record], how: &Reproduced) -> Result<Value> {
    let one = |record| ModelInspection::of(model, record, &mut |_| ControlFlow::Continue(()));
    let inspections = records.iter().map(one).collect::<Result<Vec<_>>>()?;
    let report = model_inspect_page(model, &inspections, how).html(true);
    Ok(json!({ "document": model_inspect_document(model, &inspections), "report": report }))
}
