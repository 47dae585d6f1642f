//! `Identification`: the result of `identify`.

use crate::answers::{Answer, ResultData, TEXT_WIDTH, given, result};
use crate::arrays::{array, rows};
use crate::errors::{Raise as _, codes, keyword, reasons, warnings};
use crate::export::written;
use crate::figure::Svg;
use motorfit::Error;
use motorfit::identify::{IdentifySpec, ParameterEstimate};
use motorfit::motor::{Discretization, Scope};
use motorfit::named::Named as _;
use motorfit::record::{Record, Severity};
use motorfit::report::figures;
use motorfit::report::{Part, exported_motor, html_fragment, identify_document, identify_parts, json, plain_text};
use motorfit::text::significant;
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

/// Result in the process that computed it, with its JSON document.
struct Found {
    records: Vec<Record>,
    spec: IdentifySpec,
    found: motorfit::identify::Identification,
    text: String,
}

result! {
    /// Result of an identification, in SI units: R in ohm, L in H, K in V·s/rad, B in N·m·s/rad, J in kg·m². It can be pickled.
    Identification of Found;
    properties {
        /// Value of each parameter, by symbol; nan if it is not identifiable.
        parameters = |of, py| of.by_name(py, |e| e.value.unwrap_or(f64::NAN));
        /// Standard error of each parameter; nan if it is fixed, at a bound or not identifiable, and with `polish="none"`.
        std_errors = |of, py| of.by_name(py, |e| e.std_error.unwrap_or(f64::NAN));
        /// 95 % confidence interval (low, high) of each parameter; (nan, nan) where there is no standard error.
        ci95 = |of, py| of.by_name(py, |e| e.ci95.map_or((f64::NAN, f64::NAN), |[low, high]| (low, high)));
        /// Names of the free parameters, in the order of the rows of `covariance` and `correlation`.
        free = |of, py| given(py, of.free());
        /// Correlation matrix of the estimates of the free parameters, shape (p, p), nan where undefined; `None` with
        /// `polish="none"`.
        correlation = |of, py| of.table(py, |_, _| 1.0);
        /// Covariance matrix of the estimates of the free parameters, shape (p, p), in SI units, nan where undefined; `None`
        /// with `polish="none"`.
        covariance = |of, py| of.table(py, |a, b| a * b);
        /// Lowest cost after each generation, shape (generations,); empty without a population search.
        history = |of, py| given(py, array(py, of.found.history.clone()));
        /// Cost of the parameters in the chosen criterion.
        cost = |of, py| given(py, of.found.cost);
        /// Fit 100 (1 − ‖y − ŷ‖/‖y − mean y‖) of "current" and "speed" [%]; nan for a channel that was not measured.
        fit_percent = Found::fit_percent;
        /// Level of trust in the result: "good", "check" or "poor".
        trust = |of, py| given(py, of.found.trust.level.name());
        /// Reasons for the level of trust, the most severe first: a list of `MotorfitWarning`; empty if it is good.
        trust_reasons = |of, py| given(py, reasons(py, &of.found.trust.reasons)?);
        /// Suggested next step, such as a keyword argument; `None` if the level of trust is good.
        next_step = |of, py| given(py, of.found.trust.next.as_ref().map(|next| next.spelled(keyword)));
        /// Warnings, which the call issued as Python warnings too: a list of `MotorfitWarning`.
        warnings = |of, py| given(py, warnings(py, &of.found.warnings, Severity::Report)?);
        /// Remarks, which need no action: a list of `MotorfitWarning`.
        remarks = |of, py| given(py, warnings(py, &of.found.warnings, Severity::Mention)?);
        /// Files for simulators by format: "mjcf" (MuJoCo), "urdf", "modelica" and "json"; a format that needs what is not identifiable
        /// is absent.
        exports = |of, py| given(py, written(py, exported_motor(&of.records, &of.found).ok().as_ref())?);
        /// Recordings that the model was fitted to.
        records = |of, py| given(py, of.records.iter().cloned().map(crate::record::Record).collect::<Vec<_>>());
    }
    methods {
        /// Returns the simulated signals of each recording: a list of mappings with the keys "current_A" [A] and "speed_rad_s"
        /// [rad/s], arrays of shape (samples,).
        modelled = Found::modelled;
        /// Returns the document of `to_dict` as JSON text.
        to_json = |of, py| given(py, of.text.as_str());
        /// Draws the correlation matrix of the estimates; `None` with `polish="none"`.
        plot_correlation = |of, py| given(py, figures::correlations(&of.found).map(Svg::from));
        /// Draws the lowest cost after each generation; `None` without a population search.
        plot_history = |of, py| given(py, figures::history(&of.found, &of.spec).map(Svg::from));
        __repr__ = |of, py| given(py, of.repr());
        /// Returns trust, warnings, parameters and fit as text of at most 100 columns where tables allow it.
        summary = |of, py| given(py, plain_text(&identify_parts(&of.spec, &of.found, keyword), TEXT_WIDTH));
        /// Returns the estimates as columns of equal length: "parameter", "value", "std_error", "ci95_low" and "ci95_high" in the
        /// SI "unit", nan where there is none, and "fixed".
        to_columns = Found::columns;
        /// Returns trust, warnings, parameters, fit and the response to the first recording as HTML for notebooks.
        _repr_html_ = |of, py| given(py, of.html());
    }
    documented {
        /// Version of motorfit.
        version = "motorfit";
        /// Requested method.
        method = "method";
        /// Requested refinement.
        polish = "polish";
        /// Seed of the random numbers.
        seed = "seed";
        /// Candidates per generation.
        population = "population";
        /// Generations including the initial population.
        generations = "generations";
        /// Criterion of the search.
        criterion = "criterion";
        /// Divisor of each channel's error in the criterion.
        scale = "scale";
        /// Input of the recordings: "voltage" or "current".
        input = "input";
        /// Discretization of the model.
        discretization = "discretization";
        /// Treatment of the state at the first sample.
        initial = "initial";
        /// Samples that were excluded automatically: a list with the times [s] of each run.
        left_out = "left_out";
        /// Bounds [min, max] of each free parameter, in SI units.
        bounds = "bounds";
        /// Device of the evaluation: "kind" (cpu or gpu), "name" and "precision".
        device = "device";
        /// Extensions of the model.
        extensions = "with";
        /// Models that the forward selection fitted, in their order; `None` if the extensions were given.
        model_selection = "ladder";
        /// Other models that fit as well.
        alternatives = "alternatives";
        /// First optimum, before the refinement: "method", "parameters" and "cost".
        searched = "searched";
        /// Fit of "current" and "speed" of each recording [%].
        fit_percent_by_recording = "fit_percent_by_recording";
        /// Standard deviation of the residuals of "current" [A] and "speed" [rad/s].
        residual_sigma = "residual_sigma";
        /// Initial "current" [A] and "speed" [rad/s] of each recording.
        initial_state = "initial_state";
        /// Numerical rank of the sensitivities; `None` with `polish="none"`.
        rank = "rank";
        /// Condition number of the scaled sensitivities; `None` with `polish="none"`.
        condition = "condition";
        /// Factor by which correlated residuals widen the standard errors; `None` with `polish="none"`.
        errors_widened_by = "errors_widened_by";
        /// Tests of the residuals for whiteness and for dependence on the input; `None` with `polish="none"`.
        residual_tests = "residuals";
        /// Feedforward characteristics kS, kV, kA and kG, time constants and gain, with standard errors.
        characteristics = "characteristics";
        /// Noise floor where recordings repeat the input, with the best achievable fit; else `None`.
        noise_floor = "repeatability";
        /// Comparison of the optimum with a global search.
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
        /// Draws the measured and the simulated signals of one recording.
        ///
        /// Parameters
        /// ----------
        /// recording : int, default 0
        ///     Index of the recording; negative values count from the end.
        ///
        /// Returns
        /// -------
        /// Svg
        ///
        /// Raises
        /// ------
        /// IndexError
        ///     If there is no such recording.
        #[pyo3(signature = (recording=0))]
        fn plot_response(&self, py: Python<'_>, recording: isize) -> PyResult<Svg> {
            let (records, modelled) = (self.answer(py, "records")?, self.answer(py, "modelled")?);
            let count = records.len()?;
            let at = if recording < 0 { count.checked_add_signed(recording) } else { Some(recording.cast_unsigned()) };
            let Some(at) = at.filter(|at| *at < count) else {
                return Err(PyIndexError::new_err(format!("there are {count} recordings, numbered from 0")));
            };
            let signals = modelled.get_item(at)?;
            let signal = |of: &str| crate::arrays::signal(&signals.get_item(of)?, of);
            let signals = [signal("current_A")?, signal("speed_rad_s")?];
            let record = records.get_item(at)?.cast_into::<crate::record::Record>().map_err(PyErr::from)?;
            Ok(figures::responses("response", &record.get().0, "model", &signals).into())
        }
    }
}

