//! `ModelIdentification`: the result of `Model.identify`.

use crate::answers::{Answer, ResultData, given, result};
use crate::arrays::{array, rows};
use crate::errors::{Raise as _, codes, keyword, reasons, warnings};
use crate::export::written;
use motorfit::evaluate::model::ModelRecording;
use motorfit::identify::model::{ModelEstimate, ModelSpec};
use motorfit::record::{Record, Severity};
use motorfit::report::{exported_model, json, model_document};
use motorfit::text::significant;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

/// Result in the process that computed it, with its JSON document.
struct Found {
    records: Vec<Record>,
    model: motorfit::model::Model,
    found: motorfit::identify::model::ModelIdentification,
    text: String,
}

result! {
    /// Result of an identification with a model, in the units of its parameters. It can be pickled.
    ModelIdentification of Found;
    properties {
        /// Value of each parameter; nan if it is not identifiable.
        parameters = |of, py| of.by_name(py, |e| e.value.unwrap_or(f64::NAN));
        /// Standard error of each parameter; nan if it is fixed, at a bound or not identifiable, and with `polish="none"`.
        std_errors = |of, py| of.by_name(py, |e| e.std_error.unwrap_or(f64::NAN));
        /// 95 % confidence interval (low, high) of each parameter; (nan, nan) where there is no standard error.
        ci95 = |of, py| of.by_name(py, |e| e.ci95.map_or((f64::NAN, f64::NAN), |[low, high]| (low, high)));
        /// Unit of each parameter, as written in the model.
        units = |of, py| of.by_name(py, |e| e.unit.clone());
        /// Names of the free parameters, in the order of the rows of `correlation`.
        free = |of, py| given(py, of.found.space.names(&of.model));
        /// Correlation matrix of the estimates of the free parameters, shape (p, p), nan where undefined; `None` with
        /// `polish="none"`.
        correlation = Found::correlation;
        /// Combinations of parameters that the recordings cannot distinguish, as sentences.
        unidentifiable = |of, py| given(py, of.found.combinations.clone());
        /// Combinations of parameters that the recordings identify although not each parameter: (value, standard error, low, high) by
        /// expression, as "J/K", with the 95 % confidence interval.
        combinations = Found::combinations;
        /// Cost of the parameters in the chosen criterion.
        cost = |of, py| given(py, of.found.cost);
        /// Fit 100 (1 − ‖y − ŷ‖/‖y − mean y‖) of each output [%]; nan for one that was not measured.
        fit_percent = Found::fit_percent;
        /// Level of trust in the result: "good", "check" or "poor".
        trust = |of, py| given(py, of.found.trust.level.name());
        /// Reasons for the level of trust, the most severe first: a list of `MotorfitWarning`; empty if it is good.
        trust_reasons = |of, py| given(py, reasons(py, &of.found.trust.reasons)?);
        /// Suggested next step, such as a keyword argument; `None` if the level of trust is good.
        next_step = |of, py| given(py, of.found.trust.next.as_ref().map(|next| next.spelled(keyword)));
        /// Warnings, which the call issued as Python warnings too: a list of `MotorfitWarning`.
        warnings = |of, py| given(py, warnings(py, &of.found.warnings, Severity::Report)?);
        /// The model.
        model = |of, py| given(py, crate::model::Model(of.model.clone()));
        /// Files for simulators by format: "mjcf" (MuJoCo), "urdf", "modelica" and "json"; a format that needs what the model does not
        /// name, or what is not identifiable, is absent.
        exports = Found::exports;
        /// Recordings that the model was fitted to.
        records = |of, py| given(py, of.records.iter().cloned().map(crate::record::Record).collect::<Vec<_>>());
    }
    methods {
        /// Returns the simulated outputs of each recording: a list of mappings of their names to arrays of shape (samples,).
        modelled = Found::modelled;
        /// Returns the document of `to_dict` as JSON text.
        to_json = |of, py| given(py, of.text.as_str());
        __repr__ = |of, py| given(py, of.repr());
        /// Returns the estimates as columns of equal length: "parameter", "value", "std_error", "ci95_low" and "ci95_high" in the
        /// "unit", nan where there is none, and "fixed".
        to_columns = Found::columns;
    }
    documented {
        /// Version of motorfit.
        version = "motorfit";
        /// Requested method.
        method = "method";
        /// Seed of the random numbers.
        seed = "seed";
        /// Criterion of the search.
        criterion = "criterion";
        /// Integration method: "method", "substeps", "stiffness" and "text".
        integration = "integration";
        /// Bounds [min, max] of each free parameter.
        bounds = "bounds";
        /// Device of the evaluation: "kind" (cpu or gpu), "name" and "precision".
        device = "device";
        /// First optimum, before the refinement: "method", "parameters" and "cost".
        searched = "searched";
        /// Root mean square of the residuals of each output.
        residual_sigma = "residual_sigma";
        /// Initial values of the states that are measured or free, of each recording.
        initial_state = "initial_state";
        /// Tests of the residuals for whiteness and for dependence on the input.
        residual_tests = "residuals";
        /// Comparison of the optimum with descents from other starts.
        verification = "verification";
        /// Fit of held-out recordings; `None` without them.
        validation = "validation";
        /// Reason for which the search ended.
        stop = "stop";
        /// Number of candidates evaluated.
        evaluations = "evaluations";
        /// Duration of the estimation [s].
        seconds = "seconds";
    }
    framed {
        /// Returns the estimates as a frame, with the columns of `to_columns`.
    }
    own {
    }
}

