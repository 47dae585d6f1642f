//! Results with a user's model in documents, tables and pages.

#[cfg(feature = "pages")]
use super::page::equations;
use crate::curves::model_curves;
#[cfg(feature = "pages")]
use crate::page::Section;
#[cfg(feature = "pages")]
use crate::pages::section;
use crate::recorded::Recorded;
use crate::requested::Requested;
use crate::shown::Shown;
use motorfit_identify::model::{ModelSpec, OwnModel};
use motorfit_identify::{Identification, Keys};
use motorfit_motor::Discretization;
use motorfit_record::Record;
use serde_json::json;

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
    fn sections(found: &Identification<Self>) -> Vec<Section> {
        vec![section("Equations", equations(&found.model))]
    }
}