impl Identification {
    /// Wraps the result of an identification of `records` by `spec`.
    pub fn new(records: Vec<Record>, spec: IdentifySpec, found: motorfit::identify::Identification) -> Self {
        let text = json(&identify_document(&records, &spec, &found));
        Self(ResultData::Native(Found { records, spec, found, text }))
    }
}

impl Identification {
    /// Returns the motor for `simulate` in the syntax of the command line, with the values of the first recording, and the
    /// discretization of the fit.
    ///
    /// # Errors
    /// Returns `NotIdentifiedError` if a parameter is not identified.
    pub fn motor(&self, py: Python<'_>) -> PyResult<(String, Discretization)> {
        let (mut items, mut unknown) = (Vec::new(), Vec::new());
        for (name, value) in self.answer(py, "parameters")?.cast_into::<PyDict>().map_err(PyErr::from)?.iter() {
            let (name, value) = (name.extract::<String>()?, value.extract::<f64>()?);
            match Scope::named(&name) {
                _ if value.is_nan() => unknown.push(name),
                Some((parameter, Scope::Shared | Scope::Recording(0))) => {
                    items.push(format!("{}={value}", parameter.symbol()));
                }
                _ => {}
            }
        }
        if !unknown.is_empty() {
            let message = format!("{} cannot be simulated with: not identified", unknown.join(", "));
            let remedy = "Give known values in fix, or take found.modelled(), which does not depend on them.";
            return Err(Error::not_identified(message, remedy)).raise(py);
        }
        let discretization: String = self.to_dict(py)?.get_item("discretization")?.extract()?;
        Ok((items.join(","), Discretization::named("discretization", &discretization).raise(py)?))
    }

