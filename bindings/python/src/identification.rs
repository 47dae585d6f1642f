//! `Identification`: the result of `identify`, of the DC motor or of a model.

use crate::answers::{Answer, ResultData, TEXT_WIDTH, given, result};
use crate::arrays::array;
use crate::errors::{Raise as _, codes, keyword, reasons, warnings};
use crate::export::written;
use crate::figure::Svg;
use crate::found::{AnyFound, Found, Named, by_name, columns, recorded, repr, signal, table};
use motorfit::Error;
use motorfit::motor::{Discretization, Scope};
use motorfit::named::Named as _;
use motorfit::record::Severity;
use motorfit::report::{figures, html_fragment, plain_text};
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

result! {
    /// Result of an identification, in the units of the parameters; of the DC motor in SI units: R in ohm, L in H, K in V·s/rad, B in
    /// N·m·s/rad, J in kg·m². It can be pickled.
    Identification of AnyFound;
    properties {
        /// Value of each parameter, by symbol; nan if it is not identifiable.
        parameters = |of, py| by_name(of, py, |e| e.value.unwrap_or(f64::NAN));
        /// Standard error of each parameter; nan if it is fixed, at a bound or not identifiable, and with `polish="none"`.
        std_errors = |of, py| by_name(of, py, |e| e.std_error.unwrap_or(f64::NAN));
        /// 95 % confidence interval (low, high) of each parameter; (nan, nan) where there is no standard error.
        ci95 = |of, py| by_name(of, py, |e| e.ci95.map_or((f64::NAN, f64::NAN), |[low, high]| (low, high)));
        /// Unit of each parameter.
        units = |of, py| by_name(of, py, |e| e.unit.clone());
        /// Names of the free parameters, in the order of the rows of `covariance` and `correlation`.
        free = |of, py| given(py, of.free());
        /// Correlation matrix of the estimates of the free parameters, shape (p, p), nan where undefined; `None` with
        /// `polish="none"`.
        correlation = |of, py| table(of, py, |_, _| 1.0);
        /// Covariance matrix of the estimates of the free parameters, shape (p, p), in their units, nan where undefined; `None`
        /// with `polish="none"`.
        covariance = |of, py| table(of, py, |a, b| a * b);
        /// Groups of parameters that the recordings cannot distinguish, as sentences.
        unidentifiable = |of, py| given(py, of.groups().to_vec());
        /// Combinations of parameters that the recordings identify although not each parameter: (value, standard error, low, high) by
        /// expression, as "J/K", with the 95 % confidence interval.
        combinations = |of, py| {
            let values = PyDict::new(py);
            for c in of.combinations() {
                values.set_item(&c.name, (c.value, c.std_error, c.ci95[0], c.ci95[1]))?;
            }
            Ok(values.into_any())
        };
        /// Lowest cost after each generation, shape (generations,); empty without a population search.
        history = |of, py| given(py, array(py, of.common().history.to_vec()));
        /// Cost of the parameters in the chosen criterion.
        cost = |of, py| given(py, of.common().cost);
        /// Fit 100 (1 − ‖y − ŷ‖/‖y − mean y‖) of each output [%], "current" and "speed" of the DC motor; nan for one that was not
        /// measured.
        fit_percent = |of, py| {
            let (fit, common) = (PyDict::new(py), of.common());
            for (output, percent) in common.outputs.iter().zip(common.fit_percent) {
                fit.set_item(&output.name, percent.unwrap_or(f64::NAN))?;
            }
            Ok(fit.into_any())
        };
        /// Level of trust in the result: "good", "check" or "poor".
        trust = |of, py| given(py, of.common().trust.level.name());
        /// Names of the parameters and combinations of parameters to which the level of trust applies.
        trust_of = |of, py| given(py, of.common().trust.of.clone());
        /// Reasons for the level of trust, the most severe first: a list of `MotorfitWarning`; empty if it is good.
        trust_reasons = |of, py| given(py, reasons(py, &of.common().trust.reasons)?);
        /// Suggested next step, such as a keyword argument; `None` if the level of trust is good.
        next_step = |of, py| given(py, of.common().trust.next.as_ref().map(|next| next.spelled(keyword)));
        /// Warnings, which the call issued as Python warnings too: a list of `MotorfitWarning`.
        warnings = |of, py| given(py, warnings(py, of.common().warnings, Severity::Report)?);
        /// Remarks, which need no action: a list of `MotorfitWarning`.
        remarks = |of, py| given(py, warnings(py, of.common().warnings, Severity::Mention)?);
        /// The model; `None` for the DC motor.
        model = |of, py| given(py, of.model().map(crate::model::Model));
        /// Files for simulators by format: "mjcf" (MuJoCo), "urdf", "modelica" and "json"; a format that needs what is not identifiable,
        /// or what a model does not name, is absent.
        exports = |of, py| given(py, written(py, of.exported().ok().as_ref())?);
        /// Recordings that the machine was fitted to.
        records = |of, py| given(py, of.records().iter().cloned().map(crate::record::Record).collect::<Vec<_>>());
    }
    methods {
        /// Returns the simulated signals of each recording: a list of mappings of the outputs to arrays of shape (samples,). Those of the
        /// DC motor have the keys "current_A" [A] and "speed_rad_s" [rad/s].
        modelled = |of, py| {
            let list = PyList::empty(py);
            for outputs in of.modelled().raise(py)? {
                let signals = PyDict::new(py);
                for (key, values) in of.keys().into_iter().zip(outputs) {
                    signals.set_item(key, array(py, values))?;
                }
                list.append(signals)?;
            }
            Ok(list.into_any())
        };
        /// Returns the document of `to_dict` as JSON text.
        to_json = |of, py| given(py, of.text());
        /// Draws the correlation matrix of the estimates; `None` with `polish="none"`.
        plot_correlation = |of, py| given(py, of.correlations().map(Svg::from));
        /// Draws the lowest cost after each generation; `None` without a population search.
        plot_history = |of, py| given(py, of.history().map(Svg::from));
        __repr__ = |of, py| given(py, repr(of, &codes(of.common().warnings)));
        /// Returns trust, warnings, parameters and fit as text of at most 100 columns where tables allow it.
        summary = |of, py| given(py, plain_text(&of.parts(keyword), TEXT_WIDTH));
        /// Returns the estimates as columns of equal length: "parameter", "value", "std_error", "ci95_low" and "ci95_high" in the
        /// "unit", nan where there is none, and "fixed".
        to_columns = |of, py| columns(of, py);
        /// Returns trust, warnings, parameters, fit and the response to the first recording as HTML for notebooks.
        _repr_html_ = |of, py| given(py, html_fragment(&of.notebook(keyword)));
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
        /// Integration method of a model: "method", "substeps", "stiffness" and "text"; `None` for the DC motor.
        integration = "integration";
        /// Input of the recordings of a DC motor: "voltage" or "current".
        input = "input";
        /// Discretization of the model.
        discretization = "discretization";
        /// Treatment of the state at the first sample.
        initial = "initial";
        /// Samples that were excluded automatically: a list with the times [s] of each run.
        left_out = "left_out";
        /// Bounds [min, max] of each free parameter.
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
        /// Fit of each output of each recording [%].
        fit_percent_by_recording = "fit_percent_by_recording";
        /// Standard deviation of the residuals of each output in its unit.
        residual_sigma = "residual_sigma";
        /// Initial states of each recording: "current" [A] and "speed" [rad/s], or the states of a model that are measured or free.
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
            let modelled = modelled.get_item(at)?.cast_into::<PyDict>().map_err(PyErr::from)?;
            let signals = modelled.iter().map(|(_, values)| signal(&values)).collect::<PyResult<Vec<_>>>()?;
            let record = records.get_item(at)?.cast_into::<crate::record::Record>().map_err(PyErr::from)?;
            let is_linear = self.to_dict(py)?.get_item("discretization")?.extract::<String>()? == "foh";
            let recorded = recorded(&self.answer(py, "model")?, &record.get().0, is_linear).raise(py)?;
            Ok(figures::responses("response", &recorded, "model", &signals).into())
        }
    }
}

impl Identification {
    /// Wraps the result of an identification.
    pub fn new<M: Named>(found: Found<M>) -> Self {
        Self(ResultData::Native(Box::new(found)))
    }
}

impl Identification {
    /// Returns the motor for `simulate` in the syntax of the command line, with the values of the first recording, and the
    /// discretization of the fit.
    ///
    /// # Errors
    /// Returns `NotIdentifiedError` if a parameter is not identified.
    pub fn motor(&self, py: Python<'_>) -> PyResult<(String, Discretization)> {
        if !self.answer(py, "model")?.is_none() {
            let hint = "Give simulate() of the model the parameters: model.simulate(found.parameters, …).";
            return Err(Error::usage("the result is of a model, not of the DC motor", hint)).raise(py);
        }
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
