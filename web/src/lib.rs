//! The library in a page. A [`Workbench`] holds the files of the page; it reads them, inspects them and identifies the motor. Results are the
//! JSON documents and the HTML reports of the program.

mod answer;
mod given;

use answer::{Answer, answered};
use motorfit::identify::{Inspection, identify};
use motorfit::motor::Discretization;
use motorfit::record::{Quantity, Record};
use motorfit::report::{Reproduced, identify_document, identify_page, inspect_document, inspect_page};
use motorfit::setting::Setting;
use motorfit::settings;
use serde_json::json;
use std::path::PathBuf;
use wasm_bindgen::prelude::wasm_bindgen;

/// The files of a page.
#[wasm_bindgen]
#[derive(Default)]
pub struct Workbench {
    files: Vec<(PathBuf, Vec<u8>)>,
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
    }

    /// Removes all files.
    pub fn clear(&mut self) {
        self.files.clear();
    }

    /// Returns the document of `motorfit inspect` as `document` and its report as `report`, given settings as a JSON object.
    #[must_use]
    pub fn inspect(&self, settings: &str) -> String {
        answered(|| {
            let records = self.records(settings)?;
            let inspections: Vec<Inspection<'_>> = records.iter().map(Inspection::of).collect();
            let report = inspect_page(&inspections, SETTLING_BAND, &reproduced("inspect")).html(true);
            Ok(Answer { document: inspect_document(&inspections, SETTLING_BAND), report })
        })
    }

    /// Returns the document of `motorfit identify` as `document` and its report as `report`, given settings as a JSON object.
    #[must_use]
    pub fn identify(&self, settings: &str) -> String {
        answered(|| {
            let given = given::of(settings)?;
            let records = self.records(settings)?;
            let mut spec = settings::identify(&given)?;
            if !given.has(Setting::Discretization) && records.iter().all(|record| record.driver() == Quantity::Current)
            {
                // A measured current is continuous: a first-order hold describes it better than a zero-order hold.
                spec.model.discretization = Discretization::Foh;
            }
            let found = identify(&records, &spec)?;
            let report = identify_page(&records, &spec, &found, &reproduced("identify")).html(true);
            Ok(Answer { document: identify_document(&records, &spec, &found), report })
        })
    }
}

/// Band around the steady state in which a step response counts as settled, as a fraction.
const SETTLING_BAND: f64 = 0.02;

impl Workbench {
    fn records(&self, settings: &str) -> motorfit::Result<Vec<Record>> {
        let reading = settings::reading(&given::of(settings)?)?;
        let mut records = Vec::new();
        for (path, bytes) in &self.files {
            records.extend(reading.records_from_bytes(bytes, Some(path))?);
        }
        Ok(records)
    }
}

fn reproduced(command: &str) -> Reproduced {
    Reproduced { command: format!("motorfit {command}"), options: Vec::new() }
}

/// Returns the version of the library, and the SIMD level of its kernels.
#[wasm_bindgen]
#[must_use]
pub fn about() -> String {
    json!({ "motorfit": env!("CARGO_PKG_VERSION"), "level": motorfit::evaluate::Level::best().name() }).to_string()
}
