//! Results of an identification in the process that computed them, of any machine.

use crate::answers::{Answer, given};
use crate::arrays::{array, rows};
use motorfit::estimate::Uncertainty;
use motorfit::evaluate::model::ModelRecording;
use motorfit::identify::model::OwnModel;
use motorfit::identify::{Combination, DcMotor, Identification, Output, ParameterEstimate, Trust};
use motorfit::model::Model;
use motorfit::record::Record;
use motorfit::report::{
    Exported, Figure, Part, Recorded, Shown, exported_model, exported_motor, figures, identify_document,
    identify_parts, json,
};
use motorfit::setting::Spelling;
use motorfit::text::significant;
use motorfit::warning::Warning;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// A result with its JSON document.
pub struct Found<M: Shown> {
    records: Vec<Record>,
    spec: M::Spec,
    found: Identification<M>,
    text: String,
}

impl<M: Shown> Found<M> {
    /// Makes the result of an identification of `records` by `spec`.
    pub fn new(records: Vec<Record>, spec: M::Spec, found: Identification<M>) -> Self {
        let text = json(&identify_document(&records, &spec, &found));
        Self { records, spec, found, text }
    }
}

/// The values that results of all machines have.
pub struct Common<'a> {
    pub trust: &'a Trust,
    pub outputs: &'a [Output],
    pub estimates: &'a [ParameterEstimate],
    pub uncertainty: Option<&'a Uncertainty>,
    pub fit_percent: &'a [Option<f64>],
    pub warnings: &'a [Warning],
    pub history: &'a [f64],
    pub cost: f64,
}

/// A machine as Python names it.
pub trait Named: Shown + Send + Sync + 'static {
    /// Returns the keys of the simulated outputs.
    fn keys(found: &Identification<Self>) -> Vec<String>;

    /// Returns the model; `None` for the DC motor.
    fn model(found: &Identification<Self>) -> Option<Model>;

    /// Returns what simulators need of the machine.
    fn exported(records: &[Record], found: &Identification<Self>) -> motorfit::Result<Exported>;
}

impl Named for DcMotor {
    fn keys(_: &Identification<Self>) -> Vec<String> {
        ["current_A", "speed_rad_s"].map(str::to_owned).to_vec()
    }

    fn model(_: &Identification<Self>) -> Option<Model> {
        None
    }

    fn exported(records: &[Record], found: &Identification<Self>) -> motorfit::Result<Exported> {
        exported_motor(records, found)
    }
}

impl Named for OwnModel {
    fn keys(found: &Identification<Self>) -> Vec<String> {
        found.outputs.iter().map(|output| output.name.clone()).collect()
    }

    fn model(found: &Identification<Self>) -> Option<Model> {
        Some(found.machine.model.clone())
    }

    fn exported(records: &[Record], found: &Identification<Self>) -> motorfit::Result<Exported> {
        let recordings = records.iter().map(|record| ModelRecording::new(&found.machine.model, record));
        Ok(exported_model(records, &recordings.collect::<motorfit::Result<Vec<_>>>()?, found))
    }
}

/// A result of any machine.
pub trait Answers: Send + Sync {
    fn common(&self) -> Common<'_>;
    fn records(&self) -> &[Record];
    fn text(&self) -> &str;
    fn free(&self) -> Vec<String>;
    fn groups(&self) -> &[String];
    fn combinations(&self) -> &[Combination];
    fn keys(&self) -> Vec<String>;
    fn model(&self) -> Option<Model>;
    fn modelled(&self) -> motorfit::Result<Vec<Vec<Vec<f64>>>>;
    fn exported(&self) -> motorfit::Result<Exported>;
    fn correlations(&self) -> Option<Figure>;
    fn history(&self) -> Option<Figure>;
    fn parts(&self, spelling: Spelling) -> Vec<Part>;
    /// Returns the parts with the response to the first recording.
    fn notebook(&self, spelling: Spelling) -> Vec<Part>;
}

/// A result of some machine.
pub type AnyFound = Box<dyn Answers>;

