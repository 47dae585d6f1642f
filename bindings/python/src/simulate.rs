//! `simulate`, `steiglitz_mcbride`, `refine` and `devices`.

use crate::arrays::signal;
use crate::errors::Raise as _;
use crate::identification::Identification;
use crate::pool::on_all;
use crate::reading::{several, single};
use crate::record::Record;
use crate::spec::{self, Keywords};
use motorfit::Error;
use motorfit::estimate::RefineOptions;
use motorfit::evaluate::Model;
use motorfit::experiment::{Excitation, noise_of, simulated, with_noise};
use motorfit::motor::{Discretization, Parameters};
use motorfit::named::Named as _;
use motorfit::report::{devices_document, json};
use motorfit::setting::Setting;
use motorfit::settings::parse;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Simulates a recording of a motor that starts at rest.
///
/// `simulate(found)` repeats the first recording of an identification with its estimates, `simulate(found, record)` applies the
/// input of another recording.
///
/// Parameters
/// ----------
/// parameters : Identification, str or mapping
///     {"R": ohm, "L": H, "K": V*s/rad, "B": N*m*s/rad, "J": kg*m^2}, with parameters of extensions ("Tc", "td", ...), or
///     "m2,Tc=0.01" for the motor of the paper, both with a zero-order hold of the inputs; or a result of `identify`, with its
///     discretization, and the first recording's value of each parameter that has one per recording.
/// time : array_like, shape (n,), or Record
///     Time of each sample [s], or a recording whose time, voltage and load torque are applied.
/// voltage : array_like, shape (n,)
///     Voltage [V].
/// load_torque : array_like, shape (n,), optional
///     Load torque [N*m].
/// noise : str, sequence or mapping, optional
///     Sensor noise: "40dB" (below the rms value of each signal), or standard deviations "i=0.05,w=0.5" [A, rad/s]; none by
///     default.
/// seed : int, default 1
///     Seed of the noise.
///
/// Returns
/// -------
/// Record
///
/// Raises
/// ------
/// UsageError
///     If a parameter or the noise is wrong.
/// DataError
///     If the signals are not a recording, or the simulation diverges.
/// NotIdentifiedError
///     If the identification has a parameter that is not identified.
#[pyfunction]
#[pyo3(signature = (parameters, time=None, voltage=None, *, load_torque=None, noise=None, seed=1))]
#[expect(clippy::too_many_arguments, reason = "keywords")]
pub fn simulate(
    py: Python<'_>,
    parameters: &Bound<'_, PyAny>,
    time: Option<&Bound<'_, PyAny>>,
    voltage: Option<&Bound<'_, PyAny>>,
    load_torque: Option<&Bound<'_, PyAny>>,
    noise: Option<&Bound<'_, PyAny>>,
    seed: u64,
) -> PyResult<Record> {
    let found = parameters.cast::<Identification>().ok().map(Bound::get);
    let (motor, discretization) = match found {
        Some(found) => found.motor(py)?,
        None => (spec::items(parameters, "parameters")?.join(","), Discretization::Zoh),
    };
    let motor = parse::motor(&motor).raise(py)?;
    let first = found.filter(|_| time.is_none()).map(|found| found.first(py)).transpose()?;
    let mut excitation = excitation(py, first.as_ref().or(time), voltage)?;
    if let Some(torque) = load_torque {
        excitation.torque = Some(signal(torque, "load_torque")?);
    }
    let noise = noise.map(|noise| spec::items(noise, "noise")).transpose()?.map(|items| items.join(","));
    let noise = noise.as_deref().map(parse::noise).transpose().raise(py)?;
    let record = on_all(py, || {
        let clean = simulated(motor, &excitation, discretization)?;
        noise.map_or(Ok(clean.clone()), |noise| with_noise(&clean, noise_of(&clean, noise), seed))
    })?;
    record.map(Record).raise(py)
}

/// Returns the inputs of a simulation: those of a recording, or the given signals.
fn excitation(
    py: Python<'_>,
    time: Option<&Bound<'_, PyAny>>,
    voltage: Option<&Bound<'_, PyAny>>,
) -> PyResult<Excitation> {
    let record = time.and_then(|time| time.cast::<Record>().ok());
    match (record, time, voltage) {
        (Some(record), _, None) => {
            let samples = record.get().0.samples();
            if samples.voltage.is_empty() {
                let remedy = "Give time and voltage, or a recording of the voltage.";
                return Err(Error::data("the recording has no voltage to apply", remedy)).raise(py);
            }
            let (time_s, voltage) = (samples.time_s.clone(), samples.voltage.clone());
            Ok(Excitation { time_s, voltage, torque: samples.torque.clone() })
        }
        (None, Some(time), Some(voltage)) => {
            Ok(Excitation { time_s: signal(time, "time")?, voltage: signal(voltage, "voltage")?, torque: None })
        }
        _ => Err(PyTypeError::new_err("simulate needs time and voltage, or a Record whose voltage is applied")),
    }
}