    /// Returns the first recording.
    pub fn first<'py>(&self, py: Python<'py>) -> Answer<'py> {
        self.answer(py, "records")?.get_item(0)
    }
}

impl Found {
    fn by_name<'py, T: IntoPyObject<'py>>(&self, py: Python<'py>, of: impl Fn(&ParameterEstimate) -> T) -> Answer<'py> {
        let values = PyDict::new(py);
        for estimated in self.found.estimates() {
            values.set_item(name_of(&estimated), of(&estimated))?;
        }
        Ok(values.into_any())
    }

    fn free(&self) -> Vec<String> {
        self.found.space.free().iter().map(|axis| axis.scope.name(axis.parameter)).collect()
    }

    /// Returns the correlation matrix, each element multiplied by `by` of the two standard errors.
    fn table<'py>(&self, py: Python<'py>, by: impl Fn(f64, f64) -> f64) -> Answer<'py> {
        let Some(of) = &self.found.uncertainty else { return given(py, py.None()) };
        let error = |n: usize| of.std_error.get(n).copied().flatten().unwrap_or(f64::NAN);
        let mut values = Vec::new();
        for (a, row) in of.correlation.iter().enumerate() {
            values.extend(row.iter().enumerate().map(|(b, v)| v.unwrap_or(f64::NAN) * by(error(a), error(b))));
        }
        given(py, rows(py, values, of.correlation.len())?)
    }

    fn fit_percent<'py>(&self, py: Python<'py>) -> Answer<'py> {
        let fit = PyDict::new(py);
        for (channel, percent) in ["current", "speed"].into_iter().zip(self.found.fit_percent) {
            fit.set_item(channel, percent.unwrap_or(f64::NAN))?;
        }
        Ok(fit.into_any())
    }

    fn modelled<'py>(&self, py: Python<'py>) -> Answer<'py> {
        let list = PyList::empty(py);
        for [current, speed] in self.found.modelled(&self.records).raise(py)? {
            let signals = PyDict::new(py);
            signals.set_item("current_A", array(py, current))?;
            signals.set_item("speed_rad_s", array(py, speed))?;
            list.append(signals)?;
        }
        Ok(list.into_any())
    }

    fn repr(&self) -> String {
        let one = |e: ParameterEstimate| {
            let Some(value) = e.value else { return format!("{} not identified", name_of(&e)) };
            let error = e.std_error.map_or(String::new(), |s| format!(" ± {}", significant(s, 2)));
            format!("{} = {}{error} {}", name_of(&e), significant(value, 6), e.parameter.unit())
        };
        let list: Vec<String> = self.found.estimates().into_iter().map(one).collect();
        let (trust, codes) = (self.found.trust.level.name(), codes(&self.found.warnings));
        format!("<Identification {}; trust {trust}{codes}>", list.join(", "))
    }

    fn columns<'py>(&self, py: Python<'py>) -> Answer<'py> {
        let estimates = self.found.estimates();
        let column = |of: &dyn Fn(&ParameterEstimate) -> Option<f64>| {
            array(py, estimates.iter().map(|e| of(e).unwrap_or(f64::NAN)).collect())
        };
        let columns = PyDict::new(py);
        columns.set_item("parameter", estimates.iter().map(name_of).collect::<Vec<_>>())?;
        columns.set_item("value", column(&|e| e.value))?;
        columns.set_item("std_error", column(&|e| e.std_error))?;
        columns.set_item("ci95_low", column(&|e| e.ci95.map(|ends| ends[0])))?;
        columns.set_item("ci95_high", column(&|e| e.ci95.map(|ends| ends[1])))?;
        columns.set_item("unit", estimates.iter().map(|e| e.parameter.unit()).collect::<Vec<_>>())?;
        columns.set_item("fixed", estimates.iter().map(|e| e.fixed).collect::<Vec<_>>())?;
        Ok(columns.into_any())
    }

    fn html(&self) -> String {
        let mut parts = identify_parts(&self.spec, &self.found, keyword);
        let modelled = self.found.modelled(&self.records).unwrap_or_default();
        let response = self.records.iter().zip(&modelled).next();
        parts.extend(
            response.map(|(record, signals)| Part::Figure(figures::responses("response", record, "model", signals))),
        );
        html_fragment(&parts)
    }
}

fn name_of(estimated: &ParameterEstimate) -> String {
    estimated.scope.name(estimated.parameter)
}
