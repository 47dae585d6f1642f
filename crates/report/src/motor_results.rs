//! Results of the DC motor in documents, tables and pages.

use super::curves::motor_curves;
#[cfg(feature = "pages")]
use super::held_out::held_out;
#[cfg(feature = "pages")]
use super::identified::noise_floor_text;
#[cfg(feature = "pages")]
use super::identified_tables::{characteristics_table, transfer_functions};
#[cfg(feature = "pages")]
use super::page::{Part, Section};
#[cfg(feature = "pages")]
use super::pages::section;
use super::recorded::Recorded;
use super::requested::Requested;
use super::shown::Shown;
use motorfit_identify::{DcMotor, Identification, IdentifySpec, Keys};
use motorfit_motor::Discretization;
use motorfit_record::Record;
use serde_json::{Value, json};

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
    fn sections(found: &Identification<Self>) -> Vec<Section> {
        sections(found)
    }
}

/// Returns the dynamics, the fit of held-out recordings and the noise floor.
#[cfg(feature = "pages")]
fn sections(found: &Identification) -> Vec<Section> {
    let dynamics = transfer_functions(found).map(Part::List).into_iter();
    let dynamics = dynamics.chain([Part::Table(characteristics_table(found))]).collect();
    let mut sections = vec![section("Dynamics", dynamics)];
    sections.extend(found.validation.as_ref().map(|held| section("Held-out recordings", held_out(found, held))));
    if let (Some(of), None) = (&found.noise_floor, &found.validation) {
        sections.push(section("Noise floor", vec![Part::Text(format!("{}.", noise_floor_text(of)))]));
    }
    sections
}
