//! What documents, tables and pages of a result need of its machine: the DC motor, or a user's model.

use super::curves::{columns_csv, model_curves, motor_curves};
#[cfg(feature = "pages")]
use super::page::Section;
use super::recorded::Recorded;
use super::requested::Requested;
use motorfit_identify::model::{ModelSpec, OwnModel};
use motorfit_identify::{DcMotor, Identification, IdentifySpec, Keys, Machine};
use motorfit_motor::Discretization;
use motorfit_record::Record;
use serde_json::{Value, json};

/// A machine whose results are shown.
pub trait Shown: Machine {
    /// Settings of its identification.
    type Spec: Send + Sync;

    /// Heading of the estimates on a page.
    const ESTIMATES: &'static str;

    /// Name of an optional part of the equations, as `extension`.
    const TERM: &'static str;

    /// Describes the intersample behaviour of the input where it was selected; empty elsewhere.
    fn hold(found: &Identification<Self>) -> &'static str;

    /// Returns the requested method, budget and criterion.
    fn requested(spec: &Self::Spec) -> Requested;

    /// Returns the keys of a document that name the equations, for a place before the recordings.
    fn named(found: &Identification<Self>) -> Keys;

    /// Returns the keys of a document on further settings; values of results that follow may replace them.
    fn settings(spec: &Self::Spec) -> Keys;

    /// Returns the simulated outputs of a recording at the start values, if there are any.
    fn at_start(found: &Identification<Self>, recording: usize) -> Option<&[Vec<f64>]>;

    /// Returns the fit of each output over held-out recordings \[%\], for the table of fits; `None` if it is shown elsewhere, or there are
    /// none.
    fn held_out_percent(found: &Identification<Self>) -> Option<&[Option<f64>]>;

    /// Returns headings and columns of the measured and modelled signals of all recordings.
    fn curves(found: &Identification<Self>, records: &[Record], recorded: &[Recorded]) -> (Vec<String>, Vec<Vec<f64>>);

    /// Returns a note on the simulation, for the table of fits.
    fn note(found: &Identification<Self>) -> Option<String>;

    /// Returns the result in one sentence, where not the parameters are the result; empty elsewhere.
    #[cfg(feature = "pages")]
    fn answer(found: &Identification<Self>) -> String;

    /// Returns the sections of a page that follow the estimates.
    #[cfg(feature = "pages")]
    fn sections(found: &Identification<Self>) -> Vec<Section>;
}

impl Shown for DcMotor {
    type Spec = IdentifySpec;

    const ESTIMATES: &'static str = "Estimates in SI units";

    const TERM: &'static str = "extension";

    fn hold(found: &Identification<Self>) -> &'static str {
        if found.model.discretization == Discretization::Foh { "; first-order hold of the voltage" } else { "" }
    }

    fn requested(spec: &IdentifySpec) -> Requested {
        spec.into()
    }

    fn named(_: &Identification<Self>) -> Keys {
        Vec::new()
    }

    fn settings(spec: &IdentifySpec) -> Keys {
        // The first two are placed among the settings; their values are those of the result.
        let initial = spec.model.initial.name();
        vec![("input", Value::Null), ("discretization", Value::Null), ("initial", json!(initial))]
    }

    fn at_start(_: &Identification<Self>, _: usize) -> Option<&[Vec<f64>]> {
        None
    }

    fn held_out_percent(_: &Identification<Self>) -> Option<&[Option<f64>]> {
        None
    }

    fn curves(found: &Identification<Self>, records: &[Record], _: &[Recorded]) -> (Vec<String>, Vec<Vec<f64>>) {
        motor_curves(records, found)
    }

    fn note(_: &Identification<Self>) -> Option<String> {
        None
    }

    #[cfg(feature = "pages")]
    fn answer(found: &Identification<Self>) -> String {
        super::motor_sections::instead(found)
    }

    #[cfg(feature = "pages")]
    fn sections(found: &Identification<Self>) -> Vec<Section> {
        super::motor_sections::sections(found)
    }
}

impl Shown for OwnModel {
    type Spec = ModelSpec;

    const ESTIMATES: &'static str = "Estimates";

    const TERM: &'static str = "optional term";

    fn hold(_: &Identification<Self>) -> &'static str {
        ""
    }

    fn requested(spec: &ModelSpec) -> Requested {
        spec.into()
    }

    fn named(found: &Identification<Self>) -> Keys {
        vec![("model", json!({"name": found.model.name(), "sha256": found.model.digest()}))]
    }

    fn settings(spec: &ModelSpec) -> Keys {
        let hold = if spec.is_first_order_hold { Discretization::Foh } else { Discretization::Zoh };
        vec![("discretization", json!(hold.name()))]
    }

    fn at_start(found: &Identification<Self>, recording: usize) -> Option<&[Vec<f64>]> {
        found.machine.fits.get(recording)?.at_start.as_deref()
    }

    fn held_out_percent(found: &Identification<Self>) -> Option<&[Option<f64>]> {
        Some(&found.machine.held_out_percent[..]).filter(|fits| !fits.is_empty())
    }

    fn curves(found: &Identification<Self>, _: &[Record], recorded: &[Recorded]) -> (Vec<String>, Vec<Vec<f64>>) {
        model_curves(recorded, found)
    }

    fn note(found: &Identification<Self>) -> Option<String> {
        Some(format!("Integration: {}.", found.method.described()))
    }

    #[cfg(feature = "pages")]
    fn answer(_: &Identification<Self>) -> String {
        String::new()
    }

    #[cfg(feature = "pages")]
    fn sections(found: &Identification<Self>) -> Vec<Section> {
        vec![super::pages::section("Equations", super::model::equations(&found.model))]
    }
}

/// Returns CSV with the measured and modelled signals of all recordings, one after the other; `recorded` has those of each.
#[must_use]
pub fn signals_csv<M: Shown>((records, recorded): (&[Record], &[Recorded]), found: &Identification<M>) -> String {
    let (heads, columns) = M::curves(found, records, recorded);
    columns_csv(&heads, &columns)
}

/// Returns CSV with the measured and modelled signals of all recordings of the DC motor, one after the other.
#[must_use]
pub fn curves_csv(records: &[Record], found: &Identification) -> String {
    signals_csv((records, &[]), found)
}
