//! The interface of the machine of a result: what results of the DC motor and of users' models have in different forms.

use super::estimates::Combination;
use super::result::Identification;
use crate::analysis::Output;
use motorfit_core::Result;
use motorfit_core::text::listed;
use motorfit_record::Record;
use serde_json::{Map, Value};

/// Keys of a document with their values, in their order.
pub type Keys = Vec<(&'static str, Value)>;

/// The machine of a result: the DC motor, or a user's model.
pub trait Machine: Sized {
    /// Returns the name of the machine as the title of a result.
    fn title(&self) -> String;

    /// Returns the names of the free parameters in the order of the values, as `R`, or `R[0]` for that of the first recording.
    fn free(&self) -> Vec<String>;

    /// Returns sentences on groups of parameters that the recordings cannot distinguish.
    fn groups(&self) -> &[String] {
        &[]
    }

    /// Returns the combinations of these parameters that the recordings identify.
    fn combinations(&self) -> &[Combination] {
        &[]
    }

    /// Returns the channel that was not recorded and that parameters need to be identifiable, as `a current`; `None` if all were.
    fn missing_channel(found: &Identification<Self>) -> Option<String> {
        let missing = |(_, sigma): &(&Output, &Option<f64>)| sigma.is_none();
        let outputs = found.outputs.iter().zip(&found.residual_sigma).filter(missing);
        let names: Vec<&str> = outputs.map(|(output, _)| output.name.as_str()).collect();
        (!names.is_empty()).then(|| format!("a measured {}", listed(&names, "and")))
    }

    /// Returns the bounds of the free parameters by name.
    fn bounds(&self) -> Map<String, Value>;

    /// Simulates the outputs of the recordings of the fit, shape `[recordings][outputs][samples]`, in their units. A channel that is
    /// the input is NaN.
    ///
    /// # Errors
    /// Returns the errors of the problem of a fit.
    fn modelled(found: &Identification<Self>, records: &[Record]) -> Result<Vec<Vec<Vec<f64>>>>;

    /// Returns the keys on the equations and their integration.
    fn equations(found: &Identification<Self>) -> Keys;

    /// Returns the keys on initial states and correlations.
    fn states(found: &Identification<Self>) -> Keys;

    /// Returns the tests of the residuals; null without a refinement.
    fn residuals(found: &Identification<Self>) -> Value;

    /// Returns the keys on the analysis of the estimates.
    fn analysis(found: &Identification<Self>) -> Keys;

    /// Returns the fit of held-out recordings; null if there are none.
    fn validation(found: &Identification<Self>) -> Value;
}
