//! The interface of machines for documents, tables and pages of results; the DC motor and users' models implement it.

use super::curves::columns_csv;
#[cfg(feature = "pages")]
use super::page::Section;
use super::recorded::Recorded;
use super::requested::Requested;
use motorfit_identify::{Identification, Keys, Machine};
use motorfit_record::Record;

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

    /// Returns the sections of a page that follow the estimates.
    #[cfg(feature = "pages")]
    fn sections(found: &Identification<Self>) -> Vec<Section>;
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
