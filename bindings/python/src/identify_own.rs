//! Identification of a model: `Model.identify`, and `identify` with a model.

use crate::errors::{Raise as _, warn};
use crate::found::Found;
use crate::identification::Identification;
use crate::model::Model;
use crate::progress::watched;
use crate::spec::{Keywords, keywords};
use motorfit::Error;
use motorfit::device::with_threads;
use motorfit::identify::model::{ModelProgress, hold_out_model, identify_model};
use motorfit::optimize::Progress;
use motorfit::setting::Setting;
use motorfit::settings::{self, DEVICE, PROBLEM, SEARCH, Value};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Held-out recordings, the observer, and keyword arguments of a call.
type Arguments<'a, 'py> = (Option<&'a Bound<'py, PyAny>>, Option<Py<PyAny>>, Option<&'a Bound<'py, PyDict>>);

/// Identifies the parameters of a model from recordings.
pub fn identify_own(
    model: &Model,
    records: &Bound<'_, PyAny>,
    (validate, progress, settings): Arguments<'_, '_>,
) -> PyResult<Identification> {
    let py = records.py();
    let keys = Keywords::new(py, settings, &keywords(&[&SEARCH, &PROBLEM, &DEVICE, &[Setting::Start]]))?;
    let mut given = keys.given(&[&SEARCH, &PROBLEM, &DEVICE])?;
    let mut spec = settings::model_spec(&given).map_err(Error::from).raise(py)?;
    for start in keys.groups("start")? {
        given.put(Setting::Start, Value::List(start));
        spec.starts.extend(settings::model_spec(&given).map_err(Error::from).raise(py)?.starts);
    }
    let threads = given.count(Setting::Threads);
    let (records, recordings) = model.recordings(records)?;
    let held_out = validate.map(|of| model.recordings(of)).transpose()?.map_or_else(Vec::new, |(_, of)| of);
    let model = model.0.clone();
    let (spec, found) = watched(py, progress, move |watch| {
        let mut look = |of: ModelProgress| {
            let (generation, generations) = (of.done, of.of);
            watch.generation(&Progress { generation, generations, evaluations: 0, cost: f64::NAN })
        };
        let found = with_threads(threads, || {
            let mut found = identify_model(&model, &recordings, &spec, &mut look)?;
            hold_out_model(&mut found, &recordings, &held_out, &spec)?;
            Ok(found)
        });
        (spec, found)
    })?;
    let found = found.raise(py)?;
    warn(py, &found.warnings)?;
    Ok(Identification::new(Found::new(records, spec, found)))
}
