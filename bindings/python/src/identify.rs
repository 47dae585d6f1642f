//! `identify`: estimation of the parameters of one motor.

use crate::answers::{Answer, given};
use crate::errors::{Raise as _, warn};
use crate::identification::Identification;
use crate::model::Model;
use crate::model_identification::ModelIdentification;
use crate::progress::watched;
use crate::reading::several;
use crate::spec::{self, Keywords};
use motorfit::device::with_threads;
use motorfit::identify::model::{ModelProgress, hold_out_model, identify_model};
use motorfit::identify::{IdentifySpec, hold_out, identify_with};
use motorfit::optimize::Progress;
use motorfit::record::Record;
use motorfit::setting::Setting;
use motorfit::settings::{DEVICE, PROBLEM, SEARCH};
use pyo3::prelude::*;
use pyo3::types::PyDict;

#[doc = concat!(
    "identify(records, *, model=None, validate=None, progress=None, ", include_str!("signatures/search.txt"), ", ",
    include_str!("signatures/problem.txt"), ")\n--\n"
)]
/// Identifies the parameters of one motor from a recording, or from several recordings by a joint fit.
///
/// Parameters
/// ----------
/// records : Record or sequence of Record
///     Recordings of one motor.
/// model : Model, optional
///     Equations of another machine in place of the DC motor; values are in the units of its parameters.
/// validate : Record or sequence of Record, optional
///     Held-out recordings, simulated with the estimated parameters without another fit.
/// progress : callable, optional
///     Called with a `Progress` after each generation of a population search, in the calling thread. The search ends when it
///     returns False.
#[doc = include_str!("docs/identify.txt")]
#[doc = include_str!("docs/with.txt")]
#[doc = include_str!("docs/problem.txt")]
///
/// Returns
/// -------
/// Identification or ModelIdentification
///     Estimates, standard errors and diagnostics; of a model with `model`.
///
/// Raises
/// ------
/// UsageError
///     If a setting is wrong.
/// DataError
///     If a recording cannot be used.
/// NotIdentifiedError
///     If the recordings do not determine the parameters.
/// DeviceError
///     If the device is not available.
///
/// Warns
/// -----
/// MotorfitWarning
///     For each entry of `warnings` of the result.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "keywords")]
#[pyo3(signature = (records, *, model=None, validate=None, progress=None, **settings), text_signature = None)]
pub fn identify<'py>(
    py: Python<'py>,
    records: &Bound<'py, PyAny>,
    model: Option<&Bound<'py, Model>>,
    validate: Option<&Bound<'py, PyAny>>,
    progress: Option<Py<PyAny>>,
    settings: Option<&Bound<'py, PyDict>>,
) -> Answer<'py> {
    let keys = Keywords::new(py, settings, &spec::keywords(&[&SEARCH, &PROBLEM, &DEVICE]))?;
    if let Some(model) = model {
        return given(py, of_model(model, records, validate, progress, &keys)?);
    }
    let records = several(records)?;
    let held_out = validate.map(several).transpose()?.unwrap_or_default();
    let spec = spec::identify(&keys, spec::input_of(&records))?;
    let found = watched(py, progress, move |watch| {
        let found = run(&records, &held_out, &spec, watch);
        (records, spec, found)
    })?;
    let (records, spec, found) = found;
    let found = found.raise(py)?;
    warn(py, &found.warnings)?;
    given(py, Identification::new(records, spec, found))
}

fn run(
    records: &[Record],
    held_out: &[Record],
    spec: &IdentifySpec,
    watch: &crate::progress::Watch,
) -> motorfit::Result<motorfit::identify::Identification> {
    let mut found = identify_with(records, spec, &mut |progress| watch.generation(progress))?;
    hold_out(&mut found, records, held_out, spec)?;
    Ok(found)
}

/// Identifies the parameters of a model.
fn of_model(
    model: &Bound<'_, Model>,
    records: &Bound<'_, PyAny>,
    validate: Option<&Bound<'_, PyAny>>,
    progress: Option<Py<PyAny>>,
    keys: &Keywords<'_, '_>,
) -> PyResult<ModelIdentification> {
    let py = model.py();
    let given = keys.given(&[&SEARCH, &PROBLEM, &DEVICE])?;
    let spec = motorfit::settings::model_spec(&given).map_err(motorfit::Error::from).raise(py)?;
    let threads = given.count(Setting::Threads);
    let model = model.get();
    let (records, recordings) = model.recordings(records)?;
    let held_out = validate.map(|of| model.recordings(of)).transpose()?.map_or_else(Vec::new, |(_, of)| of);
    let own = model.0.clone();
    let (own, spec, found) = watched(py, progress, move |watch| {
        let mut look = |of: ModelProgress| {
            let (generation, generations) = (of.done, of.of);
            watch.generation(&Progress { generation, generations, evaluations: 0, cost: f64::NAN })
        };
        let found = with_threads(threads, || {
            let mut found = identify_model(&own, &recordings, &spec, &mut look)?;
            hold_out_model(&own, &mut found, &held_out, &spec)?;
            Ok(found)
        });
        (own, spec, found)
    })?;
    let found = found.raise(py)?;
    warn(py, &found.warnings)?;
    Ok(ModelIdentification::new(records, own, &spec, found))
}