impl<M: Named> Answers for Found<M> {
    fn common(&self) -> Common<'_> {
        let Identification { trust, outputs, estimates, uncertainty, fit_percent, warnings, history, cost, .. } =
            &self.found;
        let (uncertainty, cost) = (uncertainty.as_ref(), *cost);
        Common { trust, outputs, estimates, uncertainty, fit_percent, warnings, history, cost }
    }

    fn records(&self) -> &[Record] {
        &self.records
    }

    fn text(&self) -> &str {
        &self.text
    }

    fn free(&self) -> Vec<String> {
        self.found.machine.free()
    }

    fn groups(&self) -> &[String] {
        self.found.machine.groups()
    }

    fn combinations(&self) -> &[Combination] {
        self.found.machine.combinations()
    }

    fn keys(&self) -> Vec<String> {
        M::keys(&self.found)
    }

    fn model(&self) -> Option<Model> {
        M::model(&self.found)
    }

    fn modelled(&self) -> motorfit::Result<Vec<Vec<Vec<f64>>>> {
        M::modelled(&self.found, &self.records)
    }

    fn exported(&self) -> motorfit::Result<Exported> {
        M::exported(&self.records, &self.found)
    }

    fn correlations(&self) -> Option<Figure> {
        figures::correlations(&self.found)
    }

    fn history(&self) -> Option<Figure> {
        figures::history(&self.found, &M::requested(&self.spec)).map(|chart| chart.figure())
    }

    fn parts(&self, spelling: Spelling) -> Vec<Part> {
        identify_parts(&self.spec, &self.found, spelling)
    }

    fn notebook(&self, spelling: Spelling) -> Vec<Part> {
        let mut parts = self.parts(spelling);
        let modelled = self.modelled().unwrap_or_default();
        let recorded = self.records.first().map(|record| match self.model() {
            None => Ok(Recorded::from(record)),
            Some(model) => Ok(Recorded::of_model(&model, &ModelRecording::new(&model, record)?, false)),
        });
        let recorded = recorded.and_then(|recorded: motorfit::Result<Recorded>| recorded.ok());
        let response = recorded.iter().zip(&modelled).next();
        let figure = response.map(|(recorded, signals)| figures::responses("response", recorded, "model", signals));
        parts.extend(figure.map(Part::Figure));
        parts
    }
}

/// Returns a mapping of the names of all parameters to a value of each.
pub fn by_name<'py, T: IntoPyObject<'py>>(
    found: &AnyFound,
    py: Python<'py>,
    of: impl Fn(&ParameterEstimate) -> T,
) -> Answer<'py> {
    let values = PyDict::new(py);
    for estimate in found.common().estimates {
        values.set_item(estimate.label(), of(estimate))?;
    }
    Ok(values.into_any())
}

/// Returns the correlation matrix, each element multiplied by `by` of the two standard errors.
pub fn table<'py>(found: &AnyFound, py: Python<'py>, by: impl Fn(f64, f64) -> f64) -> Answer<'py> {
    let Some(of) = found.common().uncertainty else { return given(py, py.None()) };
    let error = |n: usize| of.std_error.get(n).copied().flatten().unwrap_or(f64::NAN);
    let mut values = Vec::new();
    for (a, row) in of.correlation.iter().enumerate() {
        values.extend(row.iter().enumerate().map(|(b, v)| v.unwrap_or(f64::NAN) * by(error(a), error(b))));
    }
    given(py, rows(py, values, of.correlation.len())?)
}

/// Returns the estimates in a line, with the level of trust and the codes of warnings.
pub fn repr(found: &AnyFound, codes: &str) -> String {
    let one = |e: &ParameterEstimate| {
        let Some(value) = e.value else { return format!("{} not identified", e.label()) };
        let error = e.std_error.map_or(String::new(), |s| format!(" ± {}", significant(s, 2)));
        format!("{} = {}{error} {}", e.label(), significant(value, 6), e.unit)
    };
    let common = found.common();
    let list: Vec<String> = common.estimates.iter().map(one).collect();
    format!("<Identification {}; trust {}{codes}>", list.join(", "), common.trust.level.name())
}

/// Returns the estimates as columns.
pub fn columns<'py>(found: &AnyFound, py: Python<'py>) -> Answer<'py> {
    let estimates = found.common().estimates;
    let column = |of: &dyn Fn(&ParameterEstimate) -> Option<f64>| {
        array(py, estimates.iter().map(|e| of(e).unwrap_or(f64::NAN)).collect())
    };
    let columns = PyDict::new(py);
    columns.set_item("parameter", estimates.iter().map(ParameterEstimate::label).collect::<Vec<_>>())?;
    columns.set_item("value", column(&|e| e.value))?;
    columns.set_item("std_error", column(&|e| e.std_error))?;
    columns.set_item("ci95_low", column(&|e| e.ci95.map(|ends| ends[0])))?;
    columns.set_item("ci95_high", column(&|e| e.ci95.map(|ends| ends[1])))?;
    columns.set_item("unit", estimates.iter().map(|e| e.unit.as_str()).collect::<Vec<_>>())?;
    columns.set_item("fixed", estimates.iter().map(|e| e.fixed).collect::<Vec<_>>())?;
    Ok(columns.into_any())
}

/// Returns an array as values.
pub fn signal(values: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    crate::arrays::signal(values, "modelled")
}

/// Returns the signals of a recording of the DC motor, or of a model.
pub fn recorded(model: &Bound<'_, PyAny>, record: &Record, is_linear: bool) -> motorfit::Result<Recorded> {
    match model.cast::<crate::model::Model>() {
        Err(_) => Ok(Recorded::from(record)),
        Ok(model) => {
            let model = &model.get().0;
            Ok(Recorded::of_model(model, &ModelRecording::new(model, record)?, is_linear))
        }
    }
}
