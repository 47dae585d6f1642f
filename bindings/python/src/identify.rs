//! `identify`: estimation of the parameters of one motor.

use crate::errors::{Raise as _, warn};
use crate::found::Found;
use crate::identification::Identification;
use crate::identify_own::identify_own;
use crate::model::Model;
use crate::progress::watched;
use crate::reading::several;
use crate::spec::{self, Keywords};
use motorfit::identify::{IdentifySpec, hold_out, identify_with};
use motorfit::record::Record;
use motorfit::settings::{DEVICE, PROBLEM, SEARCH};
use pyo3::prelude::*;
use pyo3::types::PyDict;

#[doc = concat!(
    "identify(records, *, model=None, validate=None, progress=None, ", include_str!("signatures/search.txt"), ", ",
    include_str!("signatures/problem.txt"), ")\n--\n"
)]
/// Identifies the parameters of one machine from a recording, or from several recordings by a joint fit.
///
/// Parameters
/// ----------
/// records : Record or sequence of Record
///     Recordings of one motor; with a model also paths and frames, which are read with its signals.
/// model : Model, str, PathLike or mapping, optional
///     Equations of another machine than the DC motor, as for `Model`; settings are then those of `Model.identify`.
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
/// Identification
///     Estimates, standard errors and diagnostics.
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
#[expect(clippy::too_many_arguments, reason = "keyword arguments")]
#[pyo3(signature = (records, *, model=None, validate=None, progress=None, **settings), text_signature = None)]
pub fn identify(
    py: Python<'_>,
    records: &Bound<'_, PyAny>,
    model: Option<&Bound<'_, PyAny>>,
    validate: Option<&Bound<'_, PyAny>>,
    progress: Option<Py<PyAny>>,
    settings: Option<&Bound<'_, PyDict>>,
) -> PyResult<Identification> {
    if let Some(model) = model {
        return identify_own(&Model::of(model)?, records, (validate, progress, settings));
    }
    let keys = Keywords::new(py, settings, &spec::keywords(&[&SEARCH, &PROBLEM, &DEVICE]))?;
    let records = several(records)?;
    let held_out = validate.map(several).transpose()?.unwrap_or_default();
    let spec = spec::identify(&keys, &records)?;
    let found = watched(py, progress, move |watch| {
        let found = run(&records, &held_out, &spec, watch);
        (records, spec, found)
    })?;
    let (records, spec, found) = found;
    let found = found.raise(py)?;
    warn(py, &found.warnings)?;
    Ok(Identification::new(Found::new(records, spec, found)))
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