fn named<'py>(py: Python<'py>, parameters: &Parameters) -> PyResult<Bound<'py, PyDict>> {
    let values = PyDict::new(py);
    for (symbol, value) in ["R", "L", "K", "B", "J"].into_iter().zip(parameters.to_array()) {
        values.set_item(symbol, value)?;
    }
    Ok(values)
}

/// Returns the Steiglitz-McBride estimate (1965) of the linear motor from a recording.
///
/// Parameters
/// ----------
/// record : Record
///     Recording of voltage, current and speed.
/// discretization : {"zoh", "foh", "rk4", "euler"}
///     Discretization of the model.
///
/// Returns
/// -------
/// dict
///     {"R": ohm, "L": H, "K": V*s/rad, "B": N*m*s/rad, "J": kg*m^2}.
///
/// Raises
/// ------
/// UsageError, DataError, NotIdentifiedError
///     If the discretization is wrong, the recording cannot be used, or the estimator fails on it.
#[pyfunction]
#[pyo3(signature = (record, *, discretization="zoh"))]
pub fn steiglitz_mcbride<'py>(
    py: Python<'py>,
    record: &Bound<'py, PyAny>,
    discretization: &str,
) -> PyResult<Bound<'py, PyDict>> {
    let discretization = Discretization::named("discretization", discretization).raise(py)?;
    let model = Model { discretization, ..Model::default() };
    let record = single(record)?;
    let estimate = on_all(py, || Ok(motorfit::estimate::steiglitz_mcbride(&record, model)??))?.raise(py)?;
    named(py, &estimate.parameters)
}

/// Refines parameters by minimizing the weighted output error with the Levenberg-Marquardt method.
///
/// Parameters
/// ----------
/// records : Record or sequence of Record
///     Recordings of one motor; several are fitted jointly.
/// start : mapping
///     Starting value of each free parameter in SI units.
/// bounds, fix, discretization, initial
///     As for `identify`.
///
/// Returns
/// -------
/// dict
///     "parameters" and "std_errors" by symbol, in SI units, nan where there is none; "converged", True if the iteration
///     converged.
///
/// Raises
/// ------
/// UsageError
///     If a setting is wrong, or a free parameter has no starting value.
/// DataError, NotIdentifiedError
///     If a recording cannot be used, or the simulation diverges at the start.
#[pyfunction]
#[pyo3(signature = (records, start, **settings))]
#[pyo3(text_signature = "(records, start, *, bounds='auto', fix=None, discretization=None, initial='auto')")]
pub fn refine<'py>(
    py: Python<'py>,
    records: &Bound<'py, PyAny>,
    start: &Bound<'py, PyAny>,
    settings: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyDict>> {
    let keys = Keywords::new(py, settings, &["bounds", "fix", "discretization", "initial"])?;
    let records = several(records)?;
    let spec = spec::problem(&keys, &records)?;
    let given = parse::parameters(&spec::items(start, "start")?, Setting::Start).raise(py)?;
    let value = |axis: &motorfit::motor::Axis| given.iter().find(|(p, _)| *p == axis.parameter).map(|(_, v)| *v);
    let missing = spec.space.free().iter().find(|axis| value(axis).is_none()).map(|axis| axis.parameter.symbol());
    if let Some(symbol) = missing {
        let message = format!("start has no value for the free parameter {symbol}");
        return Err(Error::usage(message, "Give a value for each free parameter.")).raise(py);
    }
    let start: Vec<f64> = spec.space.free().iter().filter_map(value).collect();
    let options = RefineOptions { model: spec.model, sigma: None };
    let refined = on_all(py, || motorfit::estimate::refine(&records, &spec.space, &start, &options))?.raise(py)?;
    let (result, errors) = (PyDict::new(py), PyDict::new(py));
    for (axis, error) in spec.space.free().iter().zip(&refined.uncertainty.std_error) {
        errors.set_item(axis.parameter.symbol(), error.unwrap_or(f64::NAN))?;
    }
    result.set_item("parameters", named(py, &spec.space.parameters(&refined.values, 0))?)?;
    result.set_item("std_errors", errors)?;
    result.set_item("converged", refined.converged)?;
    Ok(result)
}

/// Returns the CPU and the GPUs of this machine that can evaluate candidates, as `motorfit devices --json` prints them.
#[pyfunction]
pub fn devices(py: Python<'_>) -> PyResult<Bound<'_, PyAny>> {
    let text = py.detach(|| json(&devices_document(std::thread::available_parallelism().map_or(1, usize::from))));
    py.import("json")?.call_method1("loads", (text,))
}