impl ModelIdentification {
    /// Wraps the result of an identification of `records` by `spec`.
    pub fn new(
        records: Vec<Record>,
        model: motorfit::model::Model,
        spec: &ModelSpec,
        found: motorfit::identify::model::ModelIdentification,
    ) -> Self {
        let text = json(&model_document(&records, &model, spec, &found));
        Self(ResultData::Native(Found { records, model, found, text }))
    }
}

impl Found {
    fn by_name<'py, T: IntoPyObject<'py>>(&self, py: Python<'py>, of: impl Fn(&ModelEstimate) -> T) -> Answer<'py> {
        let values = PyDict::new(py);
        for estimate in &self.found.estimates {
            values.set_item(estimate.label(), of(estimate))?;
        }
        Ok(values.into_any())
    }

    fn exports<'py>(&self, py: Python<'py>) -> Answer<'py> {
        let recordings = self.records.iter().map(|record| ModelRecording::new(&self.model, record));
        let recordings = recordings.collect::<motorfit::Result<Vec<_>>>().raise(py)?;
        let of = exported_model(&self.records, (&self.model, &recordings), &self.found);
        given(py, written(py, Some(&of))?)
    }

    fn combinations<'py>(&self, py: Python<'py>) -> Answer<'py> {
        let values = PyDict::new(py);
        for of in &self.found.identified {
            values.set_item(&of.name, (of.value, of.std_error, of.ci95[0], of.ci95[1]))?;
        }
        Ok(values.into_any())
    }

    fn correlation<'py>(&self, py: Python<'py>) -> Answer<'py> {
        let Some(of) = &self.found.uncertainty else { return given(py, py.None()) };
        let values = of.correlation.iter().flatten().map(|value| value.unwrap_or(f64::NAN)).collect();
        given(py, rows(py, values, of.correlation.len())?)
    }

    fn fit_percent<'py>(&self, py: Python<'py>) -> Answer<'py> {
        let fit = PyDict::new(py);
        for (output, percent) in self.model.outputs().iter().zip(&self.found.fit_percent) {
            fit.set_item(&output.name, percent.unwrap_or(f64::NAN))?;
        }
        Ok(fit.into_any())
    }

    fn modelled<'py>(&self, py: Python<'py>) -> Answer<'py> {
        let list = PyList::empty(py);
        for fit in &self.found.fits {
            let signals = PyDict::new(py);
            for (output, values) in self.model.outputs().iter().zip(&fit.simulated) {
                signals.set_item(&output.name, array(py, values.clone()))?;
            }
            list.append(signals)?;
        }
        Ok(list.into_any())
    }

    fn repr(&self) -> String {
        let one = |e: &ModelEstimate| {
            let Some(value) = e.value else { return format!("{} not identified", e.label()) };
            let error = e.std_error.map_or(String::new(), |s| format!(" ± {}", significant(s, 2)));
            format!("{} = {}{error} {}", e.label(), significant(value, 6), e.unit)
        };
        let list: Vec<String> = self.found.estimates.iter().map(one).collect();
        let (trust, codes) = (self.found.trust.level.name(), codes(&self.found.warnings));
        format!("<ModelIdentification {}; trust {trust}{codes}>", list.join(", "))
    }

    fn columns<'py>(&self, py: Python<'py>) -> Answer<'py> {
        let estimates = &self.found.estimates;
        let column = |of: &dyn Fn(&ModelEstimate) -> Option<f64>| {
            array(py, estimates.iter().map(|e| of(e).unwrap_or(f64::NAN)).collect())
        };
        let columns = PyDict::new(py);
        columns.set_item("parameter", estimates.iter().map(ModelEstimate::label).collect::<Vec<_>>())?;
        columns.set_item("value", column(&|e| e.value))?;
        columns.set_item("std_error", column(&|e| e.std_error))?;
        columns.set_item("ci95_low", column(&|e| e.ci95.map(|ends| ends[0])))?;
        columns.set_item("ci95_high", column(&|e| e.ci95.map(|ends| ends[1])))?;
        columns.set_item("unit", estimates.iter().map(|e| e.unit.as_str()).collect::<Vec<_>>())?;
        columns.set_item("fixed", estimates.iter().map(|e| e.fixed).collect::<Vec<_>>())?;
        Ok(columns.into_any())
    }
}
