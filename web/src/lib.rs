//! The library in a page. A [`Workbench`] holds the files of the page and its machine, the DC motor or a model; it reads, inspects and
//! identifies. A [`Search`] is watched as it runs. Results are the JSON documents and the HTML reports of the program.

mod about;
mod answer;
mod evaluation;
mod given;
mod job;
mod machine;
mod rates;
mod search;
mod spelling;

pub use about::about;
pub use job::Job;
pub use rates::Rates;
pub use search::Search;

use answer::answered;
use given::Settings;
use machine::{Machine, answer};
use motorfit::identify::{IdentifySpec, Inspection, identify};
use motorfit::record::{Reading, Record, preview};
use motorfit::report::{Recorded, Reproduced, inspect_document, inspect_page};
use motorfit::setting::Setting;
use motorfit::settings;
use motorfit::text::shell_quoted;
use motorfit::{Error, Result};
use serde_json::{Value, json};
use std::path::PathBuf;
use wasm_bindgen::prelude::wasm_bindgen;

/// Band around the steady state in which a step response counts as settled: the default of `motorfit inspect`, as a fraction.
const SETTLING_BAND: f64 = 0.02;

/// The files of a page.
#[wasm_bindgen]
#[derive(Default)]
pub struct Workbench {
    files: Vec<(PathBuf, Vec<u8>)>,
    machine: Machine,
    /// The recordings of the files as they were read last, and how.
    read: Option<(Reading, Vec<Record>)>,
}

#[wasm_bindgen]
impl Workbench {
    /// Creates a workbench without files.
    #[wasm_bindgen(constructor)]
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a file.
    pub fn add(&mut self, name: &str, bytes: Vec<u8>) {
        self.files.push((PathBuf::from(name), bytes));
        self.read = None;
    }

    /// Returns the tables of each file with their headings and first rows, given settings as a JSON object.
    #[must_use]
    pub fn preview(&self, settings: &str) -> String {
        answered(|| {
            let reading = self.machine.reading(&Settings::of(settings)?.given)?;
            let table = |(path, bytes): &(PathBuf, Vec<u8>)| Ok(json!(preview(bytes, Some(path), &reading.options)?));
            Ok(json!({ "files": self.files.iter().map(table).collect::<Result<Vec<Value>>>()? }))
        })
    }

    /// Takes a machine: the name of a built-in model or of a file with the text of a model; an empty name is the DC motor. Returns the
    /// document of `motorfit model check` with the names of all terms; of the DC motor an empty object.
    pub fn machine(&mut self, name: &str, text: &str) -> String {
        answered(|| {
            if !self.machine.is(name, text) {
                (self.machine, self.read) = (Machine::default(), None);
                self.machine = Machine::new(name, text)?;
            }
            Ok(self.machine.document())
        })
    }

    /// Returns the report of `motorfit model check`, after reading the recordings, if there are any, with settings as a JSON object.
    #[must_use]
    pub fn check(&mut self, settings: &str) -> String {
        answered(|| {
            let settings = Settings::of(settings)?;
            let records = if self.files.is_empty() { &[] } else { self.records(&settings)? };
            let notes = records.iter().map(machine::read).collect::<Vec<_>>();
            Ok(json!({ "document": self.machine.document(), "report": self.machine.page(&notes)?.html(true) }))
        })
    }

    /// Returns the document and the report of `motorfit inspect`, given settings as a JSON object.
    #[must_use]
    pub fn inspect(&mut self, settings: &str) -> String {
        answered(|| {
            let settings = Settings::of(settings)?;
            let how =
                Reproduced { command: self.command("inspect", &settings, &settings::READING), options: Vec::new() };
            if let Some(model) = self.machine.model() {
                return machine::inspected(&model, self.records(&settings)?, &how);
            }
            let records = self.records(&settings)?;
            let inspections: Vec<Inspection<'_>> = records.iter().map(Inspection::of).collect();
            let report = inspect_page(&inspections, SETTLING_BAND, &how).html(true);
            Ok(json!({ "document": inspect_document(&inspections, SETTLING_BAND), "report": report }))
        })
    }

    /// Returns the document and the report of `motorfit identify`, the curves as CSV, and the next step if there is one, given
    /// settings as a JSON object.
    #[must_use]
    pub fn identify(&mut self, settings: &str) -> String {
        answered(|| {
            let settings = Settings::of(settings)?;
            let how = Reproduced { command: self.command("identify", &settings, Setting::ALL), options: Vec::new() };
            if let Some(model) = self.machine.model() {
                return machine::identified(&model, self.records(&settings)?, &settings, &how);
            }
            let (records, spec) = self.problem(&settings)?;
            let found = identify(records, &spec)?;
            let recorded: Vec<Recorded> = records.iter().map(Recorded::from).collect();
            Ok(answer((records, &recorded), &spec, &found, &how))
        })
    }
}

impl Workbench {
    /// Returns the recordings and the spec of settings.
    pub(crate) fn problem(&mut self, settings: &Settings) -> Result<(&[Record], IdentifySpec)> {
        let spec = settings::identify(&settings.given)?;
        let records = self.records(settings)?;
        Ok((records, settings::with_intersample_of(spec, &settings.given, records)))
    }

    /// Returns the recordings of all files, read as the settings say.
    fn records(&mut self, settings: &Settings) -> Result<&[Record]> {
        let reading = self.machine.reading(&settings.given)?;
        if self.read.as_ref().is_none_or(|(of, _)| *of != reading) {
            let mut records = Vec::new();
            for (path, bytes) in &self.files {
                records.extend(reading.records_from_bytes(bytes, Some(path))?);
            }
            self.read = Some((reading, records));
        }
        let nothing = || Error::usage("there is no recording", "Choose a file.");
        self.read.as_ref().map(|(_, records)| records.as_slice()).filter(|list| !list.is_empty()).ok_or_else(nothing)
    }

    /// Returns the command line of the program that does the same, with the flags of these settings.
    fn command(&self, command: &str, settings: &Settings, of: &[Setting]) -> String {
        let paths = self.files.iter().map(|(path, _)| shell_quoted(&path.to_string_lossy()));
        let flags = settings.flags.iter().filter(|(setting, _)| of.contains(setting)).map(|(_, flag)| flag.clone());
        let words = ["motorfit".to_owned(), command.to_owned()].into_iter().chain(paths).chain(self.machine.flag());
        words.chain(flags).collect::<Vec<_>>().join(" ")
    }
}
