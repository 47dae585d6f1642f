//! Export of recordings as CSV.

use crate::heading::Quantity;
use crate::record::Record;
use motorfit_core::numeric::rounded;
use std::fmt::Write as _;

/// Returns a recording as CSV with the canonical headings. Values are written exactly, times with 15 significant digits (1.009
/// rather than 1.0089999999999999).
#[must_use]
pub fn write_csv(record: &Record) -> String {
    let present = |quantity| Some((quantity, record.samples().signal(quantity)?));
    let columns: Vec<(Quantity, &[f64])> = Quantity::ALL.into_iter().filter_map(present).collect();
    let mut text = columns.iter().map(|(quantity, _)| quantity.canonical()).collect::<Vec<_>>().join(",");
    text.push('\n');
    for n in 0..record.len() {
        for (at, (quantity, signal)) in columns.iter().enumerate() {
            let joint = if at == 0 { "" } else { "," };
            let value = if *quantity == Quantity::Time { rounded(signal[n], 15) } else { signal[n] };
            let _ = write!(text, "{joint}{value}");
        }
        text.push('\n');
    }
    text
}
